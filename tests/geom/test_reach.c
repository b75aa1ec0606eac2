// The places that a tool can reach from the inlet, for trees with known properties: a straight tube, a gap, a passage beside the centreline, a disconnected
// link, touching vessels, a thin diaphragm; rotated and mirrored; and local models with the other kernel.
#include "blob_tube.h"
#include "geom/reach.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "field_tree.h"
#include "near.h"

static FieldTree tree_room;

static FieldTree *fresh(void)
{
    tree_room.nodes = tree_room.blobs = 0;
    return &tree_room;
}

static Reach *reach_with(const VesselTree *tree, double radius)
{
    ReachOptions options = reach_default_options();
    options.tool_radius = radius;
    Reach *reach = reach_create(&(ModelField){.tree = tree}, &options);
    assert_non_null(reach);
    return reach;
}

static double part(const Reach *reach, ReachMode mode) { return reach->reached[mode] / reach->length; }

static void a_straight_tube_is_reached_to_its_end(void **state)
{
    (void)state;
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(20, 0, 0), 1, 1e9, 0);
    field_tree_extend_root(t);
    VesselTree *tree = field_tree_make(t, NULL);
    Reach *reach = reach_with(tree, 0.4);
    assert_near(reach->length, 20, 1e-12);
    for (int mode = 0; mode < REACH_MODES; mode++)
        assert_near(part(reach, mode), 1, 1e-12);
    assert_int_equal(reach->stop_count, 0);
    assert_int_equal(reach->junction_count, 0);
    reach_free(reach);
    // a ball of 0.9 fits the tube of 1, but not its closed end half a radius beyond the last node
    reach = reach_with(tree, 0.9);
    assert_true(part(reach, REACH_TOOL) > 0.96 && part(reach, REACH_TOOL) < 1);
    assert_int_equal(reach->stop_count, 1);
    assert_false(reach->stop[0].capped);
    assert_near(reach->stop[0].lost, 20 - reach->reached[REACH_ASIDE], 1e-5);
    reach_free(reach);
    reach = reach_with(tree, 1.05);
    assert_near(part(reach, REACH_ASIDE), 0, 0);
    assert_near(part(reach, REACH_POINT), 1, 0);
    assert_int_equal(reach->stop[0].node, 0);
    reach_free(reach);
    // clearance: on the axis the radius, beside it less, outside negative. The row of blobs has ripples of some thousandths
    assert_near(reach_clearance(&(ModelField){.tree = tree}, vec3(10.1, 0, 0), 20, 3), 1, 0.01);
    assert_near(reach_clearance(&(ModelField){.tree = tree}, vec3(10.1, 0.3, -0.4), 20, 3), 0.5, 0.01);
    assert_near(reach_clearance(&(ModelField){.tree = tree}, vec3(10.1, 0.9, 0.9), 20, 3), 1 - 0.9 * sqrt(2), 0.01);
    assert_near(reach_clearance(&(ModelField){.tree = tree}, vec3(10.1, 0, 0), 20, 0.2), 0.2, 0);
    vessel_tree_free(tree);
}

static void a_gap_stops_the_flood_where_it_begins(void **state)
{
    (void)state;
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(20, 0, 0), 1, 9.9, 14.1);
    field_tree_extend_root(t);
    VesselTree *tree = field_tree_make(t, NULL);
    Reach *reach = reach_with(tree, 0.18);
    // lumen ends half a radius beyond the last blob, at 9.5 + 0.5
    assert_near(reach->reached[REACH_POINT], 10, 0.06);
    assert_near(reach->reached[REACH_TOOL], 9.8, 0.13);
    assert_near(reach->reached[REACH_ASIDE], 9.8, 0.13);
    assert_int_equal(reach->stop_count, 1);
    assert_near(reach->stop[0].lost, 20 - reach->reached[REACH_ASIDE], 1e-5);
    assert_near(reach->stop[0].place.x, 10, 0.6);
    reach_free(reach);
    vessel_tree_free(tree);
}

static void a_tool_gets_by_beside_the_line(void **state)
{
    (void)state;
    for (int turn = 0; turn < 4; turn++) {
        FieldTree *t = fresh();
        double angle = 0.4 + 1.7 * turn;
        field_tree_branch(t, -1, vec3(0, 0, 0), vec3(20, 0, 0), 1, 1e9, 0);
        field_tree_extend_root(t);
        field_tree_blob(t, 20, vec3(10, 0.55 * cos(angle), 0.55 * sin(angle)), 0.75, -3);
        VesselTree *tree = field_tree_make(t, NULL);
        double on_line = reach_clearance(&(ModelField){.tree = tree}, vec3(10, 0, 0), 20, 2);
        double beside = reach_clearance(&(ModelField){.tree = tree}, vec3(10, -0.4 * cos(angle), -0.4 * sin(angle)), 20, 2);
        assert_true(on_line > 0 && on_line < 0.25 && beside > 0.4);
        Reach *reach = reach_with(tree, 0.3);
        assert_near(part(reach, REACH_POINT), 1, 0);
        assert_near(part(reach, REACH_ASIDE), 1, 0);
        assert_true(part(reach, REACH_TOOL) < 0.5 && part(reach, REACH_TOOL) > 0.45);
        reach_free(reach);
        reach = reach_with(tree, 0.7);       // too large for the passage
        assert_true(part(reach, REACH_ASIDE) < 0.5);
        assert_false(reach->stop[0].capped);
        assert_near(reach->stop[0].clearance, on_line, 0.05);
        reach_free(reach);
        vessel_tree_free(tree);
    }
}

