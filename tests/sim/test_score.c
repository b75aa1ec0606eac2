// The score: its clock and units, the hold, errors by episode, the path through a tree, buckling, forces, and points that never grow with a worse figure.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../heap_calls.h"
#include "score_scene.h"
#include "sim/score_points.h"
#include "sim/score_path.h"
#include "tests/short_run.h"

#include <stdio.h>

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

// --- the exercise in the scene ---

static void an_exercise_is_read(void **state)
{
    (void)state;
    Practice *p =
        practice_begin(IN_THE_OPEN EXERCISE(", instructions: Push., hold_s: 1.5, time_limit_s: 90, rules: {tip_force_n: 0.1, wrong_branch_mm: 4, "
                                            "buckling: false}, par: {path_ratio: 1.5}, weights: {path: 3}, error_points: 7, level: 4, mode: examination"),
                       NULL);
    const Exercise *e = p->scene->exercise;
    assert_string_equal(e->title, "Go there");
    assert_string_equal(e->instructions, "Push.");
    assert_int_equal(e->target, 0);
    assert_near(e->hold_s, 1.5, 0);
    assert_near(e->time_limit_s, 90, 0);
    assert_near(e->rules.tip_force_n, 0.1, 0);
    assert_near(e->rules.tip_length_mm, 5, 0);
    assert_near(e->rules.wrong_branch_mm, 4, 0);
    assert_false(e->rules.buckling);
    assert_near(e->par[PART_PATH], 1.5, 0);
    assert_near(e->par[PART_TIME], 0, 0);
    assert_near(e->weight[PART_PATH], 3, 0);
    assert_near(e->weight[PART_TIME], 1, 0);
    assert_near(e->error_points, 7, 0);
    assert_int_equal(e->level, 4);
    assert_int_equal(exercise_default().level, 0);
    assert_true(e->is_examination && !exercise_default().is_examination);
    practice_end(p);
}

// A target that is passed was reached when the tip came in.
static void a_target_keeps_its_first_time(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN, NULL);
    const TargetReach *reach = simulator_targets(p->simulator);
    double first_s = -1;
    for (int i = 0; i < 2000; i++) {
        practice_step(p, 20);
        if (first_s < 0 && reach->reached)
            first_s = simulator_time_s(p->simulator);
    }
    assert_true(reach->reached && reach->distance < 0.1);
    assert_true(first_s > 0.1 && first_s < 1.9);
    assert_near(reach->time_s, first_s, 0);
    practice_end(p);
}

static void a_wrong_exercise_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *words;
    } cases[] = {
        {IN_THE_OPEN "exercise: 3\n", "not a map"},
        {IN_THE_OPEN "exercise: {target: there}\n", "has no key 'title'"},
        {IN_THE_OPEN "exercise: {title: a}\n", "has no key 'target'"},
        {IN_THE_OPEN "exercise: {title: a, target: their}\n", "not a target of this scene"},
        {"seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\nexercise: {title: a, target: a}\n", "has no 'targets'"},
        {IN_THE_OPEN EXERCISE(", tool: catheter"), "not a tool of this scene; it has 1, the first is 'wire'"},
        {TWO_IN_THE_OPEN EXERCISE(", tool: guide"), "it has 2, the first is 'catheter'"},
        {IN_THE_OPEN EXERCISE(", rules: {wire_behind_mm: -1}"), "out of range"},
        {IN_THE_OPEN EXERCISE(", exchange: {wire: 1}"), "0 to 0"},
        {IN_THE_OPEN EXERCISE(", exchange: {catheter: 1}"), "expected wire"},
        {IN_THE_OPEN EXERCISE(", exchange: 1"), "not a map"},
        {IN_THE_OPEN EXERCISE(", stays: {target: there}"), "has no key 'tool'"},
        {IN_THE_OPEN EXERCISE(", stays: {tool: wire}"), "has no key 'target'"},
        {IN_THE_OPEN EXERCISE(", stays: {tool: guide, target: there}"), "'guide' is not a tool of this scene"},
        {IN_THE_OPEN EXERCISE(", stays: {tool: wire, target: their}"), "'their' is not a target of this scene"},
        {IN_THE_OPEN EXERCISE(", rules: {kick_mm_s: fast}"), "kick_mm_s"},
        {IN_THE_OPEN EXERCISE(", hold: 2"), "'hold_s'"},
        {IN_THE_OPEN EXERCISE(", hold_s: -1"), "out of range"},
        {IN_THE_OPEN EXERCISE(", hold_s: 61"), "out of range"},
        {IN_THE_OPEN EXERCISE(", time_limit_s: 0"), "above 0"},
        {IN_THE_OPEN EXERCISE(", rules: {tip_force_n: -0.1}"), "out of range"},
        {IN_THE_OPEN EXERCISE(", rules: {tip_force_mn: 1}"), "tip_force_n"},
        {IN_THE_OPEN EXERCISE(", rules: {tip_length_mm: 0}"), "above 0"},
        {IN_THE_OPEN EXERCISE(", rules: {buckling: perhaps}"), "one of: false, true"},
        {IN_THE_OPEN EXERCISE(", par: {time: 3}"), "time_s"},
        {IN_THE_OPEN EXERCISE(", weights: {path: -1}"), "out of range"},
        {IN_THE_OPEN EXERCISE(", error_points: 101"), "out of range"},
        {IN_THE_OPEN EXERCISE(", mode: exam"), "practice, examination"},
        {IN_THE_OPEN EXERCISE(", level: 0"), "1 to 5"},
        {IN_THE_OPEN EXERCISE(", level: 6"), "1 to 5"},
        {IN_THE_OPEN EXERCISE(", colour: red"), "expected title"},
        {IN_THE_OPEN "fluoroscopy: {volumes: a}\n", "'volume'"},
        {IN_THE_OPEN "fluoroscopy: {anterior: [0, 1, 0]}\n", "together give"},
        {IN_THE_OPEN "fluoroscopy: {anterior: [0, 1, 0], superior: [0, 1, 1]}\n", "not perpendicular"},
        {IN_THE_OPEN "fluoroscopy: {lao_deg: 91}\n", "out of range"},
    };
    static Faults faults;
    int wrong = 0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        faults_clear(&faults);
        Scene *scene = scene_parse(cases[i].text, strlen(cases[i].text), "x.yaml", &faults);
        if (scene || faults.count != 1 || !strstr(faults.text[0], cases[i].words))
            wrong++, print_error("%s-- expected %s; %d faults, the first: %s\n", cases[i].text, cases[i].words, faults.count, faults.text[0]);
        scene_free(scene);
    }
    assert_int_equal(wrong, 0);
}

static void a_volume_is_found_beside_the_scene(void **state)
{
    (void)state;
    static const char text[] = IN_THE_OPEN "fluoroscopy: {volume: head.nrrd}\n";
    static Faults faults;
    Scene *scene = scene_parse(text, strlen(text), "/some/folder/x.yaml", &faults);
    assert_non_null(scene);
    assert_string_equal(scene->anatomy_path, "/some/folder/head.nrrd");
    assert_null(scene->exercise);
    scene_free(scene);
}

// --- clock, distances, X-rays ---

static void the_clock_runs_from_the_first_movement(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", time_limit_s: 3"), NULL);
    ScoreFigures f = practice_go(p, 0, 2);
    assert_int_equal(f.state, SCORE_WAITING);
    assert_near(f.time_s, 0, 0);
    f = practice_go(p, 5, 1);
    assert_int_equal(f.state, SCORE_RUNNING);
    assert_near(f.start_s, 2, 1e-9);
    assert_near(f.time_s, 1, 1e-9);
    f = practice_go(p, 0, 1.999);
    assert_int_equal(f.state, SCORE_RUNNING);
    f = practice_go(p, 0, 0.001);
    assert_int_equal(f.state, SCORE_TIME_OUT);
    ScoreFigures later = practice_go(p, 5, 1);   // nothing is counted any more
    assert_memory_equal(&f, &later, sizeof f);
    practice_end(p);
}

