// A start in a sac: the tree begins at the vessel beside it, the sac is found as a sac, and the report says so. A start in a vessel, also in a tapered one or at a
// fork, stays.
#include "recon/track/rbt_sac_start.h"
#include "recon/track/rbt_track.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static Faults faults;

static const double VESSEL = 1.5, SAC = 4.5, MIDDLE = 15;    // [mm]

typedef enum { TERMINAL, ON_THE_WALL, IN_THE_WAY, TAPERED, FORK } Kind;

static double to_ball(Vec3 x, double cx, double cy) { return vec3_distance(x, vec3(cx, cy, MIDDLE)) - SAC; }

static double to_line(Vec3 x, Vec3 a, Vec3 b, double radius)
{
    Vec3 ab = vec3_sub(b, a);
    double s = fmin(fmax(vec3_dot(vec3_sub(x, a), ab) / vec3_norm2(ab), 0), 1);
    return vec3_distance(x, vec3_add_scaled(a, s, ab)) - radius;
}

static double outside(Kind kind, Vec3 x)
{
    const Vec3 begin = vec3(-5, MIDDLE, MIDDLE), end = vec3(50, MIDDLE, MIDDLE), middle = vec3(22, MIDDLE, MIDDLE);
    switch (kind) {
    case TERMINAL: return fmin(to_line(x, begin, vec3(28, MIDDLE, MIDDLE), VESSEL), to_ball(x, 30, MIDDLE));
    case ON_THE_WALL: return fmin(to_line(x, begin, end, VESSEL), to_ball(x, 20, MIDDLE + SAC + 0.3 * VESSEL));
    case IN_THE_WAY: return fmin(to_line(x, begin, end, VESSEL), to_ball(x, 20, MIDDLE));
    case TAPERED: return hypot(x.y - MIDDLE, x.z - MIDDLE) - (3.5 - 2.5 * x.x / 40);
    case FORK: break;
    }
    return fmin(to_line(x, begin, middle, 2.5), fmin(to_line(x, middle, vec3(50, 27, MIDDLE), 2), to_line(x, middle, vec3(50, 3, MIDDLE), 2)));
}

// The tree from a start; *doubt: that of a sac, or NULL.
static VesselTree *track(Kind kind, Vec3 start, RbtReport *report, const RbtWarning **doubt)
{
    const int size[3] = {80, 60, 60};
    const double voxel = 0.5;
    const Vec3 axis[3] = {{voxel, 0, 0}, {0, voxel, 0}, {0, 0, voxel}};
    Volume *v = volume_create(size, vec3(0, 0, 0), axis);
    assert_non_null(v);
    size_t n = 0;
    for (int k = 0; k < size[2]; k++)
        for (int j = 0; j < size[1]; j++)
            for (int i = 0; i < size[0]; i++)
                v->value[n++] = (float)(20 + 180 * fmin(fmax(0.5 - outside(kind, volume_point_of(v, vec3(i, j, k))) / (1.4 * voxel), 0), 1));
    v->minimum = 20, v->maximum = 200;
    RbtParameters p = rbt_default_parameters();
    p.automatic = 1;
    const RbtSeed seed = {.start = start};
    *report = (RbtReport){0};
    *doubt = NULL;
    faults_clear(&faults);
    VesselTree *tree = rbt_track(v, &p, &seed, 1, NULL, 0, 1, NULL, report, "t.yaml", &faults);
    if (!tree)
        fail_msg("%s", faults.text[0]);
    volume_free(v);
    for (int i = 0; i < report->check.warning_count; i++)
        if (report->check.warning[i].kind == RBT_SAC)
            *doubt = &report->check.warning[i];
    return tree;
}

// From a click in the sac: the vessel as long as it is, at its radius, and beside the sac none of its nodes.
static void check_sac(Kind kind, Vec3 start, double length)
{
    RbtReport report;
    const RbtWarning *doubt;
    VesselTree *tree = track(kind, start, &report, &doubt);
    assert_non_null(doubt);
    assert_true(fabs(doubt->measured - SAC) < 0.2 * SAC && fabs(doubt->limit - VESSEL) < 0.2 * VESSEL);
    assert_non_null(strstr(doubt->text, "lies in a sac"));
    assert_true(fabs(report.branch[0].radius - VESSEL) < 0.2 * VESSEL);
    assert_true(report.branch[0].length > length);
    int sacs = 0;
    for (int i = 0; i < tree->node_count; i++)
        sacs += tree->kind[i] == NODE_ANEURYSM;
    assert_true(sacs > 0 || kind == IN_THE_WAY);     // a vessel goes through that one
    vessel_tree_free(tree);
    rbt_report_free(&report);
}

