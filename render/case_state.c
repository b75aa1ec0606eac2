#include "render/case_state.h"

#include "base/base.h"
#include "render/translation.h"

#include <dirent.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Of what is as bright as the vessels, the tree should hold at least this.
static const double LEAST_HELD = 0.5;
#define ACTS "the acts"      // instead of a trace's path in messages

// Shows a message: its format is translated here.
static void say(CaseState *s, bool is_fault, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void say(CaseState *s, bool is_fault, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(s->message, sizeof s->message, tr(format), arguments);
    va_end(arguments);
    s->message_is_fault = is_fault;
}

// Without the line of a trace that the user has not written.
static void say_fault(CaseState *s, const char *text)
{
    const char *colon = strncmp(text, ACTS, strlen(ACTS)) ? NULL : strstr(text, ": ");
    say(s, true, "%s", colon ? colon + 2 : text);
}

static int by_name(const void *a, const void *b) { return strcmp(a, b); }

static void add_name(CaseState *s, CaseListId list, const char *name)
{
    if (s->list[list].count < CASE_NAMES && strlen(name) < sizeof s->list[list].name[0])
        strcpy(s->list[list].name[s->list[list].count++], name);
}

// Wires and catheters of the device library, and the segments of the body.
static void list_choices(CaseState *s)
{
    DIR *folder = s->made.library ? opendir(s->made.library) : NULL;
    for (int i = 0; i < CASE_LISTS; i++)
        s->list[i].count = 1;
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        const char *name = entry->d_name;
        size_t length = strlen(name);
        if (length <= 5 || strcmp(name + length - 5, ".yaml"))
            continue;
        if (!strncmp(name, "wire-", 5))
            add_name(s, CASE_WIRES, name);
        else if (!strncmp(name, "catheter-", 9) || !strncmp(name, "microcatheter-", 14))
            add_name(s, CASE_CATHETERS, name);
    }
    if (folder)
        closedir(folder);
    for (int i = 0; i < CASE_SEGMENTS; i++)
        qsort(s->list[i].name[1], (size_t)(s->list[i].count - 1), sizeof s->list[i].name[0], by_name);
    for (const char *const *name = patient_segment_name; *name; name++)
        add_name(s, CASE_SEGMENTS, *name);
    for (int i = 1; i < MODELS; i++)
        add_name(s, CASE_MODELS, model_names[i]);
}

static const CaseActKind list_act[CASE_LISTS] = {CASE_DEVICE, CASE_CATHETER, CASE_ANATOMY, CASE_MODEL};

// The lists show what the acts say.
static void follow_choices(CaseState *s)
{
    for (int list = 0; list < CASE_LISTS; list++) {
        const CaseAct *last = case_acts_last(&s->acts, list_act[list]);
        const char *name = list == CASE_MODELS ? case_acts_model(&s->acts) : last ? last->name : "";
        s->list[list].chosen = 0;
        for (int i = 1; i < s->list[list].count; i++)
            if (!strcmp(s->list[list].name[i], name))
                s->list[list].chosen = i;
    }
}

bool case_state_begin(CaseState *s, const CaseOptions *made)
{
    *s = (CaseState){.made = *made, .mode = CASE_START, .forbid_radius = 3, .chosen_mark = -1, .view = CASE_PROJECTION, .turns = true};
    s->made.trace_path = ACTS;
    s->made.words = tr;
    s->made.has_kind = false;        // the trace says it
    s->acts.model = made->has_kind ? model_names[made->kind] : NULL;
    list_choices(s);
    follow_choices(s);
    s->builder = case_builder_create(&s->made);
    return s->builder != NULL;
}

void case_state_end(CaseState *s)
{
    case_state_edit_end(s);
    case_builder_free(s->builder);
    case_acts_free(&s->acts);
    free(s->seen);
    *s = (CaseState){0};
}

// The place with the brightest surroundings: a vessel in most angiograms, where the slices begin.
static Vec3 brightest_place(const Volume *v)
{
    size_t nx = (size_t)v->size[0], ny = (size_t)v->size[1];
    double most = -HUGE_VAL;
    Vec3 place = volume_middle(v);
    for (int k = 1; k + 1 < v->size[2]; k++)
        for (int j = 1; j + 1 < v->size[1]; j++)
            for (int i = 1; i + 1 < v->size[0]; i++) {
                const float *x = v->value + ((size_t)k * ny + (size_t)j) * nx + (size_t)i;
                double sum = (double)x[0] + (double)x[1] + (double)x[-1] + (double)x[nx] + (double)*(x - nx) + (double)x[nx * ny] + (double)*(x - nx * ny);
                if (sum > most)
                    most = sum, place = volume_point_of(v, vec3(i, j, k));
            }
    return place;
}

