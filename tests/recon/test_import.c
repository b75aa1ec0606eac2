// Import of a surface with centrelines: shapes whose geometry is known, in various transformations: unchanged, rotated and mirrored, in metres, with the
// curves in the other patient frame, with normals into the lumen, open; curves beside the middle or with wrong radii; parts without a centreline; curves of
// another vessel.
#include "recon/surface/import_surface.h"

#include "base/sort_doubles.h"
#include "recon/phantom/phantom.h"
#include "tests/short_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static Faults faults;

enum { PLAIN, TURNED, METRES, OTHER_FRAME, INSIDE_OUT, OPENED, VARIANTS };
static const char *const variant_name[VARIANTS] = {"plain", "turned", "metres", "other frame", "inside out", "opened"};

// A rotation about (1, 1, 1), a mirror and a shift.
static Vec3 turned(Vec3 p) { return vec3(17 - (0.8 * p.y - 0.6 * p.z), 5 + 0.6 * p.y + 0.8 * p.z, -3 + p.x); }
static Vec3 placed(Vec3 p, int variant) { return variant == TURNED ? turned(p) : p; }

// Returns true if triangle t closes a flat end: perpendicular to the vessel at one of the true ends, and ahead of it.
static bool is_cap(const VesselTree *truth, const TriangleMesh *mesh, int t)
{
    Vec3 a = mesh->vertex[mesh->triangle[t][0]], b = mesh->vertex[mesh->triangle[t][1]], c = mesh->vertex[mesh->triangle[t][2]];
    Vec3 n = vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a))), middle = vec3_scale(vec3_add(a, vec3_add(b, c)), 1.0 / 3);
    for (int i = 0; i < truth->node_count; i++) {
        int children = 0;
        for (int k = i + 1; k < truth->node_count; k++)
            children += truth->parent[k] == i;
        if (i > 0 && children > 0)
            continue;
        Vec3 outward = vec3_scale(truth->direction[i], i == 0 ? -1 : 1);
        if (vec3_distance(middle, truth->center[i]) < 1.5 * truth->radius[i] && vec3_dot(n, outward) > 0.9)
            return true;
    }
    return false;
}

static SurfaceMesh *mesh_of(const Shape *shape, const VesselTree *truth, double cell, int variant)
{
    TriangleMesh *made = shape_surface(shape, cell, &faults);
    assert_non_null(made);
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    mesh->vertex_count = made->vertex_count;
    mesh->vertex = malloc((size_t)made->vertex_count * sizeof(Vec3));
    mesh->triangle = malloc((size_t)made->triangle_count * sizeof(int[3]));
    for (int i = 0; i < made->vertex_count; i++)
        mesh->vertex[i] = placed(made->vertex[i], variant);
    for (int t = 0; t < made->triangle_count; t++) {
        if (variant == OPENED && is_cap(truth, made, t))
            continue;
        int *to = mesh->triangle[mesh->triangle_count++];
        memcpy(to, made->triangle[t], sizeof(int[3]));
        if (variant == INSIDE_OUT) {
            to[0] = made->triangle[t][1];
            to[1] = made->triangle[t][0];
        }
    }
    triangle_mesh_free(made);
    MeshCheck check;
    assert_true(mesh_repair(mesh, &check));
    return mesh;
}

// A curve from the root to each end, each including the trunk. `aside`: shift perpendicular to the curve, in radii.
static CurveSet *curves_of(const VesselTree *truth, int variant, double aside, double radius_factor)
{
    CurveSet *set = curve_set_create();
    double scale = variant == METRES ? 1e-3 : 1, sign = variant == OTHER_FRAME ? -1 : 1;
    Vec3 *point = malloc((size_t)truth->node_count * sizeof *point);
    double *radius = malloc((size_t)truth->node_count * sizeof *radius);
    for (int end = 1; end < truth->node_count; end++) {
        bool is_end = true;
        for (int k = end + 1; k < truth->node_count; k++)
            is_end = is_end && truth->parent[k] != end;
        int n = 0;
        for (int i = end; is_end && i >= 0; i = truth->parent[i], n++) {
            Vec3 p = placed(vec3_add_scaled(truth->center[i], aside * truth->radius[i], vec3_normal_to(truth->direction[i])), variant);
            point[n] = vec3(sign * scale * p.x, sign * scale * p.y, scale * p.z);
            radius[n] = radius_factor * scale * truth->radius[i];
        }
        assert_true(n == 0 || curve_set_add(set, point, radius, n));
    }
    free(point);
    free(radius);
    return set;
}

