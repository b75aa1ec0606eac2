// The whole tree from one start: what is found, what is refused, and that corrections change nothing else.
#include "recon/phantom/phantom.h"
#include "recon/track/rbt_track.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "cubic_volume.h"
#include "tests/short_run.h"
#include "tube_volume.h"

static Faults faults;

// A trunk with four branches, one of which forks.
static const Vec3 tip[6] = {{10, 10, 27.5}, {18, 10, 9}, {3, 10, 15}, {10, 17.5, 18}, {17, 4, 20}, {14, 2, 27}};

static Volume *small_tree(double noise)
{
    Volume *v = dark_volume(100, 100, 145, 0.2);
    add_tube(v, vec3(10, 10, -2), tip[0], 1.2);
    add_tube(v, vec3(10, 10, 4), tip[1], 0.7);
    add_tube(v, vec3(10, 10, 9), tip[2], 0.6);
    add_tube(v, vec3(10, 10, 13), tip[3], 0.6);
    add_tube(v, vec3(10, 10, 16), vec3(13.5, 7, 18), 0.8);
    add_tube(v, vec3(13.5, 7, 18), tip[4], 0.6);
    add_tube(v, vec3(13.5, 7, 18), tip[5], 0.6);
    add_noise(v, noise);
    return v;
}

static RbtSeed trunk(void) { return (RbtSeed){.start = {10, 10, 2}, .toward = {10, 10, 4}, .has_toward = true, .radius = 1.2, .line = 1, .column = 1}; }

static RbtParameters automatic(void)
{
    RbtParameters p = rbt_default_parameters();
    p.automatic = 1;
    return p;
}

static VesselTree *track(const Volume *v, const RbtParameters *p, const RbtSeed *seed, int count, int threads, RbtReport *report)
{
    faults_clear(&faults);
    VesselTree *tree = rbt_track(v, p, seed, count, NULL, 0, threads, NULL, report, "t.yaml", &faults);
    for (int i = 0; i < faults.count && i < 3; i++)
        print_message("%s\n", faults.text[i]);
    if (tree) {
        assert_true(vessel_tree_validate(tree, "tree", &faults));
    }
    return tree;
}

static double nearest_to(const VesselTree *tree, Vec3 x)
{
    double least = 1e9;
    for (int i = 0; i < tree->node_count; i++)
        least = fmin(least, vec3_distance(tree->center[i], x));
    return least;
}

static float value_at(const Volume *v, Vec3 x)
{
    int at[3] = {(int)(x.x / v->axis[0].x + 0.5), (int)(x.y / v->axis[0].x + 0.5), (int)(x.z / v->axis[0].x + 0.5)};
    return v->value[(at[2] * v->size[1] + at[1]) * v->size[0] + at[0]];
}

// --- what is found ---

static void every_branch_from_one_start(void **state)
{
    (void)state;
    Volume *v = small_tree(0.05);
    for (int number = 1; number <= WHOLE_OR_SHORT(3, 1); number++) {
        RbtParameters p = automatic();
        RbtReport report = {0};
        RbtSeed seed = trunk();
        p.seed = number;
        VesselTree *tree = track(v, &p, &seed, 1, 0, &report);
        assert_non_null(tree);
        for (int i = 0; i < 6; i++)
            assert_true(nearest_to(tree, tip[i]) < 1.3);
        // no link passes through background, and every branch is attached to an earlier one
        for (int i = 1; i < tree->node_count; i++)
            for (double s = 0; s <= 1; s += 0.125)
                assert_true(value_at(v, vec3_mix(tree->center[i], tree->center[tree->parent[i]], s)) > 0.3f);
        assert_true(report.branch_count >= 6 && report.branch_count <= 8);
        assert_int_equal(report.branch[0].parent, -1);
        for (int i = 1; i < report.branch_count; i++) {
            assert_true(report.branch[i].parent >= 0 && report.branch[i].parent < i && report.branch[i].is_found);
            assert_int_equal(report.branch[i].order, report.branch[report.branch[i].parent].order + 1);
        }
        rbt_report_free(&report);
        vessel_tree_free(tree);
    }
    volume_free(v);
}