static void take_volume(CaseState *s)
{
    float low, high;
    Vec3 corner[8];
    s->volume = case_builder_volume(s->builder);
    s->reduced = case_builder_reduced(s->builder, &low, &high);
    s->soft = case_builder_soft(s->builder);
    const Volume *v = s->volume;
    s->axes = patient_axes(v->frame);
    s->full_low = s->low = (double)low;
    s->full_high = s->high = (double)high;
    for (int i = 0; i < 8; i++)
        corner[i] = volume_point_of(v, vec3(i & 1 ? v->size[0] - 1 : 0, i & 2 ? v->size[1] - 1 : 0, i & 4 ? v->size[2] - 1 : 0));
    s->camera = free_camera_framing(8, corner);
    free_camera_look_along(&s->camera, s->axes.posterior, s->axes.superior);
    s->camera.home_turn = s->camera.turn;
    s->cursor = brightest_place(s->reduced);
    for (int i = 0; i < 3; i++)
        s->middle[i] = volume_middle(v), s->zoom[i] = 1;
    s->has_volume = true;
    s->message[0] = 0;           // that it is still being loaded
}

bool case_state_frame(CaseState *s)
{
    BuildProgress before = s->progress;
    BuildProgress *now = &s->progress;
    *now = case_builder_progress(s->builder);
    if (!s->has_volume && case_builder_volume(s->builder))
        take_volume(s);
    if (now->seen != s->seen_number) {
        s->seen_count = case_builder_seen(s->builder, &s->seen);
        s->seen_number = now->seen;
    }
    bool is_new = now->stage != before.stage;
    if (is_new && now->stage == BUILD_FAILED)
        say_fault(s, now->message);
    // a start that was refused is followed by another one
    if (is_new && now->stage == BUILD_FAILED && s->acts.count > 0 && s->acts.act[s->acts.count - 1].kind == CASE_START)
        s->mode = CASE_START;
    if (is_new && now->stage == BUILD_LOOKING)
        say(s, false, "the wall is fitted: choose a target, or steer");
    if (is_new && now->stage == BUILD_DONE && now->held < LEAST_HELD)
        say(s, true,
            "the tree holds %.0f %% of what is as bright as its vessels; the marks list the rest. To begin elsewhere, press {start} and click a wider vessel",
            100 * now->held);
    s->pictures += is_new;
    return is_new || now->seen != before.seen || fabs(now->part - before.part) > 0.004;
}

// --- acts ---

static void follow(CaseState *s, CaseActKind kind)
{
    char *trace = case_acts_trace(&s->acts);
    bool changes_tree = case_act_changes_tree(kind), has_failed = s->progress.stage == BUILD_FAILED || s->progress.stage == BUILD_IDLE;
    s->chosen_mark = changes_tree ? -1 : s->chosen_mark;
    follow_choices(s);
    if (changes_tree)        // the editor's model is about to go
        case_state_edit_end(s);
    if (kind == CASE_MODEL && trace && s->progress.stage != BUILD_IDLE)
        case_builder_refit(s->builder, trace);
    else if (changes_tree || has_failed || !trace)
        case_builder_request(s->builder, trace);
    else if (kind == CASE_EDIT)
        case_builder_edit(s->builder, trace);
    else
        case_builder_retitle(s->builder, trace);
    free(trace);
}

// Points are rounded, so that the trace is easy to read and to type.
static Vec3 rounded(Vec3 x)
{
    const double per_mm = 100;
    return vec3(round(x.x * per_mm) / per_mm, round(x.y * per_mm) / per_mm, round(x.z * per_mm) / per_mm);
}

static void add(CaseState *s, const CaseAct *act)
{
    char text[160];
    if (!s->has_volume || (act->kind != CASE_START && !case_acts_last(&s->acts, CASE_START))) {
        say(s, true, s->has_volume ? N_("click a vessel first: the tree grows from there") : N_("the volume is still being loaded"));
        return;
    }
    const int edits = case_act_changes_tree(act->kind) ? case_acts_edits(&s->acts) : 0;
    if (!case_acts_add(&s->acts, act)) {
        say(s, true, "out of memory");
        return;
    }
    case_act_describe(act, tr, text, sizeof text);
    if (edits > 0)
        say(s, true, "%s; the %d edits of the wall before it no longer count: {undo} brings them back", text, edits);
    else
        say(s, false, "%s", text);
    follow(s, act->kind);
    s->pictures++;
}

