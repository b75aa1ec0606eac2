// Steps of a guided exercise: each ticks when its condition is met, in order, at its time; the result holds the times; wrong steps are refused with their line.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "score_scene.h"
#include "sim/open_vessel.h"
#include "sim/session.h"
#include "tests/short_run.h"

#include <stdio.h>

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))
#define STEPS(list) IN_THE_OPEN EXERCISE(", hold_s: 5, steps: [" list "]")

static void steps_tick_in_their_order(void **state)
{
    (void)state;
    Practice *p =
        practice_begin(STEPS("{text: Press., xray_s: 0.5}, {text: Inject., contrast_ml: 1}, {text: Turn., turned_deg: 45}, {text: Push., inserted_mm: "
                             "10}, {text: Arrive., tip_in: there}, {text: Stay., held_s: 1}"),
                       NULL);
    assert_int_equal(p->scene->exercise->guide.count, 6);
    assert_string_equal(p->scene->exercise->guide.step[4].text, "Arrive.");
    p->watched = true;
    ScoreFigures f = practice_go(p, 12, 1);                            // already 13 mm in: a later step waits for its turn
    assert_int_equal(f.guide.done, 0);
    p->xray.pedal = 1;
    f = practice_go(p, 0, 0.6);
    assert_int_equal(f.guide.done, 1);
    assert_near(f.guide.done_s[0], 1.5, 0.002);
    p->xray.contrast_ml_s = 2;
    f = practice_go(p, 0, 0.6);
    assert_int_equal(f.guide.done, 2);
    assert_near(f.guide.done_s[1], 2.1, 0.003);
    p->xray.contrast_ml_s = 0;
    for (int i = 0; i < 1000; i++)
        practice_step_tools(p, &(ToolCommands){.tool = {{0, -90}}});   // either way round
    f = score_figures(p->score);
    assert_int_equal(f.guide.done, 4);                                 // and at once the next, whose condition is a state
    assert_near(f.guide.done_s[2], 2.7, 0.005);
    assert_near(f.guide.done_s[3] - f.guide.done_s[2], 0.001, 1e-9);
    f = practice_go(p, 10, 0.7);
    assert_int_equal(f.guide.done, 5);
    f = practice_go(p, 0, 0.8);
    assert_int_equal(f.guide.done, 5);
    f = practice_go(p, 0, 0.5);
    assert_int_equal(f.guide.done, 6);
    assert_near(f.guide.done_s[5] - f.guide.done_s[4], 1, 0.01);
    practice_end(p);
}

// A step counts from when it began, not from the start.
static void a_step_counts_from_its_beginning(void **state)
{
    (void)state;
    Practice *p = practice_begin(STEPS("{text: Push., inserted_mm: 5}, {text: Look., xray_s: 1}, {text: Turn., turned_deg: 90}"), NULL);
    p->watched = true;
    p->xray.pedal = 1;
    for (int i = 0; i < 2000; i++)
        practice_step_tools(p, &(ToolCommands){.tool = {{1, 90}}});
    assert_int_equal(score_figures(p->score).guide.done, 0);
    practice_go(p, 10, 0.3);
    ScoreFigures f = practice_go(p, 0, 0.8);
    assert_int_equal(f.guide.done, 1);
    f = practice_go(p, 0, 0.5);
    assert_int_equal(f.guide.done, 2);
    for (int i = 0; i < 900; i++)
        practice_step_tools(p, &(ToolCommands){.tool = {{0, 90}}});
    assert_int_equal(score_figures(p->score).guide.done, 2);
    for (int i = 0; i < 200; i++)
        practice_step_tools(p, &(ToolCommands){.tool = {{0, 90}}});
    assert_int_equal(score_figures(p->score).guide.done, 3);
    practice_end(p);
}

static void a_step_may_name_its_tool(void **state)
{
    (void)state;
    Practice *p = practice_begin(TWO_IN_THE_OPEN EXERCISE(", hold_s: 5, steps: [{text: Follow., inserted_mm: 8, tool: catheter}]"), NULL);
    ScoreFigures f = practice_go_tools(p, 0, 20, 0.5);                 // the wire alone
    assert_int_equal(f.guide.done, 0);
    f = practice_go_tools(p, 20, 0, 0.4);
    assert_int_equal(f.guide.done, 1);
    practice_end(p);
}