static void ways_are_counted_both_ways(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN, NULL);
    practice_go(p, 10, 1.5);
    practice_go(p, -10, 0.5);
    ScoreFigures f = practice_go(p, 10, 0.2);
    assert_near(f.inserted_mm, 17, 1e-6);
    assert_near(f.withdrawn_mm, 5, 1e-6);
    assert_near(f.path_mm, 22, 0.8);     // in chords of 0.2 mm: up to 0.4 is lost at each of the two reversals
    assert_false(f.has_exercise);
    assert_near(f.points, 0, 0);
    practice_end(p);
}

static void x_rays_are_counted_while_the_pedal_is_down(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", rules: {contrast_ml: 5}"), NULL);
    p->watched = true;
    p->xray.field_mm = 100;
    p->xray.pedal = 1;
    ScoreFigures f = practice_go(p, 0, 1);
    assert_int_equal(f.pulses, 15);      // the first at once
    assert_near(f.fluoroscopy_s, 1, 1e-9);
    assert_near(f.dose_area_cm2, 1500, 1e-6);
    p->xray.pedal = 0;
    f = practice_go(p, 0, 1);
    assert_int_equal(f.pulses, 15);
    p->xray.pedal = 1;
    p->xray.pulses_s = 30;
    p->xray.collimator[0] = p->xray.collimator[1] = 0.5F;   // half the width
    f = practice_go(p, 0, 1);
    assert_int_equal(f.pulses, 45);
    assert_near(f.dose_area_cm2, 1500 + 1500, 1e-6);
    assert_near(f.fluoroscopy_s, 2, 1e-9);
    for (int tap = 0; tap < 3; tap++) {  // each tap gives a pulse
        p->xray.pedal = 0;
        practice_go(p, 0, 0.01);
        p->xray.pedal = 1;
        f = practice_go(p, 0, 0.01);
    }
    assert_int_equal(f.pulses, 48);
    p->xray.contrast_ml_s = 2;
    f = practice_go(p, 0, 2.499);
    assert_int_equal(f.error[ERROR_CONTRAST].count, 0);
    f = practice_go(p, 0, 0.501);
    assert_near(f.contrast_ml, 6, 1e-6);
    assert_int_equal(f.error[ERROR_CONTRAST].count, 1);
    assert_near(f.error[ERROR_CONTRAST].last_s, 3.06 + 2.5, 0.0015);
    practice_end(p);
}

static void moving_blind_is_an_error_once_until_the_pedal(void **state)
{
    (void)state;
    for (int seen = 0; seen < 2; seen++) {
        Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", rules: {blind_mm: 4}"), NULL);
        p->watched = seen;
        practice_go(p, 10, 0.39);
        assert_int_equal(score_figures(p->score).error[ERROR_BLIND].count, 0);
        ScoreFigures f = practice_go(p, 10, 0.4);
        assert_int_equal(f.error[ERROR_BLIND].count, seen);
        p->xray.pedal = 1;
        practice_go(p, 10, 0.5);
        p->xray.pedal = 0;
        f = practice_go(p, -10, 0.5);    // in either direction
        assert_int_equal(f.error[ERROR_BLIND].count, 2 * seen);
        practice_end(p);
    }
}

// --- the hold ---

static void a_target_must_be_held(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(""), NULL);     // target from 19 to 21 mm, 2 s
    ScoreFigures f = practice_go(p, 10, 2.5);      // through it
    assert_int_equal(f.state, SCORE_RUNNING);
    assert_near(f.held_s, 0, 0);
    assert_near(f.least_remaining_mm, 0, 0.2);
    practice_go(p, -10, 0.6);                      // back into the target, to 20
    f = practice_go(p, 0, 1.7);
    assert_near(f.held_s, 1.8, 0.01);
    practice_go(p, 10, 0.2);                       // out: the hold is lost
    practice_go(p, -10, 0.2);
    f = practice_go(p, 0, 1.8);
    assert_int_equal(f.state, SCORE_RUNNING);
    assert_near(f.held_s, 1.9, 0.01);
    f = practice_go(p, 0, 0.2);
    assert_int_equal(f.state, SCORE_REACHED);
    assert_near(f.held_s, 2, 1e-9);
    assert_near(f.reached_s, 2.5 + 0.6 + 1.7 + 0.4 + 1.9, 0.01);
    practice_end(p);
}

static void the_border_decides(void **state)
{
    (void)state;
    for (int inside = 0; inside < 2; inside++) {
        Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", hold_s: 0.5"), NULL);
        practice_go(p, 10, 1.7);
        ScoreFigures f = practice_go(p, 1, inside ? 1.002 : 0.998);
        f = practice_go(p, 0, 0.49);
        assert_int_equal(f.state, SCORE_RUNNING);
        f = practice_go(p, 0, 0.02);
        assert_int_equal(f.state, inside ? SCORE_REACHED : SCORE_RUNNING);
        practice_end(p);
    }
}

// --- the path through a tree ---

// A trunk along x, 0 to 40 mm, radius 2; at 20 mm a branch to +y, 20 mm, radius 1; at its end a sac of two nodes, 8 mm apart.
// Elsewhere there is a node every 2 mm.
enum { TRUNK = 21, BRANCH = 10, SAC = 2 };
static VesselTree *forked(double mirror)
{
    VesselTree *t = vessel_tree_create(TRUNK + BRANCH + SAC, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < t->node_count; i++) {
        int k = i - TRUNK + 1;
        t->center[i] = k <= 0 ? vec3(2 * i, 0, 0) : vec3(20, mirror * (k < BRANCH + SAC ? 2 * k : 2 * k + 6), 0);
        t->radius[i] = k <= 0 ? 2 : k <= BRANCH ? 1 : 3;
        t->direction[i] = k <= 0 ? vec3(1, 0, 0) : vec3(0, mirror, 0);
        t->height[i] = 2;
        t->parent[i] = i == 0 ? -1 : i == TRUNK ? 10 : i - 1;
        t->kind[i] = k > BRANCH ? NODE_ANEURYSM : NODE_VESSEL;
    }
    assert_true(vessel_tree_link(t));
    return t;
}

static void the_path_is_measured_along_the_tree(void **state)
{
    (void)state;
    VesselTree *t = forked(1);
    ScorePath path;
    assert_true(score_path_create(&path, t, vec3(0, 0, 0), vec3(20, 15, 0), 1));       // between two nodes of the branch
    assert_near(score_path_left(&path, vec3(0, 0, 0), 0), 35, 1e-9);
    assert_near(score_path_left(&path, vec3(1, 0.5, 0), 0), 34, 1e-9);                 // between nodes, beside the line
    assert_near(score_path_left(&path, vec3(40, 0, 0), 20), 35, 1e-9);                 // back to the fork, then on
    assert_near(path.off[5], 0, 0);
    assert_near(path.off[20], 20 - 2, 1e-9);                                          // beyond the fork, less the trunk's radius
    assert_near(path.off[TRUNK], 0, 0);
    score_path_destroy(&path);
    // the target is in the trunk: the branch begins at the trunk's wall; the part past the target begins behind it
    assert_true(score_path_create(&path, t, vec3(0, 0, 0), vec3(30, 0, 0), 3));
    assert_near(path.off[TRUNK], 0, 1e-12);
    assert_near(path.off[TRUNK + 4], 10 - 2, 1e-9);
    assert_near(path.off[20], 10 - 3, 1e-9);
    score_path_destroy(&path);
    // a sac is one place; the mouth may be inside the tree, and everything upstream of it is off the path
    assert_true(score_path_create(&path, t, vec3(10, 0, 0), vec3(20, 22.5, 0), 1));
    assert_near(path.off[TRUNK + BRANCH], 0, 0);
    assert_near(path.off[TRUNK + BRANCH + 1], 0, 0);
    assert_near(path.off[0], 10 - 2, 1e-9);
    score_path_destroy(&path);
    // the path leads upstream: target in the trunk, mouth at its end
    assert_true(score_path_create(&path, t, vec3(40, 0, 0), vec3(10, 0, 0), 1));
    assert_near(score_path_left(&path, vec3(40, 0, 0), 20), 30, 1e-9);
    assert_near(path.off[15], 0, 0);
    assert_near(path.off[0], 10 - 2, 1e-9);
    assert_near(path.off[TRUNK + 9], 20 - 2, 1e-9);
    score_path_destroy(&path);
    assert_true(score_path_create(&path, NULL, vec3(0, 0, 0), vec3(3, 4, 0), 1));
    assert_near(score_path_left(&path, vec3(0, 0, 0), -1), 5, 1e-12);
    score_path_destroy(&path);
    vessel_tree_free(t);
}

