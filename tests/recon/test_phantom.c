// The exact geometry of the shapes: closed forms for capsule and arc, |grad f| <= 1, projection, samples, the phantom's properties, mesh and volume against
// each other.
#include "recon/phantom/phantom.h"
#include "recon/phantom/phantom_measure.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "cubic_volume.h"
#include "tests/geom/near.h"
#include "tests/geom/random_numbers.h"

static Faults faults;

static Shape *make(const char *name, const char *key, const char *value)
{
    char option[1][2][64];
    faults_clear(&faults);
    if (key) {
        strcpy(option[0][0], key);
        strcpy(option[0][1], value);
    }
    Shape *shape = shape_create(name, key ? 1 : 0, (const char(*)[2][64])option, "test", &faults);
    assert_non_null(shape);
    return shape;
}

static void capsule_is_a_capsule(void **state)
{
    (void)state;
    Shape *shape = make("capsule", "length_mm", "7");
    uint64_t seed = 5;
    for (int i = 0; i < 500; i++) {
        Vec3 x = vec3_add(random_in_box(&seed, 5), vec3(3.5, 0, 0)), foot;
        double along = fmin(fmax(x.x, 0), 7), exact = 1 - vec3_distance(x, vec3(along, 0, 0));
        assert_near(shape_field(shape, x, NULL), exact, 1e-9);
        if (fabs(exact) < 0.8) {
            assert_near(shape_distance(shape, x, &foot), exact, 1e-9);
            assert_near(vec3_distance(foot, x), fabs(exact), 1e-9);
        }
    }
    shape_free(shape);
}

// The half torus; its splined centreline leaves the circle by less than 1e-5 mm.
static void arc_is_a_torus(void **state)
{
    (void)state;
    Shape *shape = make("arc", NULL, NULL);
    uint64_t seed = 6;
    int seen = 0;
    while (seen < 300) {
        Vec3 x = vec3_add(random_in_box(&seed, 6), vec3(0, 4, 0));
        double across = sqrt(x.x * x.x + (x.y - 4) * (x.y - 4)), exact = 1 - sqrt((across - 4) * (across - 4) + x.z * x.z);
        if (x.x < 0.5 || fabs(exact) > 0.8)
            continue;
        assert_near(shape_distance(shape, x, NULL), exact, 1e-5);
        seen++;
    }
    assert_true(shape_beyond_open_end(shape, vec3(-1, 0, 0)));
    assert_false(shape_beyond_open_end(shape, vec3(1, 0, 0)));
    shape_free(shape);
}

