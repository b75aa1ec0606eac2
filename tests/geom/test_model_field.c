// The wall of a model as its nodes see it: the nodes of a swept model, its distances against a cylinder and a fork, branches of which the file's tree knows
// nothing, sacs, and what a tool reaches in it; of blobs, the field of blobby.h.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "geom/model_field.h"
#include "geom/model_mesh.h"
#include "geom/power_walk.h"
#include "geom/reach.h"
#include "geom/tree_surface.h"
#include "near.h"
#include "sweep_models.h"

static SweepShape shape[4];

// The file's tree: a node for each of `count` places, with eight points on the circle of radius `radius` around the x axis at each.
static VesselTree *tree_along(int count, double length, double radius)
{
    VesselTree *tree = vessel_tree_create(count, 8 * (int64_t)count, 0);
    for (int i = 0; i < count; i++) {
        tree->center[i] = vec3(length * i / (count - 1), 0, 0), tree->radius[i] = radius;
        tree->direction[i] = vec3(1, 0, 0), tree->parent[i] = i - 1;
        for (int k = 0; k < 8; k++)
            tree->point[8 * i + k] = vec3(tree->center[i].x, radius * cos(k * PI / 4), radius * sin(k * PI / 4));
        tree->point_offset[i + 1] = 8 * (i + 1);
    }
    assert_true(vessel_tree_link(tree));
    return tree;
}

// A tube of radius 1.5 along x, and at x = 8 a branch of radius 1 along y.
static SweepModel *make_fork(void)
{
    shape[0] = (SweepShape){.pitch = 1, .parent = -1, .open_start = true, .radius = 1.5};
    shape[1] = (SweepShape){.pitch = 1, .parent = 0, .parent_t = 8, .radius = 1};
    sweep_shape_line(&shape[0], vec3(0, 0, 0), vec3(20, 0, 0), 21);
    sweep_shape_line(&shape[1], vec3(8, 0, 0), vec3(8, 12, 0), 13);
    return sweep_model_of(shape, 2);
}