// The tool continues straight in the trunk.
static void a_wrong_branch_counts_once_each_time(void **state)
{
    (void)state;
    VesselTree *t = forked(1);
    static const char side[] = "seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n"
                               "targets: [{name: there, point_mm: [20, 16, 0], radius_mm: 1}]\n" EXERCISE(", rules: {wrong_branch_mm: 5}");
    Practice *p = practice_begin(side, t);
    assert_near(score_figures(p->score).way_mm, 35, 1e-9);
    ScoreFigures f = practice_go(p, 10, 2.5);      // at 26 mm: 4 mm beyond the trunk's wall
    assert_int_equal(f.error_total, 0);
    assert_near(f.tool[0].off_way_mm, 4, 1e-9);
    f = practice_go(p, 10, 0.5);                   // at 31 mm
    assert_int_equal(f.error[ERROR_WRONG_BRANCH].count, 1);
    assert_near(f.error[ERROR_WRONG_BRANCH].last_s, 2.6, 0.03);       // the tip is at node 14 (28 mm) from 27 mm on
    f = practice_go(p, 10, 0.5);
    assert_int_equal(f.error[ERROR_WRONG_BRANCH].count, 1);
    practice_go(p, -10, 1.3);                      // to 23 mm and immediately in again: the same error continues
    f = practice_go(p, 10, 0.8);
    assert_int_equal(f.error[ERROR_WRONG_BRANCH].count, 1);
    practice_go(p, -10, 1.1);                      // to 20 mm, for a while
    practice_go(p, 0, 0.6);
    f = practice_go(p, 10, 1);
    assert_int_equal(f.error[ERROR_WRONG_BRANCH].count, 2);
    practice_end(p);
    // on the path nothing is counted
    p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n"
                       "targets: [{name: there, point_mm: [38, 0, 0], radius_mm: 1}]\n" EXERCISE(", rules: {wrong_branch_mm: 5}"),
                       t);
    f = practice_go(p, 10, 3.7);
    assert_int_equal(f.error_total, 0);
    f = practice_go(p, 0, 2);
    assert_int_equal(f.state, SCORE_REACHED);
    assert_near(f.efficiency, 1, 0.03);
    practice_end(p);
    vessel_tree_free(t);
}

// The tool continues straight where the tree makes a long loop: it leaves one arm and enters the other.
static void a_tip_in_another_branch_is_found(void **state)
{
    (void)state;
    enum { ARM = 16, LOOP = 31 };
    VesselTree *t = vessel_tree_create(2 * ARM + LOOP, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < t->node_count; i++) {
        int k = i - ARM, half = LOOP / 2;
        t->center[i] = k < 0 ? vec3(2 * i, 0, 0) : k < LOOP ? vec3(33, 0, 2 * (half + 1 - abs(k - half))) : vec3(36 + 2 * (k - LOOP), 0, 0);
        t->radius[i] = 2;
        t->direction[i] = vec3(1, 0, 0);
        t->parent[i] = i - 1;
    }
    assert_true(vessel_tree_link(t));
    Practice *p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" AT(60) EXERCISE(""), t);
    practice_go(p, 20, 1.4);
    assert_int_equal(score_figures(p->score).tip_node, 14);
    ScoreFigures f = practice_go(p, 20, 0.55);               // to 40 mm
    assert_int_equal(f.tip_node, ARM + LOOP + 2);
    assert_near(f.remaining_mm, 20, 0.5);
    practice_end(p);
    vessel_tree_free(t);
}

// Beside a wide vessel that belongs to a far part of the tree: although its nodes are the nearest by power, the tip stays in its own branch.
static void a_tip_beside_a_wide_vessel_stays(void **state)
{
    (void)state;
    enum { ARM = 16, LOOP = 31 };
    VesselTree *t = vessel_tree_create(2 * ARM + LOOP, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < t->node_count; i++) {
        int k = i - ARM, half = LOOP / 2;
        t->center[i] = k < 0 ? vec3(2 * i, 0, 0) : k < LOOP ? vec3(33, k > half ? 3.5 : 0, 2 * (half + 1 - abs(k - half))) : vec3(33 - 2 * (k - LOOP), 3.5, 0);
        t->radius[i] = k < LOOP ? 2 : 4;
        t->direction[i] = vec3(1, 0, 0);
        t->parent[i] = i - 1;
    }
    assert_true(vessel_tree_link(t));
    assert_true(power_nearest(t, vec3(21, 0, 0)) >= ARM + LOOP);
    Practice *p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" AT(60) EXERCISE(""), t);
    for (int k = 1; k < 12; k++) {
        ScoreFigures f = practice_go(p, 20, 0.1);            // 2 mm further, halfway between two nodes
        assert_true(f.tip_node == k || f.tip_node == k + 1);
    }
    practice_end(p);
    vessel_tree_free(t);
}

// --- buckling ---

#define TUBE(path, ends)                                                                                                                                       \
    "seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n" AT(90) "vessel: {friction: 0.1, tube: {start_mm: [0, 0, "    \
                                                                                                         "0], "                                                \
                                                                                                         "direction: [1, 0, 0], normal: [0, 1, 0], "           \
                                                                                                         "radius_mm: 2, ends: " ends ", path: [" path "]}}\n"

// The tip is held 18 mm beyond the mouth: the length pushed in forms folds.
static void a_tool_whose_tip_is_held_buckles_at_the_sheath(void **state)
{
    (void)state;
    for (int judged = 0; judged < 2; judged++) {
        static const char *const exercise[] = {EXERCISE(", rules: {buckling: false}"), EXERCISE("")};
        char text[2048];
        snprintf(text, sizeof text,
                 "seldinger: 1\n" TOOL
                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 18}\nrig: {fix: [{s_mm: end, dof: position}]}\n" AT(90) "vessel: {friction: "
                                                                                                                                           "0.1, tube: "
                                                                                                                                           "{radius_mm: 2, "
                                                                                                                                           "path: [{line_mm: "
                                                                                                                                           "60}]}}\n%s",
                 exercise[judged]);
        Practice *p = practice_begin(text, NULL);
        // one bow from wall to wall needs pi^2 1.8^2 / 20 = 1.6 mm
        ScoreFigures f = practice_go(p, 10, 0.16);
        assert_near(f.tool[0].lost_limit_mm, 1 + PI * PI * 1.8 * 1.8 / 20, 1e-9);
        assert_near(f.tool[0].lost_mm, 1.6, 0.15);
        assert_int_equal(f.error_total, 0);
        f = practice_go(p, 10, 0.14);
        assert_near(f.tool[0].lost_mm, 3, 0.3);
        assert_int_equal(f.error[ERROR_BUCKLING].count, judged);
        assert_int_equal(f.error_total, judged);
        f = practice_go(p, -10, 0.3);              // pulled straight again
        assert_near(f.tool[0].lost_mm, 0, 0.3);
        f = practice_go(p, 0, 0.6);
        assert_false(f.error[ERROR_BUCKLING].is_on);
        practice_end(p);
    }
}

