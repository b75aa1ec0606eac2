// Scenes that failed in earlier versions (scenes/hard): no tool jumps at the sheath's mouth, gains energy, or keeps moving while the hand rests.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-hard-XXXXXX";
#include "tests/folder.h"
#include "tests/short_run.h"
#include "tests/cli/json_file.h"

// Limits for a run with up to 3 s of rest at its end.
typedef struct HardCase {
    const char *scene;
    double push, gained;         // [N] largest force at the hand in either direction; [mJ] largest unexplained gain of energy in one step
    int cut, not_converged;      // maximum number of steps
    bool rests;
} HardCase;

static double number(const cJSON *summary, const char *part, const char *name)
{
    return cJSON_GetObjectItem(cJSON_GetObjectItem(summary, part), name)->valuedouble;
}

static cJSON *run(const char *scene)
{
    char command[1000];
    snprintf(command, sizeof command, "%s run '%s/scenes/hard/%s.yaml' --settle-s 3 --summary '%s' --quiet 2>/dev/null", SELDINGER_PROGRAM, SOURCE_DIR, scene,
             in_folder("summary.json"));
    int status = system(command);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    return json_of("summary.json");
}

static cJSON *holds(HardCase c)
{
    cJSON *s = run(c.scene);
    double push = fmax(number(s, "proximal", "force_most_n"), -number(s, "proximal", "force_least_n")),
           gained = number(s, "energy_mj", "gained_most_in_a_step");
    int cut = (int)number(s, "solver", "limited_steps"), failed = (int)number(s, "solver", "not_converged_steps");
    bool rests = cJSON_IsTrue(cJSON_GetObjectItem(s, "settled"));
    print_message("%-20s push %.4f N, gained %.2g mJ in a step, %d steps cut, %d not converged, %s\n", c.scene, push, gained, cut, failed,
                  rests ? "at rest" : "restless");
    assert_true(push <= c.push * (1 + 1e-9) && gained <= c.gained && cut <= c.cut && failed <= c.not_converged && (rests || !c.rests));
    double balance = number(s, "energy_mj", "hand") + number(s, "energy_mj", "load");
    static const char *const gone[] = {"elastic", "kinetic", "friction", "damping", "numerical"};
    for (int i = 0; i < 5; i++)
        balance -= number(s, "energy_mj", gone[i]);
    assert_true(fabs(balance) < 1e-6 * fabs(number(s, "energy_mj", "hand")));
    return s;
}

// EI k^2 / 2 and 0.1 % more: 8.2448 N and 60.470 N.
static void curved_tools_leave_the_mouth(void **state)
{
    (void)state;
    cJSON_Delete(holds((HardCase){"pigtail", 8.2448 * 1.001, 0.005, 0, 0, true}));
    if (!WHOLE_RUN)
        return;
    cJSON_Delete(holds((HardCase){"simmons", 60.470 * 1.001, 0.1, 0, 0, true}));
    cJSON_Delete(holds((HardCase){"phantom-pigtail", 67, 1, 1, 0, true}));
}

static void what_is_let_go_is_not_cut_for_ever(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON_Delete(holds((HardCase){"let-go", 16, 0.2, 0, 10, true}));
}

// 139 to 192 mJ are stored; without friction or damping only the integration dissipates energy.
static void a_tool_rests_with_the_hand(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON_Delete(holds((HardCase){"rest-bend", 75, 0.005, 3, 0, true}));
    cJSON_Delete(holds((HardCase){"rest-bend-friction", 75, 0.02, 3, 0, true}));
    cJSON_Delete(holds((HardCase){"rest-straight", 60, 0.01, 0, 0, false}));
    cJSON_Delete(holds((HardCase){"rest-y", 55, 0.005, 0, 0, true}));
}

static void a_hand_slips_above_its_limit(void **state)
{
    (void)state;
    cJSON *s = holds((HardCase){"hand-limit", 20, 0.2, 0, 0, true});
    assert_true(number(s, "proximal", "slip_steps") > 100 && number(s, "proximal", "slipped_mm") > 10);
    cJSON_Delete(s);
}

// Exact without clearance: 2.905 N mm at 90 degrees (phi'' = EI k k0 / GJ sin phi over 15.19 mm, after 3.80 mm of straight tool); 5 um of clearance lower it by
// 3 %.
static void twist_passes_a_clearance_of_5_um(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON *s = holds((HardCase){"clearance-5um", 0.1, 0.001, 0, 150, false});
    double torque = number(s, "proximal", "torque_n_mm");
    print_message("torque %.4f N mm\n", torque);
    assert_true(fabs(torque / 2.905 - 1) < 0.05);
    cJSON_Delete(s);
}

