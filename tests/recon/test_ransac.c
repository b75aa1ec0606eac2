// The parts of an estimation step: directions on the sphere, random numbers, RANSAC circles with outliers, least squares (Gauss-Newton against Powell's
// method), spheres.
#include "recon/track/cast_rays.h"
#include "recon/track/ransac_cylinder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>

static void directions_are_even(void **state)
{
    (void)state;
    static Vec3 d[2562];
    static const int counts[5] = {12, 42, 162, 642, 2562};
    for (int level = 0; level <= 4; level++) {
        int n = sphere_direction_count(level);
        assert_int_equal(n, counts[level]);
        assert_int_equal(sphere_level_of(n), level);
        sphere_directions(level, d);
        Vec3 sum = {0, 0, 0};
        double closest = 4, spread = 0;
        for (int i = 0; i < n; i++) {
            assert_true(fabs(vec3_norm(d[i]) - 1) < 1e-12);
            sum = vec3_add(sum, d[i]);
            double nearest = 4;
            bool opposite = false;
            for (int k = 0; k < n; k++) {
                if (k != i)
                    nearest = fmin(nearest, vec3_distance(d[i], d[k]));
                opposite = opposite || vec3_norm(vec3_add(d[i], d[k])) < 1e-9;
            }
            assert_true(opposite);   // half of them are axes
            closest = fmin(closest, nearest);
            spread = fmax(spread, nearest);
        }
        assert_true(vec3_norm(sum) < 1e-9);
        assert_true(spread < 1.3 * closest);
    }
    assert_int_equal(sphere_level_of(100), -1);
}

static void random_numbers_repeat_and_differ(void **state)
{
    (void)state;
    Random a = random_from_seed(5, 1), b = random_from_seed(5, 1), c = random_from_seed(5, 2), d = random_from_seed(6, 1);
    int same = 0, bin[10] = {0};
    for (int i = 0; i < 10000; i++) {
        uint64_t x = random_next(&a);
        assert_true(x == random_next(&b));
        same += x == random_next(&c);
        same += x == random_next(&d);
        bin[random_index(&a, 10)]++;
        random_next(&b);
    }
    assert_int_equal(same, 0);
    for (int i = 0; i < 10; i++)
        assert_true(abs(bin[i] - 1000) < 5 * 30);   // five standard deviations of a binomial
}

// Creates points on a cylinder with normal noise, then outliers in a box around it.
static int make_points(Random *random, const Cylinder *c, int inliers, int outliers, double noise, Vec3 *point)
{
    Vec3 e1 = vec3_normal_to(c->axis), e2 = vec3_cross(c->axis, e1);
    for (int i = 0; i < inliers; i++) {
        double a = 2 * PI * random_unit(random), g = 0;
        for (int k = 0; k < 12; k++)
            g += random_unit(random) - 0.5;
        double r = c->radius + noise * g;
        point[i] = vec3_add_scaled(c->center, c->height * (random_unit(random) - 0.5), c->axis);
        point[i] = vec3_add_scaled(vec3_add_scaled(point[i], r * cos(a), e1), r * sin(a), e2);
    }
    for (int i = 0; i < outliers; i++)
        point[inliers + i] = vec3_add(c->center, vec3(6 * random_unit(random) - 3, 6 * random_unit(random) - 3, 6 * random_unit(random) - 3));
    return inliers + outliers;
}

static void finds_the_circle_among_outliers(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 20; seed++) {
        Random random = random_from_seed(seed, 0);
        Vec3 point[162];
        Cylinder truth = {{1, 2, 3}, 1.1, vec3_unit(vec3(0.2, -0.5, 1)), 2}, found;
        int n = make_points(&random, &truth, 90, 72, 0.02, point);
        RansacOptions options = {0.1, 0.5, 1.5, 1.5, 0.9, 220, 500};
        Vec3 origin = vec3_add(truth.center, vec3(0.3, 0.2, -0.1));
        double rate = ransac_circle(point, n, origin, truth.axis, &options, &random, &found);
        int inlier[162], inliers = cylinder_inliers(&found, point, n, 0.1, inlier);
        assert_true(fabs(rate - (double)inliers / n) < 2.5 / n);   // the float and double tests may differ at the edge of the ring
        assert_true(rate > 90.0 / 162 * 0.95);
        bool good;
        for (int i = 0; i < 3; i++) {
            cylinder_refine(&found, point, inlier, inliers, false, &good);
            assert_true(good);
            inliers = cylinder_inliers(&found, point, n, 0.1, inlier);
        }
        Vec3 off = vec3_sub(found.center, truth.center);
        // 90 points of 0.02 mm and some outliers that lie near the wall by chance
        assert_true(vec3_norm(vec3_add_scaled(off, -vec3_dot(off, truth.axis), truth.axis)) < 0.03);
        assert_true(fabs(found.radius - truth.radius) < 0.02);
        assert_true(fabs(vec3_dot(found.axis, truth.axis)) > cos(0.06));
    }
}

