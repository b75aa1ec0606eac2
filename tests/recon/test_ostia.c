// Ostia of tracked trees against the exact geometry: synthetic trees with and without noise, and links that the image must refuse.
#include "base/sort_doubles.h"
#include "bench/track_score.h"
#include "recon/phantom/phantom.h"
#include "recon/track/rbt_link_path.h"
#include "recon/track/rbt_ostia.h"
#include "recon/track/rbt_track.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cubic_volume.h"

static Faults faults;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
static const bool is_slow = true;    // one case of each kind: accuracy is measured in the release build
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

// A synthetic vessel, its angiogram with voxels of 0.25 mm, and the tree tracked from the inlet.
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
    c.shape = shape_create(kind->name, 4, (const char(*)[2][64])option, "test", &faults);
    c.truth = c.shape ? shape_sample(c.shape, &faults) : NULL;
    c.volume = c.shape ? cubic_volume(c.shape, 0.25, 0.2, noise, (uint64_t)seed, &faults) : NULL;
    assert_true(c.truth && c.volume);
    RbtParameters p = rbt_default_parameters();
    p.automatic = 1;
    p.seed = seed;
    RbtSeed start = {
        .start = c.truth->center[2], .toward = vec3_add(c.truth->center[2], c.truth->direction[2]), .has_toward = true, .radius = c.truth->radius[2]};
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
    double *error;           // [mm] signed errors of points, > 0 inside
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

// Computes the mean, root mean square, and 99th percentile of the magnitude.
static void summarise(Figures *f, double *mean, double *rms, double *p99)
{
    *mean = *rms = *p99 = 0;
    for (int i = 0; i < f->count; i++) {
        *mean += f->error[i] / f->count;
        *rms += f->error[i] * f->error[i] / f->count;
        f->error[i] = fabs(f->error[i]);
    }
    *rms = sqrt(*rms);
    if (f->count > 0)
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
    print_message("%s, noise %.2f: %d junctions, %d doubtful, %d refused, darkest %.2f; %d wrong links; longest link %.2f of the sum of its radii\n", name,
                  noise, sum->junctions, sum->doubtful, sum->refused, sum->darkest, sum->wrong, sum->longest);
    print_message("  %d link nodes, %d outside the true lumen, shallowest %.2f r; %d points: mean %.3f, rms %.3f, p99 %.3f mm (all points %.3f, %.3f, %.3f)\n",
                  sum->nodes, sum->outside, sum->shallow, sum->link.count, mean[0], rms[0], p99[0], mean[1], rms[1], p99[1]);
    free(sum->link.error);
    free(sum->tube.error);
    assert_true(sum->junctions > 0 && sum->longest <= 1);
    assert_int_equal(sum->outside, 0);
    assert_int_equal(sum->doubtful + sum->refused + sum->wrong, 0);
    // as near to the wall as the tracked points nearby, or a quarter of a voxel if the twig is as narrow as the image's blur
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

// A vessel's axis rotated by 90 degrees, at one of eight angles.
static Vec3 turned_aside(Vec3 link, int k)
{
    Vec3 d = vec3_unit(link), u = vec3_normal_to(d), v = vec3_cross(d, u);
    return vec3_scale(vec3_add(vec3_scale(u, cos(k * PI / 4)), vec3_scale(v, sin(k * PI / 4))), vec3_norm(link));
}

// Links as long as the true one, from a true branch's axis two of its radii outside the parent's wall, in a wrong direction.
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
        print_message("noise %.2f: true links %d of %d supported, darkest %.2f; turned aside: median %.2f, %d of %d supported, %d doubtful\n", 0.05 * n,
                      own_pass, own, least, share[count / 2], pass, count, doubtful);
        assert_int_equal(own_pass, own);
        assert_true(share[count / 2] < 0.1 && pass <= 0.1 * count);
    }
}

// A link to a neighbour that only touches: it is recognised as wrong if the gap is wider than the image's blur.
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

// --- corrections in the trace file ---

// Checks that every node except those of the root's branch is connected by lumen: its link is shorter than the sum of both radii, or it belongs to a branch
// that the report lists as kept.
static void check_hanging(const VesselTree *tree)
{
    for (int i = 1; i < tree->node_count; i++)
        assert_true(ratio_of_link(tree, i) <= 1);
}

static int nodes_within(const VesselTree *tree, Vec3 x, double reach)
{
    int count = 0;
    for (int i = 0; i < tree->node_count; i++)
        count += vec3_distance(tree->center[i], x) < reach;
    return count;
}

