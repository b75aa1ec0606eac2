// Hints about what is happening: each appears when its sign does and not for a careful hand; they neither flicker nor hide a more urgent one.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "score_scene.h"

#include <stdio.h>

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

// A trunk of 40 mm along x whose last 8 mm are a sac, and a branch along y at 20 mm.
enum { TRUNK = 21, BRANCH = 8 };
static VesselTree *forked(void)
{
    VesselTree *t = vessel_tree_create(TRUNK + BRANCH, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < t->node_count; i++) {
        const int k = i - TRUNK + 1;
        t->center[i] = k <= 0 ? vec3(2 * i, 0, 0) : vec3(20, 2 * k, 0);
        t->radius[i] = k <= 0 ? 2 : 1;
        t->direction[i] = k <= 0 ? vec3(1, 0, 0) : vec3(0, 1, 0);
        t->height[i] = 2;
        t->parent[i] = i == 0 ? -1 : i == TRUNK ? 10 : i - 1;
        t->kind[i] = i < TRUNK && t->center[i].x >= 32 ? NODE_ANEURYSM : NODE_VESSEL;
    }
    assert_true(vessel_tree_link(t));
    return t;
}

// The hint of a step for one sign, the others being absent.
static HintKind one_step(Hints *hints, HintKind kind, double sign)
{
    HintSigns signs = {0};
    signs.sign[kind] = sign;
    return hints_step(hints, &signs, 1);
}

static void a_hint_waits_and_stays(void **state)
{
    (void)state;
    Hints hints = {0};
    int came = -1, went = -1;
    for (int i = 0; i < 6000; i++) {
        const HintKind hint = one_step(&hints, HINT_PRESSES, i < 1500 ? 1.2 : 0);
        came = came < 0 && hint == HINT_PRESSES ? i : came;
        went = came >= 0 && went < 0 && hint == HINT_NONE ? i : went;
    }
    assert_in_range(came, 199, 201);
    assert_in_range(went, 2499, 2501);             // a second after the sign went
    hints = (Hints){0};
    for (int i = 0; i < 250; i++)
        one_step(&hints, HINT_PRESSES, 1.2);
    for (went = 0; one_step(&hints, HINT_PRESSES, 0) != HINT_NONE; went++)
        ;
    assert_in_range(went, 1949, 1951);             // two seconds after it came
}

// A sign that comes and goes within a second, or a knock, makes no flicker.
static void a_restless_sign_does_not_flicker(void **state)
{
    (void)state;
    for (int period = 20; period <= 1600; period *= 2) {
        Hints hints = {0};
        int changes = 0;
        HintKind last = HINT_NONE;
        for (int i = 0; i < 20000; i++) {
            const HintKind hint = one_step(&hints, HINT_BUCKLES, i / (period / 2) % 2 ? 0 : 1.5);
            changes += hint != last;
            last = hint;
        }
        assert_int_equal(changes, period / 2 >= 200);                  // shorter ones never show, longer ones come once and stay
    }
    Hints hints = {0};
    for (int i = 0; i < 5000; i++)
        assert_int_equal(one_step(&hints, HINT_BUCKLES, i < 1000 || i > 4000 ? 0.99 : 0.7), HINT_NONE);
}

static void the_most_urgent_comes_first(void **state)
{
    (void)state;
    Hints hints = {0};
    HintKind hint = HINT_NONE;
    for (int kind = HINT_COUNT - 1; kind > HINT_NONE; kind--) {
        HintSigns signs = {0};
        for (int i = kind; i < HINT_COUNT; i++)
            signs.sign[i] = 1;
        for (int i = 0; i < 300; i++)
            hint = hints_step(&hints, &signs, 1);
        assert_int_equal(hint, kind);
    }
}

// --- hands ---

