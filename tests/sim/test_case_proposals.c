// What a case proposes: parts of the angiogram that the tree does not hold, against tubes and a ball of known volume; the end where tools enter; how the patient
// lies.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/base.h"
#include "sim/case_missed.h"
#include "sim/case_scene.h"
#include "sim/sim.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double RADIUS = 1.6, THIN = 1.1, BALL = 2;      // [mm]
static const double LENGTH = 40;                             // [mm] edge of the volume

static double to_line(Vec3 x, double y, double z) { return hypot(x.y - y, x.z - z); }

// Along x from border to border: a trunk, and a thinner vessel apart from it; a ball beside them, and a speck of a few voxels. Bright 200, around them 20.
static Volume *make_volume(double voxel, bool is_mirrored)
{
    int n = (int)lround(LENGTH / voxel);
    const int size[3] = {n, n, n};
    double sign = is_mirrored ? -1 : 1;
    Vec3 axis[3] = {vec3(sign * voxel, 0, 0), vec3(0, voxel, 0), vec3(0, 0, voxel)};
    Volume *v = volume_create(size, vec3(0.5 * sign * voxel, 0.5 * voxel, 0.5 * voxel), axis);
    assert_non_null(v);
    size_t at = 0;
    for (int k = 0; k < n; k++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                Vec3 x = volume_point_of(v, vec3(i, j, k));
                double ball = vec3_distance(x, vec3(20 * sign, 30, 30)) - BALL, speck = vec3_distance(x, vec3(10 * sign, 30, 10)) - voxel;
                double d = fmin(fmin(to_line(x, 10, 10) - RADIUS, to_line(x, 20, 20) - THIN), fmin(ball, speck));
                v->value[at++] = (float)(20 + 180 * fmin(fmax(0.5 - d / voxel, 0), 1));
            }
    return v;
}

// Along the line of the trunk; with `both`, the thin vessel too, linked to nothing but by its number.
static VesselTree *make_tree(bool is_mirrored, bool both)
{
    enum { NODES = 80 };
    VesselTree *t = vessel_tree_create(both ? 2 * NODES : NODES, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < t->node_count; i++) {
        double line = i < NODES ? 10 : 20;
        t->center[i] = vec3((is_mirrored ? -1 : 1) * LENGTH * (i % NODES + 0.5) / NODES, line, line);
        t->radius[i] = i < NODES ? RADIUS : THIN;
        t->direction[i] = vec3(is_mirrored ? -1 : 1, 0, 0);
        t->height[i] = LENGTH / NODES;
        t->parent[i] = i - 1;
    }
    assert_true(vessel_tree_link(t));
    return t;
}

// Error of the volumes found beside the trunk, relative to the exact ones.
static double error_at(double voxel, bool is_mirrored)
{
    Volume *v = make_volume(voxel, is_mirrored);
    VesselTree *t = make_tree(is_mirrored, false);
    Missed missed;
    double thin = PI * THIN * THIN * LENGTH, ball = 4 * PI / 3 * BALL * BALL * BALL, trunk = PI * RADIUS * RADIUS * LENGTH;
    assert_true(missed_find(v, t, &missed));
    assert_int_equal(missed.count, 2);       // the speck is too small
    assert_true(to_line(missed.part[0].place, 20, 20) < THIN);
    assert_true(vec3_distance(missed.part[1].place, vec3(is_mirrored ? -20 : 20, 30, 30)) < BALL);
    assert_true(fabs(missed.held - trunk / (trunk + thin + ball)) < 0.03);
    double error = fmax(fabs(missed.part[0].volume / thin - 1), fabs(missed.part[1].volume / ball - 1));
    volume_free(v);
    vessel_tree_free(t);
    return error;
}

static void volumes_are_those_of_the_shapes(void **state)
{
    (void)state;
    double coarse = error_at(0.5, false), fine = error_at(0.25, false);
    assert_true(coarse < 0.06);
    assert_true(fine < 0.6 * coarse);
    assert_true(fabs(error_at(0.5, true) - coarse) < 1e-9);
}

static void a_whole_tree_misses_the_ball_alone(void **state)
{
    (void)state;
    Volume *v = make_volume(0.5, false);
    VesselTree *t = make_tree(false, true);
    Missed missed;
    assert_true(missed_find(v, t, &missed));
    assert_int_equal(missed.count, 1);
    assert_true(vec3_distance(missed.part[0].place, vec3(20, 30, 30)) < BALL);
    volume_free(v);
    vessel_tree_free(t);
}

// A chain along x from x0 to x1 whose radius goes from r0 to r1.
static VesselTree *make_chain(double x0, double x1, double r0, double r1)
{
    enum { NODES = 40 };
    VesselTree *t = vessel_tree_create(NODES, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < NODES; i++) {
        double part = i / (NODES - 1.0);
        t->center[i] = vec3(x0 + part * (x1 - x0), 10, 10);
        t->radius[i] = r0 + part * (r1 - r0);
        t->direction[i] = vec3(x1 > x0 ? 1 : -1, 0, 0);
        t->height[i] = fabs(x1 - x0) / NODES;
        t->parent[i] = i - 1;
    }
    assert_true(vessel_tree_link(t));
    return t;
}

static int proposed(double x0, double x1, double r0, double r1)
{
    Volume *v = make_volume(0.5, false);
    VesselTree *t = make_chain(x0, x1, r0, r1);
    int end = case_tree_widest_end(t, v);
    volume_free(v);
    vessel_tree_free(t);
    return end == 0 ? 0 : end == 39 ? 1 : -1;
}

