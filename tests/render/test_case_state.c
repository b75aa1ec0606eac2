// The case window's state as its mouse and keys drive it, without a window: orientation, slices and projections of volumes whose content is known, and a case from
// clicks, which comes out byte for byte the same without the window.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/case_state.h"

#include <stdlib.h>
#include <string.h>

static char folder[] = "/tmp/seldinger-case-state-XXXXXX";
#include "tests/folder.h"

static Faults faults;

// --- pictures ---

// A volume of 40 x 50 x 60 voxels of 1 x 0.8 x 0.7 mm with a bright ball of 3 mm to the patient's left, front and head.
static Volume *ball_in(const char *frame, Vec3 *center)
{
    const int size[3] = {40, 50, 60};
    Vec3 axis[3] = {{1, 0, 0}, {0, 0.8, 0}, {0, 0, 0.7}};
    Volume *v = volume_create(size, vec3(-20, 7, 100), axis);
    VolumeAxes a = patient_axes(frame);
    assert_non_null(v);
    snprintf(v->frame, sizeof v->frame, "%s", frame);
    *center = vec3_add(volume_middle(v), vec3_add(vec3_scale(a.left, 8), vec3_add(vec3_scale(a.posterior, -10), vec3_scale(a.superior, 12))));
    size_t n = 0;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            for (int i = 0; i < size[0]; i++)
                v->value[n++] = vec3_distance(volume_point_of(v, vec3(i, j, k)), *center) < 3 ? 100 : 10;
    v->minimum = 10, v->maximum = 100;
    return v;
}

// Where the bright pixels of a picture lie, relative to its middle and half its size: x to the right, y up.
static void bright_middle(const Camera *c, const uint8_t *grey, double *x, double *y)
{
    double sum = 0;
    *x = *y = 0;
    for (int j = 0; j < c->height; j++)
        for (int i = 0; i < c->width; i++)
            if (grey[j * c->width + i] > 200)
                sum++, *x += 2.0 * (i + 0.5) / c->width - 1, *y += 1 - 2.0 * (j + 0.5) / c->height;
    assert_true(sum > 0);
    *x /= sum, *y /= sum;
}

static void letters_are_the_patients(void **state)
{
    (void)state;
    static const char *const frame[] = {"LPS", "RAS", "LAS", "RPI"};
    static const char right[3][4] = {"L", "L", "P"}, up[3][4] = {"A", "S", "S"};
    enum { SIDE = 120 };
    static uint8_t grey[SIDE * SIDE];
    for (int f = 0; f < 4; f++) {
        Vec3 center;
        Volume *v = ball_in(frame[f], &center);
        VolumeAxes a = patient_axes(v->frame);
        assert_true(a.is_known);
        for (int view = 0; view < 3; view++) {
            char text[4];
            double x, y;
            Camera c = slice_camera(&a, (SliceView)view, v, volume_middle(v), 1, SIDE, SIDE);
            patient_letters(&a, c.right, text);
            assert_string_equal(text, right[view]);
            patient_letters(&a, c.up, text);
            assert_string_equal(text, up[view]);
            // the ball lies to the left and front and head: right and up in the axial and coronal views, left (front) in the sagittal one
            volume_slice(v, &c, center, 10, 100, grey);
            bright_middle(&c, grey, &x, &y);
            assert_true(view == SLICE_SAGITTAL ? x < -0.1 : x > 0.1);
            assert_true(y > 0.1);
            volume_projection(v, &c, 10, 100, 1, grey);
            double px, py;
            bright_middle(&c, grey, &px, &py);
            Vec3 p = camera_project(&c, center);
            assert_true(fabs(px - (2 * p.x / SIDE - 1)) < 0.03 && fabs(py - (1 - 2 * p.y / SIDE)) < 0.03);
        }
        volume_free(v);
    }
    char text[4];
    VolumeAxes none = patient_axes("scanner-xyz");
    assert_false(none.is_known);
    patient_letters(&none, vec3(0, -1, 0), text);
    assert_string_equal(text, "-y");
    VolumeAxes lps = patient_axes("LPS");
    patient_letters(&lps, vec3_unit(vec3(-1, -0.8, 0.1)), text);
    assert_string_equal(text, "RA");
}

