// Surfaces: the derived table of marching cubes, closed manifolds facing outwards, a sphere's area and volume with order 2, the Hausdorff bound
// voxel^2 / (2 R) of docs/references.md, trees whose models join, rejected input, and the time.
#include "blob_tube.h"
#include "geom/cube_triangles.h"
#include "geom/isosurface.h"
#include "geom/power_walk.h"
#include "random_numbers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "near.h"

static void table(void **state)
{
    (void)state;
    static CubeTable t;
    cube_table_fill(&t);
    assert_int_equal(t.flat_diagonals, 0);
    assert_int_equal(t.of[0].count, 0);
    assert_int_equal(t.of[255].count, 0);
    for (int mask = 0; mask < 256; mask++) {
        int crossing = 0, used[12] = {0}, edges = 0;
        for (int e = 0; e < 12; e++) {
            int a = cube_edge_start(e), b = cube_edge_end(e);
            assert_true((a ^ b) == 1 || (a ^ b) == 2 || (a ^ b) == 4);
            crossing += (mask >> a & 1) != (mask >> b & 1);
        }
        for (int k = 0; k < t.of[mask].count; k++)
            for (int v = 0; v < 3; v++) {
                int e = t.of[mask].edge[k][v];
                assert_true((mask >> cube_edge_start(e) & 1) != (mask >> cube_edge_end(e) & 1));
                used[e] = 1;
            }
        for (int e = 0; e < 12; e++)
            edges += used[e];
        assert_int_equal(edges, crossing);   // each crossing has its vertex
    }
}

typedef struct Side {
    int a, b;
} Side;

static int compare_sides(const void *x, const void *y)
{
    const Side *s = x, *t = y;
    return s->a != t->a ? (s->a < t->a ? -1 : 1) : s->b != t->b ? (s->b < t->b ? -1 : 1) : 0;
}

// Every directed side occurs once, and so does its reverse.
static void check_closed(const TriangleMesh *m)
{
    int n = 3 * m->triangle_count;
    Side *side = malloc((size_t)n * sizeof *side);
    for (int i = 0; i < n; i++) {
        const int *t = m->triangle[i / 3];
        side[i] = (Side){t[i % 3], t[(i + 1) % 3]};
        assert_true(side[i].a >= 0 && side[i].a < m->vertex_count && side[i].a != side[i].b);
    }
    qsort(side, (size_t)n, sizeof *side, compare_sides);
    for (int i = 0; i < n; i++) {
        Side back = {side[i].b, side[i].a};
        assert_true(i == 0 || compare_sides(&side[i - 1], &side[i]) != 0);
        assert_non_null(bsearch(&back, side, (size_t)n, sizeof *side, compare_sides));
    }
    free(side);
}

static void measure(const TriangleMesh *m, double *area, double *volume)
{
    *area = *volume = 0;
    for (int i = 0; i < m->triangle_count; i++) {
        Vec3 a = m->vertex[m->triangle[i][0]], b = m->vertex[m->triangle[i][1]], c = m->vertex[m->triangle[i][2]];
        Vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
        *area += 0.5 * vec3_norm(n);
        *volume += vec3_dot(a, n) / 6;   // > 0 where triangles face outwards
    }
}

static VesselTree *ball(double r, Vec3 c)
{
    VesselTree *t = vessel_tree_create(1, 0, 1);
    t->center[0] = t->blob_center[0] = c;
    t->radius[0] = r;
    t->direction[0] = vec3(1, 0, 0);
    t->parent[0] = -1;
    t->blob_width[0] = blob_width_for_radius(r, 0.1);
    t->blob_offset[1] = 1;
    vessel_tree_link(t);
    return t;
}

static void sphere_converges(void **state)
{
    (void)state;
    double r = 1.3;
    VesselTree *t = ball(r, vec3(0.123, -4.2, 7.77));
    double area_error[3], volume_error[3];
    for (int i = 0; i < 3; i++) {
        double cell = 0.4 / (1 << i), area, volume, worst = 0;
        TriangleMesh *m = isosurface_of_tree(t, cell);
        assert_non_null(m);
        check_closed(m);
        assert_int_equal(m->vertex_count - m->triangle_count / 2, 2);   // Euler: one sphere
        measure(m, &area, &volume);
        area_error[i] = 1 - area / (4 * PI * r * r);
        volume_error[i] = 1 - volume / (4 * PI * r * r * r / 3);
        for (int v = 0; v < m->vertex_count; v++) {
            Vec3 d = vec3_sub(m->vertex[v], t->center[0]);
            assert_near(vec3_norm(d), r, 1e-11);
            assert_true(vec3_distance(m->normal[v], vec3_unit(d)) < 1e-9);
            assert_int_equal(m->node[v], 0);
        }
        for (int k = 0; k < m->triangle_count; k++) {
            Vec3 a = m->vertex[m->triangle[k][0]], b = m->vertex[m->triangle[k][1]], c = m->vertex[m->triangle[k][2]];
            double low = vec3_distance(vec3_scale(vec3_add(vec3_add(a, b), c), 1.0 / 3), t->center[0]);
            worst = fmax(worst, r - low);
        }
        assert_true(worst < cell * cell / (2 * r));
        triangle_mesh_free(m);
    }
    for (int i = 0; i < 2; i++) {   // halving the cell quarters the error
        assert_true(volume_error[i] > 0 && fabs(volume_error[i] / volume_error[i + 1] - 4) < 0.6);
        assert_true(fabs(area_error[i] / area_error[i + 1] - 4) < 0.6);
    }
    assert_true(volume_error[2] < 0.01);
    vessel_tree_free(t);
}

