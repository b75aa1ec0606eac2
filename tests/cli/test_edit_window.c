// The editor's window as a user drives it, by mouse and keys under a virtual X server: what it saves is, byte for byte, what its edits replay to without a window.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "base/whole_file.h"
#include "recon/edit/edit_file.h"

#include "tests/cli/display.h"
#include "tests/geom/sweep_models.h"

static char folder[] = "/tmp/seldinger-edit-XXXXXX";
#include "tests/folder.h"

static Faults faults;

// A trunk along x with a child upwards, in a tree of few nodes.
static int make_model(void **state)
{
    if (make_folder(state) != 0)
        return 1;
    static SweepShape shape[2] = {{.pitch = 1, .parent = -1, .open_start = true, .radius = 2}, {.pitch = 1, .parent_t = 15, .radius = 1.4}};
    sweep_shape_line(&shape[0], vec3(0, 0, 0), vec3(40, 0, 0), 21);
    sweep_shape_line(&shape[1], vec3(15, 0, 0), vec3(25, 0, 20), 11);
    VesselTree *tree = vessel_tree_create(40, 0, 0);
    for (int i = 0; i < 40; i++)
        tree->center[i] = vec3(i, 0, 0), tree->radius[i] = 2, tree->direction[i] = vec3(1, 0, 0), tree->parent[i] = i - 1;
    EditFile file = {.tree = tree, .models = {{sweep_model_of(shape, 2)}}};
    file.model = file.models.of[SECTION_POLAR];
    SweepEditor *editor = sweep_editor_create(file.model);
    bool good = edit_file_save(&file, editor, in_folder("model.h5"), &faults);
    sweep_editor_free(editor);
    edit_file_free(&file);
    return good ? display_start() : 1;
}

static int end(void **state)
{
    display_stop();
    return remove_folder(state);
}

