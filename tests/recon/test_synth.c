// The shapes for angiograms and their volumes: closed forms, properties of the random tree, the octree against all parts, partial volume, noise, threads,
// frames.
#include "bench/track_score.h"
#include "recon/phantom/phantom_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/geom/near.h"
#include "tests/geom/random_numbers.h"

static Faults faults;

// "key value key value …"
static Shape *make(const char *name, const char *text)
{
    char option[8][2][64];
    int count = 0, used;
    while (count < 8 && sscanf(text, " %63s %63s%n", option[count][0], option[count][1], &used) == 2)
        text += used, count++;
    faults_clear(&faults);
    Shape *shape = shape_create(name, count, (const char(*)[2][64])option, "test", &faults);
    if (!shape)
        fail_msg("%s", faults.text[0]);
    return shape;
}

// Compares with the distance to the helix by search along it: radius 4, rise 12, two turns.
static void helix_is_a_helix(void **state)
{
    (void)state;
    Shape *shape = make("helix", "");
    uint64_t seed = 1;
    for (int seen = 0; seen < 100;) {
        double u = random_in(&seed, 0.1, 0.9), nearest = HUGE_VAL, at = 0;
        Vec3 x = vec3_add(vec3(4 * cos(4 * PI * u), 4 * sin(4 * PI * u), 12 * u), random_in_box(&seed, 1));
        for (double step = 0.01, low = 0, high = 1; step > 1e-8; low = at - step, high = at + step, step *= 0.1)
            for (double t = low; t <= high; t += step) {
                double d = vec3_distance(x, vec3(4 * cos(4 * PI * t), 4 * sin(4 * PI * t), 12 * t));
                if (d < nearest)
                    nearest = d, at = t;
            }
        if (nearest < 0.05)
            continue;
        assert_near(shape_field(shape, x, NULL), 1 - nearest, 2e-5);   // the spline's error
        seen++;
    }
    shape_free(shape);
}

static void y_is_symmetric_and_murrays(void **state)
{
    (void)state;
    Shape *shape = make("y", "length_mm 8");
    uint64_t seed = 2;
    for (int seen = 0; seen < 300;) {
        Vec3 x = random_in_box(&seed, 7);
        double f = shape_field(shape, x, NULL);
        if (fabs(f) > 0.5)
            continue;        // far outside, the trunk's half of a part is visible past the fork
        assert_near(f, shape_field(shape, vec3(x.x, -x.y, -x.z), NULL), 2e-3);
        seen++;
    }
    VesselTree *tree = shape_sample(shape, &faults);
    double least = 1;
    for (int i = 0; i < tree->node_count; i++)
        least = fmin(least, tree->radius[i]);
    assert_near(2 * least * least * least, 1, 5e-3);   // the spline undershoots at the end of the taper
    vessel_tree_free(tree);
    shape_free(shape);
}