// A twig that is cut near its ostium, or forbidden there, is removed completely; if it is cut further out, its first part stays and is attached to its
// parent.
static void cuts_leave_no_stub(void **state)
{
    (void)state;
    Kind kind = {"twig", {{"twig_radius_mm", "0.5"}, {"radius_mm", "2"}, {"points", "8"}}, 1};
    Case c = make_case(&kind, 1, 0.05, true);
    RbtSeed start = {
        .start = c.truth->center[2], .toward = vec3_add(c.truth->center[2], c.truth->direction[2]), .has_toward = true, .radius = c.truth->radius[2]};
    int first = 0;
    for (int i = 1; i < c.truth->node_count; i++)
        first = c.truth->parent[i] != i - 1 ? i : first;
    assert_int_equal(c.report.branch_count, 2);
    const RbtBranchReport *twig = &c.report.branch[1];
    // on the link outside the wall, at the first tracked node, and two nodes further
    for (int place = 0; place < 5; place++) {
        RbtParameters p = rbt_default_parameters();
        RbtReport report = {0};
        int node = twig->first_node + (place == 0   ? twig->link_count - 1
                                       : place == 1 ? twig->link_count
                                       : place == 2 ? twig->link_count + 2
                                                    : twig->node_count / 2);
        RbtRegion region = {.center = c.tree->center[place == 4 ? twig->first_node + twig->link_count : node], .radius = 1, .line = 1, .column = 1};
        p.automatic = 1;
        *(place == 4 ? &p.forbid : &p.cut) = &region;
        *(place == 4 ? &p.forbid_count : &p.cut_count) = 1;
        VesselTree *tree = rbt_track(c.volume, &p, &start, 1, NULL, 0, 0, NULL, &report, "t.yaml", &faults);
        assert_non_null(tree);
        check_hanging(tree);
        Vec3 tip = c.truth->center[c.truth->node_count - 1];
        assert_int_equal(nodes_within(tree, tip, 2), 0);
        if (place == 3) {
            assert_int_equal(report.branch_count, 2);
            assert_true(report.branch[1].link_count > 0);
        } else {
            assert_int_equal(report.branch_count, 1);
            assert_int_equal(report.junction_count, 0);
        }
        // the vessel itself is complete
        assert_true(nodes_within(tree, c.truth->center[first - 2], 1) > 0);
        rbt_report_free(&report);
        vessel_tree_free(tree);
    }
    case_free(&c);
}

// --- refused links ---

// Draws a tube of brightness 1 with a plain blurred edge.
static void draw_tube(Volume *v, Vec3 a, Vec3 b, double radius)
{
    double voxel = v->axis[0].x;
    for (int k = 0; k < v->size[2]; k++)
        for (int j = 0; j < v->size[1]; j++)
            for (int i = 0; i < v->size[0]; i++) {
                Vec3 x = vec3(i * voxel, j * voxel, k * voxel), along = vec3_sub(b, a);
                double s = fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), along) / vec3_norm2(along)));
                double depth = radius - vec3_distance(x, vec3_add_scaled(a, s, along));
                float *old = &v->value[(k * v->size[1] + j) * v->size[0] + i];
                *old = fmaxf(*old, (float)(1 / (1 + exp(-1.7 * depth / voxel))));
            }
    v->maximum = 1;
}

// Adds nodes from a to b as a branch (or the rest of one) attached to `parent`.
static void add_nodes(Track *tree, Vec3 a, Vec3 b, double radius, int branch, int parent)
{
    double length = vec3_distance(a, b);
    int n = (int)(length / (0.5 * radius)) + 1;
    for (int i = 0; i < n; i++) {
        TrackNode node = {.cylinder = {vec3_mix(a, b, (double)i / (n - 1)), radius, vec3_unit(vec3_sub(b, a)), radius},
                          .inlier_rate = 1,
                          .contrast = 1,
                          .parent = i > 0 ? tree->count - 1 : parent,
                          .branch = branch,
                          .kind = NODE_VESSEL};
        assert_true(track_append(tree, &node, NULL));
    }
}

static int nearest_node(const Track *tree, Vec3 x)
{
    int nearest = 0;
    for (int i = 0; i < tree->count; i++)
        if (vec3_distance(tree->node[i].cylinder.center, x) < vec3_distance(tree->node[nearest].cylinder.center, x))
            nearest = i;
    return nearest;
}

