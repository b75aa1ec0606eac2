// Checks whether surfaces are closed, how they are closed, and what decimation preserves: closedness, genus, parts, rims, volume, thin branches.
#include "geom/mesh_closure.h"
#include "geom/mesh_decimate.h"
#include "geom/tree_surface.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"
#include "small_meshes.h"

static MeshClosure closure_of(const TriangleMesh *mesh)
{
    MeshClosure closure;
    assert_true(mesh_closure(mesh, &closure, NULL));
    return closure;
}

static void closed_surfaces_are_known(void **state)
{
    (void)state;
    TriangleMesh ball = sphere_mesh(10), torus = torus_mesh(5, 1, 40, 20);
    assert_int_equal(closure_of(&ball).open_edges, 0);
    assert_int_equal(closure_of(&torus).open_edges, 0);
    // an inscribed polyhedron is 11 / triangles smaller (mean sagitta of triangles of its area), more where they differ in size as the octahedron's do
    assert_near(closure_of(&ball).volume / (4 * PI / 3), 1, 1.5 * 11 / ball.triangle_count);
    // every triangle with separate vertices: the same places, other indices
    TriangleMesh soup = mesh_room(3 * ball.triangle_count, ball.triangle_count);
    for (int t = 0; t < ball.triangle_count; t++) {
        for (int k = 0; k < 3; k++)
            mesh_vertex(&soup, ball.vertex[ball.triangle[t][k]], vec3(0, 0, 1));
        mesh_triangle(&soup, 3 * t, 3 * t + 1, 3 * t + 2);
    }
    assert_int_equal(closure_of(&soup).open_edges, 0);
    assert_near(closure_of(&soup).volume, closure_of(&ball).volume, 1e-12);
    // two prisms with a common edge: four triangles meet there, and rays still enter as often as they leave
    const Vec3 left[4] = {{-1, -1, 0}, {0, -1, 0}, {0, 0, 0}, {-1, 0, 0}}, right[4] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    TriangleMesh both = mesh_and(prism_mesh(left, 4, 1), prism_mesh(right, 4, 1), vec3(0, 0, 0), false);
    SurfaceCensus census;
    assert_true(surface_census(&both, &census));
    assert_int_equal(closure_of(&both).open_edges, 0);
    assert_near(closure_of(&both).volume, 2, 1e-12);
    mesh_clear(&ball), mesh_clear(&torus), mesh_clear(&soup), mesh_clear(&both);
}

static void rims_get_lids(void **state)
{
    (void)state;
    const double radius = 1.5, length = 20;
    TriangleMesh tube = bent_tube_mesh(radius, 0, length, 10, 0.5, 5, 0.5, 48);
    MeshClosure closure;
    MeshLids lids;
    assert_true(mesh_closure(&tube, &closure, &lids));
    assert_int_equal(closure.rims, 2);
    assert_int_equal(closure.open_edges, 2 * 48);
    assert_int_equal(closure.turned_edges, 0);
    assert_int_equal(lids.triangle_count, 2 * 48);
    assert_true(closure.unevenness < 1e-9);
    // Pappus: section times the path of its centre; a polygon of 48 corners is 1 - 2 pi^2 / (3 48^2) of the disc, and the rings shorten the arc slightly
    double section = 48 * sin(PI / 48) * cos(PI / 48) * radius * radius;
    assert_near(closure.volume / (section * (length + 10 * 0.5 + 5)), 1, 1e-3);
    for (int k = 0; k < 2; k++)
        assert_near(fmin(vec3_norm(lids.middle[k]),
                         vec3_distance(lids.middle[k], vec3_add_scaled(vec3(length + 10 * sin(0.5), 10 - 10 * cos(0.5), 0), 5, vec3(cos(0.5), sin(0.5), 0)))),
                    0, 1e-9);
    mesh_lids_free(&lids);
    // a triangle that faces the other way is not a rim
    int swapped = tube.triangle[100][1];
    tube.triangle[100][1] = tube.triangle[100][2];
    tube.triangle[100][2] = swapped;
    assert_int_equal(closure_of(&tube).turned_edges, 3);
    mesh_clear(&tube);
}

static void spheres_keep_their_volume(void **state)
{
    (void)state;
    TriangleMesh ball = sphere_mesh(40);
    for (int triangles = 4000; triangles >= 250; triangles /= 4) {
        TriangleMesh *less = mesh_decimate(&ball, triangles, HUGE_VAL);
        SurfaceCensus census;
        assert_non_null(less);
        assert_true(surface_census(less, &census));
        assert_true(less->triangle_count <= triangles);
        assert_true(less->triangle_count > triangles * 9 / 10);
        assert_int_equal(census.open_edges + census.turned_edges + census.non_manifold_edges, 0);
        assert_int_equal(census.euler, 2);
        // no worse than an inscribed polyhedron with the same number of equal triangles
        assert_near(census.volume / (4 * PI / 3), 1, 11.0 / triangles);
        for (int v = 0; v < less->vertex_count; v++)
            assert_true(vec3_dot(less->normal[v], vec3_unit(less->vertex[v])) > 0.9);
        triangle_mesh_free(less);
    }
    mesh_clear(&ball);
}

