// Limits of a tree: points that the tracking does not pass, excluded vessels, and loops, which a tree cannot represent. On volumes of known geometry,
// mirrored, and with several seeds of the noise.
#include "recon/track/rbt_track.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "tests/short_run.h"
#include "tube_volume.h"

enum { SEEDS = WHOLE_OR_SHORT(4, 1), VARIANTS = WHOLE_OR_SHORT(2, 1) };

static Faults faults;

// Variant 1: mirrored in x, about the volume's middle.
static Vec3 placed(Vec3 p, int variant) { return variant ? vec3(19.8 - p.x, p.y, p.z) : p; }

static void tube(Volume *v, int variant, Vec3 a, Vec3 b, double radius) { add_tube(v, placed(a, variant), placed(b, variant), radius); }

static VesselTree *track(const Volume *v, const RbtParameters *p, Vec3 start, RbtReport *report)
{
    RbtSeed seed = {.start = start, .line = 1, .column = 1};
    faults_clear(&faults);
    *report = (RbtReport){0};
    VesselTree *tree = rbt_track(v, p, &seed, 1, NULL, 0, 0, NULL, report, "t.yaml", &faults);
    for (int i = 0; i < faults.count && i < 3; i++)
        print_message("%s\n", faults.text[i]);
    if (tree)
        assert_true(vessel_tree_validate(tree, "tree", &faults));
    return tree;
}

static double nearest_to(const VesselTree *tree, Vec3 x)
{
    double least = 1e9;
    for (int i = 0; i < tree->node_count; i++)
        least = fmin(least, vec3_distance(tree->center[i], x));
    return least;
}

static RbtParameters automatic(void)
{
    RbtParameters p = rbt_default_parameters();
    p.automatic = 1;
    return p;
}

// A trunk along z with branches at 5, 9 and 17 mm.
static Volume *trunk_with_branches(int variant, uint64_t seed)
{
    Volume *v = dark_volume(100, 100, 145, 0.2);
    tube(v, variant, vec3(10, 10, -2), vec3(10, 10, 27.5), 1.2);
    tube(v, variant, vec3(10, 10, 5), vec3(18, 10, 9), 0.7);
    tube(v, variant, vec3(10, 10, 9), vec3(3, 10, 14), 0.6);
    tube(v, variant, vec3(10, 10, 17), vec3(10, 17.5, 21), 0.6);
    add_noise_of(v, 0.05, seed);
    return v;
}

static void the_tree_ends_at_until(void **state)
{
    (void)state;
    for (int variant = 0; variant < VARIANTS; variant++)
        for (uint64_t seed = 1; seed <= SEEDS; seed++) {
            Volume *v = trunk_with_branches(variant, seed);
            RbtParameters p = automatic();
            RbtRegion until[2] = {{.center = placed(vec3(10.3, 10.2, 13), variant), .line = 3, .column = 5},
                                  {.center = placed(vec3(14, 10, 7), variant), .line = 4, .column = 5}};
            RbtReport report;
            p.until = until;
            p.until_count = 2;
            VesselTree *tree = track(v, &p, placed(vec3(10, 10, 3), variant), &report);
            assert_non_null(tree);
            double top = 0, side = 0;
            for (int i = 0; i < tree->node_count; i++) {
                Vec3 c = placed(tree->center[i], variant);
                top = fmax(top, c.z);
                side = fmax(side, c.z < 12 ? c.x : 0);
            }
            print_message("until: highest node %.2f of 13 mm, furthest of the side branch %.2f of 14 mm\n", top, side);
            assert_true(top > 11 && top < 14.5);          // the branch to (3, 10, 14) ends there anyway
            assert_true(side > 12.3 && side < 14.6);
            assert_true(nearest_to(tree, placed(vec3(10, 10, 15), variant)) > 1.5);
            assert_true(nearest_to(tree, placed(vec3(10, 17, 20.8), variant)) > 3);
            assert_true(nearest_to(tree, placed(vec3(4, 10, 13.3), variant)) < 0.8);
            bool is_reported = false;
            for (int b = 0; b < report.branch_count; b++)
                is_reported = is_reported || strstr(report.branch[b].end, "until");
            assert_true(is_reported);
            rbt_report_free(&report);
            vessel_tree_free(tree);
            volume_free(v);
        }
}

