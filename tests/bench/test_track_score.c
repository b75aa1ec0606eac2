// The scorer on hand-made trees: a fork of three branches, beside it a neighbour, a bone and a sac, and tracked trees of which one knows what is wrong.
#include "bench/track_score.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>

#include "tests/geom/near.h"

enum { MOST = 1000 };

typedef struct Draft {
    int count;
    Vec3 center[MOST];
    double radius[MOST];
    int parent[MOST];
    uint8_t kind[MOST];
} Draft;

static int add(Draft *d, int parent, Vec3 x, double r, uint8_t kind)
{
    d->center[d->count] = x;
    d->radius[d->count] = r;
    d->parent[d->count] = parent;
    d->kind[d->count] = kind;
    return d->count++;
}

// On to b in steps of half a millimetre; the last node.
static int go(Draft *d, int from, Vec3 b, double r)
{
    Vec3 a = d->center[from];
    int n = (int)ceil(vec3_distance(a, b) / 0.5);
    for (int i = 1; i <= n; i++)
        from = add(d, from, vec3_mix(a, b, (double)i / n), r, NODE_VESSEL);
    return from;
}

typedef struct Motion {          // of everything
    double turn;
    bool mirror;
    Vec3 shift;
} Motion;
static Motion motion;

static Vec3 moved_direction(Vec3 x)
{
    Vec3 y = {cos(motion.turn) * x.x - sin(motion.turn) * x.y, sin(motion.turn) * x.x + cos(motion.turn) * x.y, motion.mirror ? -x.z : x.z};
    return vec3(y.z, y.x, y.y);
}
static Vec3 moved(Vec3 x) { return vec3_add(moved_direction(x), motion.shift); }

static VesselTree *finish(const Draft *d)
{
    VesselTree *tree = vessel_tree_create(d->count, 0, 0);
    assert_non_null(tree);
    for (int i = 0; i < d->count; i++) {
        tree->center[i] = moved(d->center[i]);
        tree->radius[i] = d->radius[i];
        tree->direction[i] = vec3(1, 0, 0);
        tree->parent[i] = d->parent[i];
        tree->kind[i] = d->kind[i];
    }
    return tree;
}

static const Vec3 inlet = {0, 0, 0}, fork = {20, 0, 0}, left = {40, 15, 0}, right = {40, -15, 0};

// Branch 0 from inlet to fork, 1 to the left, 2 to the right; radius 1. A sac above the left daughter's middle.
static Draft fork_draft(void)
{
    Draft d = {0};
    int at = go(&d, add(&d, -1, inlet, 1, NODE_VESSEL), fork, 1);
    int middle = go(&d, at, vec3(30, 7.5, 0), 1);
    go(&d, middle, left, 1);
    go(&d, at, right, 1);
    add(&d, middle, vec3(30, 7.5, 3), 2.5, NODE_ANEURYSM);
    return d;
}

static TrackScore score_of(const Draft *tracked)
{
    Draft truth = fork_draft(), beside = {0};
    go(&beside, add(&beside, -1, vec3(20, -2.3, 1), 1, NODE_VESSEL), vec3(40, -17.3, 1), 1);   // along the right daughter
    go(&beside, 0, vec3(15, -10, 5), 1);
    ShapeBlock block = {moved(vec3(36, 17, 0)), {moved_direction(vec3(1, 0, 0)), moved_direction(vec3(0, 1, 0)), moved_direction(vec3(0, 0, 1))}, {3, 3, 3}};
    VesselTree *true_tree = finish(&truth), *neighbour = finish(&beside), *tree = tracked ? finish(tracked) : NULL;
    TrackTruth known = {.tree = true_tree, .neighbour = neighbour, .block_count = 1, .block = &block, .voxel_mm = 0.2, .blur_mm = 0.3};
    TrackScore score;
    assert_true(track_score(&known, tree, &score));
    assert_int_equal(score.branch_count, 3);
    vessel_tree_free(true_tree);
    vessel_tree_free(neighbour);
    vessel_tree_free(tree);
    return score;
}