static void a_click_in_a_projection_meets_the_vessel(void **state)
{
    (void)state;
    Vec3 center, place;
    Volume *v = ball_in("RAS", &center);
    VolumeAxes a = patient_axes(v->frame);
    for (int view = 0; view < 3; view++) {
        Camera c = slice_camera(&a, (SliceView)view, v, volume_middle(v), 1, 200, 150);
        Vec3 p = camera_project(&c, center);
        assert_true(volume_pick(v, &c, 10, 100, p.x, p.y, &place));
        assert_true(vec3_distance(place, center) < 1);
        assert_false(volume_pick(v, &c, 10, 100, -500, p.y, &place));
        // four pixels beside the ball it is met, twenty beside it nothing is
        const double edge = 3 / c.mm_per_pixel;
        assert_true(volume_pick(v, &c, 10, 100, p.x + edge + 4, p.y, &place));
        assert_true(vec3_distance(place, center) < 3.1);
        assert_false(volume_pick(v, &c, 10, 100, p.x + edge + 20, p.y, &place));
    }
    // what is reduced keeps the ball's place
    Volume *small = volume_reduced(v, 20);
    assert_true(small->size[0] == 20 && small->size[1] == 17 && small->size[2] == 20);
    assert_true(volume_value_at(small, center) > 99);
    volume_free(small);
    volume_free(v);
}

// --- a case ---

static double outside(Vec3 x, Vec3 a, Vec3 b, double radius)
{
    Vec3 ab = vec3_sub(b, a);
    double t = fmin(fmax(vec3_dot(vec3_sub(x, a), ab) / vec3_norm2(ab), 0), 1);
    return vec3_distance(x, vec3_add_scaled(a, t, ab)) - radius;
}

// A trunk along x from border to border, of 1.6 mm, and a branch of 1.1 mm that leaves it to the right.
static int make_volume(void **state)
{
    const int size[3] = {76, 56, 40};
    Vec3 axis[3] = {{0.4, 0, 0}, {0, 0.4, 0}, {0, 0, 0.4}};
    Volume *v = make_folder(state) == 0 && setenv("SELDINGER_CACHE", in_folder("cache"), 1) == 0 && setenv("XDG_DATA_HOME", folder, 1) == 0
                    ? volume_create(size, vec3(0, 0, 0), axis)
                    : NULL;
    if (!v)
        return 1;
    snprintf(v->frame, sizeof v->frame, "LPS");
    size_t n = 0;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            for (int i = 0; i < size[0]; i++) {
                Vec3 x = volume_point_of(v, vec3(i, j, k));
                double d = fmin(outside(x, vec3(-5, 7, 8), vec3(40, 7, 8), 1.6), outside(x, vec3(12, 7, 8), vec3(24, 18, 8), 1.1));
                v->value[n++] = (float)round(200 * fmin(fmax(0.5 - d / 0.8, 0), 1));
            }
    v->maximum = 200;
    bool good = volume_save_nrrd(v, in_folder("vessel.nrrd"), "uint8", &faults);
    volume_free(v);
    return good ? 0 : 1;
}

static const char *input(void) { return in_folder("vessel.nrrd"); }

static void wait_and_look(CaseState *s)
{
    case_builder_wait(s->builder, 300);
    case_state_frame(s);
}

static CaseState *begin(void)
{
    CaseState *s = calloc(1, sizeof *s);
    CaseOptions made = {.input = strdup(input()), .library = SOURCE_DIR "/scenes/tools"};
    assert_true(s && case_state_begin(s, &made));
    wait_and_look(s);
    assert_true(s->has_volume);
    assert_int_equal(s->progress.stage, BUILD_IDLE);
    return s;
}