static int end_count(const VesselTree *tree)
{
    int ends = 1;
    for (int i = 1; i < tree->node_count; i++) {
        bool is_end = true;
        for (int k = i + 1; k < tree->node_count; k++)
            is_end = is_end && tree->parent[k] != i;
        ends += is_end;
    }
    return ends;
}

// Distance to the true centreline in its radii, and that radius.
static double off_centre(const VesselTree *truth, int variant, Vec3 p, double *radius)
{
    double least = INFINITY;
    *radius = 1;
    for (int i = 1; i < truth->node_count; i++) {
        Vec3 a = placed(truth->center[i], variant), ab = vec3_sub(placed(truth->center[truth->parent[i]], variant), a);
        double t = fmin(fmax(vec3_dot(vec3_sub(p, a), ab) / vec3_norm2(ab), 0), 1), d = vec3_distance(p, vec3_add_scaled(a, t, ab));
        if (d < least) {
            least = d;
            *radius = truth->radius[i] + t * (truth->radius[truth->parent[i]] - truth->radius[i]);
        }
    }
    return least / *radius;
}

// The mesh bevels the edges of flat lids, so the wall near ends is not compared.
static bool is_near_end(const VesselTree *truth, Vec3 p)
{
    for (int i = 0; i < truth->node_count; i++) {
        bool is_end = true;
        for (int k = i + 1; k < truth->node_count; k++)
            is_end = is_end && truth->parent[k] != i;
        if ((i == 0 || is_end) && vec3_distance(p, truth->center[i]) < 1.6 * truth->radius[i])
            return true;
    }
    return false;
}

typedef struct Case {
    Shape *shape;
    VesselTree *truth, *tree;
    SurfaceMesh *mesh;
    ImportReport report;
} Case;

static Case import_case(const char *name, double cell, int variant, double aside, double radius_factor, const ImportOptions *options)
{
    faults_clear(&faults);
    Case c = {.shape = shape_create(name, 0, NULL, "test", &faults), .report = {.curves_scaled = 1}};
    c.truth = shape_sample(c.shape, &faults);
    c.mesh = mesh_of(c.shape, c.truth, cell, variant);
    CurveSet *set = curves_of(c.truth, variant, aside, radius_factor);
    if (import_place_curves(c.mesh, variant == METRES ? 1000 : 1, set, &c.report, name, &faults))
        c.tree = import_surface(c.mesh, set, options, &c.report, name, &faults);
    curve_set_free(set);
    assert_non_null(c.tree);
    assert_int_equal(faults.count, 0);
    return c;
}

static void case_free(Case *c)
{
    vessel_tree_free(c->tree);
    vessel_tree_free(c->truth);
    surface_free(c->mesh);
    shape_free(c->shape);
}

static void check_shape(const char *name)
{
    ImportOptions options = import_default_options();
    for (int variant = 0; variant < VARIANTS; variant++) {
        Case c = import_case(name, 0.35, variant, 0, 1, &options);
        double worst = 0, *wrong = malloc((size_t)c.tree->node_count * sizeof *wrong);
        for (int i = 0; i < c.tree->node_count; i++) {
            double radius = 0;
            worst = fmax(worst, off_centre(c.truth, variant, c.tree->center[i], &radius));
            wrong[i] = fabs(c.tree->radius[i] / radius - 1);
        }
        sort_doubles(wrong, (size_t)c.tree->node_count);
        double most = wrong[c.tree->node_count * 9 / 10], from_wall = 0;
        for (int64_t i = 0; variant == PLAIN && i < c.tree->point_offset[c.tree->node_count]; i++)
            from_wall = fmax(from_wall, is_near_end(c.truth, c.tree->point[i]) ? 0 : fabs(shape_distance(c.shape, c.tree->point[i], NULL)));
        print_message("%s %s: %d nodes, centres off by %.4f at most, radii by %.3f (p90), %ld left, %ld unseen, %d moved\n", name, variant_name[variant],
                      c.tree->node_count, worst, most, c.report.left_points, c.report.unseen_points, c.report.moved_samples);
        assert_true(worst < 0.05);
        assert_true(most < 0.1);
        if (variant == PLAIN)
            print_message("points off the wall by %.4f at most\n", from_wall);
        assert_true(from_wall < 0.05);
        assert_int_equal(c.report.end_count, end_count(c.truth));
        assert_int_equal(c.report.open_end_count, end_count(c.truth));
        assert_true(vessel_tree_root_is_open(c.tree));
        assert_true(c.report.left_points * 100 <= c.report.sampled_points);
        assert_int_equal(c.report.moved_samples, 0);
        assert_int_equal(c.report.curves_flipped, variant == OTHER_FRAME);
        assert_float_equal(c.report.curves_scaled, variant == METRES ? 1000 : 1, 0);
        free(wrong);
        case_free(&c);
    }
}

