// Sobol's sequence: its first points, and the property that defines its evenness: of each aligned block of 2^m points, each of the 2^m equal intervals of each
// axis holds one. Two axes together are even too: the sequence's t is 0 in its first two dimensions.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "study/sobol.h"

#include <math.h>
#include <string.h>

// From Bratley and Fox 1988 and Joe and Kuo 2008: points 1 to 7 in dimensions 1 to 3, in the order of Gray's code.
static void first_points_are_as_published(void **state)
{
    (void)state;
    static const double point[8][3] = {{0, 0, 0},
                                       {0.5, 0.5, 0.5},
                                       {0.75, 0.25, 0.25},
                                       {0.25, 0.75, 0.75},
                                       {0.375, 0.375, 0.625},
                                       {0.875, 0.875, 0.125},
                                       {0.625, 0.125, 0.875},
                                       {0.125, 0.625, 0.375}};
    for (uint32_t n = 0; n < 8; n++)
        for (int d = 0; d < 3; d++)
            assert_true(sobol_digits(n, d) == (uint32_t)(point[n][d] * 0x1p32));
    assert_true(sobol_unit(0, 0, 0) == 0x1p-33);
    assert_true(sobol_unit(1, 0, UINT32_C(1) << 31) == 0x1p-33);
}

static void each_axis_is_even(void **state)
{
    (void)state;
    enum { M = 10, POINTS = 1 << M };
    static unsigned char seen[POINTS];
    for (int d = 0; d < SOBOL_DIMENSIONS; d++)
        for (uint32_t block = 0; block < 3; block++)
            for (int m = 0; m <= M; m++) {
                memset(seen, 0, sizeof seen);
                for (uint32_t n = 0; n < UINT32_C(1) << m; n++) {
                    uint32_t at = m ? (sobol_digits((block << m) + n, d) ^ 0x9e3779b9u) >> (32 - m) : 0;
                    if (seen[at]++)
                        fail_msg("dimension %d, block %u of 2^%d points: two in interval %u", d + 1, block, m, at);
                }
            }
}

static void two_axes_are_even(void **state)
{
    (void)state;
    enum { M = 10, POINTS = 1 << M };
    static unsigned char seen[POINTS];
    for (int a = 0; a <= M; a++) {
        memset(seen, 0, sizeof seen);
        for (uint32_t n = 0; n < POINTS; n++) {
            uint32_t x = a ? sobol_digits(n, 0) >> (32 - a) : 0, y = a < M ? sobol_digits(n, 1) >> (32 - M + a) : 0;
            if (seen[x << (M - a) | y]++)
                fail_msg("2^%d by 2^%d intervals: two points in one", a, M - a);
        }
    }
}

// Dimensions are different sequences, and products of two have the mean of independent ones: 1,024 points come within 1e-3 of 1/4, where random ones miss it by
// 7e-3 (one standard deviation).
static void dimensions_are_independent(void **state)
{
    (void)state;
    enum { POINTS = 1024 };
    for (int a = 0; a < SOBOL_DIMENSIONS; a++)
        for (int b = 0; b < a; b++) {
            double sum = 0;
            for (uint32_t n = 0; n < POINTS; n++)
                sum += sobol_unit(n, a, 0) * sobol_unit(n, b, 0);
            if (fabs(sum / POINTS - 0.25) > 1e-3)
                fail_msg("dimensions %d and %d: the mean of products is %g", a + 1, b + 1, sum / POINTS);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(first_points_are_as_published), cmocka_unit_test(each_axis_is_even),
                                       cmocka_unit_test(two_axes_are_even), cmocka_unit_test(dimensions_are_independent)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