static void the_widest_end_is_proposed(void **state)
{
    (void)state;
    assert_int_equal(proposed(1, 39, 2, 1), 0);
    assert_int_equal(proposed(1, 39, 1, 2), 1);
    // within the volume, an end must be twice as wide as one at the border
    assert_int_equal(proposed(1, 20, 1, 1.8), 0);
    assert_int_equal(proposed(1, 20, 0.5, 1.8), 1);
    assert_int_equal(proposed(15, 25, 1, 2), 1);
}

// A vessel along x, of 1.5 mm, and in its middle a wide short stub, as where a sac was tracked as a vessel. Without a border nearby the vessel's end wins too.
static void a_stub_in_a_sac_is_no_way_in(void **state)
{
    (void)state;
    enum { NODES = 40, STUB = 4 };
    Volume *v = make_volume(0.5, false);
    for (int where = 0; where < 2; where++) {
        VesselTree *t = vessel_tree_create(NODES + STUB, 0, 0);
        assert_non_null(t);
        for (int i = 0; i < NODES + STUB; i++) {
            bool is_stub = i >= NODES;
            double from = where ? 12 : 1, to = where ? 34 : 39, x = from + (to - from) * i / (NODES - 1);
            t->center[i] = is_stub ? vec3(0.5 * (from + to), 20 + 2 * (i - NODES), 20) : vec3(x, 20, 20);
            t->radius[i] = is_stub ? 4 : 1.5;
            t->direction[i] = is_stub ? vec3(0, 1, 0) : vec3(1, 0, 0);
            t->height[i] = 1;
            t->parent[i] = i == NODES ? NODES / 2 : i - 1;
        }
        assert_true(vessel_tree_link(t));
        int end = case_tree_widest_end(t, v);
        assert_true(end == 0 || end == NODES - 1);
        vessel_tree_free(t);
    }
    volume_free(v);
}

// A vessel of 60 mm along an axis, up or down it, with branches that reach 20 mm along the next axis.
static void patient_of(int along, double sign, char *text, size_t capacity)
{
    enum { NODES = 60 };
    Faults faults = {0};
    VesselTree *t = vessel_tree_create(NODES, 0, 0);
    assert_non_null(t);
    for (int i = 0; i < NODES; i++) {
        double at[3] = {0, 0, 0}, way[3] = {0, 0, 0};
        at[along] = sign * (i < 40 ? 1.5 * i : 30), at[(along + 1) % 3] = i < 40 ? 0 : i - 40;
        way[i < 40 ? along : (along + 1) % 3] = i < 40 ? sign : 1;
        t->center[i] = vec3(at[0], at[1], at[2]);
        t->direction[i] = vec3(way[0], way[1], way[2]);
        t->radius[i] = 1;
        t->height[i] = 1;
        t->parent[i] = i == 40 ? 20 : i - 1;
    }
    assert_true(vessel_tree_link(t));
    char *scene = case_scene_text(t, &(CaseScene){.model = "model.h5", .frame = ""}, &faults), *line = scene ? strstr(scene, "anterior") : NULL;
    assert_non_null(line);
    snprintf(text, capacity, "%s", line);
    free(scene);
    vessel_tree_free(t);
}

static void vessels_lead_upwards(void **state)
{
    (void)state;
    char text[200], expected[200];
    for (int along = 0; along < 3; along++)
        for (int sign = -1; sign <= 1; sign += 2) {
            int up[3] = {0}, front[3] = {0};
            up[along] = sign, front[(along + 2) % 3] = 1;
            patient_of(along, sign, text, sizeof text);
            snprintf(expected, sizeof expected, "anterior: [%d, %d, %d]\n  superior: [%d, %d, %d]\n", front[0], front[1], front[2], up[0], up[1], up[2]);
            assert_string_equal(text, expected);
        }
}

// A vessel that tapers from 4 to 1 mm along an axis, upwards: the patient lies the same way whichever end is the root.
static void vessels_are_thin_at_the_head(void **state)
{
    (void)state;
    enum { NODES = 60 };
    for (int along = 0; along < 3; along++)
        for (int sign = -1; sign <= 1; sign += 2)
            for (int is_at_head = 0; is_at_head < 2; is_at_head++) {
                Faults faults = {0};
                char expected[60];
                int up[3] = {0};
                VesselTree *t = vessel_tree_create(NODES, 0, 0);
                assert_non_null(t);
                for (int i = 0; i < NODES; i++) {
                    int from_feet = is_at_head ? NODES - 1 - i : i;
                    double at[3] = {0, 0, 0};
                    at[along] = sign * from_feet;
                    t->center[i] = vec3(at[0], at[1], at[2]);
                    t->direction[i] = vec3(along == 0, along == 1, along == 2);
                    t->radius[i] = 4 - 3.0 * from_feet / (NODES - 1);
                    t->height[i] = 1;
                    t->parent[i] = i - 1;
                }
                assert_true(vessel_tree_link(t));
                up[along] = sign;
                snprintf(expected, sizeof expected, "superior: [%d, %d, %d]\n", up[0], up[1], up[2]);
                char *scene = case_scene_text(t, &(CaseScene){.model = "model.h5", .frame = ""}, &faults);
                assert_true(scene && strstr(scene, expected));
                free(scene);
                vessel_tree_free(t);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(volumes_are_those_of_the_shapes),
        cmocka_unit_test(a_whole_tree_misses_the_ball_alone),
        cmocka_unit_test(the_widest_end_is_proposed),
        cmocka_unit_test(a_stub_in_a_sac_is_no_way_in),
        cmocka_unit_test(vessels_lead_upwards),
        cmocka_unit_test(vessels_are_thin_at_the_head),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