// The point where a vessel's end is nearest: that is where tools enter.
static Vec3 end_near(const CaseState *s, Vec3 x)
{
    const CaseWork *work = case_builder_work(s->builder);
    return work ? case_work_tree(work)->center[case_tree_end_near(case_work_tree(work), x)] : x;
}

// A CT says what tissue is: contrast agent is far brighter.
static void doubt_start(CaseState *s, Vec3 place)
{
    const double least = 120;        // [HU] of vessels with contrast agent, in the mean of neighbouring voxels
    const Volume *v = s->volume;
    const Vec3 voxel = volume_voxel_of(v, place);
    const int middle[3] = {(int)lround(voxel.x), (int)lround(voxel.y), (int)lround(voxel.z)};
    double sum = 0;
    int count = 0;
    for (int n = 0; n < 27; n++) {
        const int i = middle[0] + n % 3 - 1, j = middle[1] + n / 3 % 3 - 1, k = middle[2] + n / 9 - 1;
        if (i < 0 || j < 0 || k < 0 || i >= v->size[0] || j >= v->size[1] || k >= v->size[2])
            continue;
        sum += (double)v->value[((size_t)k * (size_t)v->size[1] + (size_t)j) * (size_t)v->size[0] + (size_t)i];
        count++;
    }
    if (volume_has_ct_numbers(v) && count > 0 && sum / count < least)
        say(s, true, "%.0f HU lie there, as in tissue; vessels with contrast agent have 150 to 600. To begin elsewhere, press {start} and click a vessel",
            sum / count);
}

void case_state_act(CaseState *s, CaseActKind kind, Vec3 place)
{
    CaseAct act = {.kind = kind, .place = rounded(kind == CASE_ENTRY ? end_near(s, place) : place), .radius = kind == CASE_FORBID ? s->forbid_radius : 0};
    add(s, &act);
    if (s->has_volume && kind == CASE_START)
        doubt_start(s, place);
}

void case_state_click(CaseState *s, Vec3 place)
{
    int mode = s->mode;
    s->cursor = place;
    s->pictures++;
    if (mode == CASE_LOOK)
        return;
    s->mode = CASE_LOOK;
    s->turns = false;
    case_state_act(s, (CaseActKind)mode, place);
}

void case_state_click_nowhere(CaseState *s, int view)
{
    if (s->progress.stage == BUILD_LOADING)
        say(s, true, "the volume is still being loaded: click a vessel once it shows");
    else if (!s->has_volume)
        say(s, true, "there is no volume to click in");
    else if (view == CASE_PROJECTION)
        say(s, true, "nothing bright lies there: click on a vessel, or in a slice");
    else
        say(s, true, "that lies outside the volume");
}

void case_state_mode(CaseState *s, int mode) { s->mode = mode; }

static void undo_or_redo(CaseState *s, bool is_undo)
{
    char text[160];
    if (!(is_undo ? case_acts_undo(&s->acts) : case_acts_redo(&s->acts))) {
        say(s, false, is_undo ? N_("nothing to undo") : N_("nothing to do again"));
        return;
    }
    const CaseAct *act = &s->acts.act[s->acts.count - !is_undo];
    case_act_describe(act, tr, text, sizeof text);
    say(s, false, is_undo ? N_("undone: %s") : N_("done again: %s"), text);
    if (s->editor && act->kind == CASE_EDIT && is_undo)
        edit_state_undo(&s->edit);
    else if (s->editor && act->kind == CASE_EDIT)
        edit_state_do(&s->edit, &act->edit);
    follow(s, act->kind);
    s->mode = case_acts_last(&s->acts, CASE_START) ? s->mode : CASE_START;
    s->pictures++;
}

void case_state_undo(CaseState *s) { undo_or_redo(s, true); }
void case_state_redo(CaseState *s) { undo_or_redo(s, false); }

void case_state_cancel(CaseState *s)
{
    case_acts_undo(&s->acts);
    case_builder_request(s->builder, NULL);
    s->mode = case_acts_last(&s->acts, CASE_START) ? CASE_LOOK : CASE_START;
    s->pictures++;
    say(s, false, "stopped; {redo} begins it again");
}

