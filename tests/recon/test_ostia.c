// Ostia of tracked trees against truth: synthetic trees with and without noise, and links that the image must refuse.
#include "geom/sort_doubles.h"
#include "recon/phantom.h"
#include "recon/rbt_link_path.h"
#include "recon/rbt_track.h"
#include "recon/track_score.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
static const bool is_slow = true;    // one case of a kind: the figures are the release build's business
#else
static const bool is_slow = false;
#endif

typedef struct Case {
    Shape *shape;
    VesselTree *truth, *tree;
    Volume *volume;
    RbtReport report;
} Case;

static void case_free(Case *c)
{
    rbt_report_free(&c->report);
    vessel_tree_free(c->tree);
    vessel_tree_free(c->truth);
    volume_free(c->volume);
    shape_free(c->shape);
}

// A synthetic tree of 25 branches, its angiogram with voxels of 0.25 mm, and what is tracked from the trunk's inlet.
static Case tree_case(int seed, double noise, bool track)
{
    char text[64];
    Case c = {0};
    faults_clear(&faults);
    snprintf(text, sizeof text, "%d", seed);
    const char option[4][2][64] = {{"branches", "25"}, {"radius_mm", "1.4"}, {"points", "8"}, {"seed", {text[0], text[1]}}};
    c.shape = shape_create("tree", 4, option, "test", &faults);
    c.truth = c.shape ? shape_sample(c.shape, &faults) : NULL;
    c.volume = c.shape ? shape_volume(c.shape, 0.25, 0.2, noise, (uint64_t)seed, &faults) : NULL;
    assert_true(c.truth && c.volume);
    RbtParameters p = rbt_default_parameters();
    p.automatic = 1;
    RbtSeed start = {.start = c.truth->center[2], .toward = vec3_add(c.truth->center[2], c.truth->direction[2]), .has_toward = true, .radius = c.truth->radius[2]};
    if (track) {
        c.tree = rbt_track(c.volume, &p, &start, 1, NULL, 0, 0, NULL, &c.report, "t.yaml", &faults);
        assert_non_null(c.tree);
        assert_true(vessel_tree_validate(c.tree, "tree", &faults));
    }
    return c;
}

static double ratio_of_link(const VesselTree *tree, int i)
{
    return vec3_distance(tree->center[i], tree->center[tree->parent[i]]) / (tree->radius[i] + tree->radius[tree->parent[i]]);
}

typedef struct Figures {
    double *error;           // [mm] of points, signed, > 0 inside
    int count, capacity;
} Figures;

static void add_error(Figures *f, double error)
{
    if (f->count == f->capacity) {
        f->capacity = 2 * f->capacity + 1024;
        f->error = realloc(f->error, (size_t)f->capacity * sizeof *f->error);
        assert_non_null(f->error);
    }
    f->error[f->count++] = error;
}

// Mean, root mean square, 99th percentile of the magnitude.
static void summarise(Figures *f, double *mean, double *rms, double *p99)
{
    *mean = *rms = *p99 = 0;
    for (int i = 0; i < f->count; i++) {
        *mean += f->error[i] / f->count;
        *rms += f->error[i] * f->error[i] / f->count;
        f->error[i] = fabs(f->error[i]);
    }
    *rms = sqrt(*rms);
    sort_doubles(f->error, (size_t)f->count);
    *p99 = f->count > 0 ? f->error[(int)(0.99 * (f->count - 1))] : 0;
}

static void every_ostium_is_described(void **state)
{
    (void)state;
    static const double noises[2] = {0, 0.05};
    for (int n = 0; n < 2; n++) {
        Figures link = {0}, tube = {0};
        int junctions = 0, nodes = 0, doubtful = 0, refused = 0, wrong = 0, outside = 0;
        double longest = 0, shallow = HUGE_VAL, darkest = 1;
        for (int seed = 1; seed <= (is_slow ? 1 : 6); seed++) {
            Case c = tree_case(seed, noises[n], true);
            for (int i = 1; i < c.tree->node_count; i++)
                longest = fmax(longest, ratio_of_link(c.tree, i));
            for (int i = 0; i < c.tree->node_count; i++)
                for (int64_t k = c.tree->point_offset[i]; k < c.tree->point_offset[i + 1]; k += 16)
                    add_error(&tube, shape_field(c.shape, c.tree->point[k], NULL));
            for (int j = 0; j < c.report.junction_count; j++) {
                const RbtJunction *junction = &c.report.junction[j];
                if (junction->is_inner)
                    continue;
                junctions++;
                doubtful += junction->support == RBT_DOUBTFUL;
                refused += junction->support == RBT_REFUSED;
                darkest = fmin(darkest, junction->share);
                int first = junction->branch < 0 ? 0 : c.report.branch[junction->branch].first_node;
                for (int i = first; junction->branch >= 0 && i < first + junction->node_count; i++) {
                    double inside = shape_field(c.shape, c.tree->center[i], NULL);
                    nodes++;
                    outside += inside < 0;
                    shallow = fmin(shallow, inside / c.tree->radius[i]);
                    for (int64_t k = c.tree->point_offset[i]; k < c.tree->point_offset[i + 1]; k++)
                        add_error(&link, shape_field(c.shape, c.tree->point[k], NULL));
                }
            }
            TrackTruth truth = {.tree = c.truth, .voxel_mm = 0.25, .blur_mm = 0.25};
            TrackScore score;
            assert_true(track_score(&truth, c.tree, &score));
            wrong += score.wrong_attachments + score.background_links;
            track_score_free(&score);
            case_free(&c);
        }
        double mean[2], rms[2], p99[2];
        int points = link.count;
        summarise(&link, &mean[0], &rms[0], &p99[0]);
        summarise(&tube, &mean[1], &rms[1], &p99[1]);
        print_message("noise %.2f: %d junctions, %d doubtful, %d refused, darkest %.2f; %d wrong links; longest link %.2f of the sum of its radii\n", noises[n], junctions,
                      doubtful, refused, darkest, wrong, longest);
        print_message("  %d link nodes, %d outside the true lumen, shallowest %.2f r; %d points: mean %.3f, rms %.3f, p99 %.3f mm (tubes %.3f, %.3f, %.3f)\n", nodes, outside,
                      shallow, points, mean[0], rms[0], p99[0], mean[1], rms[1], p99[1]);
        free(link.error);
        free(tube.error);
        assert_true(longest <= 1);
        assert_int_equal(outside, 0);
        assert_int_equal(doubtful + refused + wrong, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_ostium_is_described),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
