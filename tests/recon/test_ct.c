// Volumes of CT numbers: bone is hidden and nothing else, the brightness to show, a vessel tracked beside bone and air, and starts on bone.
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

static const Vec3 in_vessel = {15, 25, 15}, in_bone = {33, 25, 15}, in_plaque = {15, 35, 15};

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
                value += (double)(CORTICAL - TISSUE) * share(fmin(to_axis(x, in_bone) - BONE, vec3_distance(x, in_plaque) - 1.5));
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

static void bone_is_hidden_and_nothing_else(void **state)
{
    (void)state;
    const double reach = 2;
    Volume *v = make_ct(), *before = make_ct();
    assert_true(volume_has_ct_numbers(v));
    assert_true(volume_hide_bone(v));
    for (size_t at = 0; at < (size_t)WIDE * WIDE * HIGH; at++) {
        Vec3 x = volume_point_of(v, vec3((double)(at % WIDE), (double)(at / WIDE % WIDE), (double)(at / WIDE / WIDE)));
        double outside = to_axis(x, in_bone) - BONE;
        if (outside < reach - VOXEL)
            assert_true(v->value[at] <= AIR);
        else if (outside > reach + VOXEL)
            assert_true(v->value[at] >= before->value[at] && v->value[at] <= before->value[at]);
    }
    // a speck of less than 50 mm3 is no bone
    assert_true(value_at(v, in_plaque) > CT_NUMBER_BONE);
    volume_free(v);
    volume_free(before);
}

static bool track(const Volume *v, Vec3 start, RbtReport *report, VesselTree **tree, Faults *faults)
{
    RbtParameters p = rbt_default_parameters();
    RbtSeed seed = {.start = start};
    *report = (RbtReport){0};
    *tree = rbt_track(v, &p, &seed, 1, NULL, 0, 1, NULL, report, "start", faults);
    return *tree != NULL;
}

static void a_vessel_is_tracked_beside_bone(void **state)
{
    (void)state;
    Volume *v = make_ct();
    VesselTree *tree;
    RbtReport report;
    Faults faults = {0};
    assert_true(track(v, vec3_add(in_vessel, vec3(0.4, 0.3, 0)), &report, &tree, &faults));
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int i = 0; i < tree->node_count; i++) {
        if (tree->kind[i] != NODE_VESSEL)
            continue;
        assert_true(to_axis(tree->center[i], in_vessel) < 0.2 * VOXEL);
        assert_true(fabs(tree->radius[i] - VESSEL) < 0.2 * VOXEL);
        low = fmin(low, tree->center[i].z), high = fmax(high, tree->center[i].z);
    }
    assert_true(high - low > 0.8 * VOXEL * HIGH);
    rbt_report_free(&report);
    vessel_tree_free(tree);
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
    if (track(v, in_bone, &report, &tree, &faults)) {
        bool is_said = false;
        for (int i = 0; i < report.check.warning_count; i++)
            is_said = is_said || strstr(report.check.warning[i].text, "bone?");
        assert_true(is_said);
        rbt_report_free(&report);
        vessel_tree_free(tree);
    } else {
        assert_non_null(strstr(faults.text[0], "HU as bone has"));
    }
    faults_clear(&faults);
    volume_free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bone_is_hidden_and_nothing_else),
        cmocka_unit_test(a_vessel_is_tracked_beside_bone),
        cmocka_unit_test(starts_in_tissue_and_bone_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