static void a_thin_diaphragm_shuts(void **state)
{
    (void)state;
    // a wall 0.05 mm thick across a wide tube: two blobs of support 0.6 would be thicker, so a plate of many small ones
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(20, 0, 0), 2, 1e9, 0);
    field_tree_extend_root(t);
    for (int j = -20; j <= 20; j++)
        for (int k = -20; k <= 20; k++)
            if (j * j + k * k <= 400)
                field_tree_blob(t, 10, vec3(10.03, 0.11 * j, 0.11 * k), 0.16, -2.5);
    VesselTree *tree = field_tree_make(t, NULL);
    int node = 10;
    assert_true(reach_blob_field(tree, vec3(9.95, 0, 0), &node) > 0 && reach_blob_field(tree, vec3(10.11, 0, 0), &node) > 0);
    assert_true(reach_blob_field(tree, vec3(10.03, 0, 0), &node) < 0);
    Reach *reach = reach_with(tree, 0.18);
    assert_near(reach->reached[REACH_POINT], 10, 0.25);
    assert_near(reach->reached[REACH_ASIDE], 9.8, 0.6);
    assert_int_equal(reach->stop_count, 1);
    assert_true(reach->stop[0].capped);
    assert_true(reach->stop[0].clearance > -0.08);
    reach_free(reach);
    vessel_tree_free(tree);
}

// A trunk along x, an open branch A at an angle, B without blobs at its start, C whose first node is too far away.
static VesselTree *forked(const Mat3 *turn)
{
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(30, 0, 0), 1, 1e9, 0);
    field_tree_extend_root(t);
    field_tree_branch(t, 20, vec3(10.4, 0.3, 0), vec3(18, 6, 0), 0.5, 1e9, 0);
    field_tree_branch(t, 40, vec3(20, 0.4, 0), vec3(20, 8, 0), 0.5, -1, 2.6);
    field_tree_branch(t, 40, vec3(20, 0, 3), vec3(20, 0, 9), 0.5, 1e9, 0);
    return field_tree_make(t, turn);
}

static void junctions_are_open_capped_or_apart(void **state)
{
    (void)state;
    const Mat3 turns[] = {mat3_identity(), {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, {{{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}}}};
    for (size_t k = 0; k < sizeof turns / sizeof turns[0]; k++) {
        VesselTree *tree = forked(&turns[k]);
        Reach *reach = reach_with(tree, 0.18);
        assert_int_equal(reach->junction_count, 3);
        assert_int_equal(reach->capped, 2);
        assert_int_equal(reach->capped_apart, 1);
        assert_int_equal(reach->narrow, 2);
        assert_int_equal(reach->apart_links, 1);
        assert_int_equal(reach->apart_open, 0);
        assert_near(reach->apart_length, 6, 1e-9);
        int first_of_a = 61;
        assert_int_equal(reach->junction[2].node, first_of_a);
        assert_near(reach->junction[2].clearance, 0.5, 0.02);
        // lines: trunk 30, A and its link, B and its link, C without
        double a = 9.5 + 0.5, b = 7.6 + 0.4;
        assert_near(reach->length, 30 + a + b + 6, 1e-9);
        assert_near(reach->reached[REACH_POINT], 30 + a + 1, 0.15);      // of B only the part in the trunk
        assert_int_equal(reach->stop_count, 2);
        assert_true(reach->stop[0].capped && reach->stop[1].capped);
        assert_true(reach->stop[1].apart && !reach->stop[0].apart);
        assert_near(reach->stop[0].lost, b - 0.8, 0.2);
        assert_near(reach->stop[1].lost, 6, 1e-9);
        reach_free(reach);
        vessel_tree_free(tree);
    }
}

// Two equal branches without blobs at their starts, on opposite sides of a trunk along x: of equal junctions the one with the lower node comes first.
static void equal_junctions_are_in_the_order_of_nodes(void **state)
{
    (void)state;
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(30, 0, 0), 1, 1e9, 0);
    field_tree_extend_root(t);
    for (int side = -1; side < 2; side += 2)
        field_tree_branch(t, 40, vec3(20, 0.4 * side, 0), vec3(20, 8 * side, 0), 0.5, -1, 2.6);
    VesselTree *tree = field_tree_make(t, NULL);
    Reach *reach = reach_with(tree, 0.18);
    assert_int_equal(reach->junction_count, 2);
    assert_true(reach->junction[0].clearance == reach->junction[1].clearance);
    assert_true(reach->junction[0].node < reach->junction[1].node);
    reach_free(reach);
    vessel_tree_free(tree);
}