// An artery and a vein side by side, joined by a narrow vessel; each has a branch.
static Volume *artery_and_vein(int variant, uint64_t seed)
{
    Volume *v = dark_volume(100, 100, 145, 0.2);
    tube(v, variant, vec3(6, 10, -2), vec3(6, 10, 27), 1.1);
    tube(v, variant, vec3(6, 10, 8), vec3(6, 17, 12), 0.6);
    tube(v, variant, vec3(14, 10, 2), vec3(14, 10, 31), 1.5);
    tube(v, variant, vec3(14, 10, 20), vec3(14, 17, 24), 0.7);
    tube(v, variant, vec3(6, 10, 14), vec3(14, 10, 17), 0.5);
    add_noise_of(v, 0.05, seed);
    return v;
}

static void what_is_not_wanted_is_left_out(void **state)
{
    (void)state;
    for (int variant = 0; variant < VARIANTS; variant++)
        for (uint64_t seed = 1; seed <= SEEDS; seed++) {
            Volume *v = artery_and_vein(variant, seed);
            RbtParameters p = automatic();
            RbtRegion rival = {.center = placed(vec3(14, 10, 10), variant), .line = 3, .column = 5};
            RbtReport whole_report, report;
            VesselTree *whole = track(v, &p, placed(vec3(6, 10, 3), variant), &whole_report);
            p.rival = &rival;
            p.rival_count = 1;
            VesselTree *tree = track(v, &p, placed(vec3(6, 10, 3), variant), &report);
            assert_true(whole && tree);
            // one click finds both
            assert_true(nearest_to(whole, placed(vec3(14, 10, 26), variant)) < 1);
            double furthest = 0;
            for (int i = 0; i < tree->node_count; i++)
                furthest = fmax(furthest, placed(tree->center[i], variant).x);
            print_message("not: %d of %d nodes, furthest x %.2f (the vein's wall is at 12.5), %d branches, %.0f mm left out\n", tree->node_count,
                          whole->node_count, furthest, report.left_out_count, report.left_out_length);
            assert_true(furthest < 12.7);
            assert_true(nearest_to(tree, placed(vec3(6, 10, 26), variant)) < 1 && nearest_to(tree, placed(vec3(6, 16.5, 11.7), variant)) < 1);
            assert_true(report.left_out_count >= 2 && report.left_out_length > 28);
            rbt_report_free(&report);
            rbt_report_free(&whole_report);
            vessel_tree_free(tree);
            vessel_tree_free(whole);
            volume_free(v);
        }
}

// One lumen that narrows between the start and the excluded point.
static void one_lumen_is_divided_where_it_is_narrow(void **state)
{
    (void)state;
    for (int variant = 0; variant < VARIANTS; variant++) {
        Volume *v = dark_volume(100, 100, 145, 0.2);
        for (int i = 0; i <= 600; i++) {
            double z = -2 + i * 0.05, d = (z - 17) / 1.2;
            add_ball(v, placed(vec3(10, 10, z), variant), 1.3 - 0.6 * exp(-d * d), 1);
        }
        tube(v, variant, vec3(10, 10, 22), vec3(17, 10, 25), 0.7);
        add_noise_of(v, 0.05, 1);
        RbtParameters p = automatic();
        RbtRegion rival = {.center = placed(vec3(10, 10, 24), variant), .line = 3, .column = 5};
        RbtReport report;
        p.rival = &rival;
        p.rival_count = 1;
        VesselTree *tree = track(v, &p, placed(vec3(10, 10, 5), variant), &report);
        assert_non_null(tree);
        double top = 0;
        for (int i = 0; i < tree->node_count; i++)
            top = fmax(top, tree->center[i].z);
        print_message("not: the lumen is divided at %.2f mm (narrowest at 17)\n", top);
        assert_true(fabs(top - 17) < 1.5);
        rbt_report_free(&report);
        vessel_tree_free(tree);
        volume_free(v);
    }
}

