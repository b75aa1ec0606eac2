// The surface of trees of shared blobs as sheets: a connected lumen gives one closed part, even if it touches itself or overlaps; disconnected parts are found
// and dropped. For trees with known properties, also rotated and mirrored.
#include "geom/ghost_lumens.h"
#include "geom/surface_parts.h"
#include "geom/tree_surface.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "field_tree.h"
#include "near.h"

static FieldTree tree_room;
static const Mat3 TURNS[] = {
    {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, {{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}}}, {{{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}}}};
enum { TURN_COUNT = sizeof TURNS / sizeof TURNS[0] };

static FieldTree *fresh(void)
{
    tree_room.nodes = tree_room.blobs = 0;
    return &tree_room;
}

static SurfaceCensus census_of(const TriangleMesh *mesh)
{
    SurfaceCensus census;
    assert_non_null(mesh);
    assert_true(surface_census(mesh, &census));
    assert_int_equal(census.open_edges + census.non_manifold_edges + census.turned_edges, 0);
    return census;
}

static void vertices_are_on_the_wall(const TriangleMesh *mesh, const VesselTree *tree)
{
    int off = 0;
    for (int v = 0; v < mesh->vertex_count; v++) {
        Blobby model = blobby_of(tree, mesh->node[v]);
        Vec3 g;
        double f = blobby_gradient(&model, mesh->vertex[v], &g);
        off += !(fabs(f) < 1e-9 * vec3_norm(g)) || vec3_dot(mesh->normal[v], g) > 0;
    }
    assert_int_equal(off, 0);
}

static SurfaceParts *parts_of(const TriangleMesh *mesh, const VesselTree *tree)
{
    ReachOptions options = reach_default_options();
    Reach *reach = reach_create(&(ModelField){.tree = tree}, &options);
    SurfaceParts *parts = surface_parts_create(mesh, tree, reach);
    assert_non_null(parts);
    reach_free(reach);
    return parts;
}

// A trunk that forks: one branch continues straight, the other makes a detour and then runs beside it, with its axis `apart` from that of the first.
static VesselTree *kissing(double apart, const Mat3 *turn)
{
    FieldTree *t = fresh();
    int fork = field_tree_branch(t, -1, vec3(0, 0, 0), vec3(10, 0, 0), 1, 1e9, 0);
    field_tree_extend_root(t);
    field_tree_branch(t, fork, vec3(10.5, 0, 0), vec3(40, 0, 0), 1, 1e9, 0);
    int b = field_tree_branch(t, fork, vec3(10, 0.5, 0), vec3(10, 8, 0), 1, 1e9, 0);
    b = field_tree_branch(t, b, vec3(10.5, 8, 0), vec3(20, 8, 0), 1, 1e9, 0);
    b = field_tree_branch(t, b, vec3(20, 7.5, 0), vec3(20, apart, 0), 1, 1e9, 0);
    field_tree_branch(t, b, vec3(20.5, apart, 0), vec3(40, apart, 0), 1, 1e9, 0);
    return field_tree_make(t, turn);
}

static void kissing_lumens_are_two_sheets(void **state)
{
    (void)state;
    const double apart[] = {3, 2.1, 2, 1.95, 1.6, 1};
    double far_volume = 0;
    for (size_t k = 0; k < sizeof apart / sizeof apart[0]; k++)
        for (int turn = 0; turn < (k < 3 ? TURN_COUNT : 1); turn++) {
            VesselTree *tree = kissing(apart[k], &TURNS[turn]);
            TriangleMesh *mesh = isosurface_of_tree(tree, 0.23);
            SurfaceCensus c = census_of(mesh);
            assert_int_equal(c.parts, 1);
            assert_int_equal(c.euler, 2);                     // no handle: the lumens touch and do not merge
            vertices_are_on_the_wall(mesh, tree);
            // the second branch is shorter or longer as it is nearer or further
            double volume = c.volume + PI * (apart[k] - 3);
            if (k == 0 && turn == 0)
                far_volume = volume;
            assert_near(volume, far_volume, 0.01 * far_volume);
            SurfaceParts *parts = parts_of(mesh, tree);
            assert_int_equal(parts->count, 1);
            assert_int_equal(parts->part[0].kind, PART_INLET);
            surface_parts_free(parts);
            triangle_mesh_free(mesh);
            vessel_tree_free(tree);
        }
}

static void a_fork_is_one_part(void **state)
{
    (void)state;
    for (int turn = 0; turn < TURN_COUNT; turn++) {
        FieldTree *t = fresh();
        int fork = field_tree_branch(t, -1, vec3(0, 0, 0), vec3(10, 0, 0), 1, 1e9, 0);
        field_tree_extend_root(t);
        field_tree_branch(t, fork, vec3(10.3, 0.3, 0), vec3(18, 8, 0), 0.8, 1e9, 0);
        field_tree_branch(t, fork, vec3(10.3, -0.3, 0), vec3(18, -8, 0.5), 0.8, 1e9, 0);
        field_tree_branch(t, 8, vec3(4, 0, 0.6), vec3(4, 0, 5), 0.25, 1e9, 0);
        VesselTree *tree = field_tree_make(t, &TURNS[turn]);
        for (int fine = 0; fine < 2; fine++) {
            TriangleMesh *mesh = isosurface_of_tree(tree, fine ? 0.12 : 0.3);
            SurfaceCensus c = census_of(mesh);
            assert_int_equal(c.parts, 1);
            assert_int_equal(c.euler, 2);
            vertices_are_on_the_wall(mesh, tree);
            triangle_mesh_free(mesh);
        }
        vessel_tree_free(tree);
    }
}

