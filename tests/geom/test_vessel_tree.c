// The tree's rules, its neighbour lists, topological tracking beside a kissing branch, and the half space.
#include "geom/blobby.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"
#include "random_numbers.h"

#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"

// A trunk along x that forks: the upper arm makes a U-turn and touches the lower one.
static VesselTree *forked_tree(void)
{
    enum { N = 40 };
    VesselTree *t = vessel_tree_create(N, 2 * N, N);
    assert_non_null(t);
    for (int i = 0; i < N; i++) {
        t->radius[i] = 1;
        t->direction[i] = vec3(1, 0, 0);
        t->height[i] = 1;
        t->parent[i] = i - 1;
        t->point_offset[i + 1] = 2 * (i + 1);
        t->blob_offset[i + 1] = i + 1;
        t->blob_width[i] = blob_width_for_radius(1, 0.1);
        if (i < 10)
            t->center[i] = vec3(i, 0, 0);
        else if (i < 20)                            // lower arm, straight on
            t->center[i] = vec3(i, 0, 0);
        else if (i < 25)                            // upper arm: up …
            t->center[i] = vec3(9, i - 19, 0);
        else if (i < 35)                            // … along …
            t->center[i] = vec3(9 + (i - 24), 5, 0);
        else                                        // … and down until it touches the lower arm at x = 19
            t->center[i] = vec3(19, 5 - (i - 34) * 0.7, 0);
        t->blob_center[i] = t->center[i];
        t->point[2 * i] = vec3_add(t->center[i], vec3(0, 1, 0));
        t->point[2 * i + 1] = vec3_add(t->center[i], vec3(0, 0, 1));
    }
    t->parent[20] = 9;
    vessel_tree_link(t);
    return t;
}

static void create_guards(void **state)
{
    (void)state;
    assert_null(vessel_tree_create(0, 0, 0));
    assert_null(vessel_tree_create(-1, 0, 0));
    assert_null(vessel_tree_create(INT_MAX, 0, 0));
    assert_null(vessel_tree_create(1, -1, 0));
    assert_null(vessel_tree_create(1, INT64_MAX, 0));
    assert_null(vessel_tree_create(1, INT64_MAX / 8, 0));
    assert_null(vessel_tree_create(1, 0, INT64_MAX / 16));
    VesselTree *t = vessel_tree_create(3, 0, 0);
    assert_non_null(t);
    assert_false(vessel_tree_is_model(t));
    assert_true(t->iso_level == 0.1 && t->blob_offset[3] == 0 && t->point_offset[3] == 0);
    vessel_tree_free(t);
    vessel_tree_free(NULL);
}

static void neighbours(void **state)
{
    (void)state;
    VesselTree *t = forked_tree();
    assert_int_equal(t->neighbour_offset[t->node_count], 2 * (t->node_count - 1));
    assert_int_equal(t->neighbour_offset[10] - t->neighbour_offset[9], 3);
    const int *of9 = t->neighbour + t->neighbour_offset[9];
    assert_true(of9[0] == 8 && of9[1] == 10 && of9[2] == 20);
    assert_int_equal(t->neighbour_offset[1] - t->neighbour_offset[0], 1);
    assert_int_equal(t->neighbour[0], 1);
    for (int i = 0; i < t->node_count; i++)   // every link is stored at both nodes
        for (int k = t->neighbour_offset[i]; k < t->neighbour_offset[i + 1]; k++) {
            int j = t->neighbour[k], back = 0;
            for (int m = t->neighbour_offset[j]; m < t->neighbour_offset[j + 1]; m++)
                back += t->neighbour[m] == i;
            assert_int_equal(back, 1);
        }
    vessel_tree_link(t);   // twice gives the same
    assert_true(of9[0] == 8 && of9[1] == 10 && of9[2] == 20);
    vessel_tree_free(t);
}