static void nothing_is_found_in_nothing(void **state)
{
    (void)state;
    Random random = random_from_seed(1, 1);
    RansacOptions options = {0.1, 0.5, 1.5, 1.5, 0.9, 220, 500};
    Cylinder found;
    Vec3 line[50];
    for (int i = 0; i < 50; i++)
        line[i] = vec3(0.1 * i, 0.05 * i, 0);
    assert_true(ransac_circle(line, 50, vec3(0, 0, 0), vec3(0, 0, 1), &options, &random, &found) <= 2.0 / 50 + 1e-12 ||
                found.radius >= 0.5);   // points on a line define no circle
    assert_true(ransac_circle(line, 2, vec3(0, 0, 0), vec3(0, 0, 1), &options, &random, &found) <= 0);
}

// Both methods reach the same minimum from the same start: our fast one and the paper's.
static void gauss_newton_equals_powell(void **state)
{
    (void)state;
    if (!cylinder_refine_has_powell())
        skip();
    for (uint64_t seed = 1; seed <= 10; seed++) {
        Random random = random_from_seed(seed, 3);
        Vec3 point[120];
        int inlier[120];
        bool good;
        Cylinder truth = {{-1, 0, 2}, 0.8, vec3_unit(vec3(1, 0.3, -0.4)), 2}, a, b;
        int n = make_points(&random, &truth, 120, 0, 0.03, point);
        for (int i = 0; i < n; i++)
            inlier[i] = i;
        a = truth;
        a.center = vec3_add(a.center, vec3(0.02, 0.1, -0.05));
        a.axis = vec3_unit(vec3_add(a.axis, vec3(0, 0.1, 0.08)));
        a.radius *= 0.9;
        b = a;
        double ea = cylinder_refine(&a, point, inlier, n, false, &good), eb = cylinder_refine(&b, point, inlier, n, true, &good);
        assert_true(good && ea <= eb * (1 + 1e-6));
        assert_true(eb < ea * 1.0001);
        assert_true(fabs(a.radius - b.radius) < 1e-4 && vec3_dot(a.axis, b.axis) > 1 - 1e-6);
    }
}

static void exact_points_are_fitted_exactly(void **state)
{
    (void)state;
    Random random = random_from_seed(9, 0);
    Vec3 point[100], center;
    int inlier[100];
    bool good;
    double radius;
    Cylinder truth = {{5, -3, 1}, 1.7, vec3_unit(vec3(0.1, 1, 0.2)), 4}, c = {{5.2, -3, 1.1}, 1.5, {0, 1, 0}, 4};
    int n = make_points(&random, &truth, 100, 0, 0, point);
    for (int i = 0; i < n; i++)
        inlier[i] = i;
    assert_true(cylinder_refine(&c, point, inlier, n, false, &good) < 1e-8);
    assert_true(good && fabs(c.radius - 1.7) < 1e-7 && vec3_norm(vec3_cross(c.axis, truth.axis)) < 1e-7);
    // a cap of a sphere, a third of it
    for (int i = 0; i < 60; i++) {
        double z = 1 - random_unit(&random) * 2 / 3, a = 2 * PI * random_unit(&random), s = sqrt(1 - z * z);
        point[i] = vec3_add_scaled(vec3(4, 5, 6), 2.5, vec3(s * cos(a), s * sin(a), z));
    }
    assert_true(sphere_fit(point, 60, &center, &radius));
    assert_true(vec3_distance(center, vec3(4, 5, 6)) < 1e-6 && fabs(radius - 2.5) < 1e-6);
    assert_false(sphere_fit(point, 3, &center, &radius));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_are_even),         cmocka_unit_test(random_numbers_repeat_and_differ), cmocka_unit_test(finds_the_circle_among_outliers),
        cmocka_unit_test(nothing_is_found_in_nothing), cmocka_unit_test(gauss_newton_equals_powell),       cmocka_unit_test(exact_points_are_fitted_exactly)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