static void nodes_follow_the_branches(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(34, 20, 1.5);
    ModelField m;
    assert_true(model_field_of_sweep(tree, model, &m));
    assert_true(vessel_tree_validate(m.tree, "nodes", &(Faults){0}));
    assert_near(vec3_distance(m.tree->center[0], vec3(0, 0, 0)), 0, 0);
    for (int b = 0; b < 2; b++) {
        int first = m.first_node[b], last = m.first_node[b + 1] - 1;
        assert_near(m.place[last].t, sweep_model_length(model, b), 0);
        for (int i = first + 1; i <= last; i++) {
            double step = m.place[i].t - m.place[i - 1].t;
            assert_true(step > 0.3 * shape[b].radius && step < 1.2 * shape[b].radius);
            assert_int_equal(m.tree->parent[i], i - 1);
            assert_near(m.tree->radius[i], shape[b].radius, 1e-12);
            assert_int_equal(model_field_node_at(&m, m.place[i]), i);
        }
    }
    int fork = m.tree->parent[m.first_node[1]];
    assert_true(fork < m.first_node[1] && fabs(m.place[fork].t - 8) < 0.6);
    // the nearest knot's node
    assert_int_equal(model_field_file_node(&m, 0), 0);
    assert_int_equal(model_field_file_node(&m, m.first_node[2] - 1), 21 + 12);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

static void points_go_to_the_nodes_beside_them(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(34, 20, 1.6);      // 0.1 outside
    tree->center[33] = vec3(20, 0, 40);              // and a node where the model has no vessel
    ModelField m;
    assert_true(vessel_tree_link(tree) && model_field_of_sweep(tree, model, &m));
    int64_t beside = 0, inside_branch = 0;
    for (int i = 0; i < m.tree->node_count; i++)
        for (int64_t p = m.tree->point_offset[i]; p < m.tree->point_offset[i + 1]; p++) {
            beside += fabs(m.tree->point[p].x - m.tree->center[i].x) < 1.2;
            inside_branch += m.place[i].branch == 1;
        }
    assert_int_equal(m.tree->point_count, 33 * 8);
    assert_int_equal(beside, m.tree->point_count);
    assert_true(inside_branch < 12);
    assert_true(m.left_out >= 8 && m.left_out < 8 + 6);      // those inside the branch's mouth are not near the wall
    assert_near(m.tree->error[2], 0.1, 1e-9);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

static void distances_are_those_of_the_cylinder(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(34, 20, 1.5);
    ModelField m;
    assert_true(model_field_of_sweep(tree, model, &m));
    static const double rho[] = {0, 1e-3, 0.4, 1.1, 1.49, 1.5, 1.7, 2.4};
    for (int k = 0; k < 8; k++)
        for (int turn = 0; turn < 5; turn++) {
            Vec3 way = vec3(0, cos(1.3 * turn), sin(1.3 * turn)), x = vec3_add_scaled(vec3(15, 0, 0), rho[k], way), gradient;
            int node = power_nearest(m.tree, x);
            SurfacePoint p = model_field_project(&m, node, x, x);
            assert_near(p.distance, 1.5 - rho[k], 1e-8);
            assert_near(vec3_distance(p.foot, x), fabs(p.distance), 1e-8);
            assert_near(hypot(p.foot.y, p.foot.z), 1.5, 1e-8);
            if (rho[k] > 0) {
                assert_true(p.converged);
                assert_near(vec3_dot(p.normal, way), -1, 1e-8);
                assert_near(model_field_distance(&m, node, x), 1.5 - rho[k], 1e-9);
            }
            SweepBlend blend;
            sweep_field_blend(m.field, m.place[node], x, &blend);
            assert_true(model_field_at(&m, node, x, &gradient) == blend.f && vec3_distance(gradient, blend.gradient) == 0);
        }
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

// An edit draws a branch whose knots all have the parent's node: the file's tree has no node in it.
static void a_drawn_branch_is_seen(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(34, 20, 1.5);
    for (int k = 21; k < 34; k++)
        model->knot_node[k] = 8;
    ModelField m;
    assert_true(model_field_of_sweep(tree, model, &m));
    Vec3 x = vec3(8.3, 10, 0.2);
    int node = power_nearest(m.tree, x);
    assert_int_equal(m.place[node].branch, 1);
    assert_int_equal(model_field_file_node(&m, node), 8);
    assert_near(model_field_project(&m, node, x, x).distance, 1 - hypot(0.3, 0.2), 1e-8);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

static void a_sac_has_its_node(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(40, 20, 1.5);
    sweep_add_sac(model, 15, vec3(15, -3, 0), 2.5);
    ModelField m;
    assert_true(model_field_of_sweep(tree, model, &m));
    int sac = m.tree->node_count - 1, at = power_nearest(m.tree, vec3(15, -4, 0));
    assert_int_equal(m.tree->kind[sac], NODE_ANEURYSM);
    assert_int_equal(at, sac);
    assert_int_equal(model_field_file_node(&m, sac), model->sac_node[1]);
    assert_near(m.tree->center[m.tree->parent[sac]].x, 15, 0.6);
    assert_near(model_field_project(&m, sac, vec3(15, -5.2, 0), vec3(15, -5.2, 0)).distance, 0.3, 1e-6);
    assert_near(model_field_project(&m, sac, vec3(15, -5.9, 0), vec3(15, -5.9, 0)).distance, -0.4, 1e-6);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

// 1.5 mm wide except for a waist of 0.3 around the middle.
static void waist(double t, double length, double *term)
{
    double s = (t - 0.5 * length) / 1.5;
    term[0] = 1.5 - 1.2 * exp(-s * s);
}

static void a_waist_stops_what_is_wider(void **state)
{
    (void)state;
    shape[0] = (SweepShape){.pitch = 0.25, .parent = -1, .open_start = true, .radius = 1.5, .section = waist};
    sweep_shape_line(&shape[0], vec3(0, 0, 0), vec3(20, 0, 0), 41);
    SweepModel *model = sweep_model_of(shape, 1);
    VesselTree *tree = tree_along(41, 20, 1.5);
    ModelField m;
    ReachOptions options = reach_default_options();
    assert_true(model_field_of_sweep(tree, model, &m));
    options.tool_radius = 0.2;
    Reach *reach = reach_create(&m, &options);
    assert_non_null(reach);
    assert_near(reach->length, 20, 1e-9);
    assert_near(reach->reached[REACH_TOOL], 20, 1e-6);
    assert_int_equal(reach->stop_count, 0);
    reach_free(reach);
    options.tool_radius = 0.4;
    reach = reach_create(&m, &options);
    assert_non_null(reach);
    assert_near(reach->reached[REACH_POINT], 20, 1e-6);
    assert_true(reach->reached[REACH_ASIDE] > 8 && reach->reached[REACH_ASIDE] < 10);
    assert_int_equal(reach->stop_count, 1);
    assert_false(reach->stop[0].capped);
    assert_near(reach->stop[0].clearance, 0.3, 0.02);
    assert_near(reach->stop[0].place.x, 10, 0.2);
    reach_free(reach);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

static void a_fork_is_a_junction(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(34, 20, 1.5);
    ModelField m;
    ReachOptions options = reach_default_options();
    assert_true(model_field_of_sweep(tree, model, &m));
    Reach *reach = reach_create(&m, &options);
    assert_non_null(reach);
    assert_int_equal(reach->junction_count, 1);
    assert_int_equal(reach->junction[0].node, m.first_node[1]);
    assert_int_equal(reach->capped + reach->narrow + reach->stop_count, 0);
    assert_near(reach->junction[0].clearance, 1, 0.02);
    assert_near(reach->length, 20 + 12, 0.6);        // the link to the branch begins at a node beside the fork
    assert_near(reach->reached[REACH_ASIDE], reach->length, 1e-6);
    reach_free(reach);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

// The mesh has the field's nodes, and the distance of the data from it is that of the points.
static void the_mesh_has_the_nodes_of_the_field(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    VesselTree *tree = tree_along(34, 20, 1.6);
    ModelField m;
    assert_true(model_field_of_sweep(tree, model, &m));
    TriangleMesh *mesh = triangle_mesh_of_model(&m, 0);
    assert_non_null(mesh);
    double *error = calloc((size_t)mesh->vertex_count, sizeof *error);
    assert_true(surface_point_error(mesh, &m, error, NULL));
    int along = 0;
    for (int v = 0; v < mesh->vertex_count; v++) {
        Vec3 x = mesh->vertex[v];
        assert_true(vec3_distance(x, m.tree->center[mesh->node[v]]) < 2.5);
        if (x.x > 11 && x.x < 19) {
            assert_near(error[v], -0.1, 1e-6);
            along++;
        }
    }
    assert_true(along > 100);
    free(error);
    triangle_mesh_free(mesh);
    model_field_free(&m);
    vessel_tree_free(tree);
    sweep_model_free(model);
}

static void blobs_are_seen_as_before(void **state)
{
    (void)state;
    SweepModel *model = make_fork();
    sweep_add_sac(model, 15, vec3(15, -3, 0), 2.5);
    ModelField m = model_field_of_blobs(model->sac), none = model_field_of_blobs(NULL);
    Vec3 x = vec3(15.2, -5, 0.1), a, b;
    Blobby blobs = blobby_of(model->sac, 1);
    assert_true(model_field_exists(&m) && !model_field_exists(&none));
    assert_true(model_field_at(&m, 1, x, &a) == blobby_gradient(&blobs, x, &b) && vec3_distance(a, b) == 0);
    assert_true(model_field_project(&m, 1, x, x).distance == blobby_project(&blobs, x, x).distance);
    assert_int_equal(model_field_file_node(&m, 1), 1);
    sweep_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nodes_follow_the_branches),
        cmocka_unit_test(points_go_to_the_nodes_beside_them),
        cmocka_unit_test(distances_are_those_of_the_cylinder),
        cmocka_unit_test(a_drawn_branch_is_seen),
        cmocka_unit_test(a_sac_has_its_node),
        cmocka_unit_test(a_waist_stops_what_is_wider),
        cmocka_unit_test(a_fork_is_a_junction),
        cmocka_unit_test(the_mesh_has_the_nodes_of_the_field),
        cmocka_unit_test(blobs_are_seen_as_before),
    };
    return cmocka_run_group_tests_name("model_field", tests, NULL, NULL);
}
