// See edit_state.h. Numbers of an edit are rounded to 0.0001 mm before it is applied, so that its line of YAML is short and replays to the same bits.
#include "render/edit_state.h"

#include "render/translation.h"
#include "sim/sim.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static double short_number(double x) { return floor(x * 1e4 + 0.5) / 1e4; }
static Vec3 short_point(Vec3 x) { return vec3(short_number(x.x), short_number(x.y), short_number(x.z)); }

static const SweepModel *model(const EditState *s) { return sweep_editor_model(s->editor); }
static const SweepCurve *curve(const EditState *s, int branch) { return sweep_editor_field(s->editor)->curve[branch]; }

void edit_state_say(EditState *s, bool is_fault, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(s->message, sizeof s->message, tr(format), arguments);
    va_end(arguments);
    s->message_is_fault = is_fault;
}

// The mesh follows the model within a box, or anew if the model has other branches.
static void follow(EditState *s, Vec3 low, Vec3 high)
{
    const SweepField *field = sweep_editor_field(s->editor);
    if (!s->mesh || !edit_mesh_update(s->mesh, field, low, high)) {
        EditMesh *mesh = edit_mesh_create(field, s->mesh, low, high);
        if (!mesh) {
            edit_state_say(s, true, "the surface cannot be drawn: out of memory");
            return;
        }
        edit_mesh_free(s->mesh);
        s->mesh = mesh;
    }
    s->mesh_is_new = true;
}

static void take_outline(EditState *s)
{
    sweep_contour_free(&s->outline);
    sweep_contour_create(sweep_editor_field(s->editor), s->branch, fmin(s->t, curve(s, s->branch)->length), SWEEP_CONTOUR, &s->outline);
}

// The same, and undoes the changes of what was looked at before.
static void follow_change(EditState *s, const EditChange *change)
{
    Vec3 low = change ? change->low : s->looked_low, high = change ? change->high : s->looked_high;
    if (change && s->looks) {
        low = vec3(fmin(low.x, s->looked_low.x), fmin(low.y, s->looked_low.y), fmin(low.z, s->looked_low.z));
        high = vec3(fmax(high.x, s->looked_high.x), fmax(high.y, s->looked_high.y), fmax(high.z, s->looked_high.z));
    }
    if (change || s->looks)
        follow(s, low, high);
    if (s->branch < model(s)->branch_count)
        take_outline(s);
}

static void measure(EditState *s, double since)
{
    s->update_ms = 1e3 * (clock_s(CLOCK_MONOTONIC) - since);
    s->worst_ms = fmax(s->worst_ms, s->update_ms);
}

bool edit_state_begin(EditState *s, SweepEditor *editor)
{
    *s = (EditState){.editor = editor, .snaps = true, .strength = 0.5f, .drawn_radius = 0.5f, .saved_count = 0};
    follow(s, vec3(0, 0, 0), vec3(0, 0, 0));
    s->extent = SMOOTH_SECTION;
    if (s->mesh)
        edit_state_go(s, 0, 0.5 * curve(s, 0)->length);
    edit_state_step(s, 1);
    edit_state_say(s, false, "click on the wall, or move along the branch with the wheel or {station_next} and {station_before}");
    return s->mesh != NULL;
}

void edit_state_end(EditState *s)
{
    edit_mesh_free(s->mesh);
    s->mesh = NULL;
    sweep_contour_free(&s->outline);
}

// --- the place ---

static void take_points(EditState *s)
{
    SectionPoint point[EDIT_CONTOUR];
    if (s->outline.count == 0) {
        sweep_edit_contour(model(s), s->branch, s->t, EDIT_CONTOUR, s->contour);
        return;
    }
    sweep_contour_sample(&s->outline, EDIT_CONTOUR, point, NULL);
    for (int i = 0; i < EDIT_CONTOUR; i++)
        s->contour[i] = vec3(point[i].n, point[i].b, 0);
}

static void take_contour(EditState *s)
{
    take_outline(s);
    take_points(s);
    s->is_moved = s->draws_contour = false;
    s->stroke_count = 0;
    s->blend = (float)sweep_model_blend(model(s), s->branch);
}