// A neighbour that passes by, half a voxel to two voxels from the wall, is not a branch.
static void kissing_vessel_is_refused(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k += WHOLE_OR_SHORT(1, 3)) {
        double gap = 0.1 * (1 << k % 3), slope = k < 3 ? 0.5 : 1.5;
        Volume *v = dark_volume(100, 70, 130, 0.2);
        double x = 7 + 1.0 + gap + 0.8;
        add_tube(v, vec3(7, 7, -2), vec3(7, 7, 25), 1);
        add_tube(v, vec3(x, 7 - 12 * slope, 1), vec3(x, 7 + 12 * slope, 25), 0.8);
        add_noise(v, 0.05);
        RbtParameters p = automatic();
        RbtSeed seed = {.start = {7, 7, 2}, .toward = {7, 7, 4}, .has_toward = true, .radius = 1};
        VesselTree *tree = track(v, &p, &seed, 1, 0, NULL);
        assert_non_null(tree);
        double worst = 0;
        for (int i = 0; i < tree->node_count; i++)
            worst = fmax(worst, hypot(tree->center[i].x - 7, tree->center[i].y - 7));
        if (worst > 1)
            print_message("gap %.1f mm, slope %g: %.2f mm off the vessel\n", gap, slope, worst);
        assert_true(worst < 1);
        vessel_tree_free(tree);
        volume_free(v);
    }
}

// Bone in contact, and a thin neighbour that crosses at a distance of two voxels: nothing outside the vessel is tracked.
static void dense_and_near_neighbours_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint64_t seed;
        char option[3][2][64];
    } shapes[] = {{"bone", 5, {{"seed", "5"}, {"radius_mm", "1"}, {"points", "8"}}},
                  {"bone", 7, {{"seed", "7"}, {"radius_mm", "1"}, {"points", "8"}}},
                  {"kissing", 13, {{"gap_mm", "0.4"}, {"radius_mm", "0.6"}, {"crossing_deg", "90"}}}};
    for (size_t k = WHOLE_OR_SHORT(0, 1); k < sizeof shapes / sizeof shapes[0]; k++) {
        VolumeOptions options = volume_default_options();
        options.seed = shapes[k].seed;   // as in `synth`: seed of the positions and of the noise
        Shape *shape = shape_create(shapes[k].name, 3, shapes[k].option, "test", &faults);
        assert_non_null(shape);
        VesselTree *truth = shape_sample(shape, &faults);
        Volume *v = shape_volume(shape, &options, &faults);
        assert_true(truth && v);
        RbtParameters p = automatic();
        RbtSeed seed = {.start = truth->center[2], .toward = vec3_add(truth->center[2], truth->direction[2]), .has_toward = true, .radius = truth->radius[2]};
        VesselTree *tree = track(v, &p, &seed, 1, 0, NULL);
        assert_non_null(tree);
        double deepest = 0;
        for (int i = 0; i < tree->node_count; i++)
            deepest = fmax(deepest, -shape_field(shape, tree->center[i], NULL));
        if (deepest > 0.3)
            print_message("%s %zu: %.2f mm outside\n", shapes[k].name, k, deepest);
        assert_true(deepest < 0.3);
        assert_true(nearest_to(tree, truth->center[truth->node_count - 2]) < 1);
        vessel_tree_free(tree);
        vessel_tree_free(truth);
        volume_free(v);
        shape_free(shape);
    }
}