static void end(CaseState *s)
{
    char *path = (char *)(uintptr_t)s->made.input;
    case_state_end(s);
    free(path);
    free(s);
}

static double length_of(const CaseState *s)
{
    CaseFigures figures;
    assert_non_null(case_builder_work(s->builder));
    case_work_measure(case_builder_work(s->builder), &figures);
    return figures.length;
}

static void a_click_grows_the_tree_and_acts_change_it(void **state)
{
    (void)state;
    CaseState *s = begin();
    assert_int_equal(s->mode, CASE_START);
    assert_true(volume_value_at(s->volume, s->cursor) > 190);    // the cross-hair begins in a vessel
    // acts that need a tree are refused before it
    case_state_act(s, CASE_CUT, vec3(20, 7, 8));
    assert_true(s->message_is_fault && s->acts.count == 0);
    // background is no start
    case_state_click(s, vec3(5, 20, 3));
    wait_and_look(s);
    assert_int_equal(s->progress.stage, BUILD_FAILED);
    assert_non_null(strstr(s->message, "background"));
    assert_null(case_builder_work(s->builder));
    case_state_undo(s);
    assert_int_equal(s->mode, CASE_START);
    case_state_click(s, vec3(6, 7, 8));
    assert_int_equal(s->mode, CASE_LOOK);
    wait_and_look(s);
    assert_int_equal(s->progress.stage, BUILD_DONE);
    assert_true(s->seen_count > 10);
    const double whole = length_of(s);
    assert_true(whole > 35);     // 30 mm of the trunk and most of the branch
    // the widest end at the border is the entry: one of the trunk's
    const VesselTree *tree = case_work_tree(case_builder_work(s->builder));
    assert_true(fabs(tree->center[0].y - 7) < 1 && tree->radius[0] > 1.3);
    // a click that only looks
    int acts = s->acts.count;
    case_state_click(s, vec3(20, 7, 8));
    assert_int_equal(s->acts.count, acts);
    // the branch is cut, and comes back
    case_state_mode(s, CASE_CUT);
    case_state_click(s, vec3(18, 12.5, 8));
    wait_and_look(s);
    assert_int_equal(s->progress.stage, BUILD_DONE);
    assert_true(length_of(s) < whole - 4);
    case_state_undo(s);
    wait_and_look(s);
    assert_true(length_of(s) == whole);
    case_state_redo(s);
    wait_and_look(s);
    assert_true(length_of(s) < whole - 4);
    end(s);
}

static void what_runs_is_stopped_at_once(void **state)
{
    (void)state;
    CaseState *s = begin();
    for (int i = 0; i < 5; i++) {
        case_state_act(s, CASE_START, vec3(6 + i, 7, 8));
        case_state_frame(s);
    }
    case_state_cancel(s);
    case_state_frame(s);
    assert_int_equal(s->progress.stage, BUILD_IDLE);
    assert_null(case_builder_work(s->builder));
    assert_int_equal(s->acts.count, 4);
    case_state_redo(s);
    wait_and_look(s);
    assert_int_equal(s->progress.stage, BUILD_DONE);
    end(s);          // and with a tree that grows
    s = begin();
    case_state_click(s, vec3(6, 7, 8));
    end(s);
}

static int same_folders(const char *a, const char *b)
{
    char command[600];
    snprintf(command, sizeof command, "cd '%s' && diff -r '%s' '%s'", folder, a, b);
    return system(command);
}

