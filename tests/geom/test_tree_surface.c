// Surfaces prepared for export: edge counts of shapes with known counts, specks, the inlet cut open (axis-aligned, oblique, mirrored), volume compared with a
// count of the field's sign that is independent of marching cubes, and data values at vertices.
#include "blob_tube.h"
#include "geom/tree_surface.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "near.h"

static const Vec3 TETRA[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const int OUTWARDS[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

// `copies` tetrahedra; with `scale` < 0 the last of them is turned inside out and small.
static TriangleMesh tetrahedra(int copies, const double *scale)
{
    size_t n = (size_t)copies * 4;
    TriangleMesh m = {4 * copies, 4 * copies, malloc(n * sizeof(Vec3)), malloc(n * sizeof(Vec3)), malloc(n * sizeof(int)), malloc(n * sizeof(int[3]))};
    for (int c = 0; c < copies; c++)
        for (int i = 0; i < 4; i++) {
            m.vertex[4 * c + i] = vec3_add(vec3_scale(TETRA[i], fabs(scale[c])), vec3(3 * c, 0, 0));
            m.normal[4 * c + i] = vec3(0, 0, 1);
            m.node[4 * c + i] = c;
            for (int k = 0; k < 3; k++)
                m.triangle[4 * c + i][k] = 4 * c + OUTWARDS[i][scale[c] < 0 ? 2 - k : k];
        }
    return m;
}

static void release(TriangleMesh *m)
{
    free(m->vertex);
    free(m->normal);
    free(m->node);
    free(m->triangle);
}

static void edges_are_counted(void **state)
{
    (void)state;
    SurfaceCensus c;
    TriangleMesh m = tetrahedra(2, (const double[]){1, 1});
    assert_true(surface_census(&m, &c));
    assert_int_equal(c.vertices, 8);
    assert_int_equal(c.edges, 12);
    assert_int_equal(c.parts, 2);
    assert_int_equal(c.euler, 4);
    assert_int_equal(c.open_edges + c.non_manifold_edges + c.turned_edges, 0);
    assert_near(c.volume, 2.0 / 6, 1e-14);
    assert_near(c.area, 2 * (1.5 + sqrt(3) / 2), 1e-14);
    int *t = m.triangle[5], swap = t[0];
    t[0] = t[1], t[1] = swap;
    assert_true(surface_census(&m, &c));
    assert_int_equal(c.turned_edges, 3);
    m.triangle_count = 7;   // one face away
    t[1] = t[0], t[0] = swap;
    assert_true(surface_census(&m, &c));
    assert_int_equal(c.open_edges, 3);
    assert_int_equal(c.euler, 3);
    assert_near(c.volume, 2.0 / 6, 1e-14);   // the cone to the middle of the rim closes a flat one
    memcpy(m.triangle[7], m.triangle[6], sizeof m.triangle[7]);
    m.triangle_count = 8;   // one face twice
    assert_true(surface_census(&m, &c));
    assert_int_equal(c.open_edges, 2);   // of the face away; its third edge has the doubled face twice,
    assert_int_equal(c.turned_edges, 1);
    assert_int_equal(c.non_manifold_edges, 2);
    m.triangle_count = 0;
    assert_true(surface_census(&m, &c));
    assert_true(c.vertices == 0 && c.parts == 0 && c.euler == 0 && c.volume == 0);
    release(&m);
}

static void specks_are_dropped(void **state)
{
    (void)state;
    SurfaceCensus c;
    TriangleMesh m = tetrahedra(4, (const double[]){0.1, 2, -1.5, 1});   // small, the largest, inside out, large enough
    assert_int_equal(surface_drop_specks(&m, 0.01), 2);
    assert_int_equal(m.vertex_count, 8);
    assert_int_equal(m.triangle_count, 8);
    assert_true(m.node[0] == 1 && m.node[7] == 3);
    assert_true(surface_census(&m, &c));
    assert_int_equal(c.parts, 2);
    assert_near(c.volume, (8 + 1) / 6.0, 1e-13);
    assert_int_equal(surface_drop_specks(&m, 100), 1);   // the largest stays
    assert_near(m.vertex[1].x, 5, 0);
    assert_int_equal(surface_drop_specks(&m, 0), 0);
    release(&m);
}

// A straight tube that ends in a flare: the cones over the rim of the flare subtract more volume than those of the wall add.
static void an_open_tube_is_no_speck(void **state)
{
    (void)state;
    enum { BALLS = 80 };
    Faults faults = {0};
    TubePiece line = {40, 0, 0, 0};
    Vessel *tube =
        tube_vessel_create(&(TubeOptions){.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 1, .piece_count = 1, .piece = &line}, "test", &faults);
    Vec3 center[BALLS];
    double reach[BALLS];
    assert_non_null(tube);
    for (int i = 0; i < BALLS; i++)
        center[i] = vec3(40.0 * i / (BALLS - 1), 0, 0), reach[i] = 2.2;
    TriangleMesh *m = isosurface_of_vessel(tube, BALLS, center, reach, NULL, 0.25);
    assert_non_null(m);
    int triangles = m->triangle_count;
    assert_int_equal(surface_drop_specks(m, 4 * PI / 3), 0);
    assert_int_equal(m->triangle_count, triangles);
    assert_int_equal(surface_drop_specks(m, 1e6), 0);    // the largest stays
    triangle_mesh_free(m);
    tube->destroy(tube);
}

enum { NODES = 30, OVERLAP = 3, BLOBS = 10 };
static const double STEP = 0.6;

// A tube that bends, carried through `turn` (which may mirror) and moved.
static VesselTree *bent_tube(const Mat3 *turn, Vec3 move)
{
    Vec3 line[NODES + 2 * OVERLAP];
    for (int i = 0; i < NODES + 2 * OVERLAP; i++) {
        double s = STEP * (i - OVERLAP), a = fmax(s - 6, 0) / 8;   // straight for 6 mm, then an arc of 8 mm
        Vec3 x = a > 0 ? vec3(6 + 8 * sin(a), 8 * (1 - cos(a)), 0) : vec3(s, 0, 0);
        line[i] = vec3_add(mat3_mul_vec(turn, x), move);
    }
    return blob_tube(line, NODES, OVERLAP, BLOBS, 1);
}

// The volume with f > 0 and, where `half`, downstream of the root's plane near the root: cells of a fine lattice counted by their middles.
static double counted_volume(const VesselTree *t, double cell, bool half)
{
    Vec3 low = t->center[0], high = low;
    int64_t inside = 0;
    for (int i = 0; i < t->node_count; i++) {
        low = vec3(fmin(low.x, t->center[i].x), fmin(low.y, t->center[i].y), fmin(low.z, t->center[i].z));
        high = vec3(fmax(high.x, t->center[i].x), fmax(high.y, t->center[i].y), fmax(high.z, t->center[i].z));
    }
    const double room = 5;
    for (double x = low.x - room; x < high.x + room; x += cell)
        for (double y = low.y - room; y < high.y + room; y += cell)
            for (double z = low.z - room; z < high.z + room; z += cell) {
                Vec3 p = vec3(x, y, z);
                int best = 0;
                double least = HUGE_VAL;
                for (int i = 0; i < t->node_count; i++) {
                    double d = vec3_norm2(vec3_sub(p, t->center[i]));
                    if (d < least)
                        least = d, best = i;
                }
                if (least > 36)
                    continue;
                Vec3 away = vec3_sub(p, t->center[0]);
                if (half && vec3_dot(away, t->direction[0]) < 0 && vec3_norm2(away) < 25)
                    continue;
                Blobby b = blobby_of(t, best);
                inside += blobby_field(&b, p) > 0;
            }
    return (double)inside * cell * cell * cell;
}

static void check_open(const VesselTree *t, double cell, SurfaceCensus *c)
{
    TriangleMesh *m = isosurface_of_tree(t, cell);
    assert_non_null(m);
    assert_true(surface_census(m, c));
    assert_true(c->parts == 1 && c->euler == 2 && c->open_edges == 0 && c->non_manifold_edges == 0 && c->turned_edges == 0);
    double closed = c->volume;
    assert_true(surface_open_inlet(m, t));
    assert_true(surface_census(m, c));
    assert_int_equal(c->parts, 1);
    assert_int_equal(c->vertices, m->vertex_count);
    assert_int_equal(c->euler, 1);   // a cup
    assert_int_equal(c->non_manifold_edges + c->turned_edges, 0);
    assert_true(c->open_edges > (int64_t)(2 * PI / cell / 2));
    assert_true(c->volume > 0 && c->volume < closed - 2);   // some 3 mm of tube lay upstream
    int rim = 0;
    for (int v = 0; v < m->vertex_count; v++) {
        double z = vec3_dot(vec3_sub(m->vertex[v], t->center[0]), t->direction[0]);
        if (vec3_distance(m->vertex[v], t->center[0]) < 3)
            assert_true(z > -1e-9);
        rim += fabs(z) < 1e-9 && vec3_distance(m->vertex[v], t->center[0]) < 3;
        Blobby b = blobby_of(t, m->node[v]);
        Vec3 g;
        double f = blobby_gradient(&b, m->vertex[v], &g);
        assert_near(f / vec3_norm(g), 0, 1e-9);
        assert_true(vec3_distance(m->normal[v], vec3_unit(vec3_negate(g))) < 1e-9);
    }
    assert_int_equal(rim, c->open_edges);
    for (int k = 0; k < m->triangle_count; k++) {   // no triangle faces in
        Vec3 a = m->vertex[m->triangle[k][0]], b = m->vertex[m->triangle[k][1]], d = m->vertex[m->triangle[k][2]];
        Vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(d, a));
        if (vec3_norm(n) > 1e-6)
            assert_true(vec3_dot(n, m->normal[m->triangle[k][0]]) > -1e-9);
    }
    triangle_mesh_free(m);
}

static void the_inlet_opens(void **state)
{
    (void)state;
    SurfaceCensus plain, turned, mirrored, coarse;
    Mat3 as_is = mat3_identity(), mirror = as_is, turn = mat3_from_columns(vec3(0.36, 0.48, -0.8), vec3(-0.8, 0.6, 0), vec3(0.48, 0.64, 0.6));
    mirror.m[0][0] = -1;
    VesselTree *t = bent_tube(&as_is, vec3(0, 0, 0));   // the lattice's plane is the root's plane
    check_open(t, 0.125, &plain);
    check_open(t, 0.25, &coarse);
    vessel_tree_free(t);
    t = bent_tube(&turn, vec3(11.3, -4.4, 2.9));
    check_open(t, 0.125, &turned);
    double counted = counted_volume(t, 0.15, true);   // oblique to the tube, so that the counting errors of its sections average out
    print_message("volume %.4f at 0.25 mm, %.4f at 0.125 mm; oblique %.4f, counted %.4f mm3\n", coarse.volume, plain.volume, turned.volume, counted);
    // the chords' part extrapolated away; 0.15 mm cells count this volume to about 0.2 %
    assert_near((4 * plain.volume - coarse.volume) / 3, counted, 4e-3 * counted);
    vessel_tree_free(t);
    t = bent_tube(&mirror, vec3(0, 0, 0));
    check_open(t, 0.125, &mirrored);
    vessel_tree_free(t);
    assert_near(turned.volume, plain.volume, 2e-3 * plain.volume);
    assert_near(turned.area, plain.area, 2e-3 * plain.area);
    assert_near(mirrored.volume, plain.volume, 1e-3 * plain.volume);   // except for the diagonals of the triangles
    // what chords cut off falls with the square of the cell
    assert_true(plain.volume > coarse.volume && plain.volume - coarse.volume < 0.02 * plain.volume);
}

static void what_is_not_an_inlet_stays_closed(void **state)
{
    (void)state;
    Mat3 as_is = mat3_identity();
    VesselTree *t = bent_tube(&as_is, vec3(0, 0, 0));
    TriangleMesh *m = isosurface_of_tree(t, 0.3);
    int vertices = m->vertex_count, triangles = m->triangle_count;
    t->direction[0] = vec3(-1, 0, 0);   // the tree lies upstream of the root
    assert_false(surface_open_inlet(m, t));
    assert_true(m->vertex_count == vertices && m->triangle_count == triangles);
    t->direction[0] = vec3(0.8, 0.6, 0);
    assert_true(surface_open_inlet(m, t));   // an oblique cut
    SurfaceCensus c;
    assert_true(surface_census(m, &c) && c.euler == 1 && c.non_manifold_edges == 0);
    triangle_mesh_free(m);
    vessel_tree_free(t);
}

static void vertices_know_their_data(void **state)
{
    (void)state;
    enum { POINTS = 4000 };
    const double radius = 1.3, off[2] = {0.04, -0.03};   // data outside the model at x > 0, inside it at x < 0
    VesselTree *t = vessel_tree_create(2, POINTS, 2);
    uint64_t seed = 5;
    for (int i = 0; i < 2; i++) {
        t->center[i] = t->blob_center[i] = vec3(1, 2, 3);
        t->radius[i] = radius;
        t->direction[i] = vec3(1, 0, 0);
        t->parent[i] = i - 1;
        t->blob_width[i] = blob_width_for_radius(radius, 0.1);
        t->blob_offset[i + 1] = i + 1;
        t->point_offset[i + 1] = i == 1 ? POINTS : 0;   // the first node has none of its own
    }
    for (int k = 0; k < POINTS; k++) {
        Vec3 d;
        do
            d = random_in_box(&seed, 1);
        while (vec3_norm(d) > 1 || vec3_norm(d) < 0.1);
        d = vec3_unit(d);
        t->point[k] = vec3_add_scaled(t->center[0], radius + off[d.x < 0], d);
    }
    vessel_tree_link(t);
    TriangleMesh *m = isosurface_of_tree(t, 0.2);
    double *error = malloc((size_t)m->vertex_count * sizeof *error), *distance = malloc((size_t)m->vertex_count * sizeof *distance);
    assert_true(surface_point_error(m, &(ModelField){.tree = t}, error, distance));
    for (int v = 0; v < m->vertex_count; v++) {
        Vec3 d = vec3_sub(m->vertex[v], t->center[0]);
        assert_true(distance[v] >= 0.03 - 1e-9 && distance[v] < 0.3);
        if (fabs(d.x) > 0.3)
            assert_near(error[v], d.x > 0 ? -off[0] : -off[1], 1e-9);
    }
    free(error);
    free(distance);
    triangle_mesh_free(m);
    t->point_count = 0;
    assert_false(surface_point_error(NULL, &(ModelField){.tree = t}, NULL, NULL));
    vessel_tree_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edges_are_counted),
        cmocka_unit_test(specks_are_dropped),
        cmocka_unit_test(an_open_tube_is_no_speck),
        cmocka_unit_test(the_inlet_opens),
        cmocka_unit_test(what_is_not_an_inlet_stays_closed),
        cmocka_unit_test(vertices_know_their_data),
    };
    return cmocka_run_group_tests_name("tree_surface", tests, NULL, NULL);
}