static void a_kissing_vessel_opens_nothing(void **state)
{
    (void)state;
    FieldTree *t = fresh();
    int fork = field_tree_branch(t, -1, vec3(0, 0, 0), vec3(10, 0, 0), 1, 1e9, 0);
    field_tree_extend_root(t);
    field_tree_branch(t, fork, vec3(10.5, 0, 0), vec3(40, 0, 0), 1, 1e9, 0);
    int b = field_tree_branch(t, fork, vec3(10, 0.5, 0), vec3(10, 8, 0), 1, 1, 5.5), first_of_b = t->nodes - 16;
    b = field_tree_branch(t, b, vec3(10.5, 8, 0), vec3(20, 8, 0), 1, 1e9, 0);
    b = field_tree_branch(t, b, vec3(20, 7.5, 0), vec3(20, 1.9, 0), 1, 1e9, 0);
    b = field_tree_branch(t, b, vec3(20.5, 1.9, 0), vec3(40, 1.9, 0), 1, 1e9, 0);
    VesselTree *tree = field_tree_make(t, NULL);
    int in_a = fork + 1 + 39, in_b = b - 20;                 // (30, 0, 0) and about (30, 1.9, 0): 0.1 mm of both lumens overlap
    assert_near(tree->center[in_a].x, 30, 0.3);
    assert_near(tree->center[in_b].x, 30, 0.5);
    assert_near(reach_clearance(&(ModelField){.tree = tree}, tree->center[in_a], in_a, 3), 1, 0.01);
    assert_near(reach_clearance(&(ModelField){.tree = tree}, tree->center[in_b], in_b, 3), 1, 0.01);
    Reach *reach = reach_with(tree, 0.18);
    assert_near(reach->share[in_a][REACH_ASIDE], 1, 0);
    assert_near(reach->share[in_b][REACH_POINT], 0, 0);
    assert_near(reach->share[in_b][REACH_ASIDE], 0, 0);
    assert_near(reach->share[t->nodes - 1][REACH_POINT], 0, 0);
    assert_int_equal(reach->stop_count, 1);
    assert_true(reach->stop[0].capped);
    assert_true(reach->stop[0].node >= first_of_b && reach->stop[0].node < first_of_b + 16);
    reach_free(reach);
    vessel_tree_free(tree);
}

static void local_models_are_flooded_too(void **state)
{
    (void)state;
    enum { NODES = 40, OVERLAP = 3 };
    Vec3 line[NODES + 2 * OVERLAP];
    for (int i = 0; i < NODES + 2 * OVERLAP; i++)
        line[i] = vec3(0.5 * i, 0, 0);
    VesselTree *tree = blob_tube(line, NODES, OVERLAP, 13, 1);
    Reach *reach = reach_with(tree, 0.5);
    assert_near(part(reach, REACH_ASIDE), 1, 0);
    assert_near(part(reach, REACH_TOOL), 1, 0);
    reach_free(reach);
    // the model of one node is that of another vessel: its cell is closed
    for (int64_t b = tree->blob_offset[20]; b < tree->blob_offset[21]; b++)
        tree->blob_center[b] = vec3_add(tree->blob_center[b], vec3(0, 40, 0));
    reach = reach_with(tree, 0.5);
    assert_near(reach->reached[REACH_POINT], 9.75, 0.06);
    assert_int_equal(reach->stop_count, 1);
    assert_true(reach->stop[0].capped && (reach->stop[0].node == 19 || reach->stop[0].node == 20));   // the ball, or the line
    reach_free(reach);
    vessel_tree_free(tree);
}

static void options_are_checked(void **state)
{
    (void)state;
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(4, 0, 0), 1, 1e9, 0);
    VesselTree *tree = field_tree_make(t, NULL), *bare = vessel_tree_create(3, 0, 0);
    ReachOptions options = reach_default_options();
    assert_null(reach_create(&(ModelField){0}, &options));
    assert_null(reach_create(&(ModelField){.tree = bare}, &options));
    const double bad[] = {0, -1, NAN, HUGE_VAL};
    for (int k = 0; k < 4; k++) {
        options.tool_radius = bad[k];
        assert_null(reach_create(&(ModelField){.tree = tree}, &options));
    }
    options = reach_default_options();
    options.aside = 1.5;
    assert_null(reach_create(&(ModelField){.tree = tree}, &options));
    vessel_tree_free(tree);
    vessel_tree_free(bare);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_tube_is_reached_to_its_end),
        cmocka_unit_test(a_gap_stops_the_flood_where_it_begins),
        cmocka_unit_test(a_tool_gets_by_beside_the_line),
        cmocka_unit_test(a_thin_diaphragm_shuts),
        cmocka_unit_test(junctions_are_open_capped_or_apart),
        cmocka_unit_test(equal_junctions_are_in_the_order_of_nodes),
        cmocka_unit_test(a_kissing_vessel_opens_nothing),
        cmocka_unit_test(local_models_are_flooded_too),
        cmocka_unit_test(options_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
