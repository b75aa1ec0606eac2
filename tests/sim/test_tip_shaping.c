// The exact moment of a round section that yields, compared with its stresses summed over the section; the remaining curvature of a shaped tip, compared with
// the same sum after springback.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/tip_shaping.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// [N mm] sum of stress times lever over a round section in strips of equal angle, which resolve the ends; E = 1, yield strain 1, r = 1.
static double summed_moment(double curvature)
{
    enum { STRIPS = 200000 };
    double sum = 0;
    for (int i = 0; i < STRIPS; i++) {
        double angle = -PI / 2 + PI * (i + 0.5) / STRIPS, y = sin(angle), width = 2 * cos(angle);
        double stress = fmax(-1, fmin(1, curvature * y));
        sum += stress * y * width * cos(angle) * PI / STRIPS;
    }
    return sum;
}

static void the_moment_is_that_of_the_stresses(void **state)
{
    (void)state;
    const double at[] = {0.2, 0.999, 1, 1.001, 1.1, 1.5, 2, 5, 20, 99, 101, 1000};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++)
        assert_true(fabs(tip_core_moment(at[i]) - summed_moment(at[i]) / (PI / 4)) < 1e-6);   // strips across the yield border: 3e-8
    assert_true(fabs(tip_core_moment(1e6) - 16 / (3 * PI)) < 1e-9);
    for (double k = 0; k < 3; k += 0.01)
        assert_true(tip_core_moment(k + 0.01) > tip_core_moment(k));
}

static void a_core_springs_back_by_the_moment_it_was_held_with(void **state)
{
    (void)state;
    const double diameter = 0.1, yield = tip_yield_strain / (diameter / 2);
    assert_true(tip_kept_curvature(0.99 * yield, diameter) == 0);
    assert_true(tip_kept_curvature(1.01 * yield, diameter) > 0);
    for (double k = 1.2; k < 40; k *= 1.5)
        assert_true(fabs(tip_kept_curvature(k * yield, diameter) - yield * (k - summed_moment(k) / (PI / 4))) < 1e-6 * yield);
    assert_true(tip_kept_curvature(0.5, 2 * diameter) > tip_kept_curvature(0.5, diameter));    // a thick core keeps more
}

static WireSection piece(double length, double diameter, double gpa)
{
    return (WireSection){.length = length, .diameter = diameter, .young_modulus = 1000 * gpa, .poisson_ratio = 0.3, .density = 0.0079, .friction = -1};
}

static void a_core_is_as_stiff_as_its_section(void **state)
{
    (void)state;
    const WireSection solid = piece(10, 0.3, 193), coil = piece(10, 0.3556, 0.637);
    assert_true(fabs(tip_core_diameter(&solid) - 0.3) < 1e-12);
    double core = tip_core_diameter(&coil);
    assert_true(fabs(193000 * PI / 64 * pow(core, 4) - wire_stiffness(&coil).bending) < 1e-12 && core < 0.1);
}

static double sum_of_angles(const WireSection *section, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += section[i].length * section[i].rest_curvature;
    return sum;
}

static double sum_of_lengths(const WireSection *section, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += section[i].length;
    return sum;
}

static void the_tip_keeps_the_angle_at_its_place(void **state)
{
    (void)state;
    const WireSection wire[] = {piece(100, 0.3556, 5.096), piece(20, 0.3556, 0.637)};
    const TipShaping shaping = {.length = 5, .angle = 0.75, .mandrel = 1};
    TipShaped shaped;
    char why[256] = "";
    int count;
    WireSection *out = tip_shaped_sections(wire, 2, &shaping, &count, &shaped, why, sizeof why);
    assert_non_null(out);
    assert_int_equal(count, 4);                  // shaft, straight, bend, straight
    assert_true(fabs(sum_of_lengths(out, count) - 120) < 1e-12 && fabs(sum_of_angles(out, count) - 0.75) < 1e-12);
    assert_true(out[1].length == 15 && out[1].rest_curvature == 0 && out[3].rest_curvature == 0);
    assert_true(fabs(out[2].length - shaped.arc) < 1e-12 && fabs(1 / out[2].rest_curvature - shaped.rest_radius) < 1e-12);
    // while held, it was bent around the mandrel: more than the remaining bend
    assert_true(fabs(shaped.bent_angle - shaped.arc / (1 + 0.3556 / 2)) < 1e-12 && shaped.bent_angle > 0.75);
    assert_true(out[2].young_modulus == wire[1].young_modulus && out[2].diameter == wire[1].diameter);
    free(out);
    // a bend over a border of two cores
    const TipShaping both = {.length = 22, .angle = 3, .mandrel = 2};
    out = tip_shaped_sections(wire, 2, &both, &count, &shaped, why, sizeof why);
    assert_non_null(out);
    assert_true(fabs(sum_of_lengths(out, count) - 120) < 1e-12 && fabs(sum_of_angles(out, count) - 3) < 1e-12);
    assert_true(out[0].length == 98 && out[1].length == 2 && out[1].rest_curvature > out[2].rest_curvature && out[2].rest_curvature > 0);
    free(out);
}

static void bends_before_are_pressed_straight(void **state)
{
    (void)state;
    WireSection wire[] = {piece(50, 0.889, 9.5), piece(10, 0.889, 1.957)};
    wire[0].rest_curvature = 0.01;
    wire[1].rest_curvature = 0.3;
    wire[1].rest_plane = 1;
    const TipShaping shaping = {.length = 12, .angle = 1, .mandrel = 2};
    TipShaped shaped;
    char why[256];
    int count;
    WireSection *out = tip_shaped_sections(wire, 2, &shaping, &count, &shaped, why, sizeof why);
    assert_non_null(out);
    assert_true(fabs(sum_of_angles(out, count) - (1 + 48 * 0.01)) < 1e-12);
    assert_true(out[0].rest_curvature == 0.01 && out[0].length == 48 && out[count - 1].rest_plane == 0);
    free(out);
}

static void what_a_wire_does_not_keep_is_reported(void **state)
{
    (void)state;
    const WireSection wire = piece(20, 0.3556, 0.637);
    const struct {
        TipShaping shaping;
        const char *why;
    } cases[] = {{{21, 1, 1}, "the wire is 20 mm long"},
                 {{5, 1, 20}, "does not make the core yield"},
                 {{1, 3, 1}, "a longer tip, a smaller angle or a thinner mandrel"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        TipShaped shaped;
        char why[256] = "";
        int count;
        assert_null(tip_shaped_sections(&wire, 1, &cases[i].shaping, &count, &shaped, why, sizeof why));
        assert_non_null(strstr(why, cases[i].why));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_moment_is_that_of_the_stresses), cmocka_unit_test(a_core_springs_back_by_the_moment_it_was_held_with),
        cmocka_unit_test(a_core_is_as_stiff_as_its_section),  cmocka_unit_test(the_tip_keeps_the_angle_at_its_place),
        cmocka_unit_test(bends_before_are_pressed_straight),  cmocka_unit_test(what_a_wire_does_not_keep_is_reported)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