static void what_hangs_on_nothing_is_found(void **state)
{
    (void)state;
    for (int turn = 0; turn < TURN_COUNT; turn++) {
        FieldTree *t = fresh();
        field_tree_branch(t, -1, vec3(0, 0, 0), vec3(30, 0, 0), 1, 1e9, 0);
        field_tree_extend_root(t);
        field_tree_branch(t, 40, vec3(20, 0.4, 0), vec3(20, 8, 0), 0.5, -1, 2.6);   // capped
        field_tree_blob(t, 20, vec3(10, 0.3, 2.1), 1, 2);                           // a ghost beside the trunk: f = 2 u^3 - 1 > 0 to 0.45 mm
        field_tree_blob(t, 20, vec3(10, 0, 0), 0.5, -4);                            // wall in the midst of the lumen
        VesselTree *tree = field_tree_make(t, &TURNS[turn]);
        TriangleMesh *mesh = isosurface_of_tree(tree, 0.15);
        assert_int_equal(census_of(mesh).parts, 4);
        SurfaceParts *parts = parts_of(mesh, tree);
        assert_int_equal(parts->count, 4);
        assert_int_equal(parts->part[0].kind, PART_INLET);
        assert_int_equal(parts->part[1].kind, PART_SHUT);
        assert_int_equal(parts->part[2].kind, PART_GHOST);
        assert_int_equal(parts->part[3].kind, PART_BUBBLE);
        assert_true(parts->part[1].nodes > 15);
        double r = sqrt(1 - cbrt(0.5));
        assert_near(parts->part[2].volume, 4 * PI / 3 * r * r * r, 0.1);
        assert_true(parts->part[3].volume < 0);
        const bool kinds[PART_KINDS] = {[PART_INLET] = true};
        int before = mesh->vertex_count;
        assert_true(surface_parts_keep(mesh, parts, kinds));
        assert_true(mesh->vertex_count < before);
        SurfaceCensus c = census_of(mesh);
        assert_int_equal(c.parts, 1);
        assert_int_equal(c.euler, 2);
        surface_parts_free(parts);
        triangle_mesh_free(mesh);
        vessel_tree_free(tree);
    }
}

// A branch that is shut and larger than the trunk: the part of the inlet is the one that a point reaches, not the largest.
static void the_largest_part_may_be_shut(void **state)
{
    (void)state;
    FieldTree *t = fresh();
    field_tree_branch(t, -1, vec3(0, 0, 0), vec3(30, 0, 0), 1, 1e9, 0);
    field_tree_extend_root(t);
    field_tree_branch(t, 40, vec3(20, 0.4, 0), vec3(20, 30, 0), 2, -1, 5);
    VesselTree *tree = field_tree_make(t, NULL);
    TriangleMesh *mesh = isosurface_of_tree(tree, 0.3);
    SurfaceParts *parts = parts_of(mesh, tree);
    assert_int_equal(parts->count, 2);
    assert_true(parts->part[0].volume > 2 * parts->part[1].volume);
    assert_int_equal(parts->part[0].kind, PART_SHUT);
    assert_int_equal(parts->part[1].kind, PART_INLET);
    surface_parts_free(parts);
    triangle_mesh_free(mesh);
    vessel_tree_free(tree);
}

static void ghosts_are_found_without_a_mesh(void **state)
{
    (void)state;
    for (int turn = 0; turn < TURN_COUNT; turn++) {
        FieldTree *t = fresh();
        field_tree_branch(t, -1, vec3(0, 0, 0), vec3(30, 0, 0), 1, 1e9, 0);
        field_tree_extend_root(t);
        field_tree_branch(t, 40, vec3(20, 0.4, 0), vec3(20, 8, 0), 0.5, -1, 2.6);   // capped, but lumen of the tree
        field_tree_blob(t, 20, vec3(10, 0.3, 2.1), 1, 2);
        field_tree_blob(t, 8, vec3(4, 0, 1), 0.8, 0.5);                             // a bulge of the trunk is none
        VesselTree *tree = field_tree_make(t, &TURNS[turn]);
        GhostLumens *ghosts = ghost_lumens_find(tree);
        assert_non_null(ghosts);
        assert_int_equal(ghosts->count, 1);
        assert_int_equal(ghosts->ghost[0].node, 20);
        assert_true(vec3_distance(ghosts->ghost[0].place, mat3_mul_vec(&TURNS[turn], vec3(10, 0.3, 2.1))) < 0.3);
        double r = sqrt(1 - cbrt(0.5)), volume = 4 * PI / 3 * r * r * r;
        assert_near(ghosts->ghost[0].volume, volume, 0.15 * volume);
        assert_true(ghosts->ghost[0].dissolves);
        assert_int_equal(ghosts->drop_count, 1);
        assert_near(tree->blob_amplitude[ghosts->drop[0]], 2, 0);
        ghost_lumens_free(ghosts);
        vessel_tree_free(tree);
    }
    assert_null(ghost_lumens_find(NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kissing_lumens_are_two_sheets),   cmocka_unit_test(a_fork_is_one_part),
        cmocka_unit_test(what_hangs_on_nothing_is_found),  cmocka_unit_test(the_largest_part_may_be_shut),
        cmocka_unit_test(ghosts_are_found_without_a_mesh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