static void a_case_is_the_same_without_the_window(void **state)
{
    (void)state;
    CaseState *s = begin();
    char out[4096];
    case_state_click(s, vec3(6.004, 7, 8));
    case_state_act(s, CASE_END, vec3(26, 7, 8));
    case_state_act(s, CASE_FORBID, vec3(23, 17, 8));
    case_state_act(s, CASE_BRANCH, vec3(18, 12.5, 8));
    wait_and_look(s);
    if (s->progress.stage != BUILD_DONE)
        fail_msg("%s", s->message);
    case_state_act(s, CASE_ENTRY, vec3(25, 7.5, 8));
    wait_and_look(s);
    if (s->progress.stage != BUILD_DONE)
        fail_msg("%s", s->message);
    // choices of the scene alone need no new tree
    const CaseWork *work = case_builder_work(s->builder);
    case_state_act(s, CASE_TARGET, vec3(17, 11.5, 8));
    case_state_turn_background(s);
    case_state_next(s, CASE_CATHETERS, 1);
    case_state_next(s, CASE_SEGMENTS, 1);
    case_state_next(s, CASE_SEGMENTS, 1);
    case_state_undo(s);
    assert_int_equal(s->list[CASE_SEGMENTS].chosen, 1);
    assert_string_equal(case_acts_last(&s->acts, CASE_ANATOMY)->name, patient_segment_name[0]);
    case_state_frame(s);
    assert_ptr_equal(case_builder_work(s->builder), work);
    if (!case_state_save(s, in_folder("window"), out, sizeof out, &faults))
        fail_msg("%s", s->message);
    assert_string_equal(out, in_folder("window"));
    // nothing is written over
    faults_clear(&faults);
    assert_false(case_state_save(s, in_folder("window"), out, sizeof out, &faults));
    faults_clear(&faults);
    assert_true(case_state_save(s, NULL, out, sizeof out, &faults));
    assert_string_equal(out, in_folder("seldinger/cases/vessel"));
    // from its trace, without the window
    size_t length;
    char *trace = whole_file_read(in_folder("window/trace.yaml"), &length, &faults);
    assert_non_null(trace);
    assert_non_null(strstr(trace, "start_mm: [6, 7, 8]"));
    assert_true(strstr(trace, "catheter: catheter-5f-headhunter.yaml") && strstr(trace, "anatomy: right_internal_carotid"));
    // by one thread; the window takes as many as there are cores, and a case with edits is made by two
    CaseOptions options = {.input = s->made.input, .library = s->made.library, .trace = trace, .trace_path = "trace.yaml", .threads = 1};
    CaseFigures figures;
    if (!case_make(in_folder("plain"), &options, &figures, &faults))
        fail_msg("%s", faults.text[0]);
    assert_int_equal(same_folders("window", "plain"), 0);
    assert_int_equal(same_folders("window", "seldinger/cases/vessel"), 0);
    free(trace);
    end(s);
}

static void has_edits(const char *name, int wanted)
{
    size_t length;
    char *trace = whole_file_read(in_folder(name), &length, &faults);
    assert_non_null(trace);
    int count = 0;
    for (const char *at = trace; (at = strstr(at, "{edit: ")) != NULL; at++)
        count++;
    assert_int_equal(count, wanted);
    assert_non_null(strstr(trace, "model: sweep"));
    free(trace);
}

// How far a place lies within the wall, as the node nearest to it sees it [mm].
static double depth_in(const CaseState *s, Vec3 x)
{
    const ModelField *wall = case_builder_wall(s->builder);
    int near = 0;
    assert_non_null(wall);
    for (int i = 1; i < wall->tree->node_count; i++)
        if (vec3_distance(x, wall->tree->center[i]) < vec3_distance(x, wall->tree->center[near]))
            near = i;
    return model_field_distance(wall, near, x);
}

