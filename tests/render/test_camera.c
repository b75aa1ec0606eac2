// The parallel projection without GL: axes, framing, and the view direction for a tree.
#include "render/camera.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static uint32_t random_state;
static double draw_unit(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (double)(random_state >> 8) / (double)(1u << 24);
}
static Vec3 random_vector(void)
{
    double x = draw_unit(), y = draw_unit(), z = draw_unit();
    return vec3(2 * x - 1, 2 * y - 1, 2 * z - 1);
}

static void assert_near(double a, double b, double tolerance)
{
    if (!(fabs(a - b) <= tolerance))
        fail_msg("%.12g differs from %.12g by more than %g", a, b, tolerance);
}

static void principal_axes_diagonalise(void **state)
{
    (void)state;
    random_state = 1;
    for (int round = 0; round < 200; round++) {
        // a known spectrum, rotated at random
        double value[3], known[3] = {draw_unit(), 1 + draw_unit(), 3 + draw_unit()};
        Quat q = quat_from_rotation_vector(vec3_scale(random_vector(), 3));
        Sym3 a = {0};
        for (int k = 0; k < 3; k++) {
            Vec3 v = quat_rotate(q, vec3(k == 0, k == 1, k == 2));
            a.xx += known[k] * v.x * v.x, a.xy += known[k] * v.x * v.y, a.xz += known[k] * v.x * v.z;
            a.yy += known[k] * v.y * v.y, a.yz += known[k] * v.y * v.z, a.zz += known[k] * v.z * v.z;
        }
        Vec3 axis[3];
        camera_principal_axes(&a, value, axis);
        for (int k = 0; k < 3; k++) {
            assert_near(value[k], known[k], 1e-12);
            assert_near(vec3_norm(vec3_add_scaled(sym3_mul_vec(&a, axis[k]), -value[k], axis[k])), 0, 1e-11);
        }
    }
}

static void axes_are_a_right_handed_frame(void **state)
{
    (void)state;
    random_state = 2;
    const Vec3 none = {0, 0, 0};
    Vec3 point[50];
    for (int i = 0; i < 50; i++)
        point[i] = random_vector();
    for (int round = 0; round < 200; round++) {
        Camera camera = {0};
        Vec3 view = round % 4 == 0 ? none : random_vector(), up = round % 3 == 0 ? none : random_vector();
        camera_orient(&camera, view, up, 50, point);
        assert_near(vec3_norm(camera.right), 1, 1e-12);
        assert_near(vec3_norm(camera.up), 1, 1e-12);
        assert_near(vec3_norm(vec3_sub(vec3_cross(camera.right, camera.up), camera.back)), 0, 1e-12);
        if (vec3_norm(view) > 0)
            assert_near(vec3_dot(camera.back, vec3_unit(view)), -1, 1e-12);
        if (vec3_norm(up) > 0)
            assert_true(vec3_dot(camera.up, up) > 0);
    }
    // an `up` along the view is undefined: another one is chosen
    Camera camera = {0};
    camera_orient(&camera, vec3(0, 0, -1), vec3(0, 0, 1), 50, point);
    assert_near(camera.up.y, 1, 1e-12);
}