static void random_models_are_closed(void **state)
{
    (void)state;
    uint64_t seed = 21;
    for (int trial = 0; trial < 20; trial++) {
        enum { N = 12 };
        VesselTree *t = vessel_tree_create(1, 0, N);
        t->radius[0] = 1;
        t->direction[0] = vec3(1, 0, 0);
        t->parent[0] = -1;
        for (int j = 0; j < N; j++) {
            t->blob_center[j] = random_in_box(&seed, 1.5);
            t->blob_width[j] = random_in(&seed, 0.08, 0.4);
        }
        t->blob_offset[1] = N;
        vessel_tree_link(t);
        TriangleMesh *m = isosurface_of_model(t, 0, 0.2);   // coarse on purpose: lobes near each other, ambiguous cubes
        assert_non_null(m);
        assert_true(m->triangle_count > 0);
        check_closed(m);
        double area, volume;
        measure(m, &area, &volume);
        assert_true(volume > 0);
        triangle_mesh_free(m);
        vessel_tree_free(t);
    }
}

enum { NODES = 80, OVERLAP = 3 };
static VesselTree *helix(void)
{
    Vec3 line[NODES + 2 * OVERLAP];
    helix_line(line, NODES + 2 * OVERLAP, 6, 9, 0.7);
    return blob_tube(line, NODES, OVERLAP, 10, 1);
}

static void tree_joins_without_gap(void **state)
{
    (void)state;
    VesselTree *t = helix();
    TriangleMesh *m = isosurface_of_tree(t, 0.25), *again = isosurface_of_tree(t, 0.25);
    assert_non_null(m);
    check_closed(m);
    assert_int_equal(m->vertex_count - m->triangle_count / 2, 2);   // one tube with two caps
    int off = 0;
    double worst = 0;
    for (int v = 0; v < m->vertex_count; v++) {
        int node = m->node[v];
        int64_t a = t->blob_offset[node];
        Blobby b = {.count = 10, .center = t->blob_center + a, .width = t->blob_width + a, .iso_level = 0.1};
        Vec3 g, x = m->vertex[v];
        double f = blobby_gradient(&b, x, &g);
        off += fabs(f) > 1e-9 * vec3_norm(g);
        assert_true(vec3_distance(m->normal[v], vec3_unit(vec3_negate(g))) < 1e-9);
        // its node is that of its power cell, except for the distance to the surface
        int best = power_nearest(t, x);
        double behind = power_distance(x, t->center[node], 1) - power_distance(x, t->center[best], 1);
        worst = fmax(worst, behind);
    }
    assert_int_equal(off, 0);
    assert_true(worst < 0.25);
    double area, volume, length = 0.7 * (NODES - 1);
    measure(m, &area, &volume);
    assert_true(volume > PI * length && volume < PI * (length + 2 * (1.7 + OVERLAP * 0.7)) * 1.1);
    assert_int_equal(m->vertex_count, again->vertex_count);
    assert_memory_equal(m->vertex, again->vertex, (size_t)m->vertex_count * sizeof(Vec3));
    assert_memory_equal(m->triangle, again->triangle, (size_t)m->triangle_count * sizeof *m->triangle);
    triangle_mesh_free(m);
    triangle_mesh_free(again);
    vessel_tree_free(t);
}

static void what_cannot_be_meshed(void **state)
{
    (void)state;
    VesselTree *t = ball(1, vec3(0, 0, 0));
    assert_null(isosurface_of_tree(NULL, 0.1));
    assert_null(isosurface_of_model(t, 1, 0.1));
    assert_null(isosurface_of_model(t, -1, 0.1));
    assert_null(isosurface_of_tree(t, 0));
    assert_null(isosurface_of_tree(t, -1));
    assert_null(isosurface_of_tree(t, NAN));
    assert_null(isosurface_of_tree(t, 1e-9));    // more cells than the lattice has
    t->blob_width[0] = 0.05;                     // below T: no surface, an empty mesh
    TriangleMesh *m = isosurface_of_tree(t, 0.1);
    assert_non_null(m);
    assert_true(m->vertex_count == 0 && m->triangle_count == 0);
    triangle_mesh_free(m);
    t->blob_count = 0;
    assert_null(isosurface_of_tree(t, 0.1));
    vessel_tree_free(t);
    triangle_mesh_free(NULL);
}

static void cost(void **state)
{
    (void)state;
    enum { N = 500 };
    static Vec3 line[N + 2 * OVERLAP];
    helix_line(line, N + 2 * OVERLAP, 15, 6, 0.4);
    VesselTree *t = blob_tube(line, N, OVERLAP, 10, 1.2);
    struct timespec a, b;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
    TriangleMesh *m = isosurface_of_tree(t, 0.25);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
    assert_non_null(m);
    print_message("500 nodes of 10 blobs at 0.25 mm: %.2f s, %d vertices, %d triangles\n",
                  (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec), m->vertex_count, m->triangle_count);
    triangle_mesh_free(m);
    vessel_tree_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(table),
        cmocka_unit_test(sphere_converges),
        cmocka_unit_test(random_models_are_closed),
        cmocka_unit_test(tree_joins_without_gap),
        cmocka_unit_test(what_cannot_be_meshed),
        cmocka_unit_test(cost),
    };
    return cmocka_run_group_tests_name("isosurface", tests, NULL, NULL);
}
