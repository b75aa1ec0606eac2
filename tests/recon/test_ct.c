// Volumes of CT numbers: bone and air are left out and nothing else, a vessel tracked beside bone and against it, and starts on bone.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "recon/recon.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double VOXEL = 0.5, VESSEL = 1.5, BONE = 6;     // [mm] VESSEL, BONE: radii of cylinders along z
static const float AIR = -1000, TISSUE = 40, CONTRAST = 350, CORTICAL = 1200;     // [HU]
enum { WIDE = 100, HIGH = 60 };

static const Vec3 in_vessel = {15, 25, 15}, in_bone = {33, 25, 15}, in_plaque = {15, 35, 15}, in_bare = {26, 25, 15};     // in_bare: 0.5 mm within bone

static double to_axis(Vec3 x, Vec3 axis) { return hypot(x.x - axis.x, x.y - axis.y); }
static double share(double outside) { return fmin(fmax(0.5 - outside / VOXEL, 0), 1); }

// A cylinder of tissue in air, in it a vessel, bone, and a speck as dense as bone.
static Volume *make_ct(void)
{
    const int size[3] = {WIDE, WIDE, HIGH};
    Vec3 axis[3] = {{VOXEL, 0, 0}, {0, VOXEL, 0}, {0, 0, VOXEL}};
    Volume *v = volume_create(size, vec3(0, 0, 0), axis);
    assert_non_null(v);
    float *out = v->value;
    for (int k = 0; k < HIGH; k++)
        for (int j = 0; j < WIDE; j++)
            for (int i = 0; i < WIDE; i++) {
                Vec3 x = volume_point_of(v, vec3(i, j, k));
                double value = (double)AIR + (double)(TISSUE - AIR) * share(to_axis(x, vec3(25, 25, 0)) - 20);
                value += (double)(CONTRAST - TISSUE) * share(to_axis(x, in_vessel) - VESSEL);
                const double bare = share(to_axis(x, in_bare) - VESSEL);      // a second vessel, which lies bare against bone
                value += (double)(CONTRAST - TISSUE) * bare;
                value += (double)(CORTICAL - TISSUE) * (1 - bare) * share(fmin(to_axis(x, in_bone) - BONE, vec3_distance(x, in_plaque) - 1.5));
                *out++ = (float)value;
            }
    v->minimum = AIR, v->maximum = CORTICAL;
    return v;
}

static float value_at(const Volume *v, Vec3 x)
{
    Vec3 p = volume_voxel_of(v, x);
    return v->value[((size_t)lround(p.z) * WIDE + (size_t)lround(p.y)) * WIDE + (size_t)lround(p.x)];
}

static void bone_and_air_are_left_out_and_nothing_else(void **state)
{
    (void)state;
    const double rim = 2.5 * VOXEL;      // of bone, which may be left out
    Volume *whole = make_ct(), *v = ct_soft_tissue(whole, (double)CT_NUMBER_BONE);
    assert_true(volume_has_ct_numbers(whole));
    assert_non_null(v);
    assert_false(volume_has_ct_numbers(v));
    for (size_t at = 0; at < (size_t)WIDE * WIDE * HIGH; at++) {
        const Vec3 x = volume_point_of(v, vec3((double)(at % WIDE), (double)(at / WIDE % WIDE), (double)(at / WIDE / WIDE)));
        const double outside = to_axis(x, in_bone) - BONE, bare = to_axis(x, in_bare) - VESSEL;
        const bool is_as_before = v->value[at] >= whole->value[at] && v->value[at] <= whole->value[at];
        if (to_axis(x, vec3(25, 25, 0)) - 20 > VOXEL || (outside < -VOXEL && bare > VOXEL))
            assert_true(fabs((double)v->value[at] - (double)TISSUE) < 1e-3);
        else if (to_axis(x, vec3(25, 25, 0)) - 20 < -VOXEL && (outside > rim * sqrt(3) || bare < -VOXEL))
            assert_true(is_as_before);
    }
    // a speck of less than 50 mm3 is no bone
    assert_true(value_at(v, in_plaque) > CT_NUMBER_BONE);
    volume_free(v);
    v = ct_soft_tissue(whole, 0);
    assert_true(value_at(v, in_bone) > CT_NUMBER_BONE);
    volume_free(v);
    volume_free(whole);
}