static void genus_parts_and_nodes_stay(void **state)
{
    (void)state;
    // a ring with a bead beside it, a thousandth of its volume
    TriangleMesh bead = sphere_mesh(12);
    for (int v = 0; v < bead.vertex_count; v++)
        bead.vertex[v] = vec3_scale(bead.vertex[v], 0.25);
    TriangleMesh mesh = mesh_and(torus_mesh(5, 1, 200, 60), bead, vec3(9, 0, 0), false);
    mesh.node = malloc((size_t)mesh.vertex_count * sizeof *mesh.node);
    assert_non_null(mesh.node);
    for (int v = 0; v < mesh.vertex_count; v++)
        mesh.node[v] = mesh.vertex[v].x > 8 ? 2 : mesh.vertex[v].x > 0;
    TriangleMesh *less = mesh_decimate(&mesh, 1500, HUGE_VAL), *again = mesh_decimate(&mesh, 1500, HUGE_VAL);
    SurfaceCensus before, after;
    assert_true(less && again && surface_census(&mesh, &before) && surface_census(less, &after));
    assert_int_equal(after.parts, 2);
    assert_int_equal(after.euler, 0 + 2);
    assert_int_equal(after.open_edges + after.turned_edges + after.non_manifold_edges, 0);
    assert_near(after.volume / before.volume, 1, 0.02);
    for (int v = 0; v < less->vertex_count; v++) {
        Vec3 p = less->vertex[v];
        assert_true(fabs(p.x) < 0.6 || less->node[v] == (p.x > 8 ? 2 : p.x > 0));
    }
    // the same input gives the same mesh, bit for bit
    assert_int_equal(less->vertex_count, again->vertex_count);
    assert_memory_equal(less->vertex, again->vertex, (size_t)less->vertex_count * sizeof *less->vertex);
    assert_memory_equal(less->triangle, again->triangle, (size_t)less->triangle_count * sizeof *less->triangle);
    triangle_mesh_free(less);
    triangle_mesh_free(again);
    free(mesh.node);
    mesh_clear(&mesh);
}

// The length of a line inside.
static double chord(const TriangleMesh *mesh, Vec3 from, Vec3 along)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangle[t];
        Vec3 a = mesh->vertex[c[0]], e = vec3_sub(mesh->vertex[c[1]], a), f = vec3_sub(mesh->vertex[c[2]], a), p = vec3_cross(along, f);
        double det = vec3_dot(e, p);
        if (fabs(det) < 1e-14)
            continue;
        Vec3 d = vec3_sub(from, a), q = vec3_cross(d, e);
        double u = vec3_dot(d, p) / det, v = vec3_dot(along, q) / det;
        if (u >= 0 && v >= 0 && u + v <= 1)
            sum += det > 0 ? -vec3_dot(f, q) / det : vec3_dot(f, q) / det;
    }
    return sum;
}

// A bulb of radius 6 with a branch of radius 0.25 and length 25: a surface of revolution about x.
static TriangleMesh bulb_with_branch(void)
{
    enum { RINGS = 600, AROUND = 40 };
    TriangleMesh m = mesh_room(RINGS * AROUND + 2, 2 * RINGS * AROUND);
    for (int j = 0; j < RINGS; j++) {
        double x = -6 + 37.0 * (j + 0.5) / RINGS, ball = 36 - x * x, r = fmax(ball > 0 ? sqrt(ball) : 0, x > 0 ? 0.25 : 0);
        for (int k = 0; k < AROUND; k++)
            mesh_vertex(&m, vec3(x, r * cos(2 * PI * k / AROUND), r * sin(2 * PI * k / AROUND)), vec3(1, 0, 0));
    }
    int ends[2] = {mesh_vertex(&m, vec3(-6, 0, 0), vec3(-1, 0, 0)), mesh_vertex(&m, vec3(31, 0, 0), vec3(1, 0, 0))};
    for (int j = 0; j + 1 < RINGS; j++)
        for (int k = 0; k < AROUND; k++) {
            int a = j * AROUND + k, b = j * AROUND + (k + 1) % AROUND;
            mesh_triangle(&m, a, b, a + AROUND);
            mesh_triangle(&m, b, b + AROUND, a + AROUND);
        }
    for (int k = 0; k < AROUND; k++) {
        int last = (RINGS - 1) * AROUND;
        mesh_triangle(&m, ends[0], (k + 1) % AROUND, k);
        mesh_triangle(&m, ends[1], last + k, last + (k + 1) % AROUND);
    }
    return m;
}

