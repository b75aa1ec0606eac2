// Cubic B-spline approximation: against a plain reference in double precision, and the laws that it must obey (it reproduces straight lines and smooths by
// 1/sqrt(3) voxel).
#include "base/simd.h"
#include "recon/track/ransac_cylinder.h"
#include "recon/volume/bspline.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static double basis(double x)
{
    x = fabs(x);
    return x < 1 ? 2.0 / 3 - x * x + x * x * x / 2 : x < 2 ? (2 - x) * (2 - x) * (2 - x) / 6 : 0;
}

// Sums every voxel's contribution, and the background's for voxels outside the grid.
static double reference(const Volume *v, Vec3 x)
{
    double sum = 0;
    for (int k = (int)floor(x.z) - 3; k <= (int)floor(x.z) + 3; k++)
        for (int j = (int)floor(x.y) - 3; j <= (int)floor(x.y) + 3; j++)
            for (int i = (int)floor(x.x) - 3; i <= (int)floor(x.x) + 3; i++) {
                bool inside = i >= 0 && j >= 0 && k >= 0 && i < v->size[0] && j < v->size[1] && k < v->size[2];
                double value = inside ? (double)v->value[(k * v->size[1] + j) * v->size[0] + i] : (double)v->minimum;
                sum += value * basis(x.x - i) * basis(x.y - j) * basis(x.z - k);
            }
    return sum;
}

static Volume *volume_of(double (*value)(int i, int j, int k))
{
    Volume *v = volume_create((int[3]){9, 8, 7}, vec3(0, 0, 0), (Vec3[3]){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    assert_non_null(v);
    v->minimum = 1e30f;
    for (int n = 0; n < 9 * 8 * 7; n++) {
        v->value[n] = (float)value(n % 9, n / 9 % 8, n / 72);
        v->minimum = v->value[n] < v->minimum ? v->value[n] : v->minimum;
    }
    return v;
}

static double noise(int i, int j, int k)
{
    Random random = random_from_seed((uint64_t)(i + 10 * j + 100 * k), 0);
    return random_unit(&random) - 0.3;
}
static double plane(int i, int j, int k) { return 3 + 0.5 * i - 0.25 * j + 2 * k; }
static double spike(int i, int j, int k) { return i == 4 && j == 4 && k == 3; }

static void equals_the_reference(void **state)
{
    (void)state;
    Volume *v = volume_of(noise);
    Random random = random_from_seed(1, 0);
    for (int n = 0; n < 20000; n++) {
        Vec3 x = {16 * random_unit(&random) - 4, 15 * random_unit(&random) - 4, 14 * random_unit(&random) - 4};
        assert_true(fabs((double)bspline_sample(v, x) - reference(v, x)) < 2e-6);   // 64 float products of numbers below 1
    }
    // far away, and for NaN: the background
    assert_true(bspline_sample(v, vec3(1e12, 0, 0)) == v->minimum && bspline_sample(v, vec3(0, -1e300, 0)) == v->minimum);
    assert_true(bspline_sample(v, vec3(NAN, 0, 0)) == v->minimum);
    volume_free(v);
}

static void reproduces_planes(void **state)
{
    (void)state;
    Volume *v = volume_of(plane);
    for (int n = 0; n < 100; n++) {
        Vec3 x = {1 + 0.06 * n, 1 + 0.049 * n, 1 + 0.039 * n};
        assert_true(fabs((double)bspline_sample(v, x) - (3 + 0.5 * x.x - 0.25 * x.y + 2 * x.z)) < 1e-5);
    }
    volume_free(v);
}

// The second moment of the response to one voxel is 1/3: the blur of docs/references.md, 0.1155 mm at 0.2 mm.
static void smooths_by_a_known_width(void **state)
{
    (void)state;
    Volume *v = volume_of(spike);
    double sum = 0, second = 0;
    for (int n = -400; n <= 400; n++) {
        double x = n * 0.005, value = (double)bspline_sample(v, vec3(4 + x, 4, 3));
        sum += value;
        second += value * x * x;
    }
    assert_true(fabs(sqrt(second / sum) - 1 / sqrt(3.0)) < 1e-4);
    volume_free(v);
}

// A line's samples have the same bits as single samples: inside, across the border or outside, of any length, on any instruction set.
static void lines_are_samples(void **state)
{
    (void)state;
    Volume *v = volume_of(noise);
    Random random = random_from_seed(2, 0);
    for (int level = 0; level < SIMD_COUNT; level++) {
        simd_force((SimdLevel)level);
        for (int n = 0; n < 600; n++) {
            float line[70];
            int count = n % 70 + 1;
            double pace = n % 3 ? 0.1 : 0.7;
            Vec3 start = {12 * random_unit(&random) - 2, 11 * random_unit(&random) - 2, 10 * random_unit(&random) - 2};
            Vec3 step = {pace * (random_unit(&random) - 0.5), pace * (random_unit(&random) - 0.5), pace * (random_unit(&random) - 0.5)};
            if (n % 50 == 0)
                start.x = n % 100 ? -1e15 : NAN;
            line[count % 70] = -7;
            bspline_sample_line(v, start, step, count, line);
            for (int i = 0; i < count; i++)
                assert_true(line[i] == bspline_sample(v, vec3(start.x + i * step.x, start.y + i * step.y, start.z + i * step.z)));
            assert_true(count == 70 || line[count] == -7);   // nothing is written after the end
        }
    }
    simd_force(simd_widest());
    volume_free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(equals_the_reference), cmocka_unit_test(reproduces_planes), cmocka_unit_test(smooths_by_a_known_width),
                                       cmocka_unit_test(lines_are_samples)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