// Steps with this push; returns whether the hint was shown, and checks that no other was.
static bool shows(Practice *p, double push_mm_s, double seconds, HintKind expected)
{
    bool shown = false;
    for (int i = 0; i < (int)(seconds * 1000); i++) {
        practice_step(p, push_mm_s);
        const HintKind hint = score_figures(p->score).hint;
        if (hint != HINT_NONE && hint != expected)
            fail_msg("hint %d at %d ms", hint, i);
        shown |= hint == expected;
    }
    return shown;
}

static void a_tip_that_stays_and_presses(void **state)
{
    (void)state;
    Practice *p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n" AT(
                                     58) "vessel: {friction: 0.1, contact: tube, tube: {radius_mm: 1.5, normal: [0, 1, 0], ends: closed, path: [{line_mm: "
                                         "60}]}}\n" EXERCISE(", hold_s: 60"),
                                 NULL);
    assert_false(shows(p, 20, 2.9, HINT_PRESSES));
    assert_false(shows(p, 0, 0.5, HINT_PRESSES));
    HintKind hint = HINT_NONE;
    for (int i = 0; i < 1000 && hint == HINT_NONE; i++) {
        practice_step(p, 10);
        hint = score_figures(p->score).hint;
    }
    assert_int_equal(hint, HINT_PRESSES);          // later it buckles
    const ScoreFigures f = score_figures(p->score);
    assert_true(f.hint_value > 3 && f.hint_value < 9);
    shows(p, -10, 1.5, HINT_PRESSES);
    shows(p, -2, 2, HINT_PRESSES);
    assert_int_equal(score_figures(p->score).hint, HINT_NONE);
    practice_end(p);
}

static void a_tip_that_presses_on_a_sac(void **state)
{
    (void)state;
    VesselTree *t = forked();
    Practice *p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 2}\n" AT(
                                     38) "vessel: {friction: 0.1, contact: tube, tube: {radius_mm: 1.5, normal: [0, 1, 0], ends: closed, path: [{line_mm: "
                                         "38}]}}\n" EXERCISE(", hold_s: 60"),
                                 t);
    assert_false(shows(p, 10, 3.5, HINT_SAC));
    assert_true(shows(p, 4, 1.2, HINT_SAC));
    assert_true(score_figures(p->score).hint_value > 0.05);
    practice_end(p);
    vessel_tree_free(t);
}

static void a_tool_that_buckles_at_the_sheath(void **state)
{
    (void)state;
    Practice *p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 18}\n"
                                 "rig: {fix: [{s_mm: end, dof: position}]}\n" AT(
                                     90) "vessel: {friction: 0.1, tube: {radius_mm: 2, path: [{line_mm: 60}]}}\n" EXERCISE(", rules: {buckling: false}"),
                                 NULL);
    assert_false(shows(p, 10, 0.1, HINT_BUCKLES));
    assert_true(shows(p, 4, 0.6, HINT_BUCKLES));
    practice_end(p);
}

// A soft wire folds up in a wide vessel while its tip stays.
static void a_tool_that_coils(void **state)
{
    (void)state;
    Practice *p =
        practice_begin("seldinger: 1\nwire: {elements: 80, sections: [{length_mm: 110, diameter_mm: 0.36, young_modulus_gpa: 40}, {length_mm: 50, "
                       "diameter_mm: 0.36, young_modulus_gpa: 0.3}], damping: {mass_1_s: 1, stiffness_s: 0.0005}}\nsheath: {entry_mm: [0, 0, 0], direction: "
                       "[1, 0, 0], inserted_mm: 2}\n" AT(28) "vessel: {friction: 0.2, contact: tube, tube: {radius_mm: 3, normal: [0, 1, 0], ends: closed, "
                                                             "path: [{line_mm: 80}]}}\n" EXERCISE(", hold_s: 60, rules: {buckling: false}"),
                       NULL);
    bool coils = false;
    for (int i = 0; i < 5000 && !coils; i++) {
        practice_step(p, 25);
        coils = score_figures(p->score).hint == HINT_COILS;
    }
    assert_true(coils);
    practice_end(p);
}