// Pushed into a blind end 32 mm from the mouth, a tool of any stiffness folds within 5 mm.
static void a_blind_end_makes_it_buckle(void **state)
{
    (void)state;
    for (int stiff = 0; stiff < 2; stiff++) {
        char text[2048];
        snprintf(text, sizeof text,
                 "seldinger: 1\nwire: {elements: 60, sections: [{length_mm: 80, diameter_mm: 0.36, young_modulus_gpa: %d}], damping: {mass_1_s: 1, "
                 "stiffness_s: 0.0005}}\nsheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n" AT(90) "vessel: {friction: 0.1, tube: "
                                                                                                                       "{radius_mm: 2, ends: closed, path: "
                                                                                                                       "[{line_mm: 30}]}}\n" EXERCISE(""),
                 stiff ? 80 : 5);
        Practice *p = practice_begin(text, NULL);
        ScoreFigures f = practice_go(p, 20, 1.5);
        assert_int_equal(f.error_total, 0);
        f = practice_go(p, 20, 0.25);
        assert_int_equal(f.error[ERROR_BUCKLING].count, 1);
        practice_end(p);
    }
}

static void normal_bends_are_no_buckling(void **state)
{
    (void)state;
    static const char *const scene[] = {
        TUBE("{line_mm: 5}, {arc: {radius_mm: 12, angle_deg: 90}}, {arc: {radius_mm: 12, angle_deg: 120, plane_deg: 180}}, {line_mm: 60}", "open") EXERCISE(""),
        TUBE("{arc: {radius_mm: 15, angle_deg: 300}}, {line_mm: 30}", "open") EXERCISE(""),
        TUBE("{arc: {radius_mm: 10, angle_deg: 60}}, {arc: {radius_mm: 10, angle_deg: 60, plane_deg: 90}}, {arc: {radius_mm: 10, angle_deg: 90, plane_deg: "
             "200}}, {line_mm: 60}",
             "open") EXERCISE(""),
        // a curved tip drags along the wall and over itself
        "seldinger: 1\nwire: {elements: 50, sections: [{length_mm: 85, diameter_mm: 0.4, young_modulus_gpa: 20}, {length_mm: 15, diameter_mm: 0.4, "
        "young_modulus_gpa: 5, rest_curvature_1_mm: 0.2}], damping: {mass_1_s: 1, stiffness_s: 0.0005}}\n"
        "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n" AT(90) "vessel: {friction: 0.1, tube: {radius_mm: 2.5, path: [{line_mm: "
                                                                                       "60}]}}\n" EXERCISE(""),
    };
    for (size_t i = 0; i < sizeof scene / sizeof scene[0]; i += WHOLE_OR_SHORT(1, 3)) {     // the first and the last have all kinds of pieces
        Practice *p = practice_begin(scene[i], NULL);
        double most = 0;
        for (int k = 0; k < 3; k++) {                        // in, half out, in again
            for (int n = 0; n < 22; n++)
                most = fmax(most, practice_go(p, k == 1 ? -25 : 25, 0.1).tool[0].lost_mm / score_figures(p->score).tool[0].lost_limit_mm);
        }
        ScoreFigures f = score_figures(p->score);
        print_message("bend %zu: at most %.2f of the limit %.2f mm; pushed %.2f N\n", i, most, f.tool[0].lost_limit_mm,
                      simulator_last(p->simulator)->proximal_force);
        assert_int_equal(f.error[ERROR_BUCKLING].count, 0);
        assert_true(most < 0.8);
        practice_end(p);
    }
}

// --- forces ---

// At rest against the end, the force in the shaft behind the tip equals the resultant of the wall on the tip.
static void the_tips_force_is_the_walls(void **state)
{
    (void)state;
    Practice *p =
        practice_begin(TUBE("{arc: {radius_mm: 15, angle_deg: 90}}, {line_mm: 10}", "closed") EXERCISE(", rules: {tip_length_mm: 6, tip_force_n: 0.02}"), NULL);
    practice_go(p, 20, 1.8);
    ScoreFigures f = practice_go(p, 0, 3);
    int nodes = simulator_state(p->simulator)->node_count;
    NodeReport *node = calloc((size_t)nodes, sizeof *node);
    assert_non_null(node);
    stepper_node_report(simulator_stepper(p->simulator), node);
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < nodes; i++)
        if (node[nodes - 1].s - node[i].s <= 6)
            sum = vec3_add(sum, node[i].force);
    print_message("tip %.6f N, wall on it %.6f N\n", f.tip_force_n, vec3_norm(sum));
    assert_true(vec3_norm(sum) > 0.02);
    assert_near(f.tip_force_n, vec3_norm(sum), 0.01 * vec3_norm(sum));
    assert_int_equal(f.error[ERROR_TIP_FORCE].count, 1);
    free(node);
    practice_end(p);
}

static void wall_force_is_summed_over_time(void **state)
{
    (void)state;
    Practice *p = practice_begin(TUBE("{arc: {radius_mm: 15, angle_deg: 90}}, {line_mm: 30}", "open") EXERCISE(", rules: {wall_force_n: 0.001}"), NULL);
    double peak = 0, impulse = 0;
    for (int i = 0; i < 1500; i++) {
        practice_step(p, 20);
        peak = fmax(peak, simulator_last(p->simulator)->wall_force_max);
        impulse += simulator_last(p->simulator)->wall_force_sum * 1e-3;
    }
    ScoreFigures f = score_figures(p->score);
    assert_true(peak > 0.001);
    assert_near(f.wall_force_peak_n, peak, 0);
    assert_near(f.wall_impulse_n_s, impulse, 1e-12);
    assert_int_equal(f.error[ERROR_WALL_FORCE].count, 1);    // one long episode
    int count;
    const ScoreEvent *event = score_events(p->score, &count);
    assert_int_equal(count, f.error_total);
    assert_int_equal(event[0].kind, ERROR_WALL_FORCE);
    assert_near(event[0].time_s, f.error[ERROR_WALL_FORCE].last_s, 0);
    practice_end(p);
}

// --- several tools ---

// The catheter stays behind while the wire moves to the target; then the catheter follows.
static void the_named_tool_has_to_be_there(void **state)
{
    (void)state;
    static const char *const scene[] = {TWO_IN_THE_OPEN EXERCISE(", hold_s: 0.2"), TWO_IN_THE_OPEN EXERCISE(", hold_s: 0.2, tool: wire"),
                                        TWO_IN_THE_OPEN EXERCISE(", hold_s: 0.2, tool: catheter, rules: {blind_mm: 25}")};
    for (int i = 0; i < 3; i++) {
        Practice *p = practice_begin(scene[i], NULL);
        p->watched = i == 2;
        practice_go_tools(p, 0, 20, 0.9);
        ScoreFigures f = practice_go_tools(p, 0, 0, 0.4);
        assert_int_equal(f.state, i == 2 ? SCORE_RUNNING : SCORE_REACHED);
        assert_near(f.path_mm, i == 2 ? 0 : 18, 0.3);
        assert_near(f.target_distance_mm, i == 2 ? 18 : 0, 0.05);
        if (i == 2) {
            practice_go_tools(p, 20, 0, 0.9);
            f = practice_go_tools(p, 0, 0, 0.4);
            assert_int_equal(f.state, SCORE_REACHED);
            assert_near(f.path_mm, 18, 0.3);
            assert_near(f.inserted_mm, 36, 1e-6);
            assert_near(f.tool[0].inserted_mm, 18, 1e-6);
            assert_int_equal(f.error[ERROR_BLIND].count, 1);
        }
        practice_end(p);
    }
}

// Tools that move together count as one for blind motion.
static void a_pair_moves_once(void **state)
{
    (void)state;
    Practice *p = practice_begin(TWO_IN_THE_OPEN EXERCISE(", rules: {blind_mm: 9}"), NULL);
    p->watched = true;
    ScoreFigures f = practice_go_tools(p, 20, 20, 0.4);
    assert_near(f.blind_mm, 8, 1e-6);
    assert_int_equal(f.error_total, 0);
    practice_end(p);
}

