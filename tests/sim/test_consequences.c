// Perforation, dissection, spasm and clot: each is provoked by a rough hand in a small vessel and not by a careful one; limits follow from tool and wall; a
// recording gives the same consequences bit for bit; wrong keys are refused with their line.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../heap_calls.h"
#include "score_scene.h"
#include "sim/rescore.h"
#include "sim/score_points.h"
#include "sim/session.h"
#include "sim/session_tracker.h"

#include <stdio.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-consequences-XXXXXX";
#include "tests/folder.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))
#define WIRE(gpa)                                                                                                                                              \
    "wire: {elements: 40, sections: [{length_mm: 60, diameter_mm: 0.4, young_modulus_gpa: " #gpa "}], damping: {mass_1_s: 1, stiffness_s: 0.0005}}\n"
#define SHEATH "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n"
// A vessel that ends 30 mm from the sheath, and one that turns back.
#define DEAD_END "vessel: {friction: 0.1, contact: tube, tube: {radius_mm: 1.5, normal: [0, 1, 0], ends: closed, path: [{line_mm: 30}]}}\n"
#define TURN                                                                                                                                                   \
    "vessel: {friction: 0.1, contact: tube, tube: {radius_mm: 1, normal: [0, 1, 0], path: [{line_mm: 5}, {arc: {radius_mm: 8, angle_deg: 120}}, {line_mm: "    \
    "30}]}}\n"
#define HAPPENS(more) EXERCISE(", rules: {buckling: false}, consequences: " more)

static const char dead_end[] = "seldinger: 1\n" WIRE(20) SHEATH AT(25) DEAD_END HAPPENS("true");

// --- limits ---

static void limits_grow_with_tool_and_wall(void **state)
{
    (void)state;
    const ConsequenceRules rules = consequence_rules_default();
    const ConsequenceWall artery = {2, false}, carotid = {3.5, false}, sac = {5, true}, unknown = {HUGE_VAL, false};
    const double micro = consequence_perforation_n(&rules, artery, 0.36);
    assert_near(micro, 1.2 * PI * 0.36 * 0.2, 1e-12);
    assert_near(consequence_perforation_n(&rules, carotid, 0.89) / micro, 0.89 * 3.5 / (0.36 * 2), 1e-12);
    assert_near(consequence_perforation_n(&rules, sac, 0.36), 0.75 * PI * 0.36 * 0.2, 1e-12);      // its size does not count
    assert_near(consequence_dissection_n(&rules, artery, 0.36), micro / 2 + 0.035 * 0.36, 1e-12);
    assert_true(consequence_perforation_n(&rules, unknown, 0.36) == HUGE_VAL);
}

// The same force perforates along the tip and does not across it.
static void the_direction_of_the_force_counts(void **state)
{
    (void)state;
    const ConsequenceRules rules = consequence_rules_default();
    const ConsequenceWall wall = {2, false};
    const double force = 1.5 * consequence_perforation_n(&rules, wall, 0.36);
    for (int degrees = 0; degrees <= 180; degrees += 30) {
        ConsequenceTip tip = {0};
        const double angle = degrees * PI / 180;
        const ToolPlace end = {.along = {1, 0, 0}};
        for (int i = 0; i < 300; i++)
            consequence_tip_step(&tip, &rules, wall, 0.36, end, vec3(-force * cos(angle), force * sin(angle), 0), 1);
        assert_near(vec3_norm(tip.press), force, 1e-5 * force);
        assert_int_equal(consequence_perforates(&tip), degrees <= 30);
        assert_false(consequence_dissects(&tip));                      // it does not slide
    }
}

// A knock of a few steps is none.
static void a_knock_does_no_harm(void **state)
{
    (void)state;
    const ConsequenceRules rules = consequence_rules_default();
    const ConsequenceWall wall = {2, false};
    const double force = 3 * consequence_perforation_n(&rules, wall, 0.36);
    ConsequenceTip tip = {0};
    bool perforates = false;
    for (int i = 0; i < 200; i++) {
        consequence_tip_step(&tip, &rules, wall, 0.36, (ToolPlace){.along = {1, 0, 0}}, vec3(i < 5 ? -force : 0, 0, 0), 1);
        perforates |= consequence_perforates(&tip);
    }
    assert_false(perforates);
}

// --- hands ---