// Marching requires |grad f| <= 1; the gradient is that of the field; the closest point is no further than any sample.
static void field_and_distance_agree(void **state)
{
    (void)state;
    static const char *const names[] = {"bifurcation", "spiral", "phantom"};
    for (int s = 0; s < 3; s++) {
        Shape *shape = make(names[s], NULL, NULL);
        VesselTree *tree = shape_sample(shape, &faults);
        uint64_t seed = 7;
        for (int i = 0; i < 300; i++) {
            int64_t which = (int64_t)random_in(&seed, 0, (double)tree->point_count);
            Vec3 x = vec3_add(tree->point[which], random_in_box(&seed, 0.2)), g, foot;
            double f = shape_field(shape, x, &g), step = 1e-6;
            assert_true(vec3_norm(g) < 1 + 1e-9);
            for (int k = 0; k < 3; k++) {
                Vec3 e = vec3(k == 0, k == 1, k == 2);
                double slope = (shape_field(shape, vec3_add_scaled(x, step, e), NULL) - shape_field(shape, vec3_add_scaled(x, -step, e), NULL)) / (2 * step);
                assert_near(slope, vec3_dot(g, e), 2e-4);
            }
            double d = shape_distance(shape, x, &foot);
            assert_true(d == 0 || (d > 0) == (f > 0));
            assert_near(shape_field(shape, foot, NULL), 0, 1e-9);
            assert_true(fabs(d) > fabs(f) - 1e-9);
            assert_true(fabs(d) < vec3_distance(x, tree->point[which]) + 1e-9);
            // the line to the foot is perpendicular to the surface
            Vec3 n;
            shape_field(shape, foot, &n);
            n = vec3_unit(n);
            Vec3 away = vec3_sub(x, foot);
            assert_true(vec3_norm(vec3_add_scaled(away, -vec3_dot(away, n), n)) < 1e-6);
        }
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

static void samples_lie_on_the_surface(void **state)
{
    (void)state;
    static const char *const names[] = {"capsule", "open-capsule", "arc", "bifurcation", "spiral", "phantom"};
    for (int s = 0; s < 6; s++) {
        Shape *shape = make(names[s], NULL, NULL);
        VesselTree *tree = shape_sample(shape, &faults);
        assert_non_null(tree);
        assert_true(vessel_tree_validate(tree, names[s], &faults));
        for (int64_t i = 0; i < tree->point_count; i++)
            assert_near(shape_field(shape, tree->point[i], NULL), 0, 1e-9);   // so no point is inside another part
        for (int n = 0; n < tree->node_count; n++) {
            assert_true(tree->point_offset[n + 1] - tree->point_offset[n] >= 20);
            assert_true(shape_field(shape, tree->center[n], NULL) > 0.99 * tree->radius[n]);
            int parent = tree->parent[n];
            if (parent >= 0 && tree->kind[n] == NODE_VESSEL && parent == n - 1)
                assert_true(vec3_distance(tree->center[n], tree->center[parent]) < 0.7 * tree->radius[parent]);
        }
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

static void noise_has_its_size_and_seed(void **state)
{
    (void)state;
    Shape *exact = make("arc", NULL, NULL), *noisy = make("arc", "noise_mm", "0.1");
    VesselTree *tree = shape_sample(noisy, &faults), *again = shape_sample(noisy, &faults);
    double sum = 0, square = 0, n = (double)tree->point_count;
    for (int64_t i = 0; i < tree->point_count; i++) {
        double d = shape_distance(exact, tree->point[i], NULL);
        sum += d / n;
        square += d * d / n;
    }
    // 2,800 samples: the mean must be within 3 sigma / sqrt(n), sigma within 3 / sqrt(2 n)
    assert_near(sum, 0, 3 * 0.1 / sqrt(n));
    assert_near(sqrt(square), 0.1, 0.1 * 3 / sqrt(2 * n));
    assert_memory_equal(tree->point, again->point, (size_t)tree->point_count * sizeof(Vec3));
    vessel_tree_free(tree);
    vessel_tree_free(again);
    shape_free(exact);
    shape_free(noisy);
}

// Polar radius 15.75 / theta, theta from pi to 4 pi, tube radius 0.5 to 0.15.
static void spiral_is_the_papers(void **state)
{
    (void)state;
    VesselTree *tree = shape_tree("spiral", 0, NULL, "test", &faults);
    int last = tree->node_count - 1;
    assert_near(tree->radius[0], 0.5, 1e-9);
    assert_near(tree->radius[last], 0.15, 1e-9);
    for (int n = 0; n <= last; n++) {
        Vec3 c = tree->center[n];
        double polar = sqrt(c.x * c.x + c.y * c.y), theta = 15.75 / polar;
        assert_true(theta > PI - 1e-3 && theta < 4 * PI + 1e-3);
        assert_near(c.x, polar * cos(theta), 2e-3);
        assert_near(c.y, polar * sin(theta), 2e-3);
        assert_near(c.z, 0, 1e-12);
        assert_near(tree->radius[n], 0.5 - 0.35 * (theta - PI) / (3 * PI), 2e-3);
    }
    vessel_tree_free(tree);
}

// The phantom has about 150 mm of vessel, radii 0.6 to 2.5 mm, one sac, a three-dimensional course, a pair of vessels that come close but do not touch, and
// no bends tighter than the tube.
static void phantom_keeps_its_promises(void **state)
{
    (void)state;
    VesselTree *tree = shape_tree("phantom", 0, NULL, "test", &faults);
    double length = 0, thin = 1e9, wide = 0, kiss = 1e9;
    int leaves = 0, sacs = 0;
    Vec3 low = tree->center[0], high = low;
    for (int n = 0; n < tree->node_count; n++) {
        Vec3 c = tree->center[n];
        low = vec3(fmin(low.x, c.x), fmin(low.y, c.y), fmin(low.z, c.z));
        high = vec3(fmax(high.x, c.x), fmax(high.y, c.y), fmax(high.z, c.z));
        sacs += tree->kind[n] == NODE_ANEURYSM;
        leaves += tree->neighbour_offset[n + 1] - tree->neighbour_offset[n] == 1 && n > 0;
        if (tree->kind[n] == NODE_ANEURYSM)
            continue;
        thin = fmin(thin, tree->radius[n]);
        wide = fmax(wide, tree->radius[n]);
        int a = tree->parent[n], b = a >= 0 ? tree->parent[a] : -1;
        if (a >= 0)
            length += vec3_distance(c, tree->center[a]);
        if (b >= 0 && a == n - 1 && b == n - 2) {
            Vec3 u = vec3_sub(tree->center[a], tree->center[b]), v = vec3_sub(c, tree->center[a]);
            double turn = vec3_norm(vec3_sub(vec3_unit(v), vec3_unit(u))), bend = 0.5 * (vec3_norm(u) + vec3_norm(v)) / fmax(turn, 1e-12);
            assert_true(bend > 1.3 * tree->radius[a]);
        }
        // side branches come closest to each other after their first nodes
        int branch = n, other_end;
        while (branch > 0 && tree->parent[branch] == branch - 1)
            branch--;
        for (int m = branch - 1; branch > 0 && n >= branch + 6 && m > 0; m--) {
            other_end = m;
            while (other_end > 0 && tree->parent[other_end] == other_end - 1)
                other_end--;
            if (other_end > 0 && m >= other_end + 6 && tree->kind[m] == NODE_VESSEL)
                kiss = fmin(kiss, vec3_distance(c, tree->center[m]) - tree->radius[n] - tree->radius[m]);
        }
    }
    assert_near(length, 150, 20);
    assert_near(wide, 2.5, 1e-9);
    assert_near(thin, 0.6, 1e-9);
    assert_int_equal(sacs, 1);
    assert_int_equal(leaves, 2 + 2 + 2 + 1);   // middle and anterior end, two branches each, the sac
    assert_true(high.x - low.x > 20 && high.y - low.y > 15 && high.z - low.z > 40);
    assert_true(kiss > 0.02 && kiss < 0.3);
    vessel_tree_free(tree);
}

static double mesh_volume(const TriangleMesh *mesh)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        sum += vec3_dot(mesh->vertex[v[0]], vec3_cross(mesh->vertex[v[1]], mesh->vertex[v[2]])) / 6;
    }
    return sum;
}

// A closed capsule, whose volume is known: the mesh's error decreases fourfold when the cell is halved. Every edge has two faces, which traverse it in
// opposite directions.
static void surface_is_closed_and_converges(void **state)
{
    (void)state;
    Shape *shape = make("capsule", NULL, NULL);
    double exact = PI * 4 + 4.0 / 3 * PI, error[2];
    for (int k = 0; k < 2; k++) {
        TriangleMesh *mesh = shape_surface(shape, k ? 0.15 : 0.3, &faults);
        assert_non_null(mesh);
        error[k] = exact - mesh_volume(mesh);
        assert_int_equal(2 * mesh->vertex_count - mesh->triangle_count, 4);   // Euler: a sphere
        for (int i = 0; i < mesh->vertex_count; i++) {
            assert_near(shape_field(shape, mesh->vertex[i], NULL), 0, 1e-9);
            Vec3 g;
            shape_field(shape, mesh->vertex[i], &g);
            assert_true(vec3_dot(g, mesh->normal[i]) < -0.9);
        }
        triangle_mesh_free(mesh);
    }
    assert_true(error[0] > 0 && error[1] > 0 && error[0] / error[1] > 3.3 && error[0] / error[1] < 4.7);
    shape_free(shape);
}

static void volume_holds_the_shape(void **state)
{
    (void)state;
    Shape *shape = make("capsule", NULL, NULL);
    Volume *volume = cubic_volume(shape, 0.2, 0.3, 0, 1, &faults), *noisy = cubic_volume(shape, 0.2, 0.3, 0.05, 1, &faults);
    assert_non_null(volume);
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    double sum = 0, square = 0;
    for (size_t i = 0; i < count; i++) {
        sum += (double)volume->value[i] * 0.008;
        square += pow((double)(noisy->value[i] - volume->value[i]), 2) / (double)count;
    }
    // partial voxels from the field are accurate to second order in voxel / radius
    assert_near(sum, PI * 4 + 4.0 / 3 * PI, 0.01 * sum);
    assert_near(sqrt(square), 0.05, 0.001);
    shape_free(shape);
    volume_free(volume);
    volume_free(noisy);
}

// Arches are those of their published figures: the mean arch does not depend on the seed and passes through the mean points; the figures of many arches have the
// published means and deviations; each type has its branches.
static Shape *arch(int type, uint64_t seed, double spread)
{
    char option[3][2][64] = {{"arch_type"}, {"seed"}, {"spread"}};
    snprintf(option[0][1], 64, "%d", type);
    snprintf(option[1][1], 64, "%d", (int)seed);
    snprintf(option[2][1], 64, "%g", spread);
    faults_clear(&faults);
    Shape *shape = shape_create("arch", 3, (const char(*)[2][64])option, "test", &faults);
    assert_non_null(shape);
    return shape;
}

static void arches_have_their_figures(void **state)
{
    (void)state;
    static const int types[] = {1, 2, 4, 5, 6, 7};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        Shape *mean = arch(types[i], 1, 0), *same = types[i] == 5 ? NULL : arch(types[i], 2, 0);
        // a point of the descending aorta, 20 mm wide; it widens by 0.02 mm per mm, so that a sphere further on reaches a little further
        double r = shape_field(mean, vec3(30, 0, 90), NULL);
        assert_true(r >= 10 - 1e-3 && r < 10.05);
        uint64_t seed = 9;
        for (int k = 0; same && k < 100; k++) {     // type 5 has two forms
            Vec3 x = vec3_add(vec3(0, -30, 130), random_in_box(&seed, 80));
            assert_true(shape_field(mean, x, NULL) == shape_field(same, x, NULL));
        }
        VesselTree *tree = shape_sample(mean, &faults);
        int ends = 0;
        for (int n = 0; n < tree->node_count; n++) {
            bool is_parent = false;
            for (int m = n + 1; m < tree->node_count && !is_parent; m++)
                is_parent = tree->parent[m] == n;
            ends += !is_parent;
        }
        assert_int_equal(ends, 5);      // the heart, two carotid and two subclavian arteries
        vessel_tree_free(tree);
        shape_free(mean);
        shape_free(same);
    }
    enum { MANY = 300 };
    double sum = 0, square = 0, high = 0, low = HUGE_VAL;
    for (int i = 0; i < MANY; i++) {
        Shape *one = arch(5 - 4 * (i % 2), (uint64_t)i, 1);
        Vec3 least, most;
        double r = shape_field(one, vec3(0, 0, 0), NULL);      // half of 17 mm with a deviation of 1 mm
        sum += r, square += r * r;
        shape_bounds(one, &least, &most);
        high = fmax(high, most.z), low = fmin(low, most.z);
        shape_free(one);
    }
    double mean = sum / MANY, deviation = sqrt(square / MANY - mean * mean);
    assert_true(fabs(mean - 8.5) < 4 * 0.5 / sqrt(MANY));
    assert_true(fabs(deviation / 0.5 - 1) < 4 / sqrt(2.0 * MANY));
    // the left carotid artery ends at z = 230 mm, rounded by its radius of at most 5.5 mm, and heights are stretched by 0.7 to 1.3
    assert_true(low > 0.7 * 230 && low < 0.72 * 230 + 5.5 && high > 1.28 * 230 && high < 1.3 * 230 + 5.5);
    faults_clear(&faults);
    assert_null(shape_create("arch", 1, (const char[1][2][64]){{"arch_type", "3"}}, "test", &faults));
    assert_string_equal(faults.text[0], "test: shape option arch_type is 3; expected 1, 2, 4, 5, 6 or 7");
}

static void bad_options_are_faults(void **state)
{
    (void)state;
    const char option[4][2][64] = {{"radius", "1"}, {"points", "many"}, {"noise_mm", "-1"}, {"spacing", "nan"}};
    faults_clear(&faults);
    assert_null(shape_create("capsul", 4, option, "scene.yaml", &faults));
    assert_int_equal(faults.count, 5);
    assert_non_null(strstr(faults.text[0], "open-capsule"));
    const char tight[2][2][64] = {{"radius_mm", "2"}, {"bend_radius_mm", "1"}};
    faults_clear(&faults);
    assert_null(shape_tree("arc", 2, tight, "scene.yaml", &faults));
    assert_int_equal(faults.count, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(capsule_is_a_capsule),        cmocka_unit_test(arc_is_a_torus),
        cmocka_unit_test(field_and_distance_agree),    cmocka_unit_test(samples_lie_on_the_surface),
        cmocka_unit_test(noise_has_its_size_and_seed), cmocka_unit_test(spiral_is_the_papers),
        cmocka_unit_test(phantom_keeps_its_promises),  cmocka_unit_test(surface_is_closed_and_converges),
        cmocka_unit_test(volume_holds_the_shape),      cmocka_unit_test(bad_options_are_faults),
        cmocka_unit_test(arches_have_their_figures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