static void a_wire_that_is_drawn_back_is_lost(void **state)
{
    (void)state;
    for (int judged = 0; judged < 2; judged++) {
        static const char *const scene[] = {TWO_IN_THE_OPEN EXERCISE(""), TWO_IN_THE_OPEN EXERCISE(", rules: {wire_behind_mm: 4}")};
        Practice *p = practice_begin(scene[judged], NULL);
        practice_go_tools(p, 20, 20, 0.5);
        ScoreFigures f = practice_go_tools(p, 0, -20, 0.19);
        assert_int_equal(f.error_total, 0);
        assert_near(f.tool[1].behind_mm, 3.8, 1e-6);
        f = practice_go_tools(p, 0, -20, 0.1);
        assert_int_equal(f.error[ERROR_WIRE_LOST].count, judged);
        practice_go_tools(p, 0, 20, 0.2);          // ahead again, for long enough
        f = practice_go_tools(p, 0, 0, 0.6);
        assert_false(f.error[ERROR_WIRE_LOST].is_on);
        f = practice_go_tools(p, 0, -20, 0.3);
        assert_int_equal(f.error[ERROR_WIRE_LOST].count, 2 * judged);
        int count;
        const ScoreEvent *event = score_events(p->score, &count);
        assert_int_equal(count, 2 * judged);
        assert_int_equal(judged ? event[0].tool : 1, 1);
        practice_end(p);
    }
}

// 40 mm of wire are behind the hub: they enter as the catheter is pulled out over a held wire.
static void a_wire_drawn_into_the_hub_is_lost(void **state)
{
    (void)state;
    Practice *p = practice_begin("seldinger: 1\n" TWO_TOOLS("") "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n" AT(90) EXERCISE(""), NULL);
    practice_go_tools(p, 0, 50, 0.7);
    ScoreFigures f = practice_go_tools(p, 0, 10, 0.395);
    assert_near(f.tool[1].spare_mm, 1.05, 1e-6);
    assert_int_equal(f.error_total, 0);
    f = practice_go_tools(p, 0, 10, 0.01);
    assert_int_equal(f.error[ERROR_WIRE_LOST].count, 1);
    practice_end(p);
}

// A catheter that is curved at rest is held straight by a wire: when the wire is pulled out, the catheter springs.
static void a_catheter_kicks_when_its_wire_leaves(void **state)
{
    (void)state;
    double peak[2];
    for (int fast = 0; fast < 2; fast++) {
        Practice *p = practice_begin(
            "seldinger: 1\n" TWO_TOOLS("rest: [{arc: {radius_mm: 8, angle_deg: 90}}], ") "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n" AT(50)
                EXERCISE(", rules: {kick_mm_s: 60}"),
            NULL);
        practice_go_tools(p, 50, 60, 0.5);
        ScoreFigures f = practice_go_tools(p, 0, 0, 1);
        assert_int_equal(f.error_total, 0);
        f = practice_go_tools(p, 0, fast ? -150 : -10, fast ? 0.2 : 3);
        peak[fast] = f.tool[0].kick_peak_mm_s;
        assert_int_equal(f.error[ERROR_KICK].count, fast);
        assert_near(f.tool[1].kick_peak_mm_s, 0, 5);         // its own hand moved, and before that nothing moved suddenly
        practice_end(p);
    }
    print_message("kick at 10 mm/s: %.1f, at 150 mm/s: %.1f mm/s\n", peak[0], peak[1]);
    assert_true(peak[0] > 1 && peak[1] > 3 * peak[0]);
}

#define A_SPARE_WIRE                                                                                                                                           \
    "seldinger: 1\n"                                                                                                                                           \
    "tools:\n"                                                                                                                                                 \
    "  - {name: catheter, kind: catheter, elements: 30, inserted_mm: 2, sections: [{length_mm: 60, diameter_mm: 1, inner_diameter_mm: 0.7, "                   \
    "young_modulus_gpa: 0.5, density_g_cm3: 1.5}], damping: {mass_1_s: 1, stiffness_s: 0.0005},\n"                                                             \
    "     exchange: [{elements: 20, sections: [{length_mm: 50, diameter_mm: 1, inner_diameter_mm: 0.7, young_modulus_gpa: 0.5, density_g_cm3: 1.5}]}]}\n"      \
    "  - {name: wire, kind: wire, elements: 40, inserted_mm: 2, sections: [{length_mm: 100, diameter_mm: 0.4, young_modulus_gpa: 20}],\n"                      \
    "     exchange: [{elements: 50, sections: [{length_mm: 115, diameter_mm: 0.5, young_modulus_gpa: 60}]}]}\n"                                                \
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n" AT(20)

static ScoreFigures go_with(Practice *p, double outer_mm_s, double inner_mm_s, int catheter, int wire, double seconds)
{
    const ToolCommands commands = {.tool = {{outer_mm_s, 0}, {inner_mm_s, 0}}, .fitted = {catheter, wire}};
    for (int i = 0; i < (int)(seconds * 1000 + 0.5); i++)
        practice_step_tools(p, &commands);
    return score_figures(p->score);
}

// A wire that is exchanged does not count as lost while it is pulled out, and its place does not jump; the new one has its own length. Then the catheter is
// exchanged over it.
static void an_exchange_is_no_error(void **state)
{
    (void)state;
    Practice *p = practice_begin(A_SPARE_WIRE EXERCISE(", tool: wire, hold_s: 0.2, rules: {wire_behind_mm: 4, kick_mm_s: 20}"), NULL);
    go_with(p, 10, 10, 0, 0, 0.5);
    ScoreFigures f = go_with(p, 0, -100, 0, 0, 0.8);
    double out = f.withdrawn_mm, spare = f.tool[1].spare_mm;
    assert_near(f.tool[1].behind_mm, 60, 1.1);       // at the hub
    assert_near(spare, 100, 1.1);
    assert_true(out > 58);
    f = go_with(p, 0, 0, 0, 1, 0.01);
    assert_int_equal(simulator_totals(p->simulator)->exchanges, 1);
    assert_near(f.withdrawn_mm, out, 0.01);          // no motion is counted
    assert_near(f.tool[1].spare_mm, spare + 15, 0.1);
    double path = f.path_mm;
    f = go_with(p, 0, 50, 0, 1, 1);
    assert_near(f.tool[1].behind_mm, 10, 1.1);
    assert_near(f.path_mm - path, 50, 0.5);
    assert_int_equal(f.error_total, 0);
    assert_true(f.tool[0].kick_peak_mm_s < 1 && f.tool[1].kick_peak_mm_s < 1);
    // the catheter pushed on ahead of it
    f = go_with(p, 5, 0, 0, 1, 0.1);
    assert_int_equal(f.error[ERROR_WIRE_LOST].count, 1);
    f = go_with(p, 0, 50, 0, 1, 0.4);                // out of the catheter, to 17 mm from the mouth
    f = go_with(p, -50, 0, 0, 1, 0.2);
    double held = f.target_distance_mm, hub = f.tool[1].spare_mm;
    f = go_with(p, 0, 0, 1, 1, 0.01);
    assert_int_equal(simulator_totals(p->simulator)->exchanges, 2);
    assert_near(f.target_distance_mm, held, 0.01);
    assert_near(f.tool[1].spare_mm, hub + 10, 0.1);
    f = go_with(p, 20, 0, 1, 1, 0.5);
    assert_near(f.tool[0].tip_force_n, 0, 1e-9);
    assert_int_equal(f.error_total, 1);
    assert_true(f.tool[0].kick_peak_mm_s < 1 && f.tool[1].kick_peak_mm_s < 1);
    practice_end(p);
}

// A wire that is pulled back past vessels beside the sheath is in none of them.
static void what_is_drawn_out_is_at_the_mouth(void **state)
{
    (void)state;
    VesselTree *t = forked(1);
    Practice *p = practice_begin(
        "seldinger: 1\n" TWO_TOOLS("") "sheath: {entry_mm: [30, 0, 0], direction: [1, 0, 0]}\n"
                                       "targets: [{name: there, point_mm: [38, 0, 0], radius_mm: 1}]\n" EXERCISE(", tool: wire, rules: {wrong_branch_mm: 3}"),
        t);
    ScoreFigures f = practice_go_tools(p, 0, -50, 1);
    assert_near(f.tool[1].behind_mm, 50, 1e-3);
    assert_int_equal(f.error_total, 0);
    assert_near(f.remaining_mm, 8, 1e-9);
    practice_end(p);
    vessel_tree_free(t);
}