static void a_sac_is_found(void **state)
{
    (void)state;
    Volume *v = dark_volume(110, 70, 130, 0.2);
    Vec3 sac = {11.4, 7, 13};
    add_tube(v, vec3(7, 7, -2), vec3(7, 7, 25), 1);
    add_ball(v, sac, 3.6, 1);
    add_noise(v, 0.05);
    RbtSeed seed = {.start = {7, 7, 2}, .toward = {7, 7, 4}, .has_toward = true, .radius = 1};
    for (int wanted = WHOLE_OR_SHORT(0, 1); wanted <= 1; wanted++) {
        RbtParameters p = automatic();
        RbtReport report = {0};
        p.find_aneurysms = wanted;
        VesselTree *tree = track(v, &p, &seed, 1, 0, &report);
        assert_non_null(tree);
        assert_true(nearest_to(tree, vec3(7, 7, 24)) < 1.2);
        int sacs = 0;
        for (int i = 0; i < report.branch_count; i++)
            if (report.branch[i].is_aneurysm) {
                int node = report.branch[i].first_node + report.branch[i].node_count - 1;
                sacs++;
                assert_true(vec3_distance(report.branch[i].center, sac) < 0.6 && fabs(tree->radius[node] - 3.6) < 0.4);
                assert_int_equal(tree->kind[node], NODE_ANEURYSM);
                assert_true(tree->point_offset[node + 1] - tree->point_offset[node] > 300);
            }
        assert_int_equal(sacs, wanted);
        int centers = 0;
        for (int i = 0; i < tree->node_count; i++)
            centers += tree->kind[i] == NODE_ANEURYSM;
        assert_int_equal(centers, wanted);   // a ball has one centre
        rbt_report_free(&report);
        vessel_tree_free(tree);
    }
    volume_free(v);
}

// A sac with a lobe is one sac with several centres, one of them in the lobe; each lies in the lumen and has wall points around it.
static void a_lobed_sac_has_several_centers(void **state)
{
    (void)state;
    Volume *v = dark_volume(85, 70, 90, 0.2);
    Vec3 sac = {8.4, 5, 9}, lobe = {10.4, 8.6, 10.5};
    add_tube(v, vec3(4, 5, -2), vec3(4, 5, 20), 1);
    add_ball(v, sac, 3.6, 1);
    add_ball(v, lobe, 2.4, 1);
    add_noise(v, 0.05);
    RbtSeed seed = {.start = {4, 5, 2}, .toward = {4, 5, 4}, .has_toward = true, .radius = 1};
    RbtParameters p = automatic();
    RbtReport report = {0};
    VesselTree *tree = track(v, &p, &seed, 1, 0, &report);
    assert_non_null(tree);
    int sacs = 0, centers = 0;
    double nearest = HUGE_VAL;
    for (int i = 0; i < report.branch_count; i++)
        sacs += report.branch[i].is_aneurysm;
    for (int i = 0; i < tree->node_count; i++) {
        Vec3 c = tree->center[i];
        if (tree->kind[i] != NODE_ANEURYSM)
            continue;
        centers++;
        nearest = fmin(nearest, vec3_distance(c, lobe));
        assert_true(vec3_distance(c, sac) < 3.2 || vec3_distance(c, lobe) < 2);
        int on_wall = 0, points = (int)(tree->point_offset[i + 1] - tree->point_offset[i]);
        for (int64_t k = tree->point_offset[i]; k < tree->point_offset[i + 1]; k++)
            on_wall += fabs(fmin(vec3_distance(tree->point[k], sac) - 3.6, vec3_distance(tree->point[k], lobe) - 2.4)) < 0.3;
        assert_true(points > 160 && on_wall > 0.9 * points);
    }
    print_message("lobed sac: %d centres, the nearest %.2f mm from the lobe's middle\n", centers, nearest);
    assert_int_equal(sacs, 1);
    assert_true(centers >= 2 && nearest < 1.2);
    rbt_report_free(&report);
    vessel_tree_free(tree);
    volume_free(v);
}

