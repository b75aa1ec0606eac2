// The similarity through points: exact for exact ones, the least sum of squares for others, refused where it is not determined.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "geom/similarity.h"
#include "near.h"
#include "random_numbers.h"

static Vec3 random_point(uint64_t *seed, double size) { return vec3(random_in(seed, -size, size), random_in(seed, -size, size), random_in(seed, -size, size)); }

static Similarity random_similarity(uint64_t *seed)
{
    Quat turn = quat_from_rotation_vector(random_point(seed, 3));
    return (Similarity){.turn = quat_to_mat3(turn), .scale = random_in(seed, 0.3, 3), .shift = random_point(seed, 500)};
}

static double farthest_apart(const Similarity *a, const Similarity *b)
{
    double most = 0;
    for (int k = 0; k < 8; k++) {
        Vec3 x = vec3(k & 1 ? 100 : -100, k & 2 ? 100 : -100, k & 4 ? 100 : -100);
        most = fmax(most, vec3_distance(similarity_of(a, x), similarity_of(b, x)));
    }
    return most;
}

static void exact_points_give_the_exact_similarity(void **state)
{
    (void)state;
    uint64_t seed = 5;
    for (int round = 0; round < 200; round++) {
        Similarity true_one = random_similarity(&seed), found;
        Vec3 from[9], to[9];
        for (int i = 0; i < 9; i++) {
            from[i] = random_point(&seed, 60);
            to[i] = similarity_of(&true_one, from[i]);
        }
        for (int count = 3; count <= 9; count++) {
            assert_true(similarity_fit(count, from, to, NULL, &found));
            assert_near(farthest_apart(&found, &true_one), 0, 1e-8);      // condition of three points that are almost on a line: up to 1e3 x 500 x 1e-16
        }
        // with a known turn two points are enough, and one for the shift
        assert_true(similarity_fit(2, from, to, &true_one.turn, &found));
        assert_near(farthest_apart(&found, &true_one), 0, 1e-9);
        assert_true(similarity_fit(1, from, to, &true_one.turn, &found));
        assert_near(found.scale, 1, 0);
        assert_near(vec3_distance(similarity_of(&found, from[0]), to[0]), 0, 1e-10);
    }
}

static double squares(const Similarity *s, int count, const Vec3 *from, const Vec3 *to)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += vec3_norm2(vec3_sub(similarity_of(s, from[i]), to[i]));
    return sum;
}

static void no_neighbour_fits_better(void **state)
{
    (void)state;
    uint64_t seed = 6;
    for (int round = 0; round < 50; round++) {
        Similarity true_one = random_similarity(&seed), found;
        Vec3 from[6], to[6];
        for (int i = 0; i < 6; i++) {
            from[i] = random_point(&seed, 60);
            to[i] = vec3_add(similarity_of(&true_one, from[i]), random_point(&seed, 5));
        }
        assert_true(similarity_fit(6, from, to, NULL, &found));
        double least = squares(&found, 6, from, to);
        for (int k = 0; k < 100; k++) {
            Similarity near = found;
            Mat3 turn = quat_to_mat3(quat_from_rotation_vector(random_point(&seed, 1e-2)));
            near.turn = mat3_mul(&turn, &found.turn);
            near.scale *= 1 + random_in(&seed, -1e-2, 1e-2);
            near.shift = vec3_add(near.shift, random_point(&seed, 0.5));
            assert_true(squares(&near, 6, from, to) > least);
        }
        // mirrored points get the best rotation, never a mirror
        for (int i = 0; i < 6; i++)
            to[i].x = -to[i].x;
        assert_true(similarity_fit(6, from, to, NULL, &found));
        Vec3 x = mat3_column(&found.turn, 0), y = mat3_column(&found.turn, 1), z = mat3_column(&found.turn, 2);
        assert_near(vec3_dot(vec3_cross(x, y), z), 1, 1e-12);
    }
}

static void open_fits_are_refused(void **state)
{
    (void)state;
    const Vec3 line[3] = {{1, 2, 3}, {2, 4, 6}, {5, 10, 15}}, plane[3] = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
    const Vec3 back[2] = {{10, 0, 0}, {0, 0, 0}};
    const Mat3 upright = mat3_identity();
    Similarity fit = {.scale = 77};
    assert_false(similarity_fit(3, line, plane, NULL, &fit));
    assert_false(similarity_fit(3, plane, line, NULL, &fit));
    assert_false(similarity_fit(2, plane, plane, NULL, &fit));
    assert_false(similarity_fit(0, plane, plane, &upright, &fit));
    assert_false(similarity_fit(2, plane, back, &upright, &fit));       // the scale would be negative
    assert_near(fit.scale, 77, 0);
    assert_true(similarity_fit(3, line, line, &upright, &fit));
    assert_near(fit.scale, 1, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_points_give_the_exact_similarity),
        cmocka_unit_test(no_neighbour_fits_better),
        cmocka_unit_test(open_fits_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