static void thin_branches_stay(void **state)
{
    (void)state;
    TriangleMesh mesh = bulb_with_branch();
    SurfaceCensus census;
    assert_true(surface_census(&mesh, &census));
    assert_true(census.open_edges + census.turned_edges == 0 && census.volume > 0);
    TriangleMesh *less = mesh_decimate(&mesh, 600, HUGE_VAL);
    assert_non_null(less);
    assert_int_equal(closure_of(less).open_edges, 0);
    for (double x = 6.5; x < 30.5; x += 0.37)
        for (int k = 0; k < 5; k++) {
            // through the axis, in all directions: a triangular prism would have 0.75 to 0.87
            double part = chord(less, vec3(x, 1e-4, 2e-4), vec3(1e-5, cos(0.63 * k), sin(0.63 * k))) / 0.5;
            assert_true(part > 0.7 && part < 1.15);
        }
    triangle_mesh_free(less);
    mesh_clear(&mesh);
}

static void rims_and_limits_hold(void **state)
{
    (void)state;
    TriangleMesh tube = bent_tube_mesh(1.5, 0, 20, 10, 1.5, 5, 0.1, 60);
    TriangleMesh *less = mesh_decimate(&tube, 500, HUGE_VAL), *careful = mesh_decimate(&tube, 500, 2e-3);
    assert_true(less && careful);
    MeshClosure before = closure_of(&tube), after = closure_of(less), near = closure_of(careful);
    assert_int_equal(after.open_edges, before.open_edges);
    assert_int_equal(after.rims, 2);
    assert_near(after.volume / before.volume, 1, 0.03);
    // a limit on the displacement of the wall needs more triangles and preserves volume: 2 um root mean square of 1.5 mm is 0.3 %
    assert_true(careful->triangle_count > 2 * less->triangle_count && careful->triangle_count < tube.triangle_count / 2);
    assert_near(near.volume / before.volume, 1, 2 * 2e-3 / 1.5);
    triangle_mesh_free(less);
    triangle_mesh_free(careful);
    mesh_clear(&tube);
    // the smallest result is a tetrahedron; an empty mesh stays empty
    TriangleMesh ball = sphere_mesh(3), none = mesh_room(1, 1);
    less = mesh_decimate(&ball, 0, HUGE_VAL);
    assert_true(less && less->triangle_count >= 4 && closure_of(less).open_edges == 0 && closure_of(less).volume > 0);
    triangle_mesh_free(less);
    less = mesh_decimate(&none, 10, HUGE_VAL);
    assert_true(less && less->triangle_count == 0);
    triangle_mesh_free(less);
    mesh_clear(&ball), mesh_clear(&none);
}

// A vertex over each face, at which three triangles meet.
static TriangleMesh with_pyramids(TriangleMesh mesh, double height)
{
    TriangleMesh all = mesh_room(mesh.vertex_count + mesh.triangle_count, 3 * mesh.triangle_count);
    for (int v = 0; v < mesh.vertex_count; v++)
        mesh_vertex(&all, mesh.vertex[v], mesh.normal[v]);
    for (int t = 0; t < mesh.triangle_count; t++) {
        const int *c = mesh.triangle[t];
        Vec3 middle = vec3_scale(vec3_add(vec3_add(mesh.vertex[c[0]], mesh.vertex[c[1]]), mesh.vertex[c[2]]), 1.0 / 3);
        int top = mesh_vertex(&all, vec3_scale(middle, 1 + height), vec3_unit(middle));
        for (int k = 0; k < 3; k++)
            mesh_triangle(&all, c[k], c[(k + 1) % 3], top);
    }
    mesh_clear(&mesh);
    return all;
}

static int corners_in_common(const int a[3], const int b[3])
{
    int count = 0;
    for (int i = 0; i < 9; i++)
        count += a[i / 3] == b[i % 3];
    return count;
}

// For any small number of triangles, three or more meet at each vertex, and no two have the same vertices (a pocket of two faces would also be closed).
static void nothing_folds_flat(void **state)
{
    (void)state;
    TriangleMesh shape[] = {sphere_mesh(6), torus_mesh(5, 1, 40, 20), with_pyramids(sphere_mesh(4), 0.05)};
    for (int i = 0; i < 3; i++)
        for (int triangles = 4; triangles <= 64; triangles *= 2) {
            TriangleMesh *less = mesh_decimate(&shape[i], triangles, HUGE_VAL);
            assert_non_null(less);
            int *met = calloc((size_t)less->vertex_count, sizeof *met);
            for (int t = 0; t < less->triangle_count; t++)
                for (int k = 0; k < 3; k++)
                    met[less->triangle[t][k]]++;
            for (int v = 0; v < less->vertex_count; v++)
                assert_true(met[v] >= 3);
            for (int t = 0; t < less->triangle_count; t++)
                for (int u = 0; u < t; u++)
                    assert_true(corners_in_common(less->triangle[t], less->triangle[u]) < 3);
            free(met);
            triangle_mesh_free(less);
        }
    for (int i = 0; i < 3; i++)
        mesh_clear(&shape[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_surfaces_are_known),  cmocka_unit_test(rims_get_lids),      cmocka_unit_test(spheres_keep_their_volume),
        cmocka_unit_test(genus_parts_and_nodes_stay), cmocka_unit_test(thin_branches_stay), cmocka_unit_test(rims_and_limits_hold),
        cmocka_unit_test(nothing_folds_flat),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
