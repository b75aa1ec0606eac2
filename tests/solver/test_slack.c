// The error of a shared centreline: a wire with clearance in the bend of a catheter, as two rods in contact (two_rods.h), compared with both on one line.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/short_run.h"
#include "tests/solver/two_rods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PI_ = 3.14159265358979323846;
static const double BEFORE = 40, RADIUS = 20, AFTER = 2;     // [mm]

// With `links` links in 90 degrees.
static TwoRods bend(double degrees, double clearance, int links, bool is_held)
{
    TwoRods rods;
    assert_true(two_rods_make(&rods, BEFORE, RADIUS, degrees * PI_ / 180, AFTER, RADIUS * PI_ / 2 / links));
    rods.clearance = clearance;
    rods.is_held = is_held;
    return rods;
}

static void solve(TwoRods *rods)
{
    if (two_rods_solve(rods) < 0)
        fail_msg("no balance found: clearance %g, %g N, %d of %d links", rods->clearance, rods->pressed, rods->reach, rods->links);
}

// --- the reference itself ---

static void the_gradient_is_the_energy_s(void **state)
{
    (void)state;
    TwoRods rods = bend(90, 0.2, 16, false);
    unsigned seed = 7;
    for (int k = 0; k < 2 * (rods.links + 1); k++) {
        seed = seed * 1664525u + 1013904223u;
        rods.x[k] += ((seed >> 8) % 1000 / 500.0 - 1) * 0.1;
    }
    rods.pressed = 0.3;
    rods.reach = rods.links - 3;
    double *g = calloc(2 * (size_t)rods.links + 2, sizeof *g);
    two_rods_energy(&rods);
    memcpy(g, rods.gradient, (2 * (size_t)rods.links + 2) * sizeof *g);
    for (int k = 0; k < 2 * (rods.links + 1); k++) {
        const double step = 1e-5;
        double x = rods.x[k];
        rods.x[k] = x + step;
        double up = two_rods_energy(&rods);
        rods.x[k] = x - step;
        double down = two_rods_energy(&rods);
        rods.x[k] = x;
        // rotations at the hub and at the end have no bending energy
        assert_true(fabs((up - down) / (2 * step) - g[k]) < 1e-6 * fmax(1, fabs(g[k])));
    }
    free(g);
    two_rods_free(&rods);
}

// Energy and inserted length with the wire's tip at link `reach`.
static double push_at(TwoRods *rods, int reach)
{
    double energy[2], length[2];
    for (int side = 0; side < 2; side++) {
        rods->reach = reach + (side ? 4 : -4);
        solve(rods);
        energy[side] = two_rods_energy(rods);
        length[side] = two_rods_length(rods);
    }
    return (energy[1] - energy[0]) / (length[1] - length[0]);
}

static int middle_of_bend(const TwoRods *rods, double degrees) { return (int)lround((BEFORE + RADIUS * degrees * PI_ / 360) / rods->h); }

// On one line: EI / 2 R^2 if the catheter is held, EIc EIw / (EIc + EIw) / 2 R^2 if it is free.
static void one_line_pushes_as_the_closed_forms(void **state)
{
    (void)state;
    for (int is_held = 0; is_held < 2; is_held++) {
        TwoRods rods = bend(90, 0, 120, is_held);
        double expected = (is_held ? 20.0 : 60.0 * 20 / 80) / (2 * RADIUS * RADIUS), push = push_at(&rods, middle_of_bend(&rods, 90));
        print_message("one line, %s: push %.6f N, closed form %.6f\n", is_held ? "held" : "free", push, expected);
        assert_true(fabs(push - expected) < 5e-4 * expected);
        two_rods_free(&rods);
    }
}

// The change of the wire's length in the catheter when the hand changes from pushing to pulling with `force`.
static double lost_motion(TwoRods *rods, double force)
{
    double length[2];
    rods->reach = rods->links;
    for (int side = 0; side < 2; side++) {
        rods->pressed = side ? -force : force;
        solve(rods);
        length[side] = two_rods_length(rods);
    }
    rods->pressed = 0;
    return length[0] - length[1];
}