static void the_result_holds_the_steps(void **state)
{
    (void)state;
    static Session session, back;
    Practice *p = practice_begin(STEPS("{text: Push., inserted_mm: 3}, {text: Further., inserted_mm: 6}, {text: Far., inserted_mm: 60}"), NULL);
    practice_go(p, 10, 1);
    session_begin(&session, p->scene, "Ada", "", "1970-01-01T00:00:00Z");
    session_set_score(&session, p->score);
    memset(session.series_sha256, '0', 64);
    char *text = session_json(&session);
    assert_non_null(text);
    if (!session_parse(text, strlen(text), "x.json", &back, &p->faults))
        fail_msg("%s", p->faults.text[0]);
    assert_int_equal(back.figures.guide.done, 2);
    assert_memory_equal(back.figures.guide.done_s, session.figures.guide.done_s, sizeof back.figures.guide.done_s);
    char *at = strstr(text, "\"steps\":\t[");
    if (!at)
        fail_msg("%s", text);
    at[strlen("\"steps\":\t[")] = '-';
    assert_false(session_parse(text, strlen(text), "x.json", &back, &p->faults));
    assert_non_null(strstr(p->faults.text[0], "'score.steps' is not a list of 1 to 12 times"));
    free(text);
    practice_end(p);
}

static void wrong_steps_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *steps, *words;
    } cases[] = {
        {"3", "not a list"},
        {"[]", "1 to 12"},
        {"[3]", "not a map"},
        {"[{xray_s: 1}]", "has no key 'text'"},
        {"[{text: a}]", "has 0 conditions; expected one of xray_s"},
        {"[{text: a, xray_s: 1, held_s: 1}]", "has 2 conditions"},
        {"[{text: a, xray_s: 0}]", "above 0"},
        {"[{text: a, contrast_ml: 1001}]", "out of range"},
        {"[{text: a, turned_deg: left}]", "turned_deg"},
        {"[{text: a, inserted_mm: -1}]", "out of range"},
        {"[{text: a, held_s: 61}]", "out of range"},
        {"[{text: a, tip_in: their}]", "'their' is not a target of this scene"},
        {"[{text: a, inserted_mm: 1, tool: guide}]", "'guide' is not a tool of this scene"},
        {"[{text: a, inserted_cm: 1}]", "inserted_mm"},
        {"[{text: 'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa', xray_s: 1}]",
         "at most 119 bytes"},
    };
    static Faults faults;
    int wrong = 0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[2000];
        snprintf(text, sizeof text, "%sexercise:\n  title: a\n  target: there\n  steps: %s\n", IN_THE_OPEN, cases[i].steps);
        faults_clear(&faults);
        Scene *scene = scene_parse(text, strlen(text), "x.yaml", &faults);
        if (scene || faults.count < 1 || !strstr(faults.text[0], cases[i].words) || strncmp(faults.text[0], "x.yaml:", 7) != 0)
            wrong++, print_error("%s: expected %s; %d faults, the first: %s\n", cases[i].steps, cases[i].words, faults.count, faults.text[0]);
        scene_free(scene);
    }
    assert_int_equal(wrong, 0);
}

// The solving hand, after a look and an injection, does all steps of the first case.
static void the_first_case_can_be_done(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    static Faults faults;
    OpenVessel open = {0};
    Scene *scene = scene_load(SOURCE_DIR "/scenes/exercises/first-case.yaml", &faults);
    if (!scene || !open_vessel(scene, &(OpenVesselOptions){0}, &open, &faults) || !open_vessel_inlet(scene, &open, &faults))
        fail_msg("%s", faults.text[0]);
    Simulator *simulator = simulator_create(scene, open.vessel, &faults);
    Score *score = simulator ? score_create(simulator, open.tree) : NULL;
    assert_non_null(score);
    const double look_s = 1.2, injection_s = 0.6;
    int cursor = 0;
    ScoreFigures f = {0};
    for (int i = 0; f.state != SCORE_REACHED && i < 12000; i++) {
        const double time_s = (i + 0.5) * scene->dt / 1000, script_s = time_s - look_s - injection_s;
        XrayControl xray = xray_default_control();
        xray.pedal = 1;
        xray.contrast_ml_s = time_s > look_s && script_s < 0 ? 2 : 0;
        const ToolCommands commands = script_s > 0 ? script_tools_at(scene->script, script_s, &cursor) : (ToolCommands){0};
        simulator_step(simulator, &commands);
        score_step(score, simulator, &commands, &xray);
        f = score_figures(score);
    }
    for (int i = 0; i < f.guide.done; i++)
        print_message("%6.2f s: %s\n", f.guide.done_s[i], scene->exercise->guide.step[i].text);
    assert_int_equal(f.state, SCORE_REACHED);
    assert_int_equal(f.guide.done, scene->exercise->guide.count);
    assert_int_equal(f.error_total, 0);
    score_free(score);
    simulator_destroy(simulator);
    open_vessel_close(&open);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_tick_in_their_order),  cmocka_unit_test(a_step_counts_from_its_beginning), cmocka_unit_test(a_step_may_name_its_tool),
        cmocka_unit_test(the_result_holds_the_steps), cmocka_unit_test(wrong_steps_are_refused),          cmocka_unit_test(the_first_case_can_be_done),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