// Sections are edited in the window; the edits are acts like the others, and the case comes out the same without it.
static void sections_are_edited_in_the_window(void **state)
{
    (void)state;
    CaseState *s = begin();
    char out[4096];
    assert_false(case_state_edit_begin(s));
    case_state_click(s, vec3(6, 7, 8));
    wait_and_look(s);
    assert_false(case_state_edit_begin(s));      // local models have no sections
    assert_true(s->message_is_fault && strstr(s->message, "{model} chooses the model"));
    const VesselTree *tracked = case_builder_work(s->builder)->file.tree;
    double track_s = s->progress.track_s;
    case_state_next(s, CASE_MODELS, 1);
    wait_and_look(s);
    // the tree stays as it was tracked
    assert_ptr_equal(case_builder_work(s->builder)->file.tree, tracked);
    assert_true(s->progress.track_s == track_s);
    if (s->progress.stage != BUILD_DONE)
        fail_msg("%s", s->message);
    assert_string_equal(s->list[CASE_MODELS].name[s->list[CASE_MODELS].chosen], "sweep");
    const CaseWork *work = case_builder_work(s->builder);
    const SweepModel *fitted = case_work_sweep(work);
    const Vec3 middle = vec3(20, 7, 8 + 1.6 * 1.1);      // outside the wall, inside that of a section a fifth larger
    assert_true(depth_in(s, middle) < 0);
    assert_true(case_state_edit_begin(s));
    int branch;
    double t;
    assert_true(sweep_edit_place(sweep_editor_field(s->editor), vec3(20, 7, 8 + 1.6), &branch, &t));
    edit_state_go(&s->edit, branch, t);
    edit_state_scale(&s->edit, 1.3);
    case_state_edit_take(s);
    assert_int_equal(case_acts_edits(&s->acts), 1);
    edit_state_scale(&s->edit, 1.5);
    case_state_edit_take(s);
    // one history, in the editor and outside of it
    case_state_undo(s);
    assert_int_equal(sweep_editor_list(s->editor)->count, 1);
    case_state_redo(s);
    assert_int_equal(sweep_editor_list(s->editor)->count, 2);
    case_state_undo(s);
    case_state_edit_end(s);
    wait_and_look(s);
    assert_int_equal(s->progress.stage, BUILD_DONE);
    // tree and model stay; the wall is that of the edits
    assert_ptr_equal(case_work_sweep(case_builder_work(s->builder)), fitted);
    assert_true(depth_in(s, middle) > 0);
    case_state_redo(s);          // without the editor
    case_state_undo(s);
    case_state_act(s, CASE_TARGET, vec3(17, 11.5, 8));
    wait_and_look(s);
    if (!case_state_save(s, in_folder("edited"), out, sizeof out, &faults))
        fail_msg("%s", s->message);
    has_edits("edited/trace.yaml", 1);
    size_t length;
    char *trace = whole_file_read(in_folder("edited/trace.yaml"), &length, &faults);
    CaseFigures figures;
    CaseOptions options = {.input = s->made.input, .library = s->made.library, .trace = trace, .trace_path = "trace.yaml", .threads = 2};
    if (!case_make(in_folder("headless"), &options, &figures, &faults))
        fail_msg("%s", faults.text[0]);
    assert_int_equal(same_folders("edited", "headless"), 0);
    // another tree has other branches: the edits count no longer, until that is undone
    case_state_act(s, CASE_CUT, vec3(18, 12.5, 8));
    assert_true(s->message_is_fault && strstr(s->message, "1 edits"));
    assert_int_equal(case_acts_edits(&s->acts), 0);
    wait_and_look(s);
    assert_int_equal(s->progress.stage, BUILD_DONE);
    assert_true(depth_in(s, middle) < 0);
    case_state_undo(s);
    wait_and_look(s);
    assert_int_equal(case_acts_edits(&s->acts), 1);
    assert_true(depth_in(s, middle) > 0);
    // and edits of what has no sections are refused
    const CaseOptions other = {.input = s->made.input, .trace = trace, .trace_path = "trace.yaml", .has_kind = true};
    faults_clear(&faults);
    assert_false(case_make(in_folder("local"), &other, &figures, &faults));
    assert_non_null(strstr(faults.text[0], "has no sections to edit"));
    faults_clear(&faults);
    free(trace);
    end(s);
}

static const char *shouted(const char *text)
{
    return !strcmp(text, "cut") ? "SCHNITT" : !strcmp(text, "%s at %.1f, %.1f, %.1f") ? "%s BEI %.1f, %.1f, %.1f" : text;
}