// With increasing force the pushed wire lies along the outer wall and the pulled wire along the inner one. At both ends of the bend it crosses over, which
// reduces the lost motion; a further 90 degrees have no ends and add exactly 2 c pi / 2 as soon as the middle lies on the walls.
static void lost_motion_is_two_c_theta_but_for_the_ends(void **state)
{
    (void)state;
    static const double clearance[] = {0.02, 0.1}, force[] = {0.1, 0.25, 0.5};
    for (int n = 0; n < 2; n++) {
        double c = clearance[n], exact = 2 * c * PI_ / 2, before = 0;
        TwoRods quarter = bend(90, c, 60, true), half = bend(180, c, 60, true);
        for (int i = 0; i < 3; i++) {
            double lost[2] = {lost_motion(&quarter, force[i]), lost_motion(&half, force[i])};
            print_message("held, c %.2f mm, %.2f N: lost %.5f mm in 90, %.5f in 180 degrees; the difference %.5f of 2 c theta\n", c, force[i], lost[0], lost[1],
                          (lost[1] - lost[0]) / exact);
            assert_true(lost[0] > before && lost[0] < 1.02 * exact);
            if (i == 2)
                assert_true(fabs((lost[1] - lost[0]) / exact - 1) < 1e-3);
            before = lost[0];
        }
        two_rods_free(&quarter);
        two_rods_free(&half);
    }
}

static void finer_links_change_little(void **state)
{
    (void)state;
    double lost[3], push[3];
    for (int i = 0; i < 3; i++) {
        TwoRods rods = bend(90, 0.1, 30 << i, false);
        lost[i] = lost_motion(&rods, 0.2);
        push[i] = push_at(&rods, middle_of_bend(&rods, 90));
        two_rods_free(&rods);
    }
    print_message("links of 1, 0.5, 0.25 mm: lost motion at 0.2 N %.5f, %.5f, %.5f mm; push %.5f, %.5f, %.5f N\n", lost[0], lost[1], lost[2], push[0], push[1],
                  push[2]);
    assert_true(fabs(lost[2] / lost[1] - 1) < 0.01 && fabs(push[2] / push[1] - 1) < 0.02);
}

// --- the study ---
// Up to 0.5 N: with more compression the wire buckles in the straight part into many shapes of nearly the same energy.

typedef struct Tip {
    double x, y, angle, exit;
} Tip;

static Tip tip_of(TwoRods *rods)
{
    Tip tip;
    solve(rods);
    two_rods_tip(rods, &tip.x, &tip.y, &tip.angle, &tip.exit);
    return tip;
}

static void what_one_line_gives_up(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();       // the others are the same computations
    static const double clearance[] = {0.02, 0.05, 0.1, 0.2};
    const double degree = 180 / PI_, force = 0.2;
    for (int is_held = 1; is_held >= 0; is_held--) {
        print_message("\ncatheter EI 60, %s; wire EI 20; R 20 mm, 40 mm straight before the bend, 2 mm after it\n"
                      "theta     c   2 c theta | lost motion, part of 2 c theta, at 0.05, 0.2, 0.5 N | tip: mm, degrees | exit, degrees: rest, pushed, drawn | "
                      "push, N: one line, two rods\n",
                      is_held ? "held by the vessel" : "free from its hub on");
        for (double degrees = 90; degrees < 200; degrees += 90)
            for (int n = 0; n < 4; n++) {
                double c = clearance[n], exact = 2 * c * degrees * PI_ / 180;
                TwoRods one = bend(degrees, 0, 60, is_held), two = bend(degrees, c, 60, is_held);
                Tip shared = tip_of(&one), rest = tip_of(&two);
                double lost[3] = {lost_motion(&two, 0.05), lost_motion(&two, 0.2), lost_motion(&two, 0.5)};
                two.pressed = force;
                double pushed = tip_of(&two).exit;
                two.pressed = -force;
                double drawn = tip_of(&two).exit;
                two.pressed = 0;
                int middle = middle_of_bend(&two, degrees);
                double push[2] = {push_at(&one, middle), push_at(&two, middle)};
                print_message("%5.0f  %.2f   %.4f mm |  %.3f  %.3f  %.3f | %.4f  %+.3f | %+.3f  %+.3f  %+.3f | %.5f  %.5f (%+.1f %%)\n", degrees, c, exact,
                              lost[0] / exact, lost[1] / exact, lost[2] / exact, hypot(rest.x - shared.x, rest.y - shared.y),
                              (rest.angle - shared.angle) * degree, rest.exit * degree, pushed * degree, drawn * degree, push[0], push[1],
                              100 * (push[1] / push[0] - 1));
                assert_true(lost[0] > 0 && lost[0] <= lost[1] && lost[1] <= lost[2] && lost[2] < 1.2 * exact);
                two_rods_free(&one);
                two_rods_free(&two);
            }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_gradient_is_the_energy_s),
        cmocka_unit_test(one_line_pushes_as_the_closed_forms),
        cmocka_unit_test(lost_motion_is_two_c_theta_but_for_the_ends),
        cmocka_unit_test(finer_links_change_little),
        cmocka_unit_test(what_one_line_gives_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
