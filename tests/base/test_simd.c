// One choice of the instruction set for all kernels: by environment, by force, by number; each set gives the same bits. (These have their own test of each set:
// test_block_chain, test_beam_element, test_coaxial, test_lim_vessel, test_field_vessel, test_mesh_vessel, test_bspline, test_lim_energy, test_field_fit. This
// file tests the others.)
#include "base/simd_kernel.h"
#include "recon/track/ransac_cylinder.h"
#include "solver/node_turn.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define KERNEL_TEXT "tests/base/simd_sums.inc"
#include "base/each_simd.inc"
static int (*const width_on[SIMD_COUNT])(void) = SIMD_FORMS(width);
static void (*const sums_on[SIMD_COUNT])(const double *, const double *, int, double *) = SIMD_FORMS(sums);

// Must be the first test: the variable is read once.
static void the_environment_chooses(void **state)
{
    (void)state;
    setenv("SELDINGER_SIMD", "sse2", 1);
    assert_int_equal(simd_level(), SIMD_SSE2);
    assert_int_equal(simd_choose(0), SIMD_SSE2);
}

static void no_set_is_chosen_without_support_by_the_processor(void **state)
{
    (void)state;
    for (int number = 1; number <= SIMD_COUNT; number++) {
        int set = number - 1, expected = set < (int)simd_widest() ? set : (int)simd_widest();
        assert_int_equal(simd_choose(number), expected);
        simd_force((SimdLevel)set);
        assert_int_equal(simd_level(), expected);
        assert_int_equal(simd_choose(0), expected);
    }
}

static void a_text_is_compiled_for_each_set(void **state)
{
    (void)state;
    double a[101], b[101], first[101];
    for (int i = 0; i < 101; i++)
        a[i] = sin(i), b[i] = cos(3 * i);
    for (int set = 0; set <= (int)simd_widest(); set++) {
        double sum[101] = {0};
        assert_int_equal(width_on[set](), SIMD_HAS_AVX ? 2 << set : 2);
        for (int k = 0; k < 3; k++)
            sums_on[set](a, b, 101, sum);
        if (set == 0)
            memcpy(first, sum, sizeof sum);
        assert_memory_equal(sum, first, sizeof sum);
    }
}

enum { TURNS = 37 };

// For a rotation about one axis the result is known: (cos(a/2), n sin(a/2)).
static void nodes_turn_by_the_same_bits(void **state)
{
    (void)state;
    double r[3][TURNS];
    Quat first[TURNS];
    const Vec3 n = vec3_unit(vec3(1, -2, 0.5));
    for (int set = 0; set <= (int)simd_widest(); set++) {
        Quat q[TURNS];
        for (int i = 0; i < TURNS; i++) {
            double angle = NODE_TURN_MAX * (i - TURNS / 2) / (TURNS / 2);
            r[0][i] = angle * n.x, r[1][i] = angle * n.y, r[2][i] = angle * n.z;
            q[i] = (Quat){1, 0, 0, 0};
        }
        simd_force((SimdLevel)set);
        node_turn(TURNS, r[0], r[1], r[2], q);
        if (set == 0)
            memcpy(first, q, sizeof q);
        assert_memory_equal(q, first, sizeof q);
        for (int i = 0; i < TURNS; i++) {
            double half = 0.5 * NODE_TURN_MAX * (i - TURNS / 2) / (TURNS / 2), s = sin(half);
            double off = fabs(q[i].w - cos(half)) + fabs(q[i].x - s * n.x) + fabs(q[i].y - s * n.y) + fabs(q[i].z - s * n.z);
            assert_true(off < 4e-15);     // roundings of four components
        }
    }
}

static void circles_are_found_by_the_same_bits(void **state)
{
    (void)state;
    enum { POINTS = 150 };
    Vec3 point[POINTS];
    Random random = random_from_seed(7, 1);
    for (int i = 0; i < POINTS; i++) {
        double angle = random_unit(&random) * 2 * PI, radius = i % 3 ? 2 + 0.05 * random_unit(&random) : 4 * random_unit(&random);
        point[i] = vec3(radius * cos(angle), radius * sin(angle), random_unit(&random));
    }
    Cylinder first = {.radius = 0};
    double first_share = 0;
    const RansacOptions options = {
        .trials_min = 200, .trials_max = 500, .inlier_rate = 0.9, .threshold = 0.05, .radius_min = 0.5, .radius_max = 5, .offset_max = 3};
    for (int set = 0; set <= (int)simd_widest(); set++) {
        Cylinder found = {.radius = 0};
        Random drawn = random_from_seed(9, 2);
        simd_force((SimdLevel)set);
        double share = ransac_circle(point, POINTS, vec3(0, 0, 0), vec3(0, 0, 1), &options, &drawn, &found);
        assert_true(fabs(found.radius - 2.025) < 0.05);
        if (set == 0)
            first = found, first_share = share;
        assert_memory_equal(&found.center, &first.center, sizeof first.center);
        assert_true(found.radius == first.radius && share == first_share);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_environment_chooses), cmocka_unit_test(no_set_is_chosen_without_support_by_the_processor),
                                       cmocka_unit_test(a_text_is_compiled_for_each_set), cmocka_unit_test(nodes_turn_by_the_same_bits),
                                       cmocka_unit_test(circles_are_found_by_the_same_bits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