// The target counts only with the required device.
static void the_device_that_is_required_must_be_there(void **state)
{
    (void)state;
    Practice *p = practice_begin(A_SPARE_WIRE EXERCISE(", tool: wire, exchange: {wire: 1}, hold_s: 0.2"), NULL);
    go_with(p, 0, 18, 0, 0, 1);
    ScoreFigures f = go_with(p, 0, 0, 0, 0, 1);
    assert_near(f.target_distance_mm, 0, 1e-3);
    assert_true(f.state == SCORE_RUNNING && f.held_s == 0);
    go_with(p, 0, -100, 0, 0, 0.9);
    f = go_with(p, 0, 100, 0, 1, 0.775);
    assert_int_equal(f.state, SCORE_RUNNING);
    f = go_with(p, 0, 0, 0, 1, 0.3);
    assert_int_equal(f.state, SCORE_REACHED);
    practice_end(p);
}

// An error only after the tool has stayed there, and each time it leaves.
static void a_tool_that_stays_keeps_its_place(void **state)
{
    (void)state;
    Practice *p = practice_begin(A_SPARE_WIRE EXERCISE(", tool: wire, exchange: {wire: 1}, stays: {tool: catheter, target: there}, hold_s: 0.5"), NULL);
    go_with(p, 10, 0, 0, 0, 1.8);
    ScoreFigures f = go_with(p, 10, 0, 0, 0, 0.2);        // through it
    assert_int_equal(f.error_total, 0);
    f = go_with(p, -10, 0, 0, 0, 0.2);
    f = go_with(p, 0, 0, 0, 0, 0.6);
    assert_near(f.tool[0].strayed_mm, 0, 1e-6);
    f = go_with(p, 10, 0, 0, 0, 0.09);
    assert_near(f.tool[0].strayed_mm, 0.9, 1e-3);
    assert_int_equal(f.error_total, 0);
    f = go_with(p, 10, 0, 0, 0, 0.05);
    assert_near(f.tool[0].strayed_mm, 1.4, 1e-3);
    assert_true(f.error[ERROR_TIP_MOVED].count == 1 && f.error[ERROR_TIP_MOVED].is_on);
    go_with(p, -10, 0, 0, 0, 0.14);
    f = go_with(p, 0, 0, 0, 0, 0.6);
    assert_false(f.error[ERROR_TIP_MOVED].is_on);
    f = go_with(p, -10, 0, 0, 0, 0.15);
    assert_int_equal(f.error[ERROR_TIP_MOVED].count, 2);
    practice_end(p);
}

// The part of the wall's forces on each tool where no other tool is around it.
static void each_tip_bears_its_own(void **state)
{
    (void)state;
    Practice *p =
        practice_begin("seldinger: 1\n" TWO_TOOLS("") "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n" AT(
                           90) "vessel: {friction: 0.1, contact: tube, tube: {radius_mm: 2, normal: [0, 1, 0], ends: closed, path: [{arc: {radius_mm: 15, "
                               "angle_deg: 90}}, {line_mm: 20}]}}\n" EXERCISE(", rules: {tip_length_mm: 6, tip_force_n: 0.02}"),
                       NULL);
    practice_go_tools(p, 20, 40, 0.9);
    practice_go_tools(p, 0, 20, 0.5);
    ScoreFigures f = practice_go_tools(p, 0, 0, 2);
    Simulator *simulator = p->simulator;
    int nodes = simulator_state(simulator)->node_count;
    NodeReport *node = calloc((size_t)nodes, sizeof *node);
    assert_non_null(node);
    stepper_node_report(simulator_stepper(simulator), node);
    Vec3 sum[2] = {{0, 0, 0}, {0, 0, 0}}, all = {0, 0, 0};
    int tool = 0;
    for (int i = 0; i < nodes; i++) {
        if (i > 0 && node[i - 1].s == 60)
            tool = 1;
        if (node[i].s >= (tool ? 100 : 60) - 6)
            sum[tool] = vec3_add(sum[tool], node[i].force);
        all = vec3_add(all, node[i].force);
    }
    Vec3 whole = vec3_add(stepper_tool_wall_force(simulator_stepper(simulator), 0, 0), stepper_tool_wall_force(simulator_stepper(simulator), 1, 0));
    print_message("catheter's tip %.4f N (nodes %.4f), wire's %.4f N (nodes %.4f)\n", f.tool[0].tip_force_n, vec3_norm(sum[0]), f.tool[1].tip_force_n,
                  vec3_norm(sum[1]));
    assert_near(vec3_distance(whole, all), 0, 1e-9);
    for (int k = 0; k < 2; k++)                    // a report gives a slot's force to the nodes beside it
        assert_near(f.tool[k].tip_force_n, vec3_norm(sum[k]), 0.15 * vec3_norm(sum[k]));
    assert_true(f.tool[1].tip_force_n > 0.05);
    assert_near(f.tip_force_n, fmax(f.tool[0].tip_force_n, f.tool[1].tip_force_n), 0);
    int count;
    const ScoreEvent *event = score_events(p->score, &count);
    assert_true(count > 0);
    assert_int_equal(event[0].kind, ERROR_TIP_FORCE);
    assert_int_equal(event[0].tool, 1);
    // pulled back into the catheter, the wire touches nothing
    practice_go_tools(p, 0, -40, 0.8);
    assert_near(practice_go_tools(p, 0, 0, 0.5).tool[1].tip_force_n, 0, 1e-6);
    free(node);
    practice_end(p);
}

// A tool's place is that of the drawn nodes, except for the error of the chord; its velocity is that of its motion.
static void a_tools_place_is_where_it_is(void **state)
{
    (void)state;
    Practice *p =
        practice_begin("seldinger: 1\n" TWO_TOOLS("") "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n" AT(
                           90) "vessel: {friction: 0, contact: tube, tube: {radius_mm: 1.5, normal: [0, 1, 0], path: [{arc: {radius_mm: 15, angle_deg: 90}}, "
                               "{line_mm: 40}]}}\n",
                       NULL);
    Stepper *stepper = simulator_stepper(p->simulator);
    double off = 0, slip = 0;
    for (int i = 0; i < 900; i++) {
        ToolNode node[41];
        Vec3 before[3];
        static const double at[3] = {70, 90, 100};
        for (int j = 0; j < 3; j++)
            before[j] = stepper_tool_place(stepper, 1, at[j]).position;
        practice_step_tools(p, &(ToolCommands){.tool = {{i < 500 ? 40 : 0, 0}, {i < 500 ? 60 : -40, 0}}});
        for (int k = 0; k < 2; k++) {
            int count = stepper_tool_nodes(stepper, k, node);
            for (int j = 0; j < count; j++)
                off = fmax(off, vec3_distance(node[j].position, stepper_tool_place(stepper, k, node[j].s).position));
        }
        for (int j = 0; j < 3 && i > 50; j++) {
            ToolPlace place = stepper_tool_place(stepper, 1, at[j]);
            slip = fmax(slip, fabs(vec3_dot(place.velocity, place.along) - vec3_dot(vec3_sub(place.position, before[j]), place.along)));
        }
    }
    print_message("places: at most %.4f mm off; along it %.2e mm a step\n", off, slip);
    // h^2 / 8R; a tip at most 0.04 of an element beyond the tip around it is drawn at that tip
    assert_true(off < 2.5 * 2.5 / (8 * 12) + 0.04 * 2.5);
    assert_true(slip < 5e-3);
    practice_end(p);
}

// --- points ---