static void flat_trees_are_seen_face_on(void **state)
{
    (void)state;
    random_state = 3;
    for (int round = 0; round < 100; round++) {
        Quat q = quat_from_rotation_vector(vec3_scale(random_vector(), 3));
        Vec3 normal = quat_rotate(q, vec3(0, 0, 1)), point[300];
        for (int i = 0; i < 300; i++) {
            Vec3 p = random_vector();
            point[i] = quat_rotate(q, vec3(50 * p.x, 30 * p.y, 2 * p.z));
        }
        Camera camera = {0}, again = {0};
        camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), 300, point);
        assert_true(fabs(vec3_dot(camera.back, normal)) > 0.999);
        // a small shift of the points (a moving tool, another mesh) must not flip the picture
        for (int i = 0; i < 300; i++)
            point[i] = vec3_add_scaled(point[i], 0.2, random_vector());
        camera_orient(&again, vec3(0, 0, 0), vec3(0, 0, 0), 300, point);
        if (fabs(fabs(normal.x) - fabs(normal.y)) > 0.1 && fabs(fabs(normal.y) - fabs(normal.z)) > 0.1 && fabs(fabs(normal.x) - fabs(normal.z)) > 0.1 &&
            fabs(fabs(normal.z) - 0.9) > 0.05)
            assert_true(vec3_dot(camera.back, again.back) > 0.99 && vec3_dot(camera.up, again.up) > 0.99);
    }
    // the coronal plane is seen from the front, head up
    Vec3 flat[100];
    for (int i = 0; i < 100; i++) {
        Vec3 p = random_vector();
        flat[i] = vec3(40 * p.x, 0, 30 * p.z);
    }
    Camera camera = {0};
    camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), 100, flat);
    assert_near(camera.back.y, -1, 1e-9);
    assert_near(camera.up.z, 1, 1e-9);
    assert_near(camera.right.x, 1, 1e-9);
}

static void straight_and_round_things_have_a_view(void **state)
{
    (void)state;
    Vec3 line[20], one[3] = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
    for (int axis = 0; axis < 3; axis++) {
        for (int i = 0; i < 20; i++)
            line[i] = vec3(axis == 0 ? i : 0, axis == 1 ? i : 0, axis == 2 ? i : 0);
        Camera camera = {0};
        camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), 20, line);
        assert_true(vec3_is_finite(camera.right) && vec3_is_finite(camera.up));
        Vec3 along = vec3_unit(line[19]);
        assert_near(vec3_dot(camera.back, along), 0, 1e-9);   // never along the tube
    }
    Camera camera = {0};
    camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), 3, one);
    assert_near(camera.back.y, -1, 1e-12);
    camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), 0, NULL);
    assert_near(camera.back.y, -1, 1e-12);
}

static void a_frame_holds_its_points(void **state)
{
    (void)state;
    random_state = 4;
    for (int round = 0; round < 50; round++) {
        Vec3 point[40];
        for (int i = 0; i < 40; i++)
            point[i] = vec3_add(vec3(100, -200, 300), vec3_scale(random_vector(), 40));
        Camera camera = {0};
        camera_orient(&camera, random_vector(), vec3(0, 0, 0), 40, point);
        camera_frame(&camera, 400, 300, 20, 40, point, 1.5);
        double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9, margin = 1.5 / camera.mm_per_pixel;
        for (int i = 0; i < 40; i++) {
            Vec3 p = camera_project(&camera, point[i]);
            low_x = fmin(low_x, p.x - margin), high_x = fmax(high_x, p.x + margin);
            low_y = fmin(low_y, p.y - margin), high_y = fmax(high_y, p.y + margin);
            assert_true(p.z < camera.near_depth && p.z > camera.far_depth);
        }
        assert_true(low_x >= 20 - 1e-6 && high_x <= 380 + 1e-6 && low_y >= 20 - 1e-6 && high_y <= 280 + 1e-6);
        // and no larger than necessary
        assert_near(fmin(low_x - 20, low_y - 20), 0, 1e-6);
        // zooming in on any of them cuts off none in depth
        Vec3 place = vec3_add_scaled(point[round % 40], 30, camera.back);
        camera_frame_sphere(&camera, 400, 300, 10, place, 7);
        for (int i = 0; i < 40; i++) {
            Vec3 p = camera_project(&camera, point[i]);
            assert_true(p.z < camera.near_depth && p.z > camera.far_depth);
        }
        Vec3 edge = camera_project(&camera, vec3_add_scaled(place, 7, camera.up));
        assert_near(edge.x, 200, 1e-9);
        assert_near(edge.y, 10, 1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(principal_axes_diagonalise),  cmocka_unit_test(axes_are_a_right_handed_frame),
        cmocka_unit_test(flat_trees_are_seen_face_on), cmocka_unit_test(straight_and_round_things_have_a_view),
        cmocka_unit_test(a_frame_holds_its_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