static void pushing_on_against_a_wall_perforates_it(void **state)
{
    (void)state;
    Practice *p = practice_begin(dead_end, NULL);
    ScoreFigures f = practice_go(p, 10, 2.9);                           // up to the end, 1 mm before it
    assert_true(f.has_consequences);
    assert_int_equal(f.mark_count, 0);
    assert_true(practice_go(p, 0, 1).mark_count == 0);
    f = practice_go(p, 10, 1);
    assert_int_equal(f.error[ERROR_PERFORATION].count, 1);
    assert_int_equal(f.mark[0].kind, ERROR_PERFORATION);
    assert_near(f.mark[0].limit_n, 1.2 * PI * 0.4 * 0.15, 1e-12);
    assert_true(f.mark[0].force_n > f.mark[0].limit_n && f.mark[0].at.x > 29);
    assert_true(f.mark[0].time_s > 3.9 && f.mark[0].time_s < 4.9);
    practice_end(p);
}

// In practice nothing happens; in an examination it does, whether the exercise or the trainer's window says so.
static void they_happen_where_they_should(void **state)
{
    (void)state;
    static const struct {
        const char *keys;
        int seen;
        bool happens;
    } cases[] = {{"", 0, false},
                 {", consequences: false", 0, false},
                 {", consequences: true", 0, true},
                 {", consequences: {clot_s: 900}", 0, true},
                 {", mode: examination", 0, true},
                 {"", SEEN_KNOWN | SEEN_EXAMINATION, true},
                 {", consequences: false", SEEN_KNOWN | SEEN_EXAMINATION, false}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[2000];
        snprintf(text, sizeof text, "%sexercise: {title: Go there, target: there%s}\n", "seldinger: 1\n" WIRE(20) SHEATH AT(25) DEAD_END, cases[i].keys);
        Practice *p = practice_begin(text, NULL);
        p->watched = cases[i].seen != 0;
        p->xray.seen = (float)cases[i].seen;
        ScoreFigures f = practice_go(p, 10, 4);
        if (f.error[ERROR_PERFORATION].count != cases[i].happens || f.has_consequences != cases[i].happens)
            fail_msg("%s, seen %d: %d perforations", cases[i].keys, cases[i].seen, f.error[ERROR_PERFORATION].count);
        practice_end(p);
    }
}

// A stiff wire is driven round a bend with its tip along the outer wall; a soft one follows it.
static void a_stiff_tip_driven_along_the_wall_dissects_it(void **state)
{
    (void)state;
    Practice *rough = practice_begin("seldinger: 1\n" WIRE(80) SHEATH AT(12) TURN HAPPENS("true"), NULL);
    ScoreFigures f = practice_go(rough, 10, 2.5);
    assert_int_equal(f.error[ERROR_DISSECTION].count, 1);
    assert_int_equal(f.mark[0].kind, ERROR_DISSECTION);
    assert_true(f.mark[0].force_n > 0.1 && f.mark[0].limit_n > 0.08 && f.mark[0].limit_n < 0.1);
    practice_end(rough);
    Practice *careful = practice_begin("seldinger: 1\n" WIRE(2) SHEATH AT(12) TURN HAPPENS("true"), NULL);
    f = practice_go(careful, 10, 2.5);
    assert_true(f.inserted_mm > 24);
    assert_int_equal(f.mark_count, 0);
    practice_end(careful);
}

// Pushes until the tip presses with 0.11 N, less than perforates, pulls back and rests.
static ScoreFigures poke(Practice *p, int times)
{
    ScoreFigures f = score_figures(p->score);
    for (int i = 0; i < times; i++) {
        double peak = f.tool[0].tip_force_n;
        for (int k = 0; k < 3000 && peak < 0.11; k++) {
            practice_step(p, 10);
            peak = score_figures(p->score).tool[0].tip_force_n;
        }
        assert_true(peak >= 0.11);
        practice_go(p, -10, 0.2);
        f = practice_go(p, 0, 0.8);
    }
    return f;
}

static void repeated_force_brings_a_spasm_that_relaxes(void **state)
{
    (void)state;
    Practice *p = practice_begin(dead_end, NULL);
    ScoreFigures f = poke(p, 2);
    assert_int_equal(f.error[ERROR_SPASM].count, 0);
    assert_true(f.narrowest < 0.85 && f.narrowest > 0.75);
    f = poke(p, 1);
    assert_int_equal(f.error[ERROR_SPASM].count, 1);
    assert_int_equal(f.error[ERROR_PERFORATION].count, 0);
    assert_true(f.error[ERROR_SPASM].is_on && f.narrowest < 0.75);
    const double narrowest = f.narrowest, narrowed = f.tool[0].narrowed;
    f = practice_go(p, 0, 10);
    assert_near(f.tool[0].narrowed, narrowed * exp(-10.0 / 180), 1e-6);
    assert_true(f.narrowest == narrowest);
    practice_end(p);
}

