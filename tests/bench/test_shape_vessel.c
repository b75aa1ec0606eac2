// The true surface of synthetic shapes as a vessel: against exact capsules and arcs, curvature against differences, feet on the surface and nearest, the
// inlet, open ends, scale; and the walls of shapes and of models fitted to them as triangles.
#include "bench/shape_vessel.h"

#include "geom/tree_surface.h"
#include "tests/geom/random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/geom/near.h"
#include "tests/recon/fitted_shape.h"

static VesselHit ask(const Vessel *vessel, Vec3 x)
{
    VesselMemory memory = {.node = vessel->locate(vessel, x, -1)};
    VesselHit hit;
    vessel_query(vessel, 1, &x, 1e6, &memory, &hit);
    return hit;
}

static double hessian_difference(const Sym3 *a, const Sym3 *b)
{
    double xx = a->xx - b->xx, xy = a->xy - b->xy, xz = a->xz - b->xz, yy = a->yy - b->yy, yz = a->yz - b->yz, zz = a->zz - b->zz;
    return sqrt(xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz));
}

// Capsule and arc are tubes that tube_vessel knows exactly (the arc's centreline is a spline here, 1e-6 mm off). Points from the axis to outside.
static void capsule_and_arc_are_exact(void **state)
{
    (void)state;
    Faults tube_faults = {0};
    const double scales[] = {1, 0.01, 100};
    for (int which = 0; which < 2; which++)
        for (int k = 0; k < 3; k++) {
            const char option[1][2][64] = {{"scale", ""}};
            char text[1][2][64];
            double scale = scales[k];
            memcpy(text, option, sizeof text);
            snprintf(text[0][1], sizeof text[0][1], "%g", scale);
            Shape *shape = make(which ? "arc" : "capsule", 1, (const char(*)[2][64])text);
            Vessel *truth = shape_vessel_create(shape);
            TubePiece piece = which ? (TubePiece){0, 4 * scale, PI, 0} : (TubePiece){4 * scale, 0, 0, 0};
            TubeOptions o = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = scale, .piece_count = 1, .piece = &piece, .closed_ends = !which};
            Vessel *tube = tube_vessel_create(&o, "test", &tube_faults);
            uint64_t seed = 4;
            int on_axis = 0;
            for (int i = 0; i < 3000; i++) {
                double u = random_in(&seed, 0, 1), angle = PI * u;
                Vec3 c = which ? vec3(4 * sin(angle), 4 * (1 - cos(angle)), 0) : vec3(4 * u, 0, 0);
                Vec3 x = vec3_scale(i % 20 ? vec3_add(c, random_in_box(&seed, 1.2)) : c, scale);
                VesselHit exact = ask(tube, x), hit = ask(truth, x);
                if (which && (x.x < 0 || exact.flags))
                    continue;   // beyond its ends the tube is another
                assert_int_equal(hit.flags, 0);
                assert_near(hit.gap, exact.gap, 1e-6 * scale);
                if (exact.gap > 0.95 * scale) {
                    on_axis++;   // the normal turns round there
                    continue;
                }
                assert_true(vec3_distance(hit.normal, exact.normal) < 1e-5 / (1 - fmax(exact.gap / scale, 0)));
                // where a cap begins the curvature jumps
                if (exact.gap < 0.8 * scale && (which || fabs(x.x / scale - 2) < 1.99 || fabs(x.x / scale - 2) > 2.01))
                    assert_true(hessian_difference(&hit.hessian, &exact.hessian) * scale < 0.01);
            }
            assert_true(on_axis > 100);
            Vec3 p, d, q, e;
            assert_true(truth->inlet(truth, &p, &d) && tube->inlet(tube, &q, &e));
            assert_true(vec3_distance(p, q) < 1e-9 * scale && vec3_distance(d, e) < 1e-9);
            assert_int_equal(truth->locate(truth, p, 7), 0);
            assert_true(truth->primitives == 1 && truth->bytes > 0);
            truth->destroy(truth);
            tube->destroy(tube);
            shape_free(shape);
        }
    assert_int_equal(tube_faults.count, 0);
}

