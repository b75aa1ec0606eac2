// Meshes of tubes and planes for pictures: vertices on the exact wall, normals and triangles that face out of the lumen, ends at the ends of the axis.
#include "geom/tube_mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"

// Every vertex has the exact gap 0, and the normals of mesh and wall are opposite. From just inside: on the wall a gap of rounding size has either sign.
static void check_wall(const TriangleMesh *mesh, const Vessel *exact, double depth)
{
    assert_non_null(mesh);
    assert_non_null(exact);
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 inside = vec3_add_scaled(mesh->vertex[i], -depth, mesh->normal[i]);
        VesselMemory memory = {.node = -1};
        VesselHit hit;
        vessel_query(exact, 1, &inside, 100, &memory, &hit);
        assert_near(hit.gap, depth, 1e-9);
        assert_true(vec3_norm(vec3_add(hit.normal, mesh->normal[i])) < 1e-9);
    }
}

// The triangles have an area of `area`, within `part` of it, and face outwards. Where two pieces meet, two rings lie at one place.
static void check_triangles(const TriangleMesh *mesh, double area, double part)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        for (int k = 0; k < 3; k++)
            assert_true(c[k] >= 0 && c[k] < mesh->vertex_count);
        Vec3 twice = vec3_cross(vec3_sub(mesh->vertex[c[1]], mesh->vertex[c[0]]), vec3_sub(mesh->vertex[c[2]], mesh->vertex[c[0]]));
        sum += 0.5 * vec3_norm(twice);
        if (vec3_norm(twice) > 1e-9)
            assert_true(vec3_dot(twice, mesh->normal[c[0]]) > 0);
    }
    assert_near(sum, area, part * area);
}

static void lines_and_arcs_have_the_tubes_wall(void **state)
{
    (void)state;
    TubePiece piece[] = {{.length = 20}, {.arc_radius = 10, .angle = PI / 2, .plane = 0.3}, {.length = 7}};
    TubeOptions tube = {.start = {1, 2, 3}, .direction = {2, 1, 2}, .normal = {0, 1, 0}, .radius = 2, .piece = piece, .piece_count = 3};
    Faults faults = {0};
    Vessel *exact = tube_vessel_create(&tube, "test", &faults);
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    check_wall(mesh, exact, 0.5);
    // Pappus: circumference times the axis's length; an inscribed 40-gon is 0.1 % shorter, chords of the arc (0.06 rad) 0.02 %
    check_triangles(mesh, 4 * PI * (27 + 5 * PI), 2e-3);
    triangle_mesh_free(mesh);
    exact->destroy(exact);
}

// A straight line given as several points: one ring at each station, from the first point to the last.
static void a_straight_polyline_is_a_cylinder(void **state)
{
    (void)state;
    Vec3 point[] = {{0, 0, 0}, {3, 0, 0}, {4, 0, 0}, {10, 0, 0}};
    TubeOptions tube = {.radius = 1.5, .point = point, .point_count = 4};
    Faults faults = {0};
    Vessel *exact = tube_vessel_create(&tube, "test", &faults);
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    check_wall(mesh, exact, 0.25);
    check_triangles(mesh, 3 * PI * 10, 2e-3);
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int i = 0; i < mesh->vertex_count; i++)
        low = fmin(low, mesh->vertex[i].x), high = fmax(high, mesh->vertex[i].x);
    assert_near(low, 0, 1e-12);
    assert_near(high, 10, 1e-12);
    for (int t = 0; t < mesh->triangle_count; t++) {       // no two rings at one place
        const int *c = mesh->triangle[t];
        assert_true(vec3_norm(vec3_cross(vec3_sub(mesh->vertex[c[1]], mesh->vertex[c[0]]), vec3_sub(mesh->vertex[c[2]], mesh->vertex[c[0]]))) > 1e-3);
    }
    triangle_mesh_free(mesh);
    exact->destroy(exact);
}

// Around a sharp corner the rings are great circles of a sphere about it: no vertex lies outside the lumen, and the sphere's outer side is covered.
static void a_sharp_corner_is_round_outside(void **state)
{
    (void)state;
    Vec3 point[] = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}};
    TubeOptions tube = {.radius = 1, .point = point, .point_count = 3};
    TriangleMesh *mesh = triangle_mesh_of_tube(&tube);
    Vec3 outermost = vec3_add_scaled(point[1], 1, vec3_unit(vec3(1, -1, 0)));
    double nearest = HUGE_VAL;
    assert_non_null(mesh);
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 x = mesh->vertex[i];
        double first = vec3_distance(x, vec3(fmin(x.x, 10), 0, 0)), second = vec3_distance(x, vec3(10, fmax(x.y, 0), 0));
        assert_true(fmin(first, second) < 1 + 1e-12);
        nearest = fmin(nearest, vec3_distance(x, outermost));
    }
    assert_true(nearest < 0.2);      // the rings are at most 0.2 rad apart, the vertices of a ring 0.16
    triangle_mesh_free(mesh);
}

static void a_plane_is_a_square(void **state)
{
    (void)state;
    TriangleMesh *mesh = triangle_mesh_of_plane(vec3(1, 2, 3), vec3(0, 0, 2), 5);
    assert_non_null(mesh);
    for (int i = 0; i < mesh->vertex_count; i++) {
        assert_near(mesh->vertex[i].z, 3, 1e-12);
        assert_near(mesh->normal[i].z, -1, 1e-12);
        assert_true(vec3_distance(mesh->vertex[i], vec3(1, 2, 3)) < 5 * sqrt(2) + 1e-12);
    }
    check_triangles(mesh, 100, 1e-12);
    triangle_mesh_free(mesh);
}

static void what_is_no_surface_is_null(void **state)
{
    (void)state;
    Vec3 point[] = {{0, 0, 0}, {3, 0, 0}};
    TubeOptions tube = {.radius = 1, .point = point, .point_count = 1};
    assert_null(triangle_mesh_of_tube(&tube));
    tube.point_count = 2, tube.radius = 0;
    assert_null(triangle_mesh_of_tube(&tube));
    tube.radius = HUGE_VAL;
    assert_null(triangle_mesh_of_tube(&tube));
    assert_null(triangle_mesh_of_plane(vec3(0, 0, 0), vec3(0, 0, 0), 1));
    assert_null(triangle_mesh_of_plane(vec3(0, 0, 0), vec3(0, 0, 1), 0));
    assert_null(triangle_mesh_of_plane(vec3(0, 0, 0), vec3(0, 0, 1), NAN));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_and_arcs_have_the_tubes_wall), cmocka_unit_test(a_straight_polyline_is_a_cylinder),
        cmocka_unit_test(a_sharp_corner_is_round_outside),    cmocka_unit_test(a_plane_is_a_square),
        cmocka_unit_test(what_is_no_surface_is_null),
    };
    return cmocka_run_group_tests_name("tube_mesh", tests, NULL, NULL);
}