static void a_long_stay_without_injection_brings_a_clot(void **state)
{
    (void)state;
    Practice *p = practice_begin("seldinger: 1\n" WIRE(20) SHEATH AT(25) DEAD_END HAPPENS("{clot_s: 2}"), NULL);
    p->watched = true;
    ScoreFigures f = practice_go(p, 5, 1.5);
    p->xray.contrast_ml_s = 1;
    f = practice_go(p, 0, 0.1);
    p->xray.contrast_ml_s = 0;
    f = practice_go(p, 0, 1.9);                                         // flushed in time
    assert_int_equal(f.error[ERROR_CLOT].count, 0);
    f = practice_go(p, 0, 0.2);
    assert_int_equal(f.error[ERROR_CLOT].count, 1);
    assert_true(f.error[ERROR_CLOT].is_on && f.mark[0].kind == ERROR_CLOT);
    p->xray.contrast_ml_s = 1;
    assert_false(practice_go(p, 0, 0.1).error[ERROR_CLOT].is_on);
    practice_end(p);
}

// Agent that is injected afterwards leaves through the hole.
static void contrast_leaks_from_a_perforation(void **state)
{
    (void)state;
    Practice *p = practice_begin(dead_end, NULL);
    p->watched = true;
    p->xray.contrast_ml_s = 1;
    practice_go(p, 10, 2.5);
    p->xray.contrast_ml_s = 0;
    ScoreFigures f = practice_go(p, 10, 1.5);
    assert_int_equal(f.mark_count, 1);
    assert_near(f.mark[0].leaked_ml, 0, 0);
    p->xray.contrast_ml_s = 2;
    f = practice_go(p, 0, 1.5);
    assert_near(f.mark[0].leaked_ml, 0.3, 1e-6);
    practice_end(p);
}

static void each_costs_its_points(void **state)
{
    (void)state;
    Practice *p =
        practice_begin("seldinger: 1\n" WIRE(20) SHEATH AT(25) DEAD_END
                       "exercise: {title: Go there, target: there, hold_s: 60, rules: {buckling: false}, consequences: {points: {perforation: 17}}}\n",
                       NULL);
    ScoreFigures f = practice_go(p, 10, 4);
    assert_int_equal(f.error[ERROR_PERFORATION].count, 1);
    assert_near(f.points, 100 * score_share(&f) - 17, 1e-9);
    assert_near(score_error_points(p->scene->exercise, ERROR_DISSECTION), 30, 0);
    assert_near(score_error_points(p->scene->exercise, ERROR_BLIND), 5, 0);
    practice_end(p);
}

static void a_step_allocates_nothing(void **state)
{
    (void)state;
    need_counting();
    Practice *p = practice_begin(dead_end, NULL);
    p->watched = true;
    const long before = heap_calls();
    for (int i = 0; i < 4000; i++) {
        const ToolCommands commands = {.tool = {{10, 0}}};
        simulator_step(p->simulator, &commands);
        heap_watch(true);
        score_step(p->score, p->simulator, &commands, &p->xray);
        heap_watch(false);
    }
    assert_int_equal(heap_calls() - before, 0);
    assert_true(score_figures(p->score).mark_count > 0);
    practice_end(p);
}

// --- files ---