static void test_tubes(void **state)
{
    (void)state;
    check_shape("open-capsule");
    check_shape("arc");
}

static void test_branches(void **state)
{
    (void)state;
    if (WHOLE_RUN)
        check_shape("bifurcation");
    check_shape("y");
}

static void test_threads(void **state)
{
    (void)state;
    ImportOptions options = import_default_options();
    options.threads = 1;
    Case one = import_case("y", 0.25, TURNED, 0.6, 1, &options);
    options.threads = 3;
    Case three = import_case("y", 0.25, TURNED, 0.6, 1, &options);
    size_t n = (size_t)one.tree->node_count, points = (size_t)one.tree->point_count;
    assert_int_equal(three.tree->node_count, n);
    assert_int_equal(three.tree->point_count, points);
    assert_memory_equal(one.tree->center, three.tree->center, n * sizeof(Vec3));
    assert_memory_equal(one.tree->direction, three.tree->direction, n * sizeof(Vec3));
    assert_memory_equal(one.tree->radius, three.tree->radius, n * sizeof(double));
    assert_memory_equal(one.tree->parent, three.tree->parent, n * sizeof *one.tree->parent);
    assert_memory_equal(one.tree->point_offset, three.tree->point_offset, (n + 1) * sizeof *one.tree->point_offset);
    assert_memory_equal(one.tree->point, three.tree->point, points * sizeof(Vec3));
    case_free(&one);
    case_free(&three);
}

// Points on coarse facets are moved to the round wall that the facets approximate.
static void test_coarse(void **state)
{
    (void)state;
    ImportOptions options = import_default_options();
    Case c = import_case("arc", 0.7, PLAIN, 0, 1, &options);
    double of_points = 0, of_facets = 0;
    long points = 0, facets = 0;
    for (int64_t i = 0; i < c.tree->point_count; i++) {
        double d = shape_distance(c.shape, c.tree->point[i], NULL);
        if (!is_near_end(c.truth, c.tree->point[i])) {
            of_points += d * d;
            points++;
        }
    }
    for (int t = 0; t < c.mesh->triangle_count; t++) {
        const int *corner = c.mesh->triangle[t];
        Vec3 middle = vec3_scale(vec3_add(c.mesh->vertex[corner[0]], vec3_add(c.mesh->vertex[corner[1]], c.mesh->vertex[corner[2]])), 1.0 / 3);
        double d = shape_distance(c.shape, middle, NULL);
        if (!is_near_end(c.truth, middle)) {
            of_facets += d * d;
            facets++;
        }
    }
    print_message("rms off the wall: points %.4f, facets' middles %.4f\n", sqrt(of_points / (double)points), sqrt(of_facets / (double)facets));
    assert_true(of_points / (double)points < 0.25 * of_facets / (double)facets);
    case_free(&c);
}

static double mean_off(const Case *c)
{
    double sum = 0, radius;
    for (int i = 0; i < c->tree->node_count; i++)
        sum += off_centre(c->truth, PLAIN, c->tree->center[i], &radius);
    return sum / c->tree->node_count;
}

static void test_curves_beside(void **state)
{
    (void)state;
    ImportOptions options = import_default_options();
    Case near = import_case("arc", 0.25, PLAIN, 0.2, 1, &options);
    // a curve slightly beside the middle is unchanged, except for an end outside the lumen
    assert_true(near.report.moved_samples <= 1);
    assert_float_equal(mean_off(&near), 0.2, 0.03);
    case_free(&near);
    Case far = import_case("arc", 0.25, PLAIN, 0.7, 1, &options);
    print_message("0.7 radii beside: nodes %.3f radii off, %d of %d samples moved\n", mean_off(&far), far.report.moved_samples, far.report.samples);
    assert_true(far.report.moved_samples > far.report.samples / 4);
    assert_true(mean_off(&far) < 0.45);
    case_free(&far);
}

