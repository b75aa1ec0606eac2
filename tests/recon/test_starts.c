// Checks of the first start: noise is measured, a vessel in noise is found if it can be seen and refused if it cannot, and clear volumes cause no warning.
// Rates over several seeds; `bench track --only-starts` tests more.
#include "recon/phantom/phantom.h"
#include "recon/track/rbt_scan.h"
#include "recon/track/rbt_track.h"
#include "recon/volume/volume_noise.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SEEDS = 1, FEW = 1 };
#else
enum { SEEDS = 5, FEW = 3 };       // FEW where each seed has to pass, SEEDS for a rate
#endif

static Faults faults;

typedef struct Angiogram {
    Shape *shape;
    VesselTree *truth;
    Volume *volume;
} Angiogram;

// A random tree in integer grey values, 1 mm voxels.
static Angiogram make(int seed, double radius, double contrast, double noise, double band, double rotate_deg)
{
    char option[4][2][64] = {{"points", "8"}, {"branches", "9"}, {"seed", ""}, {"radius_mm", ""}};
    snprintf(option[2][1], 64, "%d", seed);
    snprintf(option[3][1], 64, "%g", radius);
    VolumeOptions o = volume_default_options();
    o.voxel_mm[0] = o.voxel_mm[1] = o.voxel_mm[2] = 1;
    o.psf_mm = 0.5;
    o.contrast_grey = contrast;
    o.noise = noise / contrast;
    o.band = band / contrast;
    o.band_mm = 8 * radius;
    o.rotate_deg = rotate_deg;
    o.seed = 50 + (uint64_t)seed;
    faults_clear(&faults);
    Angiogram a = {.shape = shape_create("tree", 4, (const char(*)[2][64])option, "test", &faults)};
    assert_non_null(a.shape);
    a.truth = shape_sample(a.shape, &faults);
    a.volume = shape_volume(a.shape, &o, &faults);
    assert_true(a.truth && a.volume);
    return a;
}

static void release(Angiogram *a)
{
    volume_free(a->volume);
    vessel_tree_free(a->truth);
    shape_free(a->shape);
}

static VesselTree *click(const Angiogram *a, Vec3 x, RbtReport *report)
{
    RbtParameters p = rbt_default_parameters();
    RbtSeed seed = {.start = x, .line = 7, .column = 3};
    *report = (RbtReport){0};
    faults_clear(&faults);
    return rbt_track(a->volume, &p, &seed, 1, NULL, 0, 0, NULL, report, "t.yaml", &faults);
}

// Returns a point in the trunk: the first nodes of the exact tree lie along it.
static Vec3 in_trunk(const Angiogram *a, double *radius)
{
    *radius = a->truth->radius[6];
    return vec3_add_scaled(a->truth->center[6], 0.3 * *radius, vec3_normal_to(a->truth->direction[6]));
}

static double off_axis(const Angiogram *a, Vec3 x)
{
    double least = 1e9;
    for (int i = 1; i < a->truth->node_count; i++) {
        Vec3 p = a->truth->center[i], ab = vec3_sub(a->truth->center[a->truth->parent[i]], p);
        double s = fmax(0, fmin(1, vec3_dot(vec3_sub(x, p), ab) / fmax(vec3_norm2(ab), 1e-300)));
        least = fmin(least, vec3_distance(x, vec3_add_scaled(p, s, ab)));
    }
    return least;
}

static void noise_is_measured(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        double noise = i == 0 ? 2 : i == 1 ? 11 : 21, band = i == 2 ? 60 : 0;
        Angiogram a = make(i + 1, 4, 13, noise, band, 20.0 * i);
        double found = volume_noise(a.volume, 3), exact = sqrt(noise * noise + 1.0 / 12);   // with the variance of rounding
        Volume *one = volume_smoothed(a.volume, 2, 1), *three = volume_smoothed(a.volume, 2, 3);
        assert_true(one && three);
        size_t voxels = (size_t)one->size[0] * (size_t)one->size[1] * (size_t)one->size[2];
        double smooth = volume_noise(one, 9), expected = exact / pow(4 * PI * 4, 0.75), before = 0, after = 0;
        for (size_t k = 0; k < voxels; k++) {
            before += (double)a.volume->value[k] / (double)voxels;
            after += (double)one->value[k] / (double)voxels;
        }
        print_message("noise %.2f: found %.2f; smoothed by 2 voxels %.3f (white noise %.3f); mean %.3f and %.3f\n", exact, found, smooth, expected, before,
                      after);
        assert_true(fabs(found / exact - 1) < 0.05);
        assert_true(band > 0 || (smooth > 0.9 * expected && smooth < 1.5 * expected));   // the smoothing keeps the vessels
        assert_true(fabs(after - before) < 0.2);
        assert_memory_equal(one->value, three->value, voxels * sizeof(float));
        volume_free(one);
        volume_free(three);
        release(&a);
    }
}

