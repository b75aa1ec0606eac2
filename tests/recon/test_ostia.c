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

typedef struct Kind {
    const char *name, *option[3][2];
    int seeds;
} Kind;
static const Kind tree_kind = {"tree", {{"branches", "25"}, {"radius_mm", "1.4"}, {"points", "8"}}, 4};

// A synthetic vessel, its angiogram with voxels of 0.25 mm, and what is tracked from the inlet.
static Case make_case(const Kind *kind, int seed, double noise, bool track)
{
    char option[4][2][64];
    Case c = {0};
    faults_clear(&faults);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            snprintf(option[i][k], sizeof option[i][k], "%s", kind->option[i][k]);
    snprintf(option[3][0], sizeof option[3][0], "seed");
    snprintf(option[3][1], sizeof option[3][1], "%d", seed);
    c.shape = shape_create(kind->name, 4, (const char (*)[2][64])option, "test", &faults);
    c.truth = c.shape ? shape_sample(c.shape, &faults) : NULL;
    c.volume = c.shape ? shape_volume(c.shape, 0.25, 0.2, noise, (uint64_t)seed, &faults) : NULL;
    assert_true(c.truth && c.volume);
    RbtParameters p = rbt_default_parameters();
    p.automatic = 1;
    p.seed = seed;
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

typedef struct Sum {
    Figures link, tube;
    int junctions, doubtful, refused, wrong, nodes, outside;
    double longest, shallow, darkest;
} Sum;

static void add_junction(const Case *c, const RbtJunction *junction, Sum *sum)
{
    sum->junctions++;
    sum->doubtful += junction->support == RBT_DOUBTFUL;
    sum->refused += junction->support == RBT_REFUSED;
    sum->darkest = fmin(sum->darkest, junction->share);
    int first = junction->branch < 0 ? 0 : c->report.branch[junction->branch].first_node;
    for (int i = first; junction->branch >= 0 && i < first + junction->node_count; i++) {
        double inside = shape_field(c->shape, c->tree->center[i], NULL);
        sum->nodes++;
        sum->outside += inside < 0;
        sum->shallow = fmin(sum->shallow, inside / c->tree->radius[i]);
        for (int64_t k = c->tree->point_offset[i]; k < c->tree->point_offset[i + 1]; k++)
            add_error(&sum->link, shape_field(c->shape, c->tree->point[k], NULL));
    }
}

static void add_case(const Case *c, Sum *sum)
{
    for (int i = 1; i < c->tree->node_count; i++)
        sum->longest = fmax(sum->longest, ratio_of_link(c->tree, i));
    for (int i = 0; i < c->tree->node_count; i++)
        for (int64_t k = c->tree->point_offset[i]; k < c->tree->point_offset[i + 1]; k += 16)
            add_error(&sum->tube, shape_field(c->shape, c->tree->point[k], NULL));
    for (int j = 0; j < c->report.junction_count; j++)
        if (!c->report.junction[j].is_inner)
            add_junction(c, &c->report.junction[j], sum);
    TrackTruth truth = {.tree = c->truth, .voxel_mm = 0.25, .blur_mm = 0.25};
    TrackScore score;
    assert_true(track_score(&truth, c->tree, &score));
    sum->wrong += score.wrong_attachments + score.background_links;
    track_score_free(&score);
}

static void check_sum(const char *name, double noise, Sum *sum)
{
    double mean[2], rms[2], p99[2];
    summarise(&sum->link, &mean[0], &rms[0], &p99[0]);
    summarise(&sum->tube, &mean[1], &rms[1], &p99[1]);
    print_message("%s, noise %.2f: %d junctions, %d doubtful, %d refused, darkest %.2f; %d wrong links; longest link %.2f of the sum of its radii\n", name, noise,
                  sum->junctions, sum->doubtful, sum->refused, sum->darkest, sum->wrong, sum->longest);
    print_message("  %d link nodes, %d outside the true lumen, shallowest %.2f r; %d points: mean %.3f, rms %.3f, p99 %.3f mm (all points %.3f, %.3f, %.3f)\n", sum->nodes,
                  sum->outside, sum->shallow, sum->link.count, mean[0], rms[0], p99[0], mean[1], rms[1], p99[1]);
    free(sum->link.error);
    free(sum->tube.error);
    assert_true(sum->junctions > 0 && sum->longest <= 1);
    assert_int_equal(sum->outside, 0);
    assert_int_equal(sum->doubtful + sum->refused + sum->wrong, 0);
    // as near to the wall as what was tracked beside, or a quarter of a voxel where the twig is as narrow as the image's blur
    assert_true(rms[0] < fmax(1.5 * rms[1], 0.0625) && p99[0] < fmax(1.5 * p99[1], 0.125));
}

static void every_ostium_is_described(void **state)
{
    (void)state;
    static const Kind kinds[] = {{"tree", {{"branches", "25"}, {"radius_mm", "1.4"}, {"points", "8"}}, 4},
                                 {"twig", {{"twig_radius_mm", "0.4"}, {"radius_mm", "2"}, {"points", "8"}}, 4},
                                 {"twig", {{"twig_radius_mm", "0.3"}, {"radius_mm", "2"}, {"points", "8"}}, 4},
                                 {"y", {{"angle_deg", "60"}, {"radius_mm", "1"}, {"points", "8"}}, 3}};
    static const double noises[2] = {0, 0.05};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        for (int n = 0; n < 2; n++) {
            Sum sum = {.shallow = HUGE_VAL, .darkest = 1};
            for (int seed = 1; seed <= (is_slow ? 1 : kinds[k].seeds); seed++) {
                Case c = make_case(&kinds[k], seed, noises[n], true);
                add_case(&c, &sum);
                case_free(&c);
            }
            check_sum(kinds[k].name, noises[n], &sum);
        }
}

// --- what the image must refuse ---

static Tracker tracker_of(const Volume *volume, const RbtParameters *p)
{
    return (Tracker){.volume = volume, .parameters = p, .voxel = volume_voxel_size(volume)};
}

static double share_of(const Tracker *t, Vec3 from, Vec3 to, double radius)
{
    LinkLight light = {fmin(1, tracker_brightness(t, to)), 0};
    LinkPath path;
    assert_true(rbt_link_path(t, from, to, fmax(radius, t->voxel), &light, &path));
    free(path.point);
    return path.share;
}

// A vessel's axis turned by 90 degrees, at one of eight angles.
static Vec3 turned_aside(Vec3 link, int k)
{
    Vec3 d = vec3_unit(link), u = vec3_normal_to(d), v = vec3_cross(d, u);
    return vec3_scale(vec3_add(vec3_scale(u, cos(k * PI / 4)), vec3_scale(v, sin(k * PI / 4))), vec3_norm(link));
}

// From a true branch's axis, two of its radii beyond the parent's wall, a link as long as the true one that leads anywhere else.
static void links_turned_aside_are_refused(void **state)
{
    (void)state;
    RbtParameters p = rbt_default_parameters();
    for (int n = 0; n < 2; n++) {
        double share[2000], least = 1;
        int count = 0, pass = 0, doubtful = 0, own = 0, own_pass = 0;
        for (int seed = 1; seed <= (is_slow ? 1 : 4); seed++) {
            Case c = make_case(&tree_kind, seed, 0.05 * n, false);
            Tracker t = tracker_of(c.volume, &p);
            const VesselTree *tree = c.truth;
            for (int i = 1; i < tree->node_count; i++) {
                if (tree->parent[i] == i - 1)
                    continue;
                int at = i, parent = tree->parent[i];
                while (at + 1 < tree->node_count && tree->parent[at + 1] == at &&
                       vec3_distance(tree->center[at], tree->center[parent]) < tree->radius[parent] + 2 * tree->radius[at])
                    at++;
                Vec3 from = tree->center[at], link = vec3_sub(tree->center[parent], from);
                double true_share = share_of(&t, tree->center[parent], from, tree->radius[at]);
                own++;
                own_pass += true_share >= 0.5;
                least = fmin(least, true_share);
                for (int k = 0; k < 8 && count < 2000; k++) {
                    double s = share_of(&t, vec3_add(from, turned_aside(link, k)), from, tree->radius[at]);
                    pass += s >= 0.5;
                    doubtful += s >= 0.25 && s < 0.5;
                    share[count++] = s;
                }
            }
            case_free(&c);
        }
        sort_doubles(share, (size_t)count);
        print_message("noise %.2f: true links %d of %d supported, darkest %.2f; turned aside: median %.2f, %d of %d supported, %d doubtful\n", 0.05 * n, own_pass, own, least,
                      share[count / 2], pass, count, doubtful);
        assert_int_equal(own_pass, own);
        assert_true(share[count / 2] < 0.1 && pass <= 0.1 * count);
    }
}

// A link to a neighbour that only touches: a wrong bright vessel is seen as such where the gap is wider than the image's blur.
static void links_to_a_kissing_neighbour(void **state)
{
    (void)state;
    static const char *const gap[] = {"0.1", "0.25", "0.5", "0.75", "1"};
    RbtParameters p = rbt_default_parameters();
    for (int g = 0; g < 5; g++) {
        int count = 0, pass = 0, doubtful = 0;
        for (int seed = 1; seed <= (is_slow ? 1 : 4); seed++) {
            Kind kind = {"kissing", {{"gap_mm", gap[g]}, {"radius_mm", "1"}, {"crossing_deg", seed % 2 ? "0" : "90"}}, 1};
            Case c = make_case(&kind, seed, 0.05, false);
            VesselTree *other = shape_sample(shape_neighbour(c.shape), &faults);
            Tracker t = tracker_of(c.volume, &p);
            assert_non_null(other);
            for (int i = 0; i < c.truth->node_count; i++)
                for (int k = 0; k < other->node_count; k++) {
                    double apart = vec3_distance(c.truth->center[i], other->center[k]) - c.truth->radius[i] - other->radius[k];
                    if (apart > atof(gap[g]) + 0.05)
                        continue;
                    double s = share_of(&t, c.truth->center[i], other->center[k], other->radius[k]);
                    count++;
                    pass += s >= 0.5;
                    doubtful += s >= 0.25 && s < 0.5;
                }
            vessel_tree_free(other);
            case_free(&c);
        }
        print_message("kissing at %s mm, voxels of 0.25 mm: %d of %d links supported, %d doubtful\n", gap[g], pass, count, doubtful);
        assert_true(count > 0 && (g < 3 || pass == 0));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_ostium_is_described), cmocka_unit_test(links_turned_aside_are_refused), cmocka_unit_test(links_to_a_kissing_neighbour),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