void edit_state_go(EditState *s, int branch, double t)
{
    if (s->looks) {
        sweep_editor_try(s->editor, NULL, NULL, NULL);
        follow_change(s, NULL);
        s->looks = false;
    }
    s->branch = branch < 0 ? 0 : branch >= model(s)->branch_count ? model(s)->branch_count - 1 : branch;
    s->t = fmax(0, fmin(curve(s, s->branch)->length, t));
    take_contour(s);
    s->wall = edit_state_in_space(s, s->contour[0]);
}

void edit_state_step(EditState *s, int stations)
{
    const SweepBranch *b = &model(s)->branch[s->branch];
    const double *at = model(s)->break_t + b->first_break;
    int next = 0;
    while (next < b->break_count && at[next] <= s->t + 1e-9)
        next++;
    // next: the first station beyond t
    int target = stations > 0 ? next + stations - 1 : at[next > 0 ? next - 1 : 0] < s->t - 1e-9 ? next + stations : next - 1 + stations;
    target = target < 0 ? 0 : target > b->break_count - 1 ? b->break_count - 1 : target;
    edit_state_go(s, s->branch, at[target]);
}

void edit_state_move(EditState *s, double by) { edit_state_go(s, s->branch, s->t + by); }

void edit_state_branch(EditState *s, int by)
{
    int count = model(s)->branch_count, branch = (s->branch + by + count) % count;
    edit_state_go(s, branch, 0.5 * curve(s, branch)->length);
    edit_state_step(s, 1);
}

Vec3 edit_state_in_space(const EditState *s, Vec3 nb)
{
    SweepJet j = sweep_curve_at(curve(s, s->branch), s->t);
    return vec3_add_scaled(vec3_add_scaled(j.s, nb.x, j.n), nb.y, j.b);
}

bool edit_state_at_station(const EditState *s)
{
    double within;
    return fabs(sweep_edit_station(model(s), s->branch, s->t, &within) - s->t) <= within;
}

// --- edits ---

static void apply(EditState *s, const SweepEdit *edit, bool is_kept)
{
    static Faults faults;
    EditChange change;
    faults_clear(&faults);
    double since = clock_s(CLOCK_MONOTONIC);
    bool good = is_kept ? sweep_editor_do(s->editor, edit, "edit", &change, &faults) : sweep_editor_try(s->editor, edit, &change, &faults);
    if (!good) {
        const char *text = faults.count > 0 ? faults.text[0] : "the edit cannot be applied";
        edit_state_say(s, true, "%s", strncmp(text, "edit: ", 6) ? (strncmp(text, "the edit: ", 10) ? text : text + 10) : text + 6);
    }
    follow_change(s, good ? &change : NULL);
    s->looks = good && !is_kept;
    if (s->looks)
        s->looked_low = change.low, s->looked_high = change.high;
    measure(s, since);
    if (good && is_kept) {
        if (edit->kind == EDIT_SECTION)
            edit_state_say(s, false, "section set; the contour departs from it by %.3f mm at most", change.misfit);
        else
            edit_state_say(s, false, "done");
    }
    if (is_kept)
        edit_state_go(s, s->branch, s->t);
}

void edit_state_do(EditState *s, const SweepEdit *edit) { apply(s, edit, true); }

static double short_t(const EditState *s)
{
    double t = short_number(s->t);
    return t > curve(s, s->branch)->length ? s->t : t;
}

static SweepEdit section_of(EditState *s, Vec3 point[EDIT_STROKE], int count, const Vec3 *from)
{
    for (int i = 0; i < count; i++)
        point[i] = short_point(from[i]);
    return (SweepEdit){.kind = EDIT_SECTION, .branch = s->branch, .t = short_t(s), .count = count, .point = point};
}

static void show_contour(EditState *s, bool is_kept)
{
    static Vec3 point[EDIT_STROKE];
    SweepEdit edit = section_of(s, point, EDIT_CONTOUR, s->contour);
    apply(s, &edit, is_kept);
}