// The target is in the branch; the wire goes straight on.
static void a_tip_in_a_wrong_branch(void **state)
{
    (void)state;
    VesselTree *t = forked();
    Practice *p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n"
                                 "targets: [{name: there, point_mm: [20, 12, 0], radius_mm: 1}]\n" EXERCISE(", rules: {wrong_branch_mm: 5}"),
                                 t);
    assert_false(shows(p, 10, 2.3, HINT_WRONG_BRANCH));
    assert_true(shows(p, 3, 0.8, HINT_WRONG_BRANCH));
    assert_int_equal(score_figures(p->score).error[ERROR_WRONG_BRANCH].count, 0);       // before it is an error
    assert_true(shows(p, -10, 1.5, HINT_WRONG_BRANCH));
    assert_false(shows(p, 0, 2.5, HINT_WRONG_BRANCH) && score_figures(p->score).hint == HINT_WRONG_BRANCH);
    practice_end(p);
    // straight on is right
    p = practice_begin("seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" AT(38) EXERCISE(""), t);
    assert_false(shows(p, 10, 3, HINT_WRONG_BRANCH));
    practice_end(p);
    vessel_tree_free(t);
}

static void a_wire_that_is_lost(void **state)
{
    (void)state;
    Practice *p = practice_begin(TWO_IN_THE_OPEN EXERCISE(", rules: {wire_behind_mm: 3}"), NULL);
    ScoreFigures f = practice_go_tools(p, 20, 20, 0.5);
    assert_int_equal(f.hint, HINT_NONE);
    f = practice_go_tools(p, 0, -20, 0.5);
    assert_int_equal(f.hint, HINT_WIRE_LOST);
    practice_end(p);
}

static void a_tool_that_moves_unseen(void **state)
{
    (void)state;
    Practice *p = practice_begin(IN_THE_OPEN EXERCISE(", rules: {blind_mm: 10}"), NULL);
    p->watched = true;
    p->xray.pedal = 1;
    assert_false(shows(p, 10, 1, HINT_UNSEEN));
    p->xray.pedal = 0;
    assert_true(shows(p, 10, 0.9, HINT_UNSEEN));
    assert_int_equal(score_figures(p->score).error[ERROR_BLIND].count, 0);
    practice_end(p);
}

static void contrast_that_has_long_gone(void **state)
{
    (void)state;
    VesselTree *t = forked();
    Practice *p = practice_begin(
        "seldinger: 1\n" TOOL "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 1}\n" AT(60) EXERCISE(", rules: {contrast_ml: 4}"), t);
    p->watched = true;
    p->xray.pedal = 1;
    assert_false(shows(p, 0.5, 19, HINT_NO_CONTRAST));
    assert_true(shows(p, 0.5, 2, HINT_NO_CONTRAST));
    p->xray.contrast_ml_s = 1;
    shows(p, 0.5, 1.5, HINT_NO_CONTRAST);
    p->xray.contrast_ml_s = 0;
    shows(p, 0.5, 2, HINT_NO_CONTRAST);
    assert_false(shows(p, 0.5, 16, HINT_NO_CONTRAST));
    p->xray.mode = XRAY_ROADMAP;                                       // a roadmap shows the vessel
    assert_false(shows(p, 0.5, 10, HINT_NO_CONTRAST));
    practice_end(p);
    vessel_tree_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hint_waits_and_stays),      cmocka_unit_test(a_restless_sign_does_not_flicker),
        cmocka_unit_test(the_most_urgent_comes_first), cmocka_unit_test(a_tip_that_stays_and_presses),
        cmocka_unit_test(a_tip_that_presses_on_a_sac), cmocka_unit_test(a_tool_that_buckles_at_the_sheath),
        cmocka_unit_test(a_tool_that_coils),           cmocka_unit_test(a_tip_in_a_wrong_branch),
        cmocka_unit_test(a_wire_that_is_lost),         cmocka_unit_test(a_tool_that_moves_unseen),
        cmocka_unit_test(contrast_that_has_long_gone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