static void assert_labels(const TrackScore *score, TrackLabel a, TrackLabel b, TrackLabel c)
{
    const TrackLabel wanted[3] = {a, b, c};
    for (int i = 0; i < 3; i++)
        if (score->branch[i].label != wanted[i])
            fail_msg("branch %d is %s, not %s", i, track_label_name[score->branch[i].label], track_label_name[wanted[i]]);
}

static int inventions(const TrackScore *score)
{
    int n = 0;
    for (int k = 0; k < TRACK_LABELS; k++)
        n += score->invented[k];
    return n;
}

// Trunk and left daughter as they are; the right one is up to the case, from the fork on.
static Draft half_draft(int *at_fork)
{
    Draft d = {0};
    *at_fork = go(&d, add(&d, -1, inlet, 1, NODE_VESSEL), fork, 1);
    go(&d, *at_fork, left, 1);
    return d;
}

static void truth_is_successful(void **state)
{
    (void)state;
    Draft d = fork_draft();
    TrackScore score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    assert_int_equal(inventions(&score), 0);
    assert_int_equal(score.wrong_attachments + score.background_links + score.false_sacs, 0);
    assert_near(score.true_mm, 70, 1e-9);
    assert_near(score.covered_mm, 70, 1e-9);
    track_score_free(&score);
    score = score_of(NULL);
    assert_labels(&score, TRACK_WT, TRACK_WT, TRACK_WT);
    assert_near(score.covered_mm, 0, 0);
    track_score_free(&score);
}

static void stopping_early_and_never_starting(void **state)
{
    (void)state;
    int at;
    Draft d = half_draft(&at);
    TrackScore score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_WT);
    track_score_free(&score);
    go(&d, at, vec3(30, -7.5, 0), 1);
    score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_PS);
    assert_near(score.branch[2].covered, 12.5, 0.8);
    track_score_free(&score);
    // two radii before the end is reached, and half a radius past it is no leak
    d = half_draft(&at);
    go(&d, at, vec3(38.6, -13.95, 0), 1);
    score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    track_score_free(&score);
    d = half_draft(&at);
    go(&d, at, vec3(41.2, -15.9, 0), 1);
    score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    assert_int_equal(inventions(&score), 0);
    track_score_free(&score);
}

static void lost_into_what_touches(void **state)
{
    (void)state;
    int at;
    // over into the neighbour half way down the right daughter, and along it
    Draft d = half_draft(&at);
    go(&d, go(&d, go(&d, at, vec3(28, -6, 0), 1), vec3(29, -9.05, 1), 1), vec3(38, -15.8, 1), 1);
    TrackScore score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_KV);
    assert_int_equal(score.invented[TRACK_KV], 1);
    assert_true(score.invented_mm[TRACK_KV] > 8);
    track_score_free(&score);
    // into the background
    d = half_draft(&at);
    go(&d, go(&d, at, vec3(28, -6, 0), 1), vec3(32, -6, -10), 1);
    score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_LB);
    assert_int_equal(score.invented[TRACK_LB], 1);
    track_score_free(&score);
    // into the sac, and into the bone, from the left daughter
    for (int k = 0; k < 2; k++) {
        d = (Draft){0};
        at = go(&d, add(&d, -1, inlet, 1, NODE_VESSEL), fork, 1);
        go(&d, at, right, 1);
        at = go(&d, at, k ? vec3(35, 11.25, 0) : vec3(30, 7.5, 0), 1);
        go(&d, at, k ? vec3(35, 19, 0) : vec3(30, 7.5, 5), 1);
        score = score_of(&d);
        assert_labels(&score, TRACK_ST, k ? TRACK_KB : TRACK_KA, TRACK_ST);
        assert_int_equal(score.invented[k ? TRACK_KB : TRACK_KA], 1);
        track_score_free(&score);
    }
}