static int run(const char *format, ...)
{
    static char command[8000];
    int length = snprintf(command, sizeof command, "cd '%s' || exit 9; ", folder);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(command + length, sizeof command - (size_t)length, format, arguments);
    va_end(arguments);
    int status = system(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Keys and mouse wait for pictures, which take long under a sanitizer. The window is 900 x 600: the surface is left of x = 330, the section around (460, 300).
// The last loop ends the window: Esc once for the edits that are not saved, once more to leave.
static const char hand[] =
    "P=${TEST_PAUSE:-0.25}; W=$(xdotool search --sync --onlyvisible --name Seldinger | head -1); xdotool windowmove $W 0 0; "
    "xdotool windowfocus --sync $W 2>/dev/null; sleep 1; k() { for a in \"$@\"; do xdotool key $a; sleep $P; done; }; m() { xdotool mousemove $1 $2; sleep $P; "
    "}; "
    // the place by keys, a handle by keys, a smoothed branch, a wider blend
    "k Prior Prior Tab Up Up Up Return; k bracketright; k k k; k e period a; "
    // a section taken out and an edit undone, done again
    "k Next Delete; k ctrl+z ctrl+y; k t; "
    // a handle dragged, and a stroke drawn
    "k bracketleft Prior; for h in 1 2 3; do m 460 300; done; m 520 300; xdotool mousedown 1; sleep $P; m 530 300; m 540 300; xdotool mouseup 1; sleep $P; "
    "k Prior Prior Prior; xdotool keydown shift; sleep $P; m 530 300; xdotool mousedown 1; sleep $P; "
    "for p in '524 330' '505 353' '477 364' '447 362' '420 346' '400 320' '394 290' '404 262' '428 242' '458 235' '488 240' '513 258' '528 282' '530 296'; "
    "do m $p; done; xdotool mouseup 1; sleep $P; xdotool keyup shift; sleep $P; "
    "k equal; k x; k ctrl+s; k minus; "
    "while xdotool search --name Seldinger >/dev/null 2>&1; do xdotool key Escape; sleep 0.5; done";

static void a_saved_session_is_what_its_edits_replay_to(void **state)
{
    (void)state;
    need_display();
    int code = run(BY_HAND("%s edit model.h5 -o window.h5 --duration-s 150 --size 900x600 --picture window.png >out.txt 2>&1"), hand, SELDINGER_PROGRAM);
    char *said = text_of(in_folder("out.txt"));
    if (code != 0)
        print_message("%s", said);
    assert_int_equal(code, 0);
    free(said);
    assert_int_equal(run("%s edit window.h5 --save-edits edits.yaml", SELDINGER_PROGRAM), 0);
    assert_int_equal(run("%s edit model.h5 --do edits.yaml -o replay.h5 --quiet && cmp window.h5 replay.h5", SELDINGER_PROGRAM), 0);
    assert_int_equal(run("%s edit model.h5 --do edits.yaml -o again.h5 --quiet && cmp again.h5 replay.h5", SELDINGER_PROGRAM), 0);
    // every kind of input left its edit; the last one, after saving, did not
    char *edits = text_of(in_folder("edits.yaml"));
    static const char *const wanted[] = {
        "edit: section, branch: 0",        "edit: smooth, to: circle, strength: 0.6, branch: 1", "edit: blend, branch: 1, width: 0.7",
        "edit: delete_section, branch: 1", "edit: tag, branch: 1, end: end, as: flip",           "edit: cut, branch: 0"};
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++)
        if (!strstr(edits, wanted[i]))
            fail_msg("%s is missing", wanted[i]);
    int sections = 0;
    for (const char *at = edits; (at = strstr(at, "edit: section")) != NULL; at++)
        sections++;
    assert_int_equal(sections, 4);   // by keys, by a handle, by a stroke, enlarged
    free(edits);
    assert_int_equal(access(in_folder("window.png"), R_OK), 0);
}

// A contour and a branch drawn by keys alone; the pointer lies in a corner. A round contour of four points around the trunk, whose radius is 2 mm.
static const char keys[] =
    "P=${TEST_PAUSE:-0.25}; W=$(xdotool search --sync --onlyvisible --name Seldinger | head -1); xdotool windowmove $W 0 0; "
    "xdotool windowfocus --sync $W 2>/dev/null; xdotool mousemove 899 1; sleep 1; k() { for a in \"$@\"; do xdotool key $a; sleep $P; done; }; "
    "k Prior d space BackSpace space; k shift+Up shift+Up shift+Up shift+Up shift+Left shift+Left shift+Left shift+Left space; "
    "k shift+Left shift+Left shift+Left shift+Left shift+Down shift+Down shift+Down shift+Down space; "
    "k shift+Right shift+Right shift+Right shift+Right shift+Down shift+Down shift+Down shift+Down space; k Return; "
    "k ctrl+Right ctrl+Up ctrl+equal; k Tab Tab Tab Tab b shift+Up shift+Up shift+Up space shift+Up shift+Next Right space equal Return; k d space Escape; k "
    "ctrl+s; "
    "while xdotool search --name Seldinger >/dev/null 2>&1; do xdotool key Escape; sleep 0.5; done";

static void contours_and_branches_are_drawn_by_keys(void **state)
{
    (void)state;
    need_display();
    int code = run(BY_HAND("%s edit model.h5 -o keys.h5 --duration-s 150 --size 900x600 >out.txt 2>&1"), keys, SELDINGER_PROGRAM);
    assert_int_equal(code, 0);
    assert_int_equal(run("%s edit keys.h5 --save-edits drawn.yaml && %s edit model.h5 --do drawn.yaml -o drawn.h5 --quiet && cmp keys.h5 drawn.h5",
                         SELDINGER_PROGRAM, SELDINGER_PROGRAM),
                     0);
    EditList *list = edit_list_load(in_folder("drawn.yaml"), &faults);
    assert_non_null(list);
    assert_int_equal(list->count, 2);
    const SweepEdit *section = &list->edit[0], *branch = &list->edit[1];
    assert_true(section->kind == EDIT_SECTION && section->branch == 0 && section->count == 4);
    for (int i = 0; i < 4; i++)      // from the handle, in quarter turns
        assert_true(vec3_distance(section->point[i], vec3(2 - 2 * (i % 2) - 4 * (i == 2), 2 * (i == 1) - 2 * (i == 3), 0)) < 0.01);
    assert_true(branch->kind == EDIT_BRANCH && branch->branch == 0 && branch->count == 3);
    assert_true(fabs(branch->radius[2] - 0.55) < 1e-6);
    assert_true(fabs(vec3_distance(branch->point[0], branch->point[1]) - 3) < 1e-3);
    assert_true(fabs(vec3_distance(branch->point[1], branch->point[2]) - sqrt(2.01)) < 1e-3);
    edit_list_free(list);
}

static void faults_and_usage_are_reported(void **state)
{
    (void)state;
    assert_int_equal(run("printf 'edits:\\n- {edit: cut, branch: 9, t_mm: 1}\\n- {edit: blend, branch: 0, width: 1}\\n' > bad.yaml; "
                         "%s edit model.h5 --do bad.yaml -o bad.h5 2>out.txt",
                         SELDINGER_PROGRAM),
                     2);
    char *said = text_of(in_folder("out.txt"));
    assert_non_null(strstr(said, "bad.yaml:2:3: there is no branch 9; expected 0 to 1"));
    assert_non_null(strstr(said, "bad.yaml:3:3: branch 0 is the root"));
    free(said);
    assert_int_equal(access(in_folder("bad.h5"), F_OK), -1);
    assert_int_equal(run("%s edit model.h5 >out.txt 2>&1", SELDINGER_PROGRAM), 2);
    assert_int_equal(run("%s edit model.h5 --list >out.txt 2>&1 && grep -q 'branch 1: length_mm 22.3607' out.txt", SELDINGER_PROGRAM), 0);
    assert_int_equal(run("DISPLAY= WAYLAND_DISPLAY= %s edit model.h5 -o o.h5 >out.txt 2>&1", SELDINGER_PROGRAM), 2);
    said = text_of(in_folder("out.txt"));
    assert_non_null(strstr(said, "no window"));
    free(said);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(faults_and_usage_are_reported), cmocka_unit_test(a_saved_session_is_what_its_edits_replay_to),
                                       cmocka_unit_test(contours_and_branches_are_drawn_by_keys)};
    return cmocka_run_group_tests(tests, make_model, end);
}