// Joints and all: the foot lies on the surface, |x - foot| is the gap, the normal its gradient, the Hessian the normal's; and nothing of the surface is nearer.
static void feet_are_nearest(void **state)
{
    (void)state;
    const char *const name[] = {"y", "twig", "kissing", "bifurcation"};
    for (int k = 0; k < 4; k++) {
        Shape *shape = make(name[k], 0, NULL);
        VesselTree *tree = shape_sample(shape, &faults);
        Vessel *truth = shape_vessel_create(shape);
        assert_non_null(tree);
        Vec3 p, d;
        assert_true(truth->inlet(truth, &p, &d));
        assert_true(vec3_distance(p, tree->center[0]) == 0 && vec3_distance(d, tree->direction[0]) == 0);
        uint64_t seed = 9;
        int asked = 0, curved = 0;
        while (asked < (is_slow ? 60 : 200)) {
            int64_t at = (int64_t)random_in(&seed, 0, (double)tree->point_count);
            double step = 1e-3;
            Vec3 x = vec3_add(tree->point[at], random_in_box(&seed, 0.15));
            VesselMemory memory = {.node = 0};
            VesselHit hit;
            vessel_query(truth, 1, &x, 1e6, &memory, &hit);
            if (hit.flags & (VESSEL_OPEN_END | VESSEL_BEYOND))
                continue;
            asked++;
            assert_int_equal(hit.flags, 0);
            assert_near(shape_field(shape, memory.foot, NULL), 0, 1e-9);
            assert_near(vec3_norm(vec3_sub(memory.foot, vec3_add_scaled(x, -hit.gap, hit.normal))), 0, 1e-5);
            assert_true((hit.gap > 0) == (shape_field(shape, x, NULL) > 0));
            for (int64_t i = 0; i < tree->point_count; i++)   // points on the surface
                assert_true(vec3_distance(x, tree->point[i]) > fabs(hit.gap) - 1e-6);
            Vec3 slope = {0, 0, 0}, *axis = (Vec3[]){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, bend[3];
            bool smooth = true;
            for (int a = 0; a < 3; a++) {
                VesselHit up = ask(truth, vec3_add_scaled(x, step, axis[a])), down = ask(truth, vec3_add_scaled(x, -step, axis[a]));
                slope = vec3_add_scaled(slope, 0.5 * (up.gap - down.gap) / step, axis[a]);
                bend[a] = vec3_scale(vec3_sub(up.normal, down.normal), 0.5 / step);
                smooth = smooth && vec3_distance(up.normal, down.normal) < 0.02;   // not at a crease of the plain maximum
            }
            if (!smooth)
                continue;
            curved++;
            assert_true(vec3_distance(slope, hit.normal) < 2e-3);
            Sym3 h = {bend[0].x, bend[0].y, bend[0].z, bend[1].y, bend[1].z, bend[2].z};
            // the joint's blend has a third derivative of some 1 / width^2 (width 0.12 mm at the twig)
            assert_true(hessian_difference(&hit.hessian, &h) < 0.02 * (1 + 5 * fabs(sym3_trace(&h))));
        }
        assert_true(curved > asked / 2);
        truth->destroy(truth);
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

// Deep inside, where several walls are about as near, the foot is that of the nearest or of one hardly further.
static void clearance_is_no_more_than_the_wall(void **state)
{
    (void)state;
    const char *const name[] = {"y", "bifurcation", "twig"};
    for (int k = 0; k < 3; k++) {
        Shape *shape = make(name[k], 0, NULL);
        VesselTree *tree = shape_sample(shape, &faults);
        Vessel *truth = shape_vessel_create(shape);
        uint64_t seed = 31;
        for (int asked = 0; asked < (is_slow ? 100 : 300); asked++) {
            int node = (int)random_in(&seed, 0, tree->node_count);
            Vec3 x = vec3_add(tree->center[node], random_in_box(&seed, (asked % 3 ? 0.05 : 0.8) * tree->radius[node]));
            VesselHit hit = ask(truth, x);
            if (hit.flags)
                continue;
            VesselMemory memory = {.node = 0};
            VesselHit bound;
            double reach = 0.5 * tree->radius[node];
            vessel_query(truth, 1, &x, reach, &memory, &bound);
            assert_true(bound.flags == VESSEL_FAR ? bound.gap > reach && bound.gap <= hit.gap + 1e-9 : bound.gap == hit.gap);
            assert_true(fabs(hit.gap) >= fabs(shape_field(shape, x, NULL)) - 1e-9);
            for (int64_t i = 0; i < tree->point_count; i++)
                assert_true(vec3_distance(x, tree->point[i]) > fabs(hit.gap) - 0.06 * tree->radius[node]);
        }
        truth->destroy(truth);
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

// Between two centrelines that part the field is flat: there, too, the wall is a radius away, and up to the joint's 0.1 mm more.
static void flat_fields(void **state)
{
    (void)state;
    Shape *shape = make("bifurcation", 0, NULL);   // both arcs leave (0, 0, 0) along x, radius 1, bending with radius 4
    Vessel *truth = shape_vessel_create(shape);
    for (int i = 0; i <= 200; i++) {
        double x = 1e-4 * i;
        VesselHit hit = ask(truth, vec3(x, 0, 0));
        assert_true(hit.gap > 0.99 && hit.gap < 1.11);
        assert_near(vec3_norm(hit.normal), 1, 1e-12);
    }
    truth->destroy(truth);
    shape_free(shape);
}

// Upstream of the inlet a cylinder for ever; beyond the other open end for five radii, then no wall.
static void open_ends(void **state)
{
    (void)state;
    Shape *shape = make("open-capsule", 0, NULL);   // along x from 0 to 4, radius 1
    Vessel *truth = shape_vessel_create(shape);
    for (double x = -100; x < 12; x += 0.13)
        for (double y = 0; y < 1.6; y += 0.2) {
            Vec3 at = {x, y, 0};
            VesselMemory memory = {.node = 0};
            VesselHit hit;
            vessel_query(truth, 1, &at, 1e6, &memory, &hit);
            if (x > 9) {
                assert_int_equal(hit.flags, VESSEL_OPEN_END);
                assert_true(hit.gap == HUGE_VAL);
                continue;
            }
            assert_int_equal(hit.flags, x < 0 || x > 4 ? VESSEL_BEYOND : 0);
            assert_near(hit.gap, 1 - y, 1e-9);
            if (y == 0)
                continue;
            assert_true(vec3_distance(hit.normal, vec3(0, -1, 0)) < 1e-6);
            assert_true(vec3_distance(memory.foot, vec3(x, 1, 0)) < 1e-6);
        }
    assert_int_equal(ask(truth, vec3(NAN, 0, 0)).flags, VESSEL_UNSURE);
    truth->destroy(truth);
    shape_free(shape);
}

typedef struct Wall {
    SurfaceCensus census;
    double off, facet;       // of vertices and of triangles' middles from the truth, away from open ends
} Wall;

// `ends`: cover of the last nodes of branches, in radii: a model continues beyond them.
static Wall mesh_wall(const Shape *shape, const Vessel *vessel, const VesselTree *tree, double ends, double cell)
{
    double *reach = calloc((size_t)tree->node_count, sizeof *reach);
    int *from = calloc((size_t)tree->node_count, sizeof *from);
    for (int i = 0; i < tree->node_count; i++)
        reach[i] = ends * tree->radius[i], from[i] = i;
    for (int i = 0; i < tree->node_count; i++)
        if (tree->parent[i] >= 0)
            reach[tree->parent[i]] = 1.7 * tree->radius[tree->parent[i]];
    TriangleMesh *mesh = isosurface_of_vessel(vessel, tree->node_count, tree->center, reach, from, cell);
    assert_non_null(mesh);
    Wall wall = {.off = 0};
    assert_true(surface_census(mesh, &wall.census));
    assert_int_equal(wall.census.non_manifold_edges, 0);
    assert_int_equal(wall.census.turned_edges, 0);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        Vec3 a = mesh->vertex[v[0]], middle = vec3_scale(vec3_add(a, vec3_add(mesh->vertex[v[1]], mesh->vertex[v[2]])), 1.0 / 3);
        if (shape_beyond_open_end(shape, a) || shape_beyond_open_end(shape, middle))
            continue;
        wall.off = fmax(wall.off, fabs(shape_distance(shape, a, NULL)));
        wall.facet = fmax(wall.facet, fabs(shape_distance(shape, middle, NULL)));
    }
    triangle_mesh_free(mesh);
    free(reach);
    free(from);
    return wall;
}

// V - E + F = 2 parts - rims, where there are no handles.
static void shapes_as_triangles(void **state)
{
    (void)state;
    const struct {
        const char *name;
        int rims;            // open ends
        double cell, radius; // the thinnest
    } cases[] = {{"capsule", 0, 0.2, 1}, {"open-capsule", 2, 0.2, 1}, {"arc", 2, 0.25, 1},
                 {"y", 3, 0.25, 0.79},   {"twig", 2, 0.12, 0.2},      {"kissing", 1, 0.4, 1}};
    for (int k = 0; k < (is_slow ? 3 : 6); k++) {
        Shape *shape = make(cases[k].name, 0, NULL);
        VesselTree *tree = shape_sample(shape, &faults);
        Vessel *truth = shape_vessel_create(shape);
        Wall wall = mesh_wall(shape, truth, tree, 1.7, cases[k].cell);
        assert_int_equal(wall.census.parts, 1);
        assert_int_equal(wall.census.euler, 2 - cases[k].rims);
        assert_true((wall.census.open_edges > 0) == (cases[k].rims > 0));
        assert_true(wall.off < 1e-8);
        assert_true(wall.facet < pow(cases[k].cell, 2) / (2 * cases[k].radius));
        truth->destroy(truth);
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

// Models fitted to shapes with side branches: the inlet's rim and no other, and as near to the truth as the model.
static void models_as_triangles(void **state)
{
    (void)state;
    const char *const name[] = {"y", "twig"};
    for (int k = 0; k < (is_slow ? 0 : 2); k++) {
        Shape *shape = make(name[k], 0, NULL);
        LimFitOptions options = lim_fit_default_options();
        options.voxel_mm = shape_voxel_mm(shape);
        VesselTree *model = fit_of(shape, options);
        Vessel *vessel = lim_vessel_create(model);
        assert_non_null(vessel);
        Wall wall = mesh_wall(shape, vessel, model, 4, 0.12);
        assert_int_equal(wall.census.parts, 1);
        assert_int_equal(wall.census.euler, 1);
        print_message("%s: %d triangles, vertices within %.3f mm of the truth, middles %.3f\n", name[k], wall.census.triangles, wall.off, wall.facet);
        assert_true(wall.facet < wall.off + 0.05);
        vessel->destroy(vessel);
        vessel_tree_free(model);
        shape_free(shape);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(capsule_and_arc_are_exact),
        cmocka_unit_test(feet_are_nearest),
        cmocka_unit_test(clearance_is_no_more_than_the_wall),
        cmocka_unit_test(flat_fields),
        cmocka_unit_test(open_ends),
        cmocka_unit_test(shapes_as_triangles),
        cmocka_unit_test(models_as_triangles),
    };
    return cmocka_run_group_tests_name("shape_vessel", tests, NULL, NULL);
}
