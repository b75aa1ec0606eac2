// Ostia of imported trees against the exact geometry: every link has nodes, inside the lumen; no point lies in a tool's path; touching vessels stay separate.
#include "recon/surface/import_surface.h"

#include "recon/phantom/phantom.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static Faults faults;

// Adds a shape's surface to the mesh.
static void add_surface(const Shape *shape, double cell, SurfaceMesh *mesh)
{
    TriangleMesh *made = shape_surface(shape, cell, &faults);
    assert_non_null(made);
    int v = mesh->vertex_count, t = mesh->triangle_count;
    mesh->vertex = realloc(mesh->vertex, (size_t)(v + made->vertex_count) * sizeof(Vec3));
    mesh->triangle = realloc(mesh->triangle, (size_t)(t + made->triangle_count) * sizeof(int[3]));
    assert_true(mesh->vertex && mesh->triangle);
    memcpy(mesh->vertex + v, made->vertex, (size_t)made->vertex_count * sizeof(Vec3));
    for (int i = 0; i < made->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            mesh->triangle[t + i][k] = made->triangle[i][k] + v;
    mesh->vertex_count += made->vertex_count;
    mesh->triangle_count += made->triangle_count;
    triangle_mesh_free(made);
}

// A curve from the root to each end of the truth.
static CurveSet *curves_of(const VesselTree *truth)
{
    CurveSet *set = curve_set_create();
    Vec3 *point = malloc((size_t)truth->node_count * sizeof *point);
    double *radius = malloc((size_t)truth->node_count * sizeof *radius);
    assert_true(set && point && radius);
    for (int end = 1; end < truth->node_count; end++) {
        bool is_end = true;
        int n = 0;
        for (int k = end + 1; k < truth->node_count; k++)
            is_end = is_end && truth->parent[k] != end;
        for (int i = end; is_end && i >= 0; i = truth->parent[i], n++) {
            point[n] = truth->center[i];
            radius[n] = truth->radius[i];
        }
        assert_true(n == 0 || curve_set_add(set, point, radius, n));
    }
    free(point);
    free(radius);
    return set;
}

static double segment_distance(Vec3 x, Vec3 a, Vec3 b)
{
    Vec3 ab = vec3_sub(b, a);
    double l2 = vec3_norm2(ab), s = l2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), ab) / l2)) : 0;
    return vec3_distance(x, vec3_add_scaled(a, s, ab));
}

// Every link within both radii and inside, every point on the wall and clear of all centrelines.
static void check_tree(const char *name, const VesselTree *tree, const Shape *shape, const ImportReport *report, double near_wall)
{
    double longest = 0, shallow = HUGE_VAL, off = 0;
    long inner = 0;
    for (int i = 1; i < tree->node_count; i++) {
        Vec3 c = tree->center[i], p = tree->center[tree->parent[i]];
        longest = fmax(longest, vec3_distance(c, p) / (tree->radius[i] + tree->radius[tree->parent[i]]));
        for (int k = 1; k < 4; k++)
            shallow = fmin(shallow, shape_field(shape, vec3_mix(c, p, 0.25 * k), NULL) / fmin(tree->radius[i], tree->radius[tree->parent[i]]));
    }
    for (int64_t k = 0; k < tree->point_count; k += 7) {
        off = fmax(off, fabs(shape_field_cut(shape, tree->point[k])));
        for (int i = 1; i < tree->node_count; i++)
            inner +=
                segment_distance(tree->point[k], tree->center[i], tree->center[tree->parent[i]]) < 0.49 * fmin(tree->radius[i], tree->radius[tree->parent[i]]);
    }
    print_message("%s: %d junctions, %d doubtful, %d refused, %d link nodes; longest link %.2f of both radii, shallowest %.2f r; points %.3f mm off at most, "
                  "%ld inside\n",
                  name, report->junction_count, report->junctions_with[IMPORT_DOUBTFUL], report->junctions_with[IMPORT_REFUSED], report->link_nodes, longest,
                  shallow, off, inner);
    assert_true(longest <= 1 && shallow > 0 && off < near_wall);
    assert_int_equal(inner, 0);
}