static void a_start_in_a_sac_begins_at_its_vessel(void **state)
{
    (void)state;
    check_sac(TERMINAL, vec3(30, MIDDLE, MIDDLE), 15);
    check_sac(TERMINAL, vec3(31, MIDDLE + 1, MIDDLE - 1), 15);
    check_sac(ON_THE_WALL, vec3(20, MIDDLE + SAC + 0.3 * VESSEL, MIDDLE), 30);
    check_sac(IN_THE_WAY, vec3(20, MIDDLE, MIDDLE), 15);
}

// A first branch along x, of nodes 1 mm apart: whether a start at one of them lies in a sac.
static bool is_in_sac(const double *radius, int count, int start)
{
    static const int size[3] = {100, 60, 60};
    static const Vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Tracker *t = calloc(1, sizeof *t);
    Volume *v = volume_create(size, vec3(0, 0, 0), axis);
    SacStart sac;
    assert_true(t && v);
    t->volume = v;
    for (int i = 0; i < count; i++) {
        const TrackNode node = {.cylinder = {.center = vec3(30 + i, 30, 30), .axis = vec3(1, 0, 0), .radius = radius[i]}, .parent = i - 1};
        assert_true(track_append(&t->tree, &node, NULL));
    }
    const bool is = rbt_starts_in_sac(t, t->tree.node[start].cylinder.center, &sac);
    if (is)
        assert_true(sac.count > 0 && sac.vessel[0].x > 30 + start);
    track_free(&t->tree);
    volume_free(v);
    free(t);
    return is;
}

// The first branch begins at the sac's edge with a node between the sac and its vessel, as in aneurism.nrrd mirrored in x.
static void a_start_at_the_edge_of_a_sac_is_seen(void **state)
{
    (void)state;
    static const double edge[] = {3.49, 4.45, 4.61, 4.64, 4.66, 4.63, 3.27, 2.42, 2.48, 2.37, 2.36, 2.37,
                                  2.40, 2.41, 2.40, 2.41, 2.4,  2.4,  2.4,  2.4,  2.4,  2.4,  2.4};
    enum { COUNT = sizeof edge / sizeof *edge, LONG = 45 };
    double cone[LONG];
    for (int i = 0; i < LONG; i++)
        cone[i] = 4.6 - 0.05 * i;
    for (int i = 0; i <= 5; i++)
        assert_true(is_in_sac(edge, COUNT, i));
    // not in the vessel beside it, nor in one that tapers
    for (int i = 8; i < COUNT; i++)
        assert_false(is_in_sac(edge, COUNT, i));
    for (int i = 0; i < LONG; i++)
        assert_false(is_in_sac(cone, LONG, i));
}

static void a_start_in_a_vessel_stays(void **state)
{
    (void)state;
    const struct {
        Kind kind;
        Vec3 start;
    } row[] = {{TAPERED, {4, MIDDLE, MIDDLE}}, {TAPERED, {20, MIDDLE, MIDDLE}}, {FORK, {22, MIDDLE, MIDDLE}},
               {FORK, {5, MIDDLE, MIDDLE}},    {TERMINAL, {8, MIDDLE, MIDDLE}}, {ON_THE_WALL, {8, MIDDLE, MIDDLE}}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        RbtReport report;
        const RbtWarning *doubt;
        VesselTree *tree = track(row[i].kind, row[i].start, &report, &doubt);
        if (doubt)
            fail_msg("%d: %s", (int)i, doubt->text);
        vessel_tree_free(tree);
        rbt_report_free(&report);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_start_in_a_sac_begins_at_its_vessel), cmocka_unit_test(a_start_at_the_edge_of_a_sac_is_seen),
                                       cmocka_unit_test(a_start_in_a_vessel_stays)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