static bool track_with(const Volume *v, Vec3 start, double bone_hu, RbtReport *report, VesselTree **tree, Faults *faults)
{
    RbtParameters p = rbt_default_parameters();
    RbtSeed seed = {.start = start};
    p.bone_hu = bone_hu;
    p.automatic = 1;
    *report = (RbtReport){0};
    *tree = rbt_track(v, &p, &seed, 1, NULL, 0, 1, NULL, report, "start", faults);
    return *tree != NULL;
}

static bool track(const Volume *v, Vec3 start, RbtReport *report, VesselTree **tree, Faults *faults)
{
    return track_with(v, start, rbt_default_parameters().bone_hu, report, tree, faults);
}

// Length [mm] of the tree along z, and the farthest of its nodes [mm] from the vessel's axis.
static double length_of(const VesselTree *tree, Vec3 vessel, double *farthest)
{
    double low = HUGE_VAL, high = -HUGE_VAL;
    *farthest = 0;
    for (int i = 0; i < tree->node_count; i++) {
        *farthest = fmax(*farthest, to_axis(tree->center[i], vessel));
        low = fmin(low, tree->center[i].z), high = fmax(high, tree->center[i].z);
    }
    return high - low;
}

static void a_vessel_is_tracked_beside_bone(void **state)
{
    (void)state;
    Volume *v = make_ct();
    VesselTree *tree;
    RbtReport report;
    Faults faults = {0};
    double farthest;
    assert_true(track(v, vec3_add(in_vessel, vec3(0.4, 0.3, 0)), &report, &tree, &faults));
    assert_true(length_of(tree, in_vessel, &farthest) > 0.8 * VOXEL * HIGH);
    assert_true(farthest < 0.2 * VOXEL);
    for (int i = 0; i < tree->node_count; i++)
        assert_true(fabs(tree->radius[i] - VESSEL) < 0.2 * VOXEL);
    rbt_report_free(&report);
    vessel_tree_free(tree);
    volume_free(v);
}

// A third of its wall is bone, into which the tree does not leak. Without the rule it leaves the vessel.
static void a_vessel_is_tracked_that_lies_bare_against_bone(void **state)
{
    (void)state;
    Volume *v = make_ct();
    VesselTree *tree;
    RbtReport report;
    Faults faults = {0};
    double farthest;
    assert_true(track(v, in_bare, &report, &tree, &faults));
    assert_true(length_of(tree, in_bare, &farthest) > 0.8 * VOXEL * HIGH);
    print_message("against bone: nodes up to %.2f mm from the axis\n", farthest);
    assert_true(farthest < VOXEL);
    for (int i = 0; i < tree->node_count; i++)
        assert_true(fabs(tree->radius[i] - VESSEL) < VOXEL);
    rbt_report_free(&report);
    vessel_tree_free(tree);
    if (track_with(v, in_bare, 0, &report, &tree, &faults)) {
        assert_true(length_of(tree, in_bare, &farthest) < 0.5 * VOXEL * HIGH || farthest > VESSEL);
        rbt_report_free(&report);
        vessel_tree_free(tree);
    }
    faults_clear(&faults);
    volume_free(v);
}

// A quarter of the volume and more is air: tissue is background all the same.
static void starts_in_tissue_and_bone_are_named(void **state)
{
    (void)state;
    Volume *v = make_ct();
    VesselTree *tree;
    RbtReport report;
    Faults faults = {0};
    assert_false(track(v, vec3(20, 15, 15), &report, &tree, &faults));
    assert_non_null(strstr(faults.text[0], "background"));
    faults_clear(&faults);
    assert_false(track(v, in_bone, &report, &tree, &faults));
    assert_non_null(strstr(faults.text[0], "HU as bone has"));
    faults_clear(&faults);
    volume_free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bone_and_air_are_left_out_and_nothing_else),
        cmocka_unit_test(a_vessel_is_tracked_beside_bone),
        cmocka_unit_test(a_vessel_is_tracked_that_lies_bare_against_bone),
        cmocka_unit_test(starts_in_tissue_and_bone_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