static void every_ostium_is_described(void **state)
{
    (void)state;
    static const struct {
        const char *name, option[3][2][64];
        int junctions;
        double cell, off;    // [mm] cells of the mesh, and largest distance of its facets from the wall
    } kinds[] = {{"tree", {{"branches", "15"}, {"radius_mm", "1.4"}, {"seed", "1"}}, 7, 0.3, 0.08},
                 {"twig", {{"twig_radius_mm", "0.4"}, {"radius_mm", "2"}, {"seed", "1"}}, 1, 0.2, 0.05},
                 {"y", {{"angle_deg", "60"}, {"radius_mm", "1"}, {"seed", "1"}}, 1, 0.2, 0.05}};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        faults_clear(&faults);
        Shape *shape = shape_create(kinds[k].name, 3, kinds[k].option, "test", &faults);
        VesselTree *truth = shape ? shape_sample(shape, &faults) : NULL;
        SurfaceMesh mesh = {0};
        MeshCheck check;
        ImportReport report = {.curves_scaled = 1};
        ImportOptions options = import_default_options();
        assert_non_null(truth);
        add_surface(shape, kinds[k].cell, &mesh);
        assert_true(mesh_repair(&mesh, &check));
        CurveSet *set = curves_of(truth);
        VesselTree *tree = import_surface(&mesh, set, &options, &report, kinds[k].name, &faults);
        assert_non_null(tree);
        check_tree(kinds[k].name, tree, shape, &report, kinds[k].off);
        assert_int_equal(report.junction_count, kinds[k].junctions);
        assert_int_equal(report.junctions_with[IMPORT_SUPPORTED], kinds[k].junctions);
        assert_true(report.link_nodes > 0 || k == 1);   // the twig's own first nodes reach far enough into the wide vessel
        vessel_tree_free(tree);
        curve_set_free(set);
        free(mesh.vertex);
        free(mesh.triangle);
        vessel_tree_free(truth);
        shape_free(shape);
    }
}

// Curves that lead from one vessel into its neighbour through both walls: the surface shows that there is no connection, however thin the gap.
static void touching_vessels_stay_apart(void **state)
{
    (void)state;
    static const char *const gap[] = {"0.02", "0.1", "0.4"};
    for (int g = 0; g < 3; g++) {
        const char option[2][2][64] = {{"radius_mm", "1"}, {"gap_mm", {gap[g][0], gap[g][1], gap[g][2], gap[g][2] ? gap[g][3] : 0}}};
        faults_clear(&faults);
        Shape *shape = shape_create("kissing", 2, option, "test", &faults);
        assert_non_null(shape);
        VesselTree *truth = shape_sample(shape, &faults), *other = shape_sample(shape_neighbour(shape), &faults);
        SurfaceMesh mesh = {0};
        MeshCheck check;
        ImportReport report = {.curves_scaled = 1};
        ImportOptions options = import_default_options();
        assert_true(truth && other);
        add_surface(shape, 0.3, &mesh);
        add_surface(shape_neighbour(shape), 0.3, &mesh);
        assert_true(mesh_repair(&mesh, &check));
        CurveSet *set = curves_of(truth);
        // where the vessels are nearest: from the axis of one to that of the other, and along it
        int from = 0, to = 0, count = 0;
        for (int i = 0; i < truth->node_count; i++)
            for (int k = 1; k + 4 < other->node_count; k++)
                if (vec3_distance(truth->center[i], other->center[k]) < vec3_distance(truth->center[from], other->center[to]) - 1e-9) {
                    from = i;
                    to = k;
                }
        Vec3 *point = malloc(((size_t)other->node_count + 1) * sizeof *point);
        double *radius = malloc(((size_t)other->node_count + 1) * sizeof *radius);
        point[count] = truth->center[from];
        radius[count++] = 1;
        for (int k = to; k < other->node_count; k++) {
            point[count] = other->center[k];
            radius[count++] = other->radius[k];
        }
        assert_true(curve_set_add(set, point, radius, count));
        options.has_root = true;
        options.root = truth->center[0];
        VesselTree *tree = import_surface(&mesh, set, &options, &report, "kissing", &faults);
        for (int i = 0; i < faults.count; i++)
            print_message("%s\n", faults.text[i]);
        assert_non_null(tree);
        print_message("gap %s mm: %d junctions, %d refused, %d nodes left out, %d curves apart\n", gap[g], report.junction_count,
                      report.junctions_with[IMPORT_REFUSED], report.refused_nodes, report.lost_curves);
        for (int i = 0; i < tree->node_count; i++)
            assert_true(shape_field(shape, tree->center[i], NULL) > 0);
        assert_true(report.junctions_with[IMPORT_REFUSED] + report.lost_curves > 0);
        vessel_tree_free(tree);
        curve_set_free(set);
        free(point);
        free(radius);
        free(mesh.vertex);
        free(mesh.triangle);
        vessel_tree_free(truth);
        vessel_tree_free(other);
        shape_free(shape);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_ostium_is_described), cmocka_unit_test(touching_vessels_stay_apart)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