void case_state_next(CaseState *s, CaseListId list, int by)
{
    CaseAct act = {.kind = list_act[list]};
    const int count = s->list[list].count, next = (s->list[list].chosen + by + count) % count;
    snprintf(act.name, sizeof act.name, "%s", s->list[list].name[next]);
    add(s, &act);
}

// --- editing the wall ---

bool case_state_edit_begin(CaseState *s)
{
    const CaseWork *work = case_builder_work(s->builder);
    if (s->editor)
        return true;
    if (!work) {
        say(s, true, "there is no wall to edit yet");
        return false;
    }
    if (work->how.model != FIT_MODEL_SWEEP) {
        say(s, true, "the sections of a swept model can be edited: {model} chooses the model of the wall");
        return false;
    }
    bool good = (s->editor = sweep_editor_create(case_work_sweep(work))) != NULL;
    static Faults faults;
    faults_clear(&faults);
    for (int i = case_acts_first_edit(&s->acts); good && i < s->acts.count; i++)
        if (s->acts.act[i].kind == CASE_EDIT)
            good = sweep_editor_do(s->editor, &s->acts.act[i].edit, ACTS, NULL, &faults);
    if (!good || !edit_state_begin(&s->edit, s->editor)) {
        case_state_edit_end(s);
        say_fault(s, faults.count > 0 ? faults.text[0] : "out of memory");
        return false;
    }
    s->edit.saved_count = case_acts_edits(&s->acts);
    return true;
}

void case_state_edit_end(CaseState *s)
{
    if (!s->editor)
        return;
    edit_state_end(&s->edit);
    sweep_editor_free(s->editor);
    s->editor = NULL;
    s->pictures++;
}

void case_state_edit_take(CaseState *s)
{
    const EditList *list = s->editor ? sweep_editor_list(s->editor) : NULL;
    for (int i = case_acts_edits(&s->acts); list && i < list->count; i++)
        add(s, &(CaseAct){.kind = CASE_EDIT, .edit = list->edit[i]});
    s->edit.saved_count = case_acts_edits(&s->acts);
}

void case_state_turn_background(CaseState *s)
{
    const CaseAct *last = case_acts_last(&s->acts, CASE_BEHIND);
    CaseAct act = {.kind = CASE_BEHIND, .is_on = !(last && last->is_on)};
    add(s, &act);
}

bool case_state_forbids_bone(const CaseState *s)
{
    const CaseAct *last = case_acts_last(&s->acts, CASE_BONE);
    return s->soft && (!last || last->is_on);
}

void case_state_turn_bone(CaseState *s)
{
    if (s->has_volume && !s->soft) {
        say(s, true, "only a CT says what bone is: choose a region with {forbid} instead");
        return;
    }
    add(s, &(CaseAct){.kind = CASE_BONE, .is_on = !case_state_forbids_bone(s)});
    s->shows_bone = s->has_volume && !case_state_forbids_bone(s);
}

void case_state_choose_mark(CaseState *s, int mark)
{
    const CaseMark *marks;
    int count = case_builder_marks(s->builder, &marks);
    if (count == 0)
        return;
    s->chosen_mark = (mark % count + count) % count;
    if (marks[s->chosen_mark].has_place)
        s->cursor = marks[s->chosen_mark].place;
    s->turns = false;
    s->pictures++;
}

// --- views ---

const Volume *case_state_projected(const CaseState *s) { return s->soft && !s->shows_bone ? s->soft : s->volume; }

Camera case_state_camera(const CaseState *s, int view, int width, int height)
{
    if (view == CASE_PROJECTION)
        return free_camera_projection(&s->camera, width, height, vec3_distance(s->camera.low, s->camera.high) + 10);
    return slice_camera(&s->axes, (SliceView)view, s->volume, s->middle[view], s->zoom[view], width, height);
}

// The edge of a voxel along a direction [mm].
static double voxel_along(const Volume *v, Vec3 direction)
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += vec3_norm(v->axis[k]) * fabs(vec3_dot(vec3_unit(v->axis[k]), direction));
    return sum;
}

// Keeps the cross-hair in the volume.
static void move_cursor(CaseState *s, Vec3 direction, double voxels)
{
    Vec3 next = vec3_add_scaled(s->cursor, voxels * voxel_along(s->volume, direction), direction), v = volume_voxel_of(s->volume, next);
    v.x = fmin(fmax(v.x, 0), s->volume->size[0] - 1);
    v.y = fmin(fmax(v.y, 0), s->volume->size[1] - 1);
    v.z = fmin(fmax(v.z, 0), s->volume->size[2] - 1);
    s->cursor = volume_point_of(s->volume, v);
    s->pictures++;
}