static void test_wrong_radii(void **state)
{
    (void)state;
    ImportOptions options = import_default_options();
    const double factor[] = {0.6, 1.5};
    for (size_t k = 0; k < sizeof factor / sizeof factor[0]; k++) {
        Case c = import_case("arc", 0.25, PLAIN, 0, factor[k], &options);
        for (int i = 0; i < c.tree->node_count; i++)
            assert_float_equal(c.tree->radius[i], 1, 0.08);
        case_free(&c);
    }
}

// A thin branch without a centreline beside the only vessel that has one, and a part far away: both are omitted and reported.
static void test_no_centreline(void **state)
{
    (void)state;
    ImportOptions options = import_default_options();
    faults_clear(&faults);
    Shape *shape = shape_create("twig", 0, NULL, "test", &faults);
    VesselTree *truth = shape_sample(shape, &faults);
    SurfaceMesh *mesh = mesh_of(shape, truth, 0.08, PLAIN);
    int v = mesh->vertex_count, t = mesh->triangle_count;
    mesh->vertex = realloc(mesh->vertex, (size_t)(v + 4) * sizeof(Vec3));
    mesh->triangle = realloc(mesh->triangle, (size_t)(t + 4) * sizeof(int[3]));
    for (int k = 0; k < 4; k++) {
        mesh->vertex[v + k] = vec3(100 + (k == 1), 100 + (k == 2), 100 + (k == 3));
        for (int m = 0; m < 3; m++)
            mesh->triangle[t + k][m] = v + (k + m + (k + m >= 4 ? -4 : 0));
    }
    mesh->vertex_count += 4;
    mesh->triangle_count += 4;
    MeshCheck check;
    assert_true(mesh_repair(mesh, &check));
    // only the longest curve
    CurveSet *all = curves_of(truth, PLAIN, 0, 1), *set = curve_set_create();
    int longest = 0;
    for (int i = 1; i < all->curve_count; i++)
        if (vec3_distance(all->point[all->offset[i]], all->point[all->offset[i + 1] - 1]) >
            vec3_distance(all->point[all->offset[longest]], all->point[all->offset[longest + 1] - 1]))
            longest = i;
    assert_true(all->curve_count == 2);
    assert_true(curve_set_add(set, all->point + all->offset[longest], all->radius + all->offset[longest], all->offset[longest + 1] - all->offset[longest]));
    ImportReport report = {.curves_scaled = 1};
    VesselTree *tree = import_surface(mesh, set, &options, &report, "twig", &faults);
    assert_non_null(tree);
    assert_int_equal(report.unused_components, 1);
    assert_int_equal(report.branch_count, 1);
    assert_true(report.left_points > 0);
    double farthest = 0;
    for (int64_t i = 0; i < tree->point_count; i++) {
        double least = INFINITY;
        for (int k = 0; k < set->point_count; k++)
            least = fmin(least, vec3_distance(tree->point[i], set->point[k]) / set->radius[k]);
        farthest = fmax(farthest, least);
    }
    print_message("twig: points up to %.2f radii from the vessel's curve, %ld left out\n", farthest, report.left_points);
    assert_true(farthest < 1.7);
    vessel_tree_free(tree);
    curve_set_free(set);
    curve_set_free(all);
    surface_free(mesh);
    vessel_tree_free(truth);
    shape_free(shape);
}

static void test_other_vessel(void **state)
{
    (void)state;
    faults_clear(&faults);
    Shape *shape = shape_create("arc", 0, NULL, "test", &faults);
    VesselTree *truth = shape_sample(shape, &faults);
    SurfaceMesh *mesh = mesh_of(shape, truth, 0.4, PLAIN);
    CurveSet *set = curves_of(truth, PLAIN, 0, 1);
    for (int i = 0; i < set->point_count; i++)
        set->point[i].z += 30;
    ImportReport report = {.curves_scaled = 1};
    assert_false(import_place_curves(mesh, 1, set, &report, "arc.vtp", &faults));
    assert_int_equal(faults.count, 1);
    curve_set_free(set);
    surface_free(mesh);
    vessel_tree_free(truth);
    shape_free(shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_tubes),         cmocka_unit_test(test_branches),      cmocka_unit_test(test_threads),
                                       cmocka_unit_test(test_coarse),        cmocka_unit_test(test_curves_beside), cmocka_unit_test(test_wrong_radii),
                                       cmocka_unit_test(test_no_centreline), cmocka_unit_test(test_other_vessel)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