// The least distance of the two walls is the gap, at any angle; measured at the nodes, and between them along the links.
static void kissing_vessels_keep_their_gap(void **state)
{
    (void)state;
    static const double angles[] = {0, 40, 90}, gaps[] = {0.1, 0.3, 0.6};
    for (int k = 0; k < 9; k++) {
        char text[128];
        snprintf(text, sizeof text, "gap_mm %g crossing_deg %g radius_mm 0.7", gaps[k / 3], angles[k % 3]);
        Shape *shape = make("kissing", text);
        VesselTree *tree = shape_sample(shape, &faults);
        double least = HUGE_VAL;
        for (int i = 0; i < tree->node_count; i++)
            for (int m = 0; m < 20 && i > 0; m++) {
                Vec3 x = vec3_mix(tree->center[i - 1], tree->center[i], m / 20.0);
                least = fmin(least, -shape_field(shape_neighbour(shape), x, NULL) - tree->radius[i]);
            }
        assert_near(least, gaps[k / 3], 3e-3);
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

static void bone_touches(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        Shape *shape = k ? make("tree", "branches 11 blocks 3 gap_mm 0.1") : make("bone", "");
        int count;
        const ShapeBlock *block = shape_blocks(shape, &count);
        assert_int_equal(count, k ? 3 : 6);
        for (int b = 0; b < count; b++) {
            double least = HUGE_VAL;
            for (int p = 0; p < shape->part_count; p++)
                for (int i = 0; i < shape->part[p].sample_count; i++)
                    least = fmin(least, -shape_block_distance(&block[b], shape->part[p].sample[i]) - shape->part[p].sample_radius[i]);
            assert_near(least, k ? 0.1 : 0, 1e-5);
        }
        ShapeBlock box = {.center = {1, 2, 3}, .axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .half = {1, 2, 3}};
        assert_near(shape_block_distance(&box, vec3(1, 2, 3)), 1, 1e-12);
        assert_near(shape_block_distance(&box, vec3(5, 7, 3)), -sqrt(9 + 9), 1e-12);
        shape_free(shape);
    }
}

static double way_between(const VesselTree *tree, const double *arc, int a, int b)
{
    int i = a, k = b;
    while (i != k) {         // parents precede children
        if (i > k)
            i = tree->parent[i];
        else
            k = tree->parent[k];
    }
    return arc[a] + arc[b] - 2 * arc[i];
}

// The random tree has the requested number of branches, follows Murray's law at each bifurcation, has bends wider than the tube, and no contact between
// vessels that are not neighbours in the tree.
static void random_tree_keeps_its_promises(void **state)
{
    (void)state;
    static const char *const seeds[] = {"branches 51 seed 1 points 8", "branches 51 seed 2 points 8", "branches 31 seed 9 points 8 sacs 3",
                                        "branches 200 seed 3 points 8"};
    for (int s = 0; s < 4; s++) {
        Shape *shape = make("tree", seeds[s]);
        VesselTree *tree = shape_sample(shape, &faults);
        assert_true(vessel_tree_validate(tree, "tree", &faults));
        TrackTruth truth = {.tree = tree, .voxel_mm = 0.2};
        TrackScore plan;
        assert_true(track_score(&truth, NULL, &plan));
        assert_int_equal(plan.branch_count, s < 2 ? 51 : s == 2 ? 31 : 199);
        int sacs = 0, n = tree->node_count;
        double *arc = calloc((size_t)n, sizeof *arc);
        for (int i = 1; i < n; i++) {
            int a = tree->parent[i], b = tree->parent[a];
            arc[i] = arc[a] + vec3_distance(tree->center[i], tree->center[a]);
            sacs += tree->kind[i] == NODE_ANEURYSM;
            if (b >= 0 && a == i - 1 && b == i - 2 && tree->kind[i] == NODE_VESSEL) {
                Vec3 u = vec3_sub(tree->center[a], tree->center[b]), v = vec3_sub(tree->center[i], tree->center[a]);
                double turn = vec3_norm(vec3_sub(vec3_unit(v), vec3_unit(u)));
                assert_true(0.5 * (vec3_norm(u) + vec3_norm(v)) > 1.3 * tree->radius[a] * turn);
            }
        }
        assert_int_equal(sacs, s == 2 ? 3 : 0);
        for (int i = 0; i < n; i++)
            for (int k = 0; k < i; k++) {
                double sum = tree->radius[i] + tree->radius[k];
                if (tree->kind[i] == NODE_ANEURYSM || tree->kind[k] == NODE_ANEURYSM ||
                    vec3_norm2(vec3_sub(tree->center[i], tree->center[k])) > (sum + 0.5) * (sum + 0.5))
                    continue;
                assert_true(way_between(tree, arc, i, k) < 8 * fmax(tree->radius[i], tree->radius[k]) + 2);
            }
        for (int b = 0; b < plan.branch_count; b++) {   // a parent and its two daughters, at their distal ends
            double cubes = 0;
            int daughters = 0;
            for (int c = 0; c < plan.branch_count; c++)
                if (plan.branch[c].first_node == plan.branch[b].last_node)
                    cubes += pow(tree->radius[plan.branch[c].last_node], 3), daughters++;
            assert_true(daughters == 0 || daughters == 2);
            if (daughters == 2) {
                // the wider daughter's radius is reached after three radii; its own last node may already lie in the next bifurcation
                double parent = tree->radius[plan.branch[b].last_node];
                assert_near(cbrt(cubes) / parent, 1, 0.12);
            }
        }
        free(arc);
        track_score_free(&plan);
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

static void the_seed_makes_the_tree(void **state)
{
    (void)state;
    Shape *a = make("tree", "branches 21 seed 5 points 8"), *b = make("tree", "branches 21 seed 5 points 8"), *c = make("tree", "branches 21 seed 6 points 8");
    VesselTree *x = shape_sample(a, &faults), *y = shape_sample(b, &faults), *z = shape_sample(c, &faults);
    assert_int_equal(x->node_count, y->node_count);
    assert_memory_equal(x->center, y->center, (size_t)x->node_count * sizeof(Vec3));
    assert_memory_equal(x->point, y->point, (size_t)x->point_count * sizeof(Vec3));
    assert_true(z->node_count != x->node_count || memcmp(x->center, z->center, (size_t)x->node_count * sizeof(Vec3)) != 0);
    vessel_tree_free(x);
    vessel_tree_free(y);
    vessel_tree_free(z);
    shape_free(a);
    shape_free(b);
    shape_free(c);
}

// The parts that a cell omits have no effect: the bits are the same as with all parts.
static void octree_changes_no_bit(void **state)
{
    (void)state;
    Shape *shape = make("tree", "branches 61 seed 4 sacs 2");
    assert_true(shape->cell_count > 100);
    Shape all = *shape;
    all.cell_count = 0;
    Vec3 low, high, middle;
    shape_bounds(shape, &low, &high);
    middle = vec3_mix(low, high, 0.5);
    uint64_t seed = 3;
    for (int i = 0; i < 4000; i++) {
        Vec3 x, g, h;
        if (i % 2) {         // near a wall or a joint
            const Part *part = &shape->part[(int)random_in(&seed, 0, shape->part_count)];
            int k = (int)random_in(&seed, 0, part->sample_count);
            x = vec3_add(part->sample[k], random_in_box(&seed, 2 * part->sample_radius[k]));
        } else {
            x = vec3_add(middle, random_in_box(&seed, vec3_norm(vec3_sub(high, low))));
        }
        double f = shape_field(shape, x, &g), exact = shape_field(&all, x, &h);
        assert_memory_equal(&f, &exact, sizeof f);
        assert_memory_equal(&g, &h, sizeof g);
        f = shape_field_cut(shape, x), exact = shape_field_cut(&all, x);
        assert_memory_equal(&f, &exact, sizeof f);
    }
    shape_free(shape);
}

static void samples_lie_on_the_surface(void **state)
{
    (void)state;
    static const char *const names[] = {"helix", "y", "kissing", "bone", "twig", "tree"};
    for (int s = 0; s < 6; s++) {
        Shape *shape = make(names[s], s == 5 ? "branches 11 sacs 1" : "");
        VesselTree *tree = shape_sample(shape, &faults);
        assert_true(vessel_tree_validate(tree, names[s], &faults));
        for (int64_t i = 0; i < tree->point_count; i++)
            assert_near(shape_field(shape, tree->point[i], NULL), 0, 1e-9);
        for (int n = 0; n < tree->node_count; n++)
            assert_true(shape_field(shape, tree->center[n], NULL) > 0.98 * tree->radius[n]);
        vessel_tree_free(tree);
        shape_free(shape);
    }
}

// --- Volumes ---

static size_t voxels_of(const Volume *v) { return (size_t)v->size[0] * (size_t)v->size[1] * (size_t)v->size[2]; }
static Vec3 place_of(const Volume *v, size_t i)
{
    size_t nx = (size_t)v->size[0], ny = (size_t)v->size[1];
    return volume_point_of(v, vec3((double)(i % nx), (double)(i / nx % ny), (double)(i / nx / ny)));
}

// Voxels without blur against the fraction of 8^3 points inside; cubic and anisotropic grids, rotated.
static void voxels_hold_their_share(void **state)
{
    (void)state;
    Shape *shape = make("helix", "turns 1 rise_mm 6");
    for (int k = 0; k < 2; k++) {
        VolumeOptions o = volume_default_options();
        o.psf_mm = o.noise = 0;
        if (k)
            o.voxel_mm[1] = 0.3, o.voxel_mm[2] = 0.4, o.rotate_deg = 40;
        Volume *v = shape_volume(shape, &o, &faults);
        double sum = 0, square = 0, widest = 0;
        int seen = 0;
        for (size_t i = 0; i < voxels_of(v); i += 7) {
            Vec3 x = place_of(v, i);
            if (fabs(shape_field(shape, x, NULL)) > 0.3) {
                if (fabs(shape_field(shape, x, NULL)) > 0.6)
                    assert_near((double)v->value[i], shape_field(shape, x, NULL) > 0, 0);
                continue;
            }
            int in = 0;
            Vec3 at = volume_voxel_of(v, x);
            for (int m = 0; m < 512; m++)
                in += shape_field(shape, volume_point_of(v, vec3_add(at, vec3((m % 8 + 0.5) / 8 - 0.5, (m / 8 % 8 + 0.5) / 8 - 0.5, (m / 64 + 0.5) / 8 - 0.5))),
                                  NULL) > 0;
            double error = (double)v->value[i] - in / 512.0;
            sum += error;
            square += error * error;
            widest = fmax(widest, fabs(error));
            seen++;
        }
        // the box filter approximates the cube's projection, which is rounder: errors up to 0.07, none on average
        assert_true(seen > 300);
        assert_near(sum / seen, 0, 0.01);
        assert_true(sqrt(square / seen) < 0.04 && widest < 0.15);
        volume_free(v);
    }
    shape_free(shape);
}

// The middle of a long tube of radius R blurred by b is 1 - exp(-R^2 / (2 b^2)), b^2 = psf^2 + v^2 / 12.
static void blur_is_gaussian(void **state)
{
    (void)state;
    Shape *shape = make("open-capsule", "length_mm 10 radius_mm 0.5");
    for (int k = 0; k < 3; k++) {
        VolumeOptions o = volume_default_options();
        o.noise = 0;
        o.psf_mm = 0.2 + 0.1 * k;
        o.voxel_mm[0] = k == 1 ? 0.3 : 0.1, o.voxel_mm[1] = o.voxel_mm[2] = 0.1;
        Volume *v = shape_volume(shape, &o, &faults);
        double most = 0;
        for (size_t i = 0; i < voxels_of(v); i++) {
            Vec3 x = place_of(v, i);
            if (fabs(x.x - 5) > 0.2 || x.y * x.y + x.z * x.z > 0.01)
                continue;
            double b2 = o.psf_mm * o.psf_mm + 0.01 / 12, r2 = x.y * x.y + x.z * x.z, exact = 0;
            for (int n = 0; n < 4000; n++) {   // int_0^R s/b^2 exp(-(s^2 + r^2) / 2 b^2) I0(s r / b^2) ds, I0 by its series
                double s = 0.5 * (n + 0.5) / 4000, q = pow(s * sqrt(r2) / b2 / 2, 2), bessel = 1 + q + q * q / 4 + q * q * q / 36;
                exact += s / b2 * exp(-(s * s + r2) / (2 * b2)) * bessel * 0.5 / 4000;
            }
            most = fmax(most, fabs((double)v->value[i] - exact));
        }
        assert_true(most > 0 && most < 0.005);
        volume_free(v);
    }
    shape_free(shape);
}

static void noise_is_white(void **state)
{
    (void)state;
    Shape *shape = make("capsule", "length_mm 10");
    VolumeOptions o = volume_default_options();
    o.noise = 0;
    Volume *clean = shape_volume(shape, &o, &faults);
    o.noise = 0.2;
    Volume *noisy = shape_volume(shape, &o, &faults);
    o.seed++;
    Volume *other = shape_volume(shape, &o, &faults);
    size_t count = voxels_of(clean), strides[3] = {1, (size_t)clean->size[0], (size_t)clean->size[0] * (size_t)clean->size[1]};
    double mean = 0, square = 0, fourth = 0, along[3] = {0}, between = 0, n = (double)count;
    for (size_t i = 0; i < count; i++) {
        double e = ((double)noisy->value[i] - (double)clean->value[i]) / 0.2;
        mean += e / n;
        square += e * e / n;
        fourth += e * e * e * e / n;
        between += e * ((double)other->value[i] - (double)clean->value[i]) / 0.2 / n;
        for (int k = 0; k < 3; k++)
            if (i + strides[k] < count)
                along[k] += e * ((double)noisy->value[i + strides[k]] - (double)clean->value[i + strides[k]]) / 0.2 / n;
    }
    double sigma = 4 / sqrt(n);   // four standard errors; the fourth moment's is sqrt(96 / n)
    assert_near(mean, 0, sigma);
    assert_near(square, 1, sigma * sqrt(2));
    assert_near(fourth, 3, sigma * sqrt(96));
    assert_near(between, 0, sigma);
    for (int k = 0; k < 3; k++)
        assert_near(along[k], 0, sigma);
    volume_free(clean);
    volume_free(noisy);
    volume_free(other);
    shape_free(shape);
}

static void threads_change_no_bit(void **state)
{
    (void)state;
    Shape *shape = make("tree", "branches 7 blocks 1 sacs 1 radius_mm 0.7");
    VolumeOptions o = volume_default_options();
    o.voxel_mm[0] = 0.4, o.voxel_mm[1] = 0.3, o.voxel_mm[2] = 0.5, o.rotate_deg = 20, o.fade = 0.3, o.clip = 0, o.saturate = 0.9;
    o.threads = 1;
    Volume *one = shape_volume(shape, &o, &faults);
    for (o.threads = 2; o.threads < 5; o.threads++) {
        Volume *more = shape_volume(shape, &o, &faults);
        assert_memory_equal(one->value, more->value, voxels_of(one) * sizeof(float));
        assert_true(one->minimum == more->minimum && one->maximum == more->maximum);
        volume_free(more);
    }
    assert_near((double)one->minimum, 0, 0);
    assert_near((double)one->maximum, 0.9, 1e-6);
    volume_free(one);
    shape_free(shape);
}

// Trilinear value at a point.
static double value_at(const Volume *v, Vec3 x)
{
    Vec3 at = volume_voxel_of(v, x);
    int i = (int)floor(at.x), j = (int)floor(at.y), k = (int)floor(at.z);
    double sum = 0;
    assert_true(i >= 0 && j >= 0 && k >= 0 && i + 1 < v->size[0] && j + 1 < v->size[1] && k + 1 < v->size[2]);
    for (int c = 0; c < 8; c++) {
        double w = (c & 1 ? at.x - i : 1 - at.x + i) * (c & 2 ? at.y - j : 1 - at.y + j) * (c & 4 ? at.z - k : 1 - at.z + k);
        sum += w * (double)v->value[(size_t)(i + (c & 1)) + (size_t)v->size[0] * ((size_t)(j + (c >> 1 & 1)) + (size_t)v->size[1] * (size_t)(k + (c >> 2)))];
    }
    return sum;
}

// On a rotated grid the tree does not move: brightness 1 on the centreline, halfway on the wall; fading along the path; neighbours and bone are visible.
static void brightness_is_where_it_should_be(void **state)
{
    (void)state;
    VolumeOptions o = volume_default_options();
    o.noise = 0, o.voxel_mm[2] = 0.3, o.psf_mm = 0.15;
    for (int k = 0; k < 3; k++) {
        o.rotate_deg = 60 * k;
        o.fade = k == 2 ? 0.5 : 0;
        Shape *shape = make("bone", "blocks 4");
        VesselTree *tree = shape_sample(shape, &faults);
        Volume *v = shape_volume(shape, &o, &faults);
        int count, seen = 0;
        const ShapeBlock *block = shape_blocks(shape, &count);
        for (int b = 0; b < count; b++)
            assert_near(value_at(v, block[b].center), 1.2, 1e-3);
        for (int i = 0; i < tree->node_count; i++) {
            double bright = 1 - o.fade * i / (tree->node_count - 1.0), away = HUGE_VAL;
            for (int b = 0; b < count; b++)
                away = fmin(away, -shape_block_distance(&block[b], tree->center[i]));
            if (away < 1.8 || i < 3)
                continue;
            assert_near(value_at(v, tree->center[i]), bright, 0.01);
            double wall = 0;
            for (int64_t p = tree->point_offset[i]; p < tree->point_offset[i + 1]; p++)
                wall += value_at(v, tree->point[p]) / (double)(tree->point_offset[i + 1] - tree->point_offset[i]);
            if (i < tree->node_count - 3)
                assert_near(wall, 0.5 * bright, 0.06);   // at a convex wall it is less than half
            seen++;
        }
        assert_true(seen > 20);
        volume_free(v);
        vessel_tree_free(tree);
        shape_free(shape);
    }
    Shape *shape = make("kissing", "");
    Volume *v = shape_volume(shape, &o, &faults);
    o.fade = 0;
    assert_true(value_at(v, vec3(0, 2.2, 0)) > 0.7 && value_at(v, vec3(0, -2.2, 0)) < 0.01);
    volume_free(v);
    shape_free(shape);
}

static void bad_options_are_faults(void **state)
{
    (void)state;
    const char option[3][2][64] = {{"branches", "201"}, {"gap_mm", "-1"}, {"crossing_deg", "x"}};
    faults_clear(&faults);
    assert_null(shape_create("tree", 3, option, "test", &faults));
    assert_int_equal(faults.count, 3);
    faults_clear(&faults);
    VolumeOptions o = volume_default_options();
    o.voxel_mm[0] = o.voxel_mm[1] = o.voxel_mm[2] = 0.001;
    Shape *shape = make("y", "");
    assert_null(shape_volume(shape, &o, &faults));
    assert_int_equal(faults.count, 1);
    shape_free(shape);
}

// Integer grey values, vessels and band brighter by the requested contrast, the noise in grey values; the band crosses the trunk.
static void grey_values_and_a_band(void **state)
{
    (void)state;
    Shape *shape = make("tree", "branches 5 radius_mm 4 points 8");
    VesselTree *truth = shape_sample(shape, &faults);
    VolumeOptions o = volume_default_options();
    o.voxel_mm[0] = o.voxel_mm[1] = o.voxel_mm[2] = 1;
    o.psf_mm = 0.5;
    o.noise = 0;
    o.contrast_grey = 13;
    o.background_grey = 70;
    o.band = 40.0 / 13;
    o.band_mm = 16;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        long level[256] = {0}, whole = 0;
        o.seed = seed;
        o.threads = seed % 2 ? 1 : 3;
        Volume *v = shape_volume(shape, &o, &faults);
        assert_non_null(v);
        long voxels = (long)v->size[0] * v->size[1] * v->size[2];
        for (long i = 0; i < voxels; i++) {
            double value = (double)v->value[i];
            whole += value == floor(value) && value >= 0 && value <= 255;
            level[(int)value]++;
        }
        assert_int_equal(whole, voxels);
        assert_true(level[70] > voxels / 4 && level[110] > 1000 && level[83] > 50 && level[123] > 5);   // background, band, vessel, both
        assert_true(v->minimum == 70 && v->maximum == 123);
        bool crossed = false;
        for (int i = 0; i < truth->node_count; i++) {
            Vec3 at = volume_voxel_of(v, truth->center[i]);
            size_t place = (size_t)(at.x + 0.5) + (size_t)v->size[0] * ((size_t)(at.y + 0.5) + (size_t)v->size[1] * (size_t)(at.z + 0.5));
            crossed = crossed || v->value[place] > 118;
        }
        assert_true(crossed);
        volume_free(v);
    }
    o.band = 0;
    o.noise = 11.0 / 13;
    Volume *v = shape_volume(shape, &o, &faults);
    double sum = 0, square = 0;
    long n = 0;
    for (int k = 0; k < 4; k++)   // the margin is background
        for (int i = 0; i < v->size[0] * v->size[1]; i++, n++) {
            double value = (double)v->value[k * v->size[0] * v->size[1] + i];
            sum += value;
            square += value * value;
        }
    assert_near(sum / (double)n, 70, 0.5);
    assert_near(sqrt(square / (double)n - pow(sum / (double)n, 2)), sqrt(121 + 1.0 / 12), 0.3);
    volume_free(v);
    vessel_tree_free(truth);
    shape_free(shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(helix_is_a_helix),
        cmocka_unit_test(y_is_symmetric_and_murrays),
        cmocka_unit_test(kissing_vessels_keep_their_gap),
        cmocka_unit_test(bone_touches),
        cmocka_unit_test(random_tree_keeps_its_promises),
        cmocka_unit_test(the_seed_makes_the_tree),
        cmocka_unit_test(octree_changes_no_bit),
        cmocka_unit_test(samples_lie_on_the_surface),
        cmocka_unit_test(voxels_hold_their_share),
        cmocka_unit_test(blur_is_gaussian),
        cmocka_unit_test(noise_is_white),
        cmocka_unit_test(grey_values_and_a_band),
        cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(brightness_is_where_it_should_be),
        cmocka_unit_test(bad_options_are_faults),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