void edit_state_drag(EditState *s, Vec3 nb)
{
    enum { STEP = EDIT_CONTOUR / EDIT_HANDLES, REACH = 2 * STEP };
    int at = s->handle * STEP;
    Vec3 here = s->contour[at];
    double grown = vec3_norm(nb) - vec3_norm(here);
    // along the rays, so that the contour stays a star; a smooth bump over the neighbours
    for (int k = -REACH + 1; k < REACH; k++) {
        Vec3 *p = &s->contour[(at + k + EDIT_CONTOUR) % EDIT_CONTOUR];
        double far = (double)k / REACH, bump = (1 - far * far) * (1 - far * far), r = vec3_norm(*p);
        *p = vec3_scale(*p, fmax(0.1 * r, r + bump * grown) / r);
    }
    s->is_moved = true;
    show_contour(s, false);
    if (s->looks)
        edit_state_say(s, false, "{keep} keeps the contour, {leave} drops it");
}

void edit_state_scale(EditState *s, double factor)
{
    for (int i = 0; i < EDIT_CONTOUR; i++)
        s->contour[i] = vec3_scale(s->contour[i], factor);
    show_contour(s, true);
}

void edit_state_keep(EditState *s)
{
    if (s->is_moved)
        show_contour(s, true);
}

// Points of a stroke closer than a 50th of its extent are left out.
static void end_stroke(EditState *s, int least, const char *too_short)
{
    static Vec3 point[EDIT_STROKE];
    Vec3 *kept = s->stroke;
    int count = 0;
    double extent = 0;
    for (int i = 0; i < s->stroke_count; i++)
        extent = fmax(extent, vec3_norm(s->stroke[i]));
    for (int i = 0; i < s->stroke_count; i++)
        if (count == 0 || vec3_distance(s->stroke[i], kept[count - 1]) > extent / 50)
            kept[count++] = s->stroke[i];
    while (count > 3 && vec3_distance(kept[count - 1], kept[0]) < extent / 50)
        count--;
    s->stroke_count = 0;
    if (count < least) {
        edit_state_say(s, true, "%s", tr(too_short));
        return;
    }
    SweepEdit edit = section_of(s, point, count, kept);
    apply(s, &edit, true);
}

void edit_state_stroke_end(EditState *s)
{
    const int least = 6;     // of a hand that goes around
    end_stroke(s, least, N_("the stroke is too short; draw once around the vessel with Shift and the left button held"));
}

// --- drawing by keys ---

void edit_state_handle(EditState *s, int handle)
{
    s->handle = handle;
    s->wall = edit_state_in_space(s, s->contour[handle * (EDIT_CONTOUR / EDIT_HANDLES)]);
}

void edit_state_contour_begin(EditState *s)
{
    edit_state_go(s, s->branch, s->t);
    s->draws_contour = true;
    s->draws_branch = false;
    s->pen = s->contour[s->handle * (EDIT_CONTOUR / EDIT_HANDLES)];
    edit_state_say(s, false, "{left} {right} {up} {down} move the pen, {add} adds a point, {back} takes it back; {end} closes the contour, {drop} drops it");
}

bool edit_state_draws(const EditState *s) { return s->draws_contour || s->draws_branch; }

void edit_state_pen_move(EditState *s, Vec3 by) { s->pen = vec3_add(s->pen, by); }

void edit_state_pen_add(EditState *s)
{
    if (s->draws_branch)
        edit_state_draw_add(s, s->pen);
    else if (s->draws_contour && s->stroke_count < EDIT_STROKE)
        s->stroke[s->stroke_count++] = s->pen;
}

// The first point of a branch is where it begins.
void edit_state_pen_back(EditState *s)
{
    if (s->draws_branch && s->drawn_count > 1)
        s->drawn_count--;
    else if (s->draws_contour && s->stroke_count > 0)
        s->stroke_count--;
}

void edit_state_pen_end(EditState *s, bool is_kept)
{
    if (s->draws_branch) {
        edit_state_draw_end(s, is_kept);
        return;
    }
    s->draws_contour = false;
    if (is_kept) {
        end_stroke(s, 3, N_("a contour needs three points or more"));
    } else {
        s->stroke_count = 0;
        edit_state_say(s, false, "the contour was dropped");
    }
}

