// Centrelines computed from surfaces alone, against those of the shapes: as many ends and branches, near the true ones, with their radii; the same when
// rotated and mirrored, and with any number of threads. A surface that encloses nothing is refused.
#include "recon/phantom/phantom.h"
#include "recon/surface/import_surface.h"
#include "recon/surface/mesh_centreline.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static Faults faults;

static Vec3 turned(Vec3 p, bool turn)
{
    // a rotation about (1, 1, 1), a mirror and a shift
    return turn ? vec3(17 - (0.8 * p.y - 0.6 * p.z), 5 + 0.6 * p.y + 0.8 * p.z, -3 + p.x) : p;
}

static SurfaceMesh *mesh_of(const Shape *shape, double cell, bool turn)
{
    TriangleMesh *made = shape_surface(shape, cell, &faults);
    assert_non_null(made);
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    mesh->vertex_count = made->vertex_count;
    mesh->triangle_count = made->triangle_count;
    mesh->vertex = malloc((size_t)made->vertex_count * sizeof(Vec3));
    mesh->triangle = malloc((size_t)made->triangle_count * sizeof(int[3]));
    for (int i = 0; i < made->vertex_count; i++)
        mesh->vertex[i] = turned(made->vertex[i], turn);
    memcpy(mesh->triangle, made->triangle, (size_t)made->triangle_count * sizeof(int[3]));
    triangle_mesh_free(made);
    MeshCheck check;
    assert_true(mesh_repair(mesh, &check));
    return mesh;
}

static double to_segment(Vec3 p, Vec3 a, Vec3 b)
{
    Vec3 ab = vec3_sub(b, a);
    double t = vec3_dot(vec3_sub(p, a), ab) / fmax(vec3_norm2(ab), 1e-300);
    return vec3_distance(p, vec3_add_scaled(a, fmin(fmax(t, 0), 1), ab));
}

// Computes the fraction of the true nodes that lie within half a radius of the curves, and the mean distance of the curves' points from the true centrelines,
// in radii.
static void compare(const CurveSet *set, const VesselTree *truth, bool turn, double *found, double *off, double *radius_error)
{
    int hits = 0, n = 0;
    double sum = 0, wrong = 0;
    for (int i = 0; i < truth->node_count; i++) {
        double least = INFINITY;
        for (int c = 0; c < set->curve_count; c++)
            for (int k = set->offset[c]; k + 1 < set->offset[c + 1]; k++)
                least = fmin(least, to_segment(turned(truth->center[i], turn), set->point[k], set->point[k + 1]));
        hits += least < 0.5 * truth->radius[i];
    }
    for (int k = 0; k < set->point_count; k++) {
        double least = INFINITY, radius = 1;
        for (int i = 1; i < truth->node_count; i++) {
            double d = to_segment(set->point[k], turned(truth->center[i], turn), turned(truth->center[truth->parent[i]], turn));
            if (d < least) {
                least = d;
                radius = truth->radius[i];
            }
        }
        sum += least / radius;
        wrong += fabs(set->radius[k] / radius - 1);
        n++;
    }
    *found = (double)hits / truth->node_count;
    *off = sum / n;
    *radius_error = wrong / n;
}

static void count_tree(const VesselTree *tree, int *ends, int *branches)
{
    *ends = 1;
    *branches = 1;
    for (int i = 0; i < tree->node_count; i++) {
        int children = 0;
        for (int k = i + 1; k < tree->node_count; k++)
            children += tree->parent[k] == i;
        *ends += children == 0;
        *branches += children > 1 ? children : 0;
    }
}

static void check_shape(const char *name, const char *key, const char *value, double cell, double off_max)
{
    char option[1][2][64];
    snprintf(option[0][0], 64, "%s", key);
    snprintf(option[0][1], 64, "%s", value);
    faults_clear(&faults);
    Shape *shape = shape_create(name, key[0] ? 1 : 0, (const char(*)[2][64])option, "test", &faults);
    VesselTree *truth = shape_sample(shape, &faults);
    assert_non_null(truth);
    for (int turn = 0; turn < 2; turn++) {
        SurfaceMesh *mesh = mesh_of(shape, cell, turn);
        ImportOptions options = import_default_options();
        ImportReport report = {0};
        CurveSet *set = mesh_centreline(mesh, &options, &report, name, &faults);
        assert_non_null(set);
        double found, off, radius_error;
        compare(set, truth, turn, &found, &off, &radius_error);
        VesselTree *tree = import_surface(mesh, set, &options, &report, name, &faults);
        assert_non_null(tree);
        int ends, branches;
        count_tree(truth, &ends, &branches);
        print_message("%s%s: ends %d of %d, branches %d of %d, found %.3f, off %.4f radii, radius %.4f, %.2f %% unseen\n", name, turn ? " turned" : "",
                      report.end_count, ends, report.branch_count, branches, found, off, radius_error,
                      100.0 * (double)report.unseen_points / (double)report.sampled_points);
        assert_int_equal(report.end_count, ends);
        assert_int_equal(report.branch_count, branches);
        assert_true(found > 0.98);
        assert_true(off < off_max);
        assert_true(radius_error < 0.1);
        assert_true(report.unseen_points <= report.sampled_points / 50);
        if (turn == 0 && branches == 3) {
            options.threads = 3;
            CurveSet *again = mesh_centreline(mesh, &options, &report, name, &faults);
            assert_non_null(again);
            assert_int_equal(again->point_count, set->point_count);
            assert_memory_equal(again->point, set->point, (size_t)set->point_count * sizeof(Vec3));
            curve_set_free(again);
        }
        vessel_tree_free(tree);
        curve_set_free(set);
        surface_free(mesh);
    }
    vessel_tree_free(truth);
    shape_free(shape);
}