static void expect_fault(VesselTree *t, const char *words)
{
    static Faults faults;
    static char text[FAULTS_CAPACITY * FAULT_LENGTH];
    faults_clear(&faults);
    assert_false(vessel_tree_validate(t, "m.h5", &faults));
    assert_true(faults.count == 1);
    faults_print(&faults, text, sizeof text);
    assert_non_null(strstr(text, words));
    assert_non_null(strstr(text, "m.h5"));
}

static void rules(void **state)
{
    (void)state;
    static Faults faults;
    VesselTree *t = forked_tree();
    faults_clear(&faults);
    assert_true(vessel_tree_validate(t, "m.h5", &faults) && faults.count == 0);
#define BREAK(place, value, words)                                                                                                                             \
    do {                                                                                                                                                       \
        __typeof__(place) kept = place;                                                                                                                        \
        place = value;                                                                                                                                         \
        expect_fault(t, words);                                                                                                                                \
        place = kept;                                                                                                                                          \
    } while (0)
    BREAK(t->center[5].y, NAN, "nodes/center[5]");
    BREAK(t->radius[7], 0, "nodes/radius[7]");
    BREAK(t->radius[7], INFINITY, "nodes/radius[7]");
    BREAK(t->direction[3].x, 1.00001, "nodes/direction[3]");
    BREAK(t->direction[3].x, NAN, "nodes/direction[3]");
    BREAK(t->height[2], -1, "nodes/height[2]");
    BREAK(t->parent[0], 0, "nodes/parent[0]");
    BREAK(t->parent[6], -1, "one root");
    BREAK(t->parent[6], 6, "parents come before children");
    BREAK(t->parent[6], INT32_MIN, "nodes/parent[6]");
    BREAK(t->kind[1], 2, "nodes/kind[1]");
    BREAK(t->point[9].z, INFINITY, "points/xyz[9]");
    BREAK(t->point_offset[0], 1, "points/offset[0]");
    BREAK(t->point_offset[4], 100, "points/offset[5]");
    BREAK(t->point_offset[40], 81, "points/offset ends");
    BREAK(t->blob_center[0].x, NAN, "blobs/center[0]");
    BREAK(t->blob_width[3], 0, "blobs/width[3]");
    BREAK(t->blob_offset[2], -1, "blobs/offset[2]");
    BREAK(t->error[3], NAN, "blobs/error_mm[3]");
    BREAK(t->iso_level, 0, "iso_level");
#undef BREAK
    t->radius[0] = -1, t->radius[1] = -1, t->kind[0] = 9;   // one fault per rule, with the first index
    faults_clear(&faults);
    assert_false(vessel_tree_validate(t, "m.h5", &faults));
    assert_int_equal(faults.count, 2);
    assert_non_null(strstr(faults.text[0], "radius[0]"));
    vessel_tree_free(t);
}

static void nearest_by_power(void **state)
{
    (void)state;
    VesselTree *t = forked_tree();
    uint64_t seed = 5;
    for (int i = 0; i < t->node_count; i++)
        t->radius[i] = random_in(&seed, 0.5, 1.5);
    for (int trial = 0; trial < 500; trial++) {
        Vec3 x = vec3_add(vec3(10, 2, 0), random_in_box(&seed, 12));
        int best = power_nearest(t, x), reached = power_walk(t, x, trial % t->node_count, 1000);
        double d = power_distance(x, t->center[best], t->radius[best]);
        for (int i = 0; i < t->node_count; i++)
            assert_true(power_distance(x, t->center[i], t->radius[i]) >= d);
        // where the walk ends, no neighbour is better, except one whose vessel is further away than its diameter, and further in radii
        double here = power_distance(x, t->center[reached], t->radius[reached]), radii = vec3_distance(x, t->center[reached]) / t->radius[reached];
        for (int k = t->neighbour_offset[reached]; k < t->neighbour_offset[reached + 1]; k++) {
            int next = t->neighbour[k];
            double far = vec3_distance(x, t->center[next]) / t->radius[next];
            assert_true(power_distance(x, t->center[next], t->radius[next]) >= here || (far >= 2 && far >= radii));
        }
        assert_int_equal(power_walk(t, x, -1, 4), best);
        assert_int_equal(power_walk(t, x, best, 0), best);
    }
    vessel_tree_free(t);
}