void edit_state_delete(EditState *s)
{
    SweepEdit edit = {.kind = EDIT_DELETE_SECTION, .branch = s->branch, .t = short_t(s)};
    apply(s, &edit, true);
}

void edit_state_smooth(EditState *s, bool is_kept)
{
    SweepEdit edit = {.kind = EDIT_SMOOTH,
                      .branch = s->branch,
                      .t = short_t(s),
                      .extent = s->extent,
                      .shape = s->shape,
                      .amount = floor((double)s->strength * 100 + 0.5) / 100};
    apply(s, &edit, is_kept);
    if (s->looks)
        edit_state_say(s, false, "{smooth} keeps the smoothed wall, {leave} drops it");
    if (!is_kept)
        take_points(s);
}

void edit_state_blend(EditState *s, bool is_kept)
{
    float wanted = s->blend;
    SweepEdit edit = {.kind = EDIT_BLEND, .branch = s->branch, .amount = floor((double)wanted * 100 + 0.5) / 100};
    apply(s, &edit, is_kept);
}

void edit_state_flip(EditState *s)
{
    bool is_far = s->t > 0.5 * curve(s, s->branch)->length || model(s)->branch[s->branch].parent >= 0;
    SweepEdit edit = {.kind = EDIT_TAG, .branch = s->branch, .end = is_far, .tag = EDIT_TAG_FLIP};
    apply(s, &edit, true);
    edit_state_say(s, false, "%s of branch %d: %s", is_far ? "end" : "start", s->branch,
                   sweep_model_tag(model(s), s->branch, is_far) == SWEEP_TAG_IN ? "blood flows in" : "blood flows out");
}

void edit_state_cut(EditState *s)
{
    SweepEdit edit = {.kind = EDIT_CUT, .branch = s->branch, .t = short_t(s)};
    apply(s, &edit, true);
}

void edit_state_draw_begin(EditState *s)
{
    s->draws_branch = true;
    s->draws_contour = false;
    s->stroke_count = s->drawn_count = 0;
    edit_state_draw_add(s, s->wall);
    edit_state_say(
        s, false,
        "click points of the new branch, or {left} {right} {up} {down} {nearer} {farther} move the pen and {add} adds a point; {end} ends it, {drop} drops it");
}

void edit_state_draw_add(EditState *s, Vec3 x)
{
    if (s->drawn_count < EDIT_DRAWN)
        s->drawn[s->drawn_count++] = short_point(x);
    s->pen = x;
}

void edit_state_draw_end(EditState *s, bool is_kept)
{
    double radius[EDIT_DRAWN];
    s->draws_branch = false;
    if (!is_kept || s->drawn_count < 2) {
        edit_state_say(s, is_kept, is_kept ? "a new branch needs one point beyond its start" : "the new branch was dropped");
        return;
    }
    for (int i = 0; i < s->drawn_count; i++)
        radius[i] = short_number((double)s->drawn_radius);
    SweepEdit edit = {.kind = EDIT_BRANCH, .branch = s->branch, .t = short_t(s), .count = s->drawn_count, .point = s->drawn, .radius = radius};
    int before = model(s)->branch_count;
    apply(s, &edit, true);
    if (model(s)->branch_count > before)
        edit_state_go(s, before, 0.5 * curve(s, before)->length);
}

static void go_back(EditState *s, bool (*go)(SweepEditor *, EditChange *), const char *none)
{
    EditChange change;
    double since = clock_s(CLOCK_MONOTONIC);
    if (!go(s->editor, &change)) {
        edit_state_say(s, true, "%s", none);
        return;
    }
    follow_change(s, &change);
    s->looks = false;
    measure(s, since);
    edit_state_go(s, s->branch, s->t);
    edit_state_say(s, false, "%d edits", sweep_editor_list(s->editor)->count);
}

void edit_state_undo(EditState *s) { go_back(s, sweep_editor_undo, "there is no edit to undo"); }
void edit_state_redo(EditState *s) { go_back(s, sweep_editor_redo, "there is no edit to do again"); }