static void test_tubes(void **state)
{
    (void)state;
    check_shape("open-capsule", "", "", 0.3, 0.02);
    for (int k = 0; k < 2; k++)       // only printed
        check_shape(k ? "helix" : "arc", "", "", k ? 0.4 : 0.3, 0.02);
}

static void test_branches(void **state)
{
    (void)state;
    check_shape("bifurcation", "", "", 0.3, 0.05);
    check_shape("y", "", "", 0.3, 0.04);
    check_shape("tree", "branches", "11", 0.45, 0.05);
}

static VesselTree *import_alone(SurfaceMesh *mesh, const char *name, ImportReport *report)
{
    ImportOptions options = import_default_options();
    CurveSet *set = mesh_centreline(mesh, &options, report, name, &faults);
    assert_non_null(set);
    VesselTree *tree = import_surface(mesh, set, &options, report, name, &faults);
    assert_non_null(tree);
    assert_int_equal(report->loop_count, 0);
    assert_true(report->unseen_points <= report->sampled_points / 50);
    curve_set_free(set);
    surface_free(mesh);
    return tree;
}

// A sac gives at most one branch and hides no other.
static void test_sacs(void **state)
{
    (void)state;
    static const char option[3][2][64] = {{"branches", "9"}, {"sacs", "2"}, {"seed", "2"}};
    faults_clear(&faults);
    int ends, branches;
    Shape *plain = shape_create("tree", 1, option, "test", &faults), *shape = shape_create("tree", 3, option, "test", &faults);
    VesselTree *truth = shape_sample(plain, &faults);
    assert_non_null(truth);
    count_tree(truth, &ends, &branches);
    for (int turn = 0; turn < 2; turn++) {
        ImportReport report = {0};
        VesselTree *tree = import_alone(mesh_of(shape, 0.5, turn), "sacs", &report);
        print_message("two sacs%s: ends %d of %d without sacs\n", turn ? " turned" : "", report.end_count, ends);
        assert_in_range(report.end_count, ends, ends + 2);
        vessel_tree_free(tree);
    }
    vessel_tree_free(truth);
    shape_free(plain);
    shape_free(shape);
}

// A tube of radius 2 mm along 30 mm of a circle of 20 mm, open at its ends, narrowed to `least` of its radius in the middle.
static SurfaceMesh *stenosis(double least)
{
    enum { RINGS = 121, AROUND = 24 };
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    mesh->vertex = malloc((size_t)RINGS * AROUND * sizeof(Vec3));
    mesh->triangle = malloc((size_t)RINGS * AROUND * 2 * sizeof(int[3]));
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < AROUND; k++) {
            double s = 30.0 * i / (RINGS - 1), a = s / 20, around = 2 * PI * k / AROUND, r = 2 * (1 - (1 - least) * exp(-(s - 15) * (s - 15) / 4));
            Vec3 inward = vec3(-sin(a), cos(a), 0), middle = vec3(20 * sin(a), 20 * (1 - cos(a)), 0);
            mesh->vertex[mesh->vertex_count++] = vec3_add(middle, vec3_add(vec3_scale(inward, r * cos(around)), vec3(0, 0, r * sin(around))));
        }
    for (int i = 0; i + 1 < RINGS; i++)
        for (int k = 0; k < AROUND; k++) {
            int a = i * AROUND + k, b = i * AROUND + (k + 1) % AROUND;
            memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){a, b, a + AROUND}, sizeof(int[3]));
            memcpy(mesh->triangle[mesh->triangle_count++], (int[3]){b, b + AROUND, a + AROUND}, sizeof(int[3]));
        }
    MeshCheck check;
    assert_true(mesh_repair(mesh, &check));
    return mesh;
}

static void test_stenosis(void **state)
{
    (void)state;
    for (double least = 0.6; least > 0.1; least -= 0.2) {
        ImportReport report = {0};
        faults_clear(&faults);
        VesselTree *tree = import_alone(stenosis(least), "stenosis", &report);
        print_message("narrowed to %.1f: radius %.3f of %.3f mm, length %.2f of 30 mm\n", least, report.radius_min, 2 * least, report.length);
        assert_int_equal(report.branch_count, 1);
        assert_int_equal(report.open_end_count, 2);
        assert_true(fabs(report.length - 30) < 0.6);
        // the inscribed circle of a polygon of 24 sides has 0.99 of the radius
        assert_true(fabs(report.radius_min / (2 * least) - 1) < 0.1);
        vessel_tree_free(tree);
    }
}

static void test_nothing(void **state)
{
    (void)state;
    // one triangle encloses nothing
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    mesh->vertex_count = 3;
    mesh->triangle_count = 1;
    mesh->vertex = malloc(3 * sizeof(Vec3));
    mesh->triangle = malloc(sizeof(int[3]));
    mesh->vertex[0] = vec3(0, 0, 0);
    mesh->vertex[1] = vec3(5, 0, 0);
    mesh->vertex[2] = vec3(0, 5, 0);
    for (int k = 0; k < 3; k++)
        mesh->triangle[0][k] = k;
    ImportOptions options = import_default_options();
    ImportReport report = {0};
    faults_clear(&faults);
    assert_null(mesh_centreline(mesh, &options, &report, "flat.stl", &faults));
    assert_int_equal(faults.count, 1);
    surface_free(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_tubes), cmocka_unit_test(test_branches), cmocka_unit_test(test_sacs),
                                       cmocka_unit_test(test_stenosis), cmocka_unit_test(test_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