// A point that slides along the lower arm past the place where the upper arm touches it keeps a node of the lower arm, even where it is nearer to nodes of the
// upper one; a point that moves along the upper arm reaches the same place with a node of the upper arm.
static void kissing_branches(void **state)
{
    (void)state;
    VesselTree *t = forked_tree();
    int node = power_walk(t, vec3(0, 0, 0), -1, 0);
    for (double x = 0; x <= 19; x += 0.05) {
        node = power_walk(t, vec3(x, x < 12 ? -0.5 : 0.9, 0), node, 3);   // past the fork on its side
        assert_true(node < 20);
        assert_near(t->center[node].x, x, 0.51);
    }
    Vec3 kiss = vec3(19, 0.9, 0);
    assert_true(power_nearest(t, kiss) >= 35);
    assert_int_equal(node, 19);
    node = 9;
    for (double y = 0; y <= 5; y += 0.05)
        node = power_walk(t, vec3(9, y, 0), node, 3);
    for (double x = 9; x <= 19; x += 0.05)
        node = power_walk(t, vec3(x, 5, 0), node, 3);
    for (double y = 5; y >= 0.9; y -= 0.05)
        node = power_walk(t, vec3(19, y, 0), node, 3);
    assert_int_equal(node, 39);
    vessel_tree_free(t);
}

// A sac at the convex side of a bend, attached to a node further upstream: every path to it leads over worse nodes. A point inside the sac is located there; a
// point that is pushed out of the lower arm into the wall of the touching arm (above) does not change arms.
static void wide_sac(void **state)
{
    (void)state;
    enum { N = 9, SAC = N };
    VesselTree *t = vessel_tree_create(N + 1, 0, 1);   // local models: near is narrower
    for (int i = 0; i < N; i++) {
        double a = (i - 4) * 1.1 / 6;
        t->center[i] = vec3(-6 + 6 * cos(a), 6 * sin(a), 0);
        t->radius[i] = 2.2;
        t->parent[i] = i - 1;
    }
    t->center[SAC] = vec3(6.5, 0, 0);
    t->radius[SAC] = 3.5;
    t->parent[SAC] = 2;
    vessel_tree_link(t);
    Vec3 x = {5, 2, 0};
    assert_true(power_distance(x, t->center[SAC], 3.5) < 0);
    for (int i = 0; i < N; i++)   // node 5 is the best of the vessel: descent stops there
        assert_true(power_distance(x, t->center[i], 2.2) >= power_distance(x, t->center[5], 2.2));
    for (int k = t->near_offset[5]; k < t->near_offset[6]; k++)
        assert_true(t->near[k] != SAC);
    assert_int_equal(power_walk(t, x, 5, 4), SAC);
    assert_int_equal(power_walk(t, vec3(1, 0.5, 0), SAC, 4), 4);   // and back into the vessel
    vessel_tree_free(t);
    t = forked_tree();
    assert_int_equal(power_walk(t, vec3(19, 1.35, 0), 19, 4), 19);
    vessel_tree_free(t);
}

static void half_space(void **state)
{
    (void)state;
    assert_null(plane_vessel_create(vec3(0, 0, 0), vec3(0, 0, 0)));
    assert_null(plane_vessel_create(vec3(0, 0, 0), vec3(0, NAN, 0)));
    assert_null(plane_vessel_create(vec3(0, INFINITY, 0), vec3(0, 1, 0)));
    Vessel *v = plane_vessel_create(vec3(1, 2, 3), vec3(0, 0, 2));
    assert_non_null(v);
    Vec3 x[3] = {{5, 5, 7}, {0, 0, -1}, {0, NAN, 0}}, p, d;
    VesselMemory memory[3] = {{.node = -1}, {.node = -1}, {.node = -1}};
    VesselHit hit[3];
    vessel_query(v, 3, x, 1, memory, hit);
    assert_true(hit[0].gap == 4 && hit[1].gap == -4 && hit[0].normal.z == 1 && hit[0].hessian.xx == 0 && hit[0].flags == 0);
    assert_true(hit[2].flags == VESSEL_UNSURE && hit[2].gap == 0);
    assert_false(v->inlet(v, &p, &d));
    v->destroy(v);
}