#define JUDGED                                                                                                                                                 \
    EXERCISE(", rules: {blind_mm: 5, contrast_ml: 3}, par: {time_s: 3, fluoroscopy_s: 2, contrast_ml: 1, path_ratio: 1.01, wall_force_n: 1, "                  \
             "wall_impulse_n_s: 1}")

typedef struct Hand {
    double wait_s, contrast_ml_s, detour_mm, pedal_off_s;    // the changes that make the session worse
} Hand;

static ScoreFigures reach(Hand hand)
{
    Practice *p = practice_begin(IN_THE_OPEN JUDGED, NULL);
    p->watched = true;
    p->xray.pedal = 1;
    practice_go(p, 10, 0.5);
    practice_go(p, 10, hand.detour_mm / 10);
    practice_go(p, -10, hand.detour_mm / 10);
    practice_go(p, 0, hand.wait_s);
    p->xray.contrast_ml_s = (float)hand.contrast_ml_s;
    practice_go(p, 0, 1);
    p->xray.contrast_ml_s = 0;
    p->xray.pedal = hand.pedal_off_s > 0 ? 0 : 1;
    practice_go(p, 10, hand.pedal_off_s);
    p->xray.pedal = 1;
    practice_go(p, 10, 1.4 - hand.pedal_off_s);
    ScoreFigures f = practice_go(p, 0, 3);
    assert_int_equal(f.state, SCORE_REACHED);
    practice_end(p);
    return f;
}

static void a_worse_figure_never_gives_more_points(void **state)
{
    (void)state;
    ScoreFigures best = reach((Hand){0});
    assert_true(best.points > 50 && best.points <= 100);
    for (int k = 0; k < 4; k++) {
        double before = best.points;
        for (int level = WHOLE_OR_SHORT(1, 2); level <= WHOLE_OR_SHORT(3, 2); level++) {
            double x = level;
            Hand hand = {.wait_s = k == 0 ? x : 0, .contrast_ml_s = k == 1 ? 1.2 * x : 0, .detour_mm = k == 2 ? x : 0, .pedal_off_s = k == 3 ? 0.3 * x : 0};
            ScoreFigures f = reach(hand);
            if (k < 3 || level == 2)                         // pedal off: less X-rays, but blind from 5 mm on
                assert_true(f.points < before);
            before = f.points;
        }
    }
    assert_int_equal(reach((Hand){.contrast_ml_s = 4}).error_total, 1);
}

static void nothing_done_is_worth_nothing(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN JUDGED, NULL);
    assert_near(practice_go(p, 0, 1).points, 0, 0);
    p->watched = true;
    p->xray.pedal = 1;
    assert_near(practice_go(p, 0, 1).points, 0, 1e-9);
    ScoreFigures half = practice_go(p, 10, 1);
    assert_true(half.points > 20 && half.points < 50);       // half of the path: at most a quarter of the points; at its end half
    practice_end(p);
}

// --- what the trainee sees ---

// Movements without X-rays add up however short each is; a pull counts half. A single pulse between them does not make them seen.
static void blind_distance_adds_up(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", rules: {blind_mm: 4}, par: {blind_mm: 2}"), NULL);
    p->watched = true;
    ScoreFigures f = {0};
    for (int i = 0; i < 10; i++) {
        f = practice_go(p, 10, 0.1);
        assert_near(f.blind_mm, 1, 1e-6);
        p->xray.pedal = 1;
        f = practice_go(p, 0, 0.001);
        p->xray.pedal = 0;
    }
    assert_near(f.blind_total_mm, 10, 1e-6);
    assert_near(f.part[PART_BLIND], 0.2, 1e-6);
    assert_int_equal(f.error_total, 0);
    f = practice_go(p, -10, 0.3);
    assert_near(f.blind_total_mm, 11.5, 1e-6);
    p->xray.pedal = 1;
    f = practice_go(p, 10, 0.5);
    assert_near(f.blind_total_mm, 11.5, 1e-6);
    practice_end(p);
}

// The pedal alone does not show a tool: the image must be on the screen, its tip in the open field, and the pulses frequent.
static void only_an_image_of_the_tip_is_sight(void **state)
{
    (void)state;
    static const struct {
        int seen;
        float pulses_s;
        double blind_mm;     // of 10 mm
    } cases[] = {{0, 15, 0},
                 {SEEN_KNOWN | SEEN_XRAY | SEEN_TIP, 15, 0},
                 {SEEN_KNOWN | SEEN_XRAY, 15, 10},
                 {SEEN_KNOWN | SEEN_TIP, 15, 10},
                 {SEEN_KNOWN | SEEN_XRAY | SEEN_TIP << 1, 15, 10},
                 {SEEN_KNOWN | SEEN_XRAY | SEEN_TIP, 7.5F, 0},
                 {SEEN_KNOWN | SEEN_XRAY | SEEN_TIP, 1, 8}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Practice *p = practice_begin(IN_THE_OPEN EXERCISE(""), NULL);
        p->watched = true;
        p->xray.pedal = 1;
        p->xray.seen = (float)cases[i].seen;
        p->xray.pulses_s = cases[i].pulses_s;
        ScoreFigures f = practice_go(p, 10, 1);
        assert_near(f.blind_total_mm, cases[i].blind_mm, 0.1);
        practice_end(p);
    }
}

// A catheter that is drawn back over its wire is seen by the wire's tip; a wire that is pushed on is not seen by the catheter's.
static void a_tool_is_seen_by_the_tip_ahead_of_it(void **state)
{
    (void)state;
    for (int tip = 0; tip < 2; tip++)
        for (int pushed = 0; pushed < 2; pushed++) {
            Practice *p = practice_begin(TWO_IN_THE_OPEN EXERCISE(""), NULL);
            practice_go_tools(p, 0, 20, 0.2);
            p->watched = true;
            p->xray.pedal = 1;
            p->xray.seen = (float)(SEEN_KNOWN | SEEN_XRAY | SEEN_TIP << tip);
            ScoreFigures f = practice_go_tools(p, pushed == 0 ? 10 : 0, pushed == 1 ? 10 : 0, 0.2);
            assert_near(f.blind_total_mm, tip == 0 && pushed == 1 ? 2 : 0, 1e-6);
            practice_end(p);
        }
}

// Time with a 3D view in sight counts while a tool moves, and for 2 s after a look, also if it was taken during a pause; looking at rest is free.
static void looking_at_3d_while_moving_is_guidance(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", par: {guidance_s: 0.5}"), NULL);
    p->watched = true;
    p->xray.pedal = 1;
    p->xray.looks = 3;           // before the clock runs
    practice_go(p, 0, 0.1);
    p->xray.pedal = 0;
    practice_go(p, 0, 2.5);
    ScoreFigures f = practice_go(p, 1, 1);
    assert_near(f.guided_s, 0, 0);
    p->xray.seen = SEEN_KNOWN | SEEN_3D;
    f = practice_go(p, 0, 1);
    assert_near(f.guided_s, 0, 0);
    f = practice_go(p, 1, 1);
    assert_near(f.guided_s, 1, 1e-9);
    assert_near(f.part[PART_GUIDANCE], 0.5, 1e-9);
    p->xray.seen = SEEN_KNOWN;
    f = practice_go(p, 1, 3);
    assert_near(f.guided_s, 3, 0.002);
    p->xray.looks++;             // shown and hidden again between two steps
    f = practice_go(p, 1, 3);
    assert_near(f.guided_s, 5, 0.004);
    practice_end(p);
}

// Going past the target again and again, never far enough for an error, costs more each time.
static void retries_below_the_limit_cost_points(void **state)
{
    (void)state;
    VesselTree *t = forked(1);
    double before = 101;
    for (int retries = 0; retries < 4; retries++) {
        Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", rules: {wrong_branch_mm: 5}, par: {path_ratio: 1.2, time_s: 2}"), t);
        p->watched = true;
        p->xray.pedal = 1;
        practice_go(p, 10, 1.5);
        for (int i = 0; i < retries; i++) {
            practice_go(p, 10, 1);
            practice_go(p, -10, 1);
        }
        practice_go(p, 10, 0.4);
        ScoreFigures f = practice_go(p, 0, 2);
        assert_int_equal(f.state, SCORE_REACHED);
        assert_int_equal(f.error_total, 0);
        assert_true(f.points < before - 5);
        before = f.points;
        practice_end(p);
    }
    vessel_tree_free(t);
}