// What the simulator puts together is in the language of the window.
static void acts_are_translated(void **state)
{
    (void)state;
    char text[100];
    CaseAct act = {.kind = CASE_CUT, .place = vec3(1, 2, 3)};
    case_act_describe(&act, NULL, text, sizeof text);
    assert_string_equal(text, "cut at 1.0, 2.0, 3.0");
    case_act_describe(&act, shouted, text, sizeof text);
    assert_string_equal(text, "SCHNITT BEI 1.0, 2.0, 3.0");
}

static void views_move_as_the_patient_lies(void **state)
{
    (void)state;
    CaseState *s = begin();
    s->cursor = vec3(12, 8, 8);
    case_state_scroll(s, SLICE_AXIAL, 1);        // towards the feet, in LPS -z, by a voxel
    assert_true(fabs(s->cursor.z - 7.6) < 1e-9);
    case_state_move(s, SLICE_CORONAL, 2, 1);     // to the patient's left and head
    assert_true(fabs(s->cursor.x - 12.8) < 1e-9 && fabs(s->cursor.z - 8) < 1e-9);
    for (int i = 0; i < 500; i++)
        case_state_move(s, SLICE_SAGITTAL, 1, 0);
    assert_true(fabs(s->cursor.y - 22) < 1e-9);  // the last voxel
    double width = s->high - s->low, level = s->high + s->low;
    case_state_window(s, 2, 0);
    assert_true(fabs(s->high - s->low - 2 * width) < 1e-9 && fabs(s->high + s->low - level) < 1e-9);
    end(s);
}

// A click that has no effect says why, and so does a start in the tissue of a CT.
static void a_click_without_effect_says_why(void **state)
{
    (void)state;
    CaseState *s = calloc(1, sizeof *s);
    CaseOptions made = {.input = strdup(input())};
    assert_true(s && case_state_begin(s, &made));
    case_state_click_nowhere(s, SLICE_AXIAL);
    assert_true(s->message_is_fault && strstr(s->message, "still being loaded"));
    wait_and_look(s);
    assert_int_equal(s->message[0], 0);          // it is loaded now
    case_state_click_nowhere(s, SLICE_AXIAL);
    assert_non_null(strstr(s->message, "outside the volume"));
    case_state_click_nowhere(s, CASE_PROJECTION);
    assert_non_null(strstr(s->message, "nothing bright"));
    assert_int_equal(s->acts.count, 0);
    end(s);

    const int size[3] = {40, 40, 40};
    Vec3 axis[3] = {{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}};
    Volume *v = volume_create(size, vec3(0, 0, 0), axis);
    assert_non_null(v);
    for (size_t n = 0; n < 64000; n++) {
        Vec3 x = volume_point_of(v, vec3((double)(n % 40), (double)(n / 40 % 40), (double)(n / 1600)));
        v->value[n] = x.z > 18 ? -1000 : outside(x, vec3(-5, 10, 8), vec3(30, 10, 8), 2) < 0 ? 350 : 40;
    }
    v->minimum = -1000, v->maximum = 350;
    assert_true(volume_save_nrrd(v, in_folder("ct.nrrd"), "int16", &faults));
    volume_free(v);
    s = calloc(1, sizeof *s);
    made.input = strdup(in_folder("ct.nrrd"));
    assert_true(s && case_state_begin(s, &made));
    wait_and_look(s);
    case_state_click(s, vec3(10, 4, 8));
    assert_true(s->message_is_fault && strstr(s->message, "40 HU lie there, as in tissue"));
    case_state_act(s, CASE_START, vec3(10, 10, 8));
    assert_false(s->message_is_fault);
    end(s);
}

static bool trace_says(const CaseState *s, const char *text)
{
    char *trace = case_acts_trace(&s->acts);
    assert_non_null(trace);
    const bool says = strstr(trace, text) != NULL;
    free(trace);
    return says;
}