// The work of the inner hand counts too: without it, 840 of 1000 steps were cut, up to the end.
static void an_inner_hand_pushes_a_stiff_bend_out(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON *s = holds((HardCase){"j-wire", 25, 0.8, 40, 2, false});
    const cJSON *wire = cJSON_GetArrayItem(cJSON_GetObjectItem(s, "tools"), 1);
    assert_true(cJSON_GetObjectItem(wire, "inserted_mm")->valuedouble > 45);
    cJSON_Delete(s);
}

// Straightening takes EI k^2 / 2 = 0.767 N until the tip is inside.
static void a_curved_tip_is_drawn_into_the_sheath(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON_Delete(holds((HardCase){"withdrawn", 0.767 * 1.002, 0.002, 0, 0, true}));
}

// The element across the mouth has the length that the tool has moved, not the commanded length, which gained 17 mJ in a step.
static void a_hand_that_slips_makes_no_energy(void **state)
{
    (void)state;
    cJSON_Delete(holds((HardCase){"hand-slips-in-bends", 20, 1e-6, 0, 0, true}));
}

// Whole turns of the tool that continues at a tip are not twist, behind the mouth too: before, a step gained 3,908 mJ, and 87 steps were not solved.
static void a_guide_is_drawn_back_over_a_turned_wire(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON_Delete(holds((HardCase){"guide-withdrawn", 0.5, 0.25, 0, 0, true}));
}

// The chord from the mouth to the first node is short, and a small turn stretches it: before, 1.4e-3 of the work was gained.
static void a_curl_is_drawn_into_the_sheath(void **state)
{
    (void)state;
    cJSON *s = run("curl-drawn-in");
    double gained = number(s, "energy_mj", "gained");
    print_message("curl-drawn-in        gained %.2g of 0.047 mJ\n", gained);
    assert_true(gained < 1e-5);
    cJSON_Delete(s);
}

// Before, single steps gained 2.1e-2, 8.1e-2, 3.9e3, 8.9e-3 and 1.2e-3 of the work.
static void quick_steps_gain_no_energy(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    const struct {
        const char *name;
        double share;        // share of the work of hands and loads that all steps together may gain
    } scene[] = {
        {"stiff-wire-turned", 1e-3}, {"wire-in-soft-guide", 5e-3}, {"tips-nearly-flush", 5e-3}, {"twist-at-mouth", 1e-4}, {"whole-turns-inside", 2e-4}};
    for (size_t i = 0; i < sizeof scene / sizeof *scene; i++) {
        cJSON *s = run(scene[i].name);
        double gained = number(s, "energy_mj", "gained"), work = number(s, "energy_mj", "work");
        print_message("%-20s gained %.2g of %.3g mJ\n", scene[i].name, gained, work);
        assert_true(work > 1 && gained < scene[i].share * work);
        cJSON_Delete(s);
    }
}

// A tip held by the wall keeps its node, and a tip that comes out far in a step gets a node for that step: without it, the tip passed 2.3 mm through the wall.
static void an_inner_tip_stays_within_the_wall(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    cJSON *s = run("inner-tip-on-wall");
    double deepest = number(s, "penetration_mm", "max");
    print_message("inner-tip-on-wall    %.3f mm outside\n", deepest);
    assert_true(deepest < 0.1);
    cJSON_Delete(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(curved_tools_leave_the_mouth),
        cmocka_unit_test(what_is_let_go_is_not_cut_for_ever),
        cmocka_unit_test(a_tool_rests_with_the_hand),
        cmocka_unit_test(a_hand_slips_above_its_limit),
        cmocka_unit_test(an_inner_hand_pushes_a_stiff_bend_out),
        cmocka_unit_test(twist_passes_a_clearance_of_5_um),
        cmocka_unit_test(a_curved_tip_is_drawn_into_the_sheath),
        cmocka_unit_test(a_hand_that_slips_makes_no_energy),
        cmocka_unit_test(a_guide_is_drawn_back_over_a_turned_wire),
        cmocka_unit_test(a_curl_is_drawn_into_the_sheath),
        cmocka_unit_test(an_inner_tip_stays_within_the_wall),
        cmocka_unit_test(quick_steps_gain_no_energy),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