// Clear volumes cause no warning.
static void clear_volumes_are_not_warned_of(void **state)
{
    (void)state;
    int warnings = 0, trials = 0;
    for (int seed = 1; seed <= FEW; seed++)
        for (int k = 0; k < 3; k++) {
            double radius;
            Angiogram a = make(seed, 4, 100, k == 0 ? 0 : k == 1 ? 5 : 15, 0, 15.0 * k);
            Vec3 x = in_trunk(&a, &radius);
            RbtReport report;
            VesselTree *tree = click(&a, x, &report);
            assert_non_null(tree);
            const RbtStartCheck *c = &report.check;
            for (int i = 0; i < c->warning_count; i++)
                print_message("seed %d, noise %d: %s\n", seed, k, c->warning[i].text);
            trials++;
            warnings += c->warning_count > 0;
            assert_true(c->smoothing_mm == 0);
            assert_true(fabs(c->cylinder.radius / radius - 1) < 0.15 && off_axis(&a, c->cylinder.center) < 0.2 * radius);
            assert_true(fabs(c->drift - 0.3 * radius) < 0.2 * radius);
            assert_true(fabs(c->contrast - 100) < 15);
            assert_int_equal(report.loop_count, 0);
            rbt_report_free(&report);
            vessel_tree_free(tree);
            release(&a);
        }
    print_message("%d of %d clear volumes with a warning\n", warnings, trials);
    assert_true(warnings * 10 <= trials);
}

static void a_vessel_in_noise_is_found(void **state)
{
    (void)state;
    int right = 0, trials = 0;
    for (int seed = 1; seed <= SEEDS; seed++)
        for (int k = 0; k < 2; k++) {
            double radius, length = 0;
            Angiogram a = make(seed, 4, 13, 16, k ? 40 : 0, 25.0 * k);
            Vec3 x = in_trunk(&a, &radius);
            RbtReport report;
            VesselTree *tree = click(&a, x, &report);
            trials++;
            if (tree) {
                const RbtStartCheck *c = &report.check;
                length = report.branch[0].length;
                right += off_axis(&a, c->cylinder.center) < 0.5 * radius && fabs(c->cylinder.radius / radius - 1) < 0.3 && length > 4 * radius;
                bool warns = false;
                for (int i = 0; i < c->warning_count; i++)
                    warns = warns || c->warning[i].kind == RBT_NOISE;
                assert_true(warns && c->smoothing_mm > 0 && fabs(c->noise / 16 - 1) < 0.1);
            }
            print_message("seed %d, band %d: %s, start %.2f radii off the axis, radius %.2f of the true, first branch %.0f mm\n", seed, k,
                          tree ? "tracked" : faults.text[0], off_axis(&a, report.check.cylinder.center) / radius, report.check.cylinder.radius / radius,
                          length);
            rbt_report_free(&report);
            vessel_tree_free(tree);
            release(&a);
        }
    print_message("right: %d of %d\n", right, trials);
    assert_true(right * 10 >= 8 * trials);
}

static void hidden_vessels_are_refused(void **state)
{
    (void)state;
    for (int seed = 1; seed <= FEW; seed++)
        for (int k = 0; k < 2; k++) {
            double radius;
            Angiogram a = k ? make(seed, 4, 13, 16, 40, 0) : make(seed, 2, 4, 40, 0, 0);
            Vec3 x = in_trunk(&a, &radius);
            if (k)   // a place outside all vessels, away from the trunk's root
                x = vec3_add_scaled(a.truth->center[0], 3.2 * radius, vec3_normal_to(a.truth->direction[0]));
            RbtReport report;
            VesselTree *tree = click(&a, x, &report);
            if (tree)
                print_message("seed %d: found %.1f radii from any vessel, radius %.2f, certainty %.1f: %s\n", seed,
                              off_axis(&a, report.check.cylinder.center) / radius, report.check.cylinder.radius, report.check.certainty,
                              report.check.warning_count > 1 ? report.check.warning[0].text : "no word");
            assert_null(tree);
            print_message("%s\n", faults.text[0]);
            assert_int_equal(faults.count, 1);
            assert_non_null(strstr(faults.text[0], "t.yaml:7:3"));
            assert_true(strstr(faults.text[0], "noise hides the edge") || strstr(faults.text[0], "background") || strstr(faults.text[0], "from the click"));
            rbt_report_free(&report);
            release(&a);
        }
}

// A tube has the same contrast all around, a slab is bright on two sides.
static void a_slab_is_no_tube(void **state)
{
    (void)state;
    Volume *v = volume_create((int[3]){60, 60, 60}, vec3(0, 0, 0), (Vec3[3]){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    assert_non_null(v);
    for (int kind = 0; kind < 3; kind++) {
        for (int k = 0; k < 60; k++)
            for (int j = 0; j < 60; j++)
                for (int i = 0; i < 60; i++) {
                    double rho = hypot(i - 30, j - 30);
                    bool in = kind == 0 ? rho < 5 : kind == 1 ? abs(i - 30) < 5 : i > 30;
                    v->value[(k * 60 + j) * 60 + i] = in ? 50 : 10;
                }
        Cylinder tube = {vec3(kind == 2 ? 35 : 30, 30, 30), 5, vec3(0, 0, 1), 10};
        RbtSight sight = rbt_sight_of(v, 5, &tube);
        print_message("%s: contrast %.1f, evenness %.2f, %.0f standard errors\n",
                      kind == 0   ? "tube"
                      : kind == 1 ? "slab"
                                  : "step",
                      sight.contrast, sight.evenness, sight.certainty);
        assert_int_equal(rbt_is_tube(&sight), kind == 0);
        assert_true(kind != 0 || (fabs(sight.contrast - 40) < 1 && sight.evenness > 0.95));
    }
    volume_free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(noise_is_measured), cmocka_unit_test(a_slab_is_no_tube),
                                       cmocka_unit_test(clear_volumes_are_not_warned_of), cmocka_unit_test(a_vessel_in_noise_is_found),
                                       cmocka_unit_test(hidden_vessels_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