// A branch that was attached to the neighbour of its vessel is attached to its own vessel, although that comes later in the list; a branch that is connected
// to nothing is removed with its subtree; one given in the trace file stays, with its link closed.
static void refused_links(void **state)
{
    (void)state;
    Volume *v = volume_create((int[3]){110, 60, 100}, vec3(0, 0, 0), (Vec3[3]){{0.25, 0, 0}, {0, 0.25, 0}, {0, 0, 0.25}});
    assert_non_null(v);
    RbtParameters p = rbt_default_parameters();
    Tracker *t = calloc(1, sizeof *t);
    assert_non_null(t);
    *t = tracker_of(v, &p);
    t->ray_count = (int)p.n_r;
    Vec3 trunk[2] = {{12, 7.5, 1}, {12, 7.5, 23}}, parent[2] = {{5, 7.5, 1}, {5, 7.5, 23}}, child[3] = {{8, 7.5, 10}, {9.5, 7.5, 10}, {9.5, 7.5, 22}},
         lone[2] = {{20, 7.5, 5}, {20, 7.5, 15}}, twig[2] = {{21.5, 7.5, 12}, {26, 7.5, 12}};
    draw_tube(v, trunk[0], trunk[1], 1.2);
    draw_tube(v, parent[0], parent[1], 1.2);
    draw_tube(v, vec3(5, 7.5, 10), child[1], 0.6);
    draw_tube(v, child[1], child[2], 0.6);
    draw_tube(v, lone[0], lone[1], 0.9);
    draw_tube(v, vec3(20, 7.5, 12), twig[1], 0.5);
    add_nodes(&t->tree, trunk[0], trunk[1], 1.2, 0, -1);
    add_nodes(&t->tree, child[0], child[1], 0.6, 1, nearest_node(&t->tree, vec3(12, 7.5, 10)));
    add_nodes(&t->tree, child[1], child[2], 0.6, 1, t->tree.count - 1);
    add_nodes(&t->tree, parent[0], parent[1], 1.2, 2, 0);
    add_nodes(&t->tree, lone[0], lone[1], 0.9, 3, 4);
    add_nodes(&t->tree, twig[0], twig[1], 0.5, 4, nearest_node(&t->tree, vec3(20, 7.5, 12)));
    const bool is_named[5] = {true, false, true, false, false};
    RbtJunctions found = {0};
    assert_true(rbt_open_ostia(t, is_named, 2, &found));
    assert_int_equal(found.count, 3);
    const RbtJunction *moved = &found.junction[0], *kept = &found.junction[1], *refused = &found.junction[2];
    print_message("moved: share %.2f, %d nodes; kept: share %.2f; refused: share %.2f, %d nodes dropped\n", moved->share, moved->node_count, kept->share,
                  refused->share, refused->dropped_nodes);
    assert_true(moved->branch == 1 && moved->is_moved && moved->support == RBT_SUPPORTED && moved->parent == 2 && moved->node_count > 0);
    assert_true(kept->branch == 2 && kept->support == RBT_KEPT && kept->share < 0.25 && kept->node_count == 0);
    assert_true(refused->branch == 3 && refused->support == RBT_REFUSED && refused->dropped_nodes > 20);
    int links = 0;
    for (int i = 0; i < t->tree.count; i++) {
        const TrackNode *n = &t->tree.node[i];
        assert_true(n->parent < i && n->branch <= 2);
        links += n->is_link;
        if (n->parent < 0)
            continue;
        const Cylinder *a = &n->cylinder, *b = &t->tree.node[n->parent].cylinder;
        bool is_shut = n->branch == 2 && t->tree.node[n->parent].branch == 0;
        assert_true((vec3_distance(a->center, b->center) > a->radius + b->radius) == is_shut);
        if (n->is_link)
            assert_true(fabs(a->center.y - 7.5) < 0.2 && fabs(a->center.z - 10) < 0.2 && a->center.x > 4 && a->center.x < 8);
    }
    assert_int_equal(links, moved->node_count);
    free(found.junction);
    track_free(&t->tree);
    free(t);
    volume_free(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_ostium_is_described),
        cmocka_unit_test(links_turned_aside_are_refused),
        cmocka_unit_test(links_to_a_kissing_neighbour),
        cmocka_unit_test(cuts_leave_no_stub),
        cmocka_unit_test(refused_links),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