// A click anywhere in a random tree, half a radius off the axis, without direction or radius.
static void a_click_anywhere(void **state)
{
    (void)state;
    static const char option[][2][64] = {{"branches", "11"}, {"radius_mm", "1.4"}, {"seed", "5"}};
    Shape *shape = shape_create("tree", 3, option, "test", &faults);
    assert_non_null(shape);
    VesselTree *truth = shape_sample(shape, &faults);
    Volume *v = cubic_volume(shape, 0.25, 0.2, 0.05, 3, &faults);
    assert_true(truth && v);
    for (int k = 0; k < WHOLE_OR_SHORT(3, 1); k++) {
        int node = truth->node_count * (2 * k + 1) / 8;
        Vec3 off = vec3_normal_to(truth->direction[node]);
        RbtSeed seed = {.start = vec3_add_scaled(truth->center[node], (k % 2 ? 0.5 : -0.5) * truth->radius[node], off), .line = 1, .column = 1};
        RbtParameters p = automatic();
        RbtReport report = {0};
        VesselTree *tree = track(v, &p, &seed, 1, 0, &report);
        assert_non_null(tree);
        int met = 0, beside = 0;
        for (int i = 0; i < truth->node_count; i++)
            met += nearest_to(tree, truth->center[i]) < fmax(truth->radius[i], 0.5);
        for (int i = 0; i < tree->node_count; i++)
            beside += shape_field(shape, tree->center[i], NULL) < -0.25;
        print_message("%s: %d of %d nodes met\n", report.start, met, truth->node_count);
        assert_true(met > 0.95 * truth->node_count);
        assert_int_equal(beside, 0);
        rbt_report_free(&report);
        vessel_tree_free(tree);
    }
    volume_free(v);
    vessel_tree_free(truth);
    shape_free(shape);
}

// --- corrections ---

// Checks that every node of `part` further than `radius` from `around` is in `whole` with the same bits, including its points and its parent's position.
// Returns how many nodes of `whole` are missing.
static int missing_beside(const VesselTree *whole, const VesselTree *part, Vec3 around, double radius)
{
    int found = 0, needed = 0;
    for (int i = 0; i < part->node_count; i++) {
        if (vec3_distance(part->center[i], around) < radius)
            continue;
        needed++;
        int was = found;
        int64_t points = part->point_offset[i + 1] - part->point_offset[i];
        for (int k = 0; k < whole->node_count; k++) {
            if (memcmp(&whole->center[k], &part->center[i], sizeof(Vec3)))
                continue;
            assert_true(whole->radius[k] == part->radius[i] && whole->height[k] == part->height[i]);
            assert_memory_equal(&whole->direction[k], &part->direction[i], sizeof(Vec3));
            if (whole->point_offset[k + 1] - whole->point_offset[k] != points)
                print_message("node %d at (%.2f, %.2f, %.2f) mm has other points\n", i, part->center[i].x, part->center[i].y, part->center[i].z);
            assert_true(whole->point_offset[k + 1] - whole->point_offset[k] == points);
            assert_memory_equal(whole->point + whole->point_offset[k], part->point + part->point_offset[i], (size_t)points * sizeof(Vec3));
            if (part->parent[i] >= 0)
                assert_memory_equal(&whole->center[whole->parent[k]], &part->center[part->parent[i]], sizeof(Vec3));
            found++;
            break;
        }
        if (found == was)
            print_message("node %d at (%.2f, %.2f, %.2f) mm moved\n", i, part->center[i].x, part->center[i].y, part->center[i].z);
    }
    assert_int_equal(found, needed);
    return whole->node_count - found;
}

static int missing_nodes(const VesselTree *whole, const VesselTree *part) { return missing_beside(whole, part, vec3(0, 0, 0), 0); }