static void unfit_limits_are_refused(void **state)
{
    (void)state;
    Volume *v = trunk_with_branches(0, 1);
    static const struct {
        Vec3 point;
        bool is_rival;
        const char *words;
    } cases[] = {{{3, 3, 3}, false, "lies in no vessel"}, {{10, 10, 3.2}, false, "lies at the first start"}, {{500, 10, 3}, false, "outside the volume"},
                 {{3, 3, 3}, true, "lies in no vessel"},  {{10, 10, 3.2}, true, "from the first start"},     {{500, 10, 3}, true, "outside the volume"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        RbtParameters p = automatic();
        RbtRegion region = {.center = cases[i].point, .line = 3, .column = 5};
        RbtReport report;
        p.until = p.rival = &region;
        p.until_count = !cases[i].is_rival;
        p.rival_count = cases[i].is_rival;
        assert_null(track(v, &p, vec3(10, 10, 3), &report));
        assert_non_null(strstr(faults.text[0], cases[i].words));
        assert_non_null(strstr(faults.text[0], "t.yaml:3:5"));
    }
    volume_free(v);
}

// A vessel that divides and joins again.
static void a_ring_is_a_loop(void **state)
{
    (void)state;
    for (int variant = 0; variant < VARIANTS; variant++)
        for (uint64_t seed = 1; seed <= SEEDS; seed++) {
            Volume *v = dark_volume(100, 100, 145, 0.2);
            tube(v, variant, vec3(10, 10, -2), vec3(10, 10, 6), 1);
            tube(v, variant, vec3(10, 10, 22), vec3(10, 10, 31), 1);
            Vec3 ring[41];
            double around = 0;
            for (int i = 0; i <= 40; i++) {
                double a = 2 * PI * i / 40;
                ring[i] = vec3(10 + 6 * sin(a), 10, 14 - 8 * cos(a));
                if (i > 0) {
                    tube(v, variant, ring[i - 1], ring[i], i <= 20 ? 0.8 : 0.7);
                    around += vec3_distance(ring[i - 1], ring[i]);
                }
            }
            add_noise_of(v, 0.05, seed);
            RbtParameters p = automatic();
            RbtReport report;
            VesselTree *tree = track(v, &p, placed(vec3(10, 10, 3), variant), &report);
            assert_non_null(tree);
            double off = 1e9;
            for (int i = 0; i <= 40 && report.loop_count > 0; i++)
                off = fmin(off, vec3_distance(report.loop[0].place, placed(ring[i], variant)));
            print_message("ring: %d loops, %.1f mm around (the truth %.1f), its place %.2f mm from the ring\n", report.loop_count,
                          report.loop_count > 0 ? report.loop[0].length : 0, around, off);
            assert_int_equal(report.loop_count, 1);
            assert_true(fabs(report.loop[0].length / around - 1) < 0.1);
            assert_true(off < 1);
            rbt_report_free(&report);
            vessel_tree_free(tree);
            volume_free(v);
            // and no loop is found where there is none
            v = trunk_with_branches(variant, seed);
            tree = track(v, &p, placed(vec3(10, 10, 3), variant), &report);
            assert_non_null(tree);
            assert_int_equal(report.loop_count, 0);
            rbt_report_free(&report);
            vessel_tree_free(tree);
            volume_free(v);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_tree_ends_at_until), cmocka_unit_test(what_is_not_wanted_is_left_out),
                                       cmocka_unit_test(one_lumen_is_divided_where_it_is_narrow), cmocka_unit_test(unfit_limits_are_refused),
                                       cmocka_unit_test(a_ring_is_a_loop)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