// The points of the parts add up to the whole, and a part that lost some says why.
static void points_are_those_of_the_parts(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", rules: {blind_mm: 5}, par: {time_s: 1, blind_mm: 5, path_ratio: 2}, weights: {blind: 2}"), NULL);
    p->watched = true;
    practice_go(p, 10, 1.9);
    ScoreFigures f = practice_go(p, 0, 2.5);
    assert_int_equal(f.state, SCORE_REACHED);
    assert_int_equal(f.error_total, 1);
    double points = -5 * f.error_total, most = 0;
    for (int i = 0; i < PART_COUNT; i++) {
        char why[120];
        points += f.judged[i].points;
        most += f.judged[i].most;
        score_part_reason(&f, (ScorePart)i, why, sizeof why);
        assert_int_equal(i == PART_TIME || i == PART_BLIND, why[0] != 0);
    }
    assert_near(most, 100, 1e-9);
    assert_near(points, f.points, 1e-9);
    assert_near(f.judged[PART_BLIND].most, 50, 1e-9);
    assert_near(f.judged[PART_BLIND].measured, 19, 1e-6);
    practice_end(p);
}

static ScoreFigures through_a_bend(bool mirrored)
{
    VesselTree *tree = forked(mirrored ? -1 : 1);
    char text[2048];
    snprintf(text, sizeof text,
             "seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], normal: [0, %d, 0], inserted_mm: 2}\n"
             "targets: [{name: there, point_mm: [20, %d, 0], radius_mm: 2}]\nvessel: {friction: 0.1, tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], normal: "
             "[0, %d, 0], radius_mm: 2, path: [{line_mm: 8}, {arc: {radius_mm: 12, angle_deg: 90}}, {line_mm: 20}]}}\n" EXERCISE(", hold_s: 0.2, rules: "
                                                                                                                                 "{tip_force_n: 0.01, "
                                                                                                                                 "wall_force_n: 0.01, "
                                                                                                                                 "wrong_branch_mm: 3}, par: "
                                                                                                                                 "{time_s: 1, path_ratio: 1, "
                                                                                                                                 "wall_impulse_n_s: 0.01}"),
             mirrored ? -1 : 1, mirrored ? -20 : 20, mirrored ? -1 : 1);
    Practice *p = practice_begin(text, tree);
    practice_go(p, 20, 1.55);
    ScoreFigures f = practice_go(p, 0, 1);
    practice_end(p);
    vessel_tree_free(tree);
    return f;
}

static void a_mirrored_scene_gives_the_same_score(void **state)
{
    (void)state;
    ScoreFigures one = through_a_bend(false), two = through_a_bend(true), again = through_a_bend(false);
    assert_memory_equal(&one, &again, sizeof one);           // the same run is bit-identical
    assert_int_equal(one.state, SCORE_REACHED);
    assert_int_equal(one.state, two.state);
    assert_true(one.points > 0 && one.points < 100 && one.error_total > 0);
    assert_near(one.points, two.points, 1e-3 * one.points);
    assert_near(one.path_mm, two.path_mm, 1e-3 * one.path_mm);
    assert_near(one.way_mm, two.way_mm, 1e-9);
    assert_near(one.wall_impulse_n_s, two.wall_impulse_n_s, 1e-3 * one.wall_impulse_n_s);
    for (int i = 0; i < ERROR_COUNT; i++)
        assert_int_equal(one.error[i].count, two.error[i].count);
}

static void a_step_allocates_nothing(void **state)
{
    (void)state;
    need_counting();
    VesselTree *t = forked(1);
    Practice *p = practice_begin(TUBE("{line_mm: 30}", "closed") EXERCISE(", rules: {tip_force_n: 0.1, wrong_branch_mm: 1}"), t);
    p->watched = true;
    p->xray.pedal = 1;
    long before = heap_calls();
    for (int i = 0; i < 2000; i++) {
        simulator_step_one_tool(p->simulator, (Command){20, 0});
        heap_watch(true);
        score_step(p->score, p->simulator, &(ToolCommands){.tool = {{20, 0}}}, &p->xray);
        heap_watch(false);
    }
    assert_int_equal(heap_calls() - before, 0);
    assert_true(score_figures(p->score).error_total > 0);
    practice_end(p);
    vessel_tree_free(t);
    p = practice_begin(TWO_IN_THE_OPEN EXERCISE(", rules: {tip_force_n: 0.1, kick_mm_s: 1, wire_behind_mm: 1}"), NULL);
    before = heap_calls();
    for (int i = 0; i < 800; i++) {
        ToolCommands commands = {.tool = {{i < 400 ? 40 : 0, 0}, {i < 400 ? 60 : -60, 0}}};
        simulator_step(p->simulator, &commands);
        heap_watch(true);
        score_step(p->score, p->simulator, &commands, NULL);
        heap_watch(false);
    }
    assert_int_equal(heap_calls() - before, 0);
    assert_true(score_figures(p->score).error[ERROR_WIRE_LOST].count > 0);
    practice_end(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_exercise_is_read),
        cmocka_unit_test(a_target_keeps_its_first_time),
        cmocka_unit_test(a_wrong_exercise_is_refused),
        cmocka_unit_test(a_volume_is_found_beside_the_scene),
        cmocka_unit_test(the_clock_runs_from_the_first_movement),
        cmocka_unit_test(ways_are_counted_both_ways),
        cmocka_unit_test(x_rays_are_counted_while_the_pedal_is_down),
        cmocka_unit_test(moving_blind_is_an_error_once_until_the_pedal),
        cmocka_unit_test(a_target_must_be_held),
        cmocka_unit_test(the_border_decides),
        cmocka_unit_test(the_path_is_measured_along_the_tree),
        cmocka_unit_test(a_wrong_branch_counts_once_each_time),
        cmocka_unit_test(a_tip_in_another_branch_is_found),
        cmocka_unit_test(a_tip_beside_a_wide_vessel_stays),
        cmocka_unit_test(a_tool_whose_tip_is_held_buckles_at_the_sheath),
        cmocka_unit_test(a_blind_end_makes_it_buckle),
        cmocka_unit_test(normal_bends_are_no_buckling),
        cmocka_unit_test(the_tips_force_is_the_walls),
        cmocka_unit_test(wall_force_is_summed_over_time),
        cmocka_unit_test(the_named_tool_has_to_be_there),
        cmocka_unit_test(a_pair_moves_once),
        cmocka_unit_test(a_wire_that_is_drawn_back_is_lost),
        cmocka_unit_test(a_wire_drawn_into_the_hub_is_lost),
        cmocka_unit_test(a_catheter_kicks_when_its_wire_leaves),
        cmocka_unit_test(an_exchange_is_no_error),
        cmocka_unit_test(what_is_drawn_out_is_at_the_mouth),
        cmocka_unit_test(the_device_that_is_required_must_be_there),
        cmocka_unit_test(a_tool_that_stays_keeps_its_place),
        cmocka_unit_test(each_tip_bears_its_own),
        cmocka_unit_test(a_tools_place_is_where_it_is),
        cmocka_unit_test(a_worse_figure_never_gives_more_points),
        cmocka_unit_test(nothing_done_is_worth_nothing),
        cmocka_unit_test(blind_distance_adds_up),
        cmocka_unit_test(only_an_image_of_the_tip_is_sight),
        cmocka_unit_test(a_tool_is_seen_by_the_tip_ahead_of_it),
        cmocka_unit_test(looking_at_3d_while_moving_is_guidance),
        cmocka_unit_test(retries_below_the_limit_cost_points),
        cmocka_unit_test(points_are_those_of_the_parts),
        cmocka_unit_test(a_mirrored_scene_gives_the_same_score),
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(a_step_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