static void corrections_leave_the_rest(void **state)
{
    (void)state;
    Volume *v = small_tree(0.05);
    RbtParameters p = automatic();
    RbtSeed seed[2] = {trunk(), {.start = {6, 10, 12.4}, .radius = 0.6}};
    VesselTree *whole = track(v, &p, seed, 1, 0, NULL);
    assert_non_null(whole);
    // a cut removes the forked branch with both daughters and no other; the trunk's points in an ostium are not wall while the branch exists
    RbtRegion cut = {.center = {12, 8.3, 17.2}, .line = 3, .column = 7};
    p.cut = &cut;
    p.cut_count = 1;
    VesselTree *tree = track(v, &p, seed, 1, 0, NULL);
    assert_non_null(tree);
    assert_true(missing_beside(whole, tree, vec3(10.5, 9.5, 16.8), 2.2) > 20);
    assert_true(nearest_to(tree, tip[4]) > 4 && nearest_to(tree, tip[5]) > 4);
    for (int i = 0; i < 4; i++)
        assert_true(nearest_to(tree, tip[i]) < 1.3);
    vessel_tree_free(tree);
    p.cut_count = 0;
    // a forbidden region on the branch to tip 2: that branch ends in front of it, the others are unchanged
    RbtRegion forbid = {.center = {31.5, 50, 62}, .is_voxel = true, .radius = 1.2, .line = 2, .column = 5};
    p.forbid = &forbid;
    p.forbid_count = 1;
    VesselTree *without = track(v, &p, seed, 1, 0, NULL);
    assert_non_null(without);
    Vec3 middle = volume_point_of(v, forbid.center);
    assert_true(nearest_to(without, middle) >= 1.2 && nearest_to(without, tip[2]) > 2);
    Vec3 stump = {6.8, 10, 12};
    assert_true(missing_beside(whole, without, stump, 4.2) > 5);   // its link depends on its own first nodes
    missing_beside(without, whole, vec3(5.6, 10, 12.9), 5.6);   // the branch itself with its link
    // a start adds a branch to the tree after a cut: nothing else changes
    p.forbid_count = 0;
    cut.center = vec3(7.5, 10, 11.1);
    p.cut_count = 1;
    VesselTree *less = track(v, &p, seed, 1, 0, NULL), *more = track(v, &p, seed, 2, 0, NULL);
    assert_true(less && more);
    assert_true(nearest_to(less, tip[2]) > 2);
    assert_true(nearest_to(more, tip[2]) < 1.3);
    missing_beside(more, less, vec3(9.3, 10, 9.6), 1.5);
    vessel_tree_free(less);
    vessel_tree_free(more);
    // a start on a branch that was already found adds nothing
    p.cut_count = 0;
    more = track(v, &p, seed, 2, 0, NULL);
    assert_non_null(more);
    assert_int_equal(missing_nodes(whole, more), 0);
    vessel_tree_free(more);
    // a cut away from all branches is a fault with its position
    cut.center = vec3(2, 2, 2);
    p.cut_count = 1;
    faults_clear(&faults);
    assert_null(rbt_track(v, &p, seed, 1, NULL, 0, 0, NULL, NULL, "t.yaml", &faults));
    assert_non_null(strstr(faults.text[0], "t.yaml:3:7"));
    vessel_tree_free(without);
    vessel_tree_free(whole);
    volume_free(v);
}

static void the_same_for_any_number_of_threads(void **state)
{
    (void)state;
    Volume *v = small_tree(0.08);
    RbtParameters p = automatic();
    RbtSeed seed = trunk();
    VesselTree *one = track(v, &p, &seed, 1, 1, NULL);
    assert_non_null(one);
    for (int threads = 2; threads <= 3; threads++) {
        VesselTree *tree = track(v, &p, &seed, 1, threads, NULL);
        assert_non_null(tree);
        assert_int_equal(tree->node_count, one->node_count);
        assert_int_equal(missing_nodes(one, tree), 0);
        assert_memory_equal(tree->parent, one->parent, (size_t)one->node_count * sizeof *one->parent);
        vessel_tree_free(tree);
    }
    vessel_tree_free(one);
    volume_free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_branch_from_one_start),
        cmocka_unit_test(kissing_vessel_is_refused),
        cmocka_unit_test(dense_and_near_neighbours_are_refused),
        cmocka_unit_test(a_sac_is_found),
        cmocka_unit_test(a_lobed_sac_has_several_centers),
        cmocka_unit_test(a_click_anywhere),
        cmocka_unit_test(corrections_leave_the_rest),
        cmocka_unit_test(the_same_for_any_number_of_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
