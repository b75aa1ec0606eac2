// Debriefing as a user does it: `seldinger replay --beside` under a virtual X server, with another recording and with the script of a hand, and keys by xdotool.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <time.h>

static char folder[] = "/tmp/seldinger-debrief-XXXXXX";
#include "display.h"
#include "tests/folder.h"

#define SCENE                                                                                                                                                  \
    "seldinger: 1\nvessel: {tube: {radius_mm: 1.2, normal: [0, 1, 0], path: [{line_mm: 15}, {arc: {radius_mm: 20, angle_deg: 60}}, {line_mm: 10}]}, "          \
    "contact: tube, friction: 0.05}\nwire: {elements: 20, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"                            \
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\ntargets: [{name: end, point_mm: [15, 0, 0], radius_mm: 2}]\n"                        \
    "exercise: {title: Along, target: end, hold_s: 0.2, rules: {wall_force_n: 0.0001}}\n"

static int run(const char *command)
{
    char text[1500];
    snprintf(text, sizeof text, "cd '%s' && S='%s' && %s", folder, SELDINGER_PROGRAM, command);
    int status = system(text);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int set_up(void **state)
{
    if (make_folder(state) != 0 || display_start() != 0)
        return -1;
    put("scene.yaml", SCENE);
    put("hand.csv", "t_s,push_mm_s,twist_deg_s\n0.2,30,0\n0.6,0,0\n1,0,0\n");
    put("slow.csv", "t_s,push_mm_s,twist_deg_s\n0.5,15,0\n1.2,0,0\n1.5,0,0\n");
    put("broken.csv", "t_s,push_mm_s,twist_deg_s\nfast,1,0\n");
    return run("for h in hand slow; do \"$S\" run scene.yaml --script $h.csv --record $h.h5 --quiet || exit 1; done");
}

static int tear_down(void **state)
{
    display_stop();
    return remove_folder(state);
}

static void what_cannot_be_shown_beside_is_reported(void **state)
{
    (void)state;
    assert_int_equal(run("\"$S\" replay slow.h5 --beside nosuch.h5 --quiet 2>out.txt"), 2);
    assert_int_equal(run("grep -q nosuch.h5 out.txt"), 0);
    assert_int_equal(run("\"$S\" replay slow.h5 --beside broken.csv --quiet 2>out.txt"), 2);
    assert_int_equal(run("grep -q broken.csv:2 out.txt"), 0);
    assert_int_equal(run("\"$S\" replay slow.h5 --picture hand.h5 --beside hand.h5 --quiet 2>out.txt"), 2);
    assert_int_equal(run("grep -q -e --beside out.txt"), 0);
}

// Keys go to the window until it closes; it must end well whatever was pressed.
static void recordings_and_scripts_run_side_by_side(void **state)
{
    (void)state;
    need_display();
    static const char *const beside[] = {"hand.h5", "hand.csv"};
    for (int i = 0; i < 2; i++) {
        char command[600];
        snprintf(command, sizeof command,
                 "{ \"$S\" replay slow.h5 --beside %s --duration-s 6 --size 640x480 --quiet >out.txt 2>&1 & p=$!; "
                 "while kill -0 $p 2>/dev/null; do xdotool search --name 'Seldinger replay' >/dev/null 2>&1 && "
                 "xdotool key Down Down y 9 greater Right ctrl+Left Up 6 8 5 9 p less; sleep 0.3; done; wait $p; }",
                 beside[i]);
        assert_int_equal(run(command), 0);
        assert_int_equal(run("! grep . out.txt"), 0);
    }
    assert_int_equal(run("! ls -d /tmp/seldinger-beside-* 2>/dev/null"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_cannot_be_shown_beside_is_reported), cmocka_unit_test(recordings_and_scripts_run_side_by_side)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