void case_state_scroll(CaseState *s, int view, double voxels)
{
    if (s->has_volume && view < CASE_PROJECTION)
        move_cursor(s, case_state_camera(s, view, 100, 100).back, voxels);
}

void case_state_move(CaseState *s, int view, double right, double up)
{
    if (!s->has_volume)
        return;
    if (view == CASE_PROJECTION) {
        const double pixels = 12;    // of the mouse's way for a key
        s->turns = false;
        free_camera_orbit(&s->camera, pixels * right, -pixels * up);
        s->turned++;
        return;
    }
    Camera c = case_state_camera(s, view, 100, 100);
    move_cursor(s, c.right, right);
    move_cursor(s, c.up, up);
}

void case_state_zoom(CaseState *s, int view, double notches)
{
    const double notch = 1.15, most = 20;
    if (!s->has_volume)
        return;
    if (view == CASE_PROJECTION) {
        free_camera_zoom(&s->camera, notches, 50, 50, 100, 100);
    } else {
        s->zoom[view] = fmin(fmax(s->zoom[view] * pow(notch, notches), 1), most);
        // the cross-hair comes towards the middle
        Vec3 whole = volume_middle(s->volume);
        s->middle[view] = vec3_mix(s->cursor, whole, 1 / s->zoom[view]);
    }
    s->pictures++;
}

void case_state_window(CaseState *s, double wider, double higher)
{
    double width = (s->high - s->low) * wider, level = 0.5 * (s->low + s->high) + higher * (s->full_high - s->full_low), whole = s->full_high - s->full_low;
    width = fmin(fmax(width, 0.01 * whole), 10 * whole);
    s->low = level - 0.5 * width, s->high = level + 0.5 * width;
    s->pictures++;
}

const char *case_state_hint(const CaseState *s)
{
    static const char *const clicks[CASE_ACTS + 1] = {"Click a vessel: the whole tree grows from there",
                                                      "Click a vessel that is missing",
                                                      "Click where nothing is to be tracked",
                                                      "Click where a branch is to be cut off",
                                                      "Click where the vessel is to end",
                                                      "Click into the sac",
                                                      "Click the end where the tools enter",
                                                      "Click where the tip has to go",
                                                      [CASE_LOOK] = "Click to look there; {start} to {target} choose what a click does; {steer} steers"};
    switch (s->progress.stage) {
    case BUILD_LOADING: return "The volume is being loaded; {leave} leaves";
    case BUILD_TRACKING: return "The tree grows. A click looks there; to begin elsewhere, press {start} and click; {leave} stops";
    case BUILD_FITTING:
        return "The wall is fitted to the image. A click looks there; to correct the tree, press one of {start} to {target} and click; {leave} stops";
    default: return s->has_volume ? clicks[s->mode] : "The volume cannot be read; {leave} leaves";
    }
}

// A folder of the user's cases that holds none yet, named after the volume.
static bool new_folder(const char *volume, char *out, size_t capacity)
{
    char data[PATH_MAX], name[80] = "";
    size_t length = strlen(volume);
    while (length > 1 && volume[length - 1] == '/')
        length--;
    size_t first = length;
    while (first > 0 && volume[first - 1] != '/')
        first--;
    for (size_t i = first; i < length && volume[i] != '.' && i - first + 1 < sizeof name; i++)
        name[i - first] = volume[i];
    if (!folders_data(data, sizeof data))
        return false;
    for (int i = 1; i < 10000; i++) {
        int wrote = i == 1 ? snprintf(out, capacity, "%s/cases/%s", data, name[0] ? name : "case") : snprintf(out, capacity, "%s/cases/%s-%d", data, name, i);
        if (wrote <= 0 || (size_t)wrote >= capacity)
            return false;
        if (!case_is_there(out))
            return folders_create(out);
    }
    return false;
}

bool case_state_save(CaseState *s, const char *folder, char *out, size_t capacity, Faults *faults)
{
    if (folder)
        snprintf(out, capacity, "%s", folder);
    else if (!new_folder(s->made.input, out, capacity))
        faults_add(faults, s->made.input, 0, 0, "its case cannot be kept: neither $XDG_DATA_HOME nor $HOME names a writable folder");
    bool good = faults->count == 0 && case_builder_save(s->builder, out, faults);
    if (!good)
        say_fault(s, faults->text[0]);
    return good;
}