// A vessel along x that lies on a block of bone: the projection, a click and the tree leave the bone out, until the user wants it.
static void bone_of_a_ct_is_forbidden_in_one_act(void **state)
{
    (void)state;
    const int size[3] = {60, 50, 40};
    const Vec3 axis[3] = {{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}}, in_bone = {15, 18, 10};
    Volume *v = volume_create(size, vec3(0, 0, 0), axis);
    Vec3 place;
    assert_non_null(v);
    for (size_t n = 0; n < 120000; n++) {
        const Vec3 x = volume_point_of(v, vec3((double)(n % 60), (double)(n / 60 % 50), (double)(n / 3000)));
        const double vessel = fmin(fmax(0.5 - outside(x, vec3(-5, 10, 10), vec3(40, 10, 10), 2) / 0.7, 0), 1);
        v->value[n] = x.z > 18.4 ? -1000 : (float)round(vessel * 350 + (1 - vessel) * (x.y > 11.5 ? 1200 : 40));
    }
    v->minimum = -1000, v->maximum = 1200;
    assert_true(volume_save_nrrd(v, in_folder("bone.nrrd"), "int16", &faults));
    volume_free(v);
    CaseState *s = calloc(1, sizeof *s);
    CaseOptions made = {.input = strdup(in_folder("bone.nrrd"))};
    assert_true(s && case_state_begin(s, &made));
    wait_and_look(s);
    assert_true(case_state_forbids_bone(s));
    assert_true(volume_value_at(case_state_projected(s), in_bone) < 100);
    // a click in the view from behind passes the bone and meets the vessel
    const Camera c = slice_camera(&s->axes, SLICE_CORONAL, s->volume, volume_middle(s->volume), 1, 200, 150);
    const Vec3 p = camera_project(&c, vec3(15, 10, 10));
    assert_true(volume_pick(case_state_projected(s), &c, s->low, s->high, p.x, p.y, &place));
    assert_true(fabs(place.y - 10) < 2);
    case_state_act(s, CASE_START, vec3(15, 10, 10));
    wait_and_look(s);
    if (s->progress.stage != BUILD_DONE)
        fail_msg("%s", s->message);
    const VesselTree *tree = case_work_tree(case_builder_work(s->builder));
    for (int i = 0; i < tree->node_count; i++)
        assert_true(outside(tree->center[i], vec3(-5, 10, 10), vec3(40, 10, 10), 0) < 0.5);
    assert_true(length_of(s) > 25);
    assert_false(trace_says(s, "bone_hu"));
    // one act lets it be tracked, and is undone like any other
    case_state_turn_bone(s);
    assert_false(case_state_forbids_bone(s));
    assert_true(trace_says(s, "bone_hu: 0\n"));
    assert_true(volume_value_at(case_state_projected(s), in_bone) > 1000);
    case_state_undo(s);
    assert_true(case_state_forbids_bone(s) && !trace_says(s, "bone_hu"));
    case_state_turn_bone(s);
    case_state_turn_bone(s);
    assert_true(case_state_forbids_bone(s) && !trace_says(s, "bone_hu"));
    end(s);
    // no other volume says what bone is
    s = begin();
    assert_false(case_state_forbids_bone(s));
    case_state_turn_bone(s);
    assert_true(s->message_is_fault && s->acts.count == 0);
    end(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(letters_are_the_patients),          cmocka_unit_test(a_click_in_a_projection_meets_the_vessel),
        cmocka_unit_test(views_move_as_the_patient_lies),    cmocka_unit_test(a_click_grows_the_tree_and_acts_change_it),
        cmocka_unit_test(what_runs_is_stopped_at_once),      cmocka_unit_test(a_case_is_the_same_without_the_window),
        cmocka_unit_test(sections_are_edited_in_the_window), cmocka_unit_test(acts_are_translated),
        cmocka_unit_test(a_click_without_effect_says_why),   cmocka_unit_test(bone_of_a_ct_is_forbidden_in_one_act),
    };
    return cmocka_run_group_tests(tests, make_volume, remove_folder);
}
