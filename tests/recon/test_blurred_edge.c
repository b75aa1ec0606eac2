// Edges of blurred vessels: the closed form against the profile, its inverse, the blur estimated from volumes of known blur, and a tracked tree after
// correction against the true vessel.
#include "recon/volume/blurred_edge.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "recon/phantom/phantom.h"
#include "recon/track/rbt_track.h"
#include "tests/geom/near.h"

// Compares with the steepest point of the profile itself, P(x) = int phi_b(x - u) erf((R^2 - u^2)^(1/2) / (b sqrt 2)) du, and with the two limits.
static void edge_of_a_blurred_disc(void **state)
{
    (void)state;
    static const double blurs[] = {0.1, 0.3, 0.7, 1.5};
    for (int k = 0; k < 4; k++) {
        double b = blurs[k], steepest = 0, at = 0;
        for (double x = 0.005; x < 2.5; x += 0.005) {
            double slope = 0;
            for (int n = 0; n < 1000; n++) {
                double u = -cos(3.14159265358979323846 * (n + 0.5) / 1000), root = sqrt(1 - u * u);
                slope += (x - u) / (b * b) * exp(-(x - u) * (x - u) / (2 * b * b)) * erf(root / (b * sqrt(2))) * root;
            }
            if (slope > steepest)
                steepest = slope, at = x;
        }
        assert_near(blurred_edge_of(1, b), at, 0.006);
    }
    assert_near(blurred_edge_of(2, 0.1), 2 - 0.01 / 4, 1e-5);
    assert_near(blurred_edge_of(0.01, 1), 1, 1e-3);
    assert_near(blurred_edge_of(1.3, 0), 1.3, 0);
}

static void the_inverse(void **state)
{
    (void)state;
    for (double radius = 1.4; radius < 30; radius *= 1.3)
        assert_near(blurred_edge_undo(blurred_edge_of(radius, 1), 1), radius, 1e-6 * radius);
    assert_near(blurred_edge_undo(1.2, 1), 1.2, 0);   // indeterminate: the edge of any small disc
    assert_near(blurred_edge_undo(0.7, 0), 0.7, 0);
}

// A tracked helix of radius 1 mm at 0.2 mm voxels, noise 5 %: the estimated blur, and the wall points against the vessel before and after the correction.
static void wall_of_a_tracked_helix(void **state)
{
    (void)state;
    static const double psf[] = {0, 0.1, 0.2, 0.35};
    static const char turns[2][64] = {"turns", "1"};
    Faults faults = {0};
    Shape *shape = shape_create("helix", 1, &turns, "test", &faults);
    assert_non_null(shape);
    VesselTree *truth = shape_sample(shape, &faults);
    for (int k = 0; k < 4; k++) {
        VolumeOptions options = volume_default_options();
        options.psf_mm = psf[k];
        Volume *v = shape_volume(shape, &options, &faults);
        RbtParameters p = rbt_default_parameters();
        RbtSeed seed = {.start = truth->center[2], .toward = truth->center[4], .has_toward = true, .radius = truth->radius[2]};
        VesselTree *tree = rbt_track(v, &p, &seed, 1, NULL, 0, 0, NULL, NULL, "test", &faults);
        assert_non_null(tree);
        double voxel2 = 0.04, expected = sqrt(psf[k] * psf[k] + voxel2 / 12 + voxel2 / 3), found = blurred_edge_measure(v, tree);
        double all = sqrt(found * found + voxel2 / 12);   // with the moving average along the rays
        double mean[2] = {0, 0};
        int count[2] = {0, 0};
        for (int after = 0; after < 2; after++) {
            if (after)
                assert_true(blurred_edge_correct(tree, all));
            for (int i = 0; i < tree->node_count; i++) {
                double end = fmin(vec3_distance(tree->center[i], truth->center[0]), vec3_distance(tree->center[i], truth->center[truth->node_count - 1]));
                for (int64_t q = tree->point_offset[i]; end > 3 && q < tree->point_offset[i + 1]; q++) {
                    mean[after] -= shape_distance(shape, tree->point[q], NULL);
                    count[after]++;
                }
            }
            mean[after] /= count[after];
        }
        print_message("psf %.2f: blur %.4f (%.4f), wall %+.4f (closed form %+.4f), set right %+.4f mm\n", psf[k], found, expected, mean[0],
                      blurred_edge_of(1, sqrt(expected * expected + voxel2 / 12)) - 1, mean[1]);
        assert_near(found, expected, 0.08 * expected);
        assert_near(mean[1], 0, 0.008);
        vessel_tree_free(tree);
        volume_free(v);
    }
    vessel_tree_free(truth);
    shape_free(shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(edge_of_a_blurred_disc), cmocka_unit_test(the_inverse), cmocka_unit_test(wall_of_a_tracked_helix)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