// What was recorded gives the same consequences, bit for bit, and a session's file holds them.
static void a_recording_repeats_them(void **state)
{
    (void)state;
    static Session session, back;
    Practice *p = practice_begin(dead_end, NULL);
    SessionTracker *tracker = session_tracker_create(p->simulator, NULL);
    assert_non_null(tracker);
    const RecordingOptions options = recording_default_options();
    Recording *recording = recording_create(in_folder("rough.h5"), p->simulator, &options, &p->faults);
    assert_non_null(recording);
    for (int i = 0; i < 5000; i++) {
        const ToolCommands commands = {.tool = {{i < 4000 ? 10 : 0, 0}}};
        p->xray.pedal = 1;
        p->xray.contrast_ml_s = i > 4200 ? 1 : 0;
        simulator_step(p->simulator, &commands);
        session_tracker_step(tracker, p->simulator, &commands, &p->xray);
        assert_true(recording_step(recording, p->simulator, &commands, &p->xray));
    }
    assert_true(recording_close(recording, p->simulator, &p->faults));
    const ScoreFigures live = score_figures(session_tracker_score(tracker));
    assert_true(live.mark_count >= 1 && live.mark[0].leaked_ml > 0);
    RecordedRun *run = recorded_run_load(in_folder("rough.h5"), &p->faults);
    assert_non_null(run);
    const OpenVessel open = {.vessel = p->vessel};
    Rescore *rescore = rescore_create(run, p->scene, &open, &p->faults);
    assert_non_null(rescore);
    rescore_advance(rescore, INT64_MAX, HUGE_VAL);
    const ScoreFigures again = score_figures(rescore_score(rescore));
    assert_memory_equal(again.mark, live.mark, sizeof live.mark);
    assert_true(again.narrowest == live.narrowest && again.points == live.points && again.hint == live.hint && again.hint_value == live.hint_value);
    assert_memory_equal(again.error, live.error, sizeof live.error);

    session_begin(&session, p->scene, "Ada", "", "1970-01-01T00:00:00Z");
    session_set_score(&session, rescore_score(rescore));
    session_set_run(&session, run, "rough.h5");
    char *text = session_json(&session);
    assert_non_null(text);
    if (!session_parse(text, strlen(text), "rough.json", &back, &p->faults))
        fail_msg("%s", p->faults.text[0]);
    assert_int_equal(back.figures.mark_count, live.mark_count);
    assert_true(back.figures.mark[0].kind == ERROR_PERFORATION && back.figures.mark[0].at.x == live.mark[0].at.x);
    assert_true(back.figures.mark[0].leaked_ml == live.mark[0].leaked_ml);
    char *twice = session_json(&back);
    assert_string_equal(twice, text);
    // faults of each part are reported
    static const char *const wrong[][3] = {{"\"kind\":\t\"perforation\",\n\t\t\t\t\t\"time_s\"", "\"kind\":\t\"kick\",\n\t\t\t\t\t\"time_s\"", "'perforation'"},
                                           {"\"narrowest\":\t", "\"narrowest\":\t7", "'score.consequences.narrowest'"},
                                           {"\"at_mm\":\t[", "\"at_mm\":\t[1, ", "three numbers"},
                                           {"\"marks\":\t[", "\"mark\":\t[", "unknown key 'mark'"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const char *at = strstr(text, wrong[i][0]);
        if (!at)
            fail_msg("%s is not in %s", wrong[i][0], text);
        const size_t capacity = strlen(text) + 100;
        char *bad = malloc(capacity);
        snprintf(bad, capacity, "%.*s%s%s", (int)(at - text), text, wrong[i][1], at + strlen(wrong[i][0]));
        faults_clear(&p->faults);
        assert_false(session_parse(bad, strlen(bad), "bad.json", &back, &p->faults));
        if (!strstr(p->faults.text[0], wrong[i][2]))
            fail_msg("%s: %s", wrong[i][1], p->faults.text[0]);
        free(bad);
    }
    free(twice);
    free(text);
    rescore_free(rescore);
    recorded_run_free(run);
    session_tracker_free(tracker);
    practice_end(p);
}

static void wrong_keys_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *keys, *words;
    } cases[] = {
        {"perhaps", "one of: false, true"},
        {"[true]", "not a map"},
        {"{wall_strength_mpa: 0}", "at least 0.01 and at most 100"},
        {"{sac_strength_mpa: strong}", "sac_strength_mpa"},
        {"{wall_to_radius: 2}", "at least 0.001 and at most 1"},
        {"{sac_wall_mm: -1}", "at least 0.001 and at most 10"},
        {"{clot_s: 0}", "above 0"},
        {"{clot_min: 3}", "expected"},
        {"{points: {perforation: 101}}", "at least 0 and at most 100"},
        {"{points: {fracture: 1}}", "expected perforation"},
    };
    static Faults faults;
    int wrong = 0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[2000];
        snprintf(text, sizeof text, "%sexercise:\n  title: a\n  target: there\n  consequences: %s\n", IN_THE_OPEN, cases[i].keys);
        faults_clear(&faults);
        Scene *scene = scene_parse(text, strlen(text), "x.yaml", &faults);
        if (scene || faults.count != 1 || !strstr(faults.text[0], cases[i].words) || strncmp(faults.text[0], "x.yaml:", 7) != 0)
            wrong++, print_error("%s: expected %s; %d faults, the first: %s\n", cases[i].keys, cases[i].words, faults.count, faults.text[0]);
        scene_free(scene);
    }
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limits_grow_with_tool_and_wall),
        cmocka_unit_test(the_direction_of_the_force_counts),
        cmocka_unit_test(a_knock_does_no_harm),
        cmocka_unit_test(pushing_on_against_a_wall_perforates_it),
        cmocka_unit_test(they_happen_where_they_should),
        cmocka_unit_test(a_stiff_tip_driven_along_the_wall_dissects_it),
        cmocka_unit_test(repeated_force_brings_a_spasm_that_relaxes),
        cmocka_unit_test(a_long_stay_without_injection_brings_a_clot),
        cmocka_unit_test(contrast_leaks_from_a_perforation),
        cmocka_unit_test(each_costs_its_points),
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(a_step_allocates_nothing),
        cmocka_unit_test(a_recording_repeats_them),
        cmocka_unit_test(wrong_keys_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