static bool is_near(const VesselTree *t, int i, int j)
{
    for (int k = t->near_offset[i]; k < t->near_offset[i + 1]; k++)
        if (t->near[k] == j)
            return true;
    return false;
}

// The path through the tree, over the common ancestor.
static double way_between(const VesselTree *t, int i, int j)
{
    double length = 0;
    while (i != j) {
        int *up = i > j ? &i : &j;
        length += vec3_distance(t->center[*up], t->center[t->parent[*up]]);
        *up = t->parent[*up];
    }
    return length;
}

// Wide vessels with dense nodes have hundreds of near nodes: all are listed, on both sides.
static void near_is_complete_and_mutual(void **state)
{
    (void)state;
    enum { TRUNK = 300, TWIG = 60, ALL = TRUNK + 2 * TWIG + 1 };
    VesselTree *t = vessel_tree_create(ALL, 0, 0);
    uint64_t seed = 3;
    for (int i = 0; i < ALL; i++) {
        bool trunk = i < TRUNK, sac = i == ALL - 1;
        int twig = trunk || sac ? -1 : (i - TRUNK) / TWIG, step = trunk ? i : (i - TRUNK) % TWIG, root = 100 + 90 * twig;
        t->center[i] = trunk ? vec3(0.1 * i, 0.3 * sin(0.02 * i), 0) : sac ? vec3(20, -7, 0) : vec3(t->center[root].x + 0.05 * step, 0.1 * step, 0.02 * step);
        t->radius[i] = trunk ? random_in(&seed, 3, 6) : sac ? 5 : 0.4;
        t->direction[i] = vec3(1, 0, 0);
        t->parent[i] = sac ? 200 : trunk || step > 0 ? i - 1 : root;
        t->kind[i] = sac ? NODE_ANEURYSM : NODE_VESSEL;
    }
    assert_true(vessel_tree_link(t));
    int most = 0;
    for (int i = 0; i < ALL; i++) {
        most = t->near_offset[i + 1] - t->near_offset[i] > most ? t->near_offset[i + 1] - t->near_offset[i] : most;
        for (int j = 0; j < i; j++) {
            double reach = t->radius[i] + t->radius[j], way = way_between(t, i, j), apart = vec3_distance(t->center[i], t->center[j]);
            bool is = t->parent[i] == j || (way < 3 * reach && apart < 1.5 * reach);
            assert_true(is_near(t, i, j) == is && is_near(t, j, i) == is);
        }
    }
    assert_true(most > 150);
    vessel_tree_free(t);
}

// Nodes of a damaged file, all at one place: lists are truncated in the same way, in bounded time (20,000 nodes) and memory (5,000 already have more pairs).
static void near_lists_are_bounded(void **state)
{
    (void)state;
    for (int heap = 5000; heap <= 20000; heap += 15000) {
        VesselTree *t = vessel_tree_create(heap, 0, 0);
        for (int i = 0; i < heap; i++) {
            t->radius[i] = 1;
            t->direction[i] = vec3(1, 0, 0);
            t->parent[i] = i - 1;
        }
        assert_true(vessel_tree_link(t));
        assert_true(is_near(t, 5, 6) && is_near(t, 6, 5) && t->near_offset[heap] < (1 << 24) + heap);
        vessel_tree_free(t);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(create_guards),
        cmocka_unit_test(neighbours),
        cmocka_unit_test(rules),
        cmocka_unit_test(nearest_by_power),
        cmocka_unit_test(kissing_branches),
        cmocka_unit_test(wide_sac),
        cmocka_unit_test(near_is_complete_and_mutual),
        cmocka_unit_test(near_lists_are_bounded),
        cmocka_unit_test(half_space),
    };
    return cmocka_run_group_tests_name("vessel_tree", tests, NULL, NULL);
}