static void turning_back(void **state)
{
    (void)state;
    int at;
    Draft d = half_draft(&at);
    go(&d, go(&d, go(&d, at, vec3(32, -9, 0), 1), vec3(32, -9.4, 0.4), 1), vec3(24, -3.4, 0.4), 1);
    TrackScore score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_BT);
    assert_int_equal(score.invented[TRACK_BT], 1);
    track_score_free(&score);
}

static void leaks_off_a_followed_branch_are_counted(void **state)
{
    (void)state;
    Draft d = fork_draft();
    int at = 20;             // (10, 0, 0) on the trunk
    assert_near(d.center[at].x, 10, 1e-9);
    go(&d, at, vec3(10, 8, 0), 1);
    TrackScore score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    assert_int_equal(score.invented[TRACK_LB], 1);
    assert_near(score.invented_mm[TRACK_LB], 7, 0.6);
    track_score_free(&score);
    // past the end by six radii
    d = half_draft(&at);
    go(&d, at, vec3(44.8, -18.6, 0), 1);
    score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    assert_int_equal(score.invented[TRACK_LB], 1);
    track_score_free(&score);
    // one node that lies outside and comes back: an excursion, and a link that leaves the lumen
    d = fork_draft();
    d.center[20] = vec3(10, 1.4, 0);
    score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    assert_int_equal(inventions(&score), 0);
    track_score_free(&score);
    // an aneurysm where none is
    d = fork_draft();
    add(&d, 20, vec3(10, 6, 0), 2, NODE_ANEURYSM);
    score = score_of(&d);
    assert_int_equal(score.false_sacs, 1);
    track_score_free(&score);
}

// The right daughter hangs on the left one by a link through the background.
static void hanging_on_the_wrong_vessel(void **state)
{
    (void)state;
    int at;
    Draft d = half_draft(&at);
    int from = d.count - 10;
    at = add(&d, from, vec3(36, -12, 0), 1, NODE_VESSEL);
    go(&d, at, vec3(22, -1.5, 0), 1);
    go(&d, at, right, 1);
    TrackScore score = score_of(&d);
    assert_int_equal(score.wrong_attachments, 1);
    assert_int_equal(score.background_links, 1);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_WT);
    assert_true(score.branch[2].hangs_wrong && !score.branch[1].hangs_wrong);
    track_score_free(&score);
}

// Centres 0.2 off, radii 0.05 above what the blur leaves.
static void errors_are_those_put_in(void **state)
{
    (void)state;
    Draft d = fork_draft();
    for (int i = 0; i < d.count; i++) {
        d.center[i].z += 0.2;
        d.radius[i] += 0.05 - 0.3 * 0.3 / 2;
    }
    TrackScore score = score_of(&d);
    assert_labels(&score, TRACK_ST, TRACK_ST, TRACK_ST);
    assert_true(score.sample_count > 100);
    for (int i = 0; i < score.sample_count; i++) {
        assert_near(score.sample[i].center, 0.2, 1e-9);
        assert_near(score.sample[i].radius, 0.05, 1e-9);
        assert_near(score.sample[i].true_radius, 1, 1e-9);
    }
    track_score_free(&score);
}

// All of the above once more, turned and mirrored.
static int another_frame(void **state)
{
    (void)state;
    motion = (Motion){0.7, true, {100, -50, 30}};
    return 0;
}
static int same_frame(void **state)
{
    (void)state;
    motion = (Motion){0};
    return 0;
}

int main(void)
{
#define BOTH(f) cmocka_unit_test(f), cmocka_unit_test_setup_teardown(f, another_frame, same_frame)
    const struct CMUnitTest tests[] = {
        BOTH(truth_is_successful),
        BOTH(stopping_early_and_never_starting),
        BOTH(lost_into_what_touches),
        BOTH(turning_back),
        BOTH(leaks_off_a_followed_branch_are_counted),
        BOTH(hanging_on_the_wrong_vessel),
        BOTH(errors_are_those_put_in),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
