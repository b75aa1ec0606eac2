// Triangle meshes for the tests: spheres, tori, boxes, swept tubes, and transformations.
#ifndef SELDINGER_TESTS_SMALL_MESHES_H
#define SELDINGER_TESTS_SMALL_MESHES_H

#include "geom/isosurface.h"
#include "random_numbers.h"

#include <stdlib.h>
#include <string.h>

// Appends without bounds checks: the capacity is enough for the tests.
static inline TriangleMesh mesh_room(int vertices, int triangles)
{
    TriangleMesh m = {.vertex = calloc((size_t)vertices, sizeof(Vec3)),
                      .normal = calloc((size_t)vertices, sizeof(Vec3)),
                      .triangle = calloc((size_t)triangles, sizeof *m.triangle)};
    return m;
}

static inline void mesh_clear(TriangleMesh *m)
{
    free(m->vertex);
    free(m->normal);
    free(m->triangle);
    *m = (TriangleMesh){0};
}

static inline int mesh_vertex(TriangleMesh *m, Vec3 place, Vec3 normal)
{
    m->vertex[m->vertex_count] = place;
    m->normal[m->vertex_count] = normal;
    return m->vertex_count++;
}

static inline void mesh_triangle(TriangleMesh *m, int a, int b, int c)
{
    int *t = m->triangle[m->triangle_count++];
    t[0] = a, t[1] = b, t[2] = c;
}

// Unit sphere: each face of an octahedron is divided into n^2 triangles by vertices on a lattice.
static inline TriangleMesh sphere_mesh(int n)
{
    TriangleMesh m = mesh_room(8 * (n + 1) * (n + 2) / 2, 8 * n * n);
    for (int face = 0; face < 8; face++) {
        Vec3 corner[3] = {{face & 1 ? -1 : 1, 0, 0}, {0, face & 2 ? -1 : 1, 0}, {0, 0, face & 4 ? -1 : 1}};
        bool turned = ((face & 1) ^ (face >> 1 & 1) ^ (face >> 2 & 1)) != 0;
        int *row = malloc((size_t)(n + 1) * (size_t)(n + 1) * sizeof *row);
        for (int i = 0; i <= n; i++)
            for (int k = 0; k <= n - i; k++) {
                Vec3 p = vec3_scale(corner[0], n - i - k);
                p = vec3_unit(vec3_add_scaled(vec3_add_scaled(p, i, corner[1]), k, corner[2]));
                int v = 0;
                while (v < m.vertex_count && vec3_distance(m.vertex[v], p) > 1e-9)
                    v++;
                row[i * (n + 1) + k] = v < m.vertex_count ? v : mesh_vertex(&m, p, p);
            }
        for (int i = 0; i < n; i++)
            for (int k = 0; k < n - i; k++) {
                int a = row[i * (n + 1) + k], b = row[(i + 1) * (n + 1) + k], c = row[i * (n + 1) + k + 1];
                mesh_triangle(&m, a, turned ? c : b, turned ? b : c);
                if (k + 1 < n - i) {
                    int d = row[(i + 1) * (n + 1) + k + 1];
                    mesh_triangle(&m, b, turned ? c : d, turned ? d : c);
                }
            }
        free(row);
    }
    return m;
}

// Appends `more`, moved by `by`, optionally inside out.
static inline TriangleMesh mesh_and(TriangleMesh m, TriangleMesh more, Vec3 by, bool inside_out)
{
    TriangleMesh all = mesh_room(m.vertex_count + more.vertex_count, m.triangle_count + more.triangle_count);
    for (int v = 0; v < m.vertex_count; v++)
        mesh_vertex(&all, m.vertex[v], m.normal[v]);
    for (int v = 0; v < more.vertex_count; v++)
        mesh_vertex(&all, vec3_add(more.vertex[v], by), inside_out ? vec3_negate(more.normal[v]) : more.normal[v]);
    for (int t = 0; t < m.triangle_count; t++)
        mesh_triangle(&all, m.triangle[t][0], m.triangle[t][1], m.triangle[t][2]);
    for (int t = 0; t < more.triangle_count; t++) {
        const int *c = more.triangle[t];
        mesh_triangle(&all, c[0] + m.vertex_count, c[inside_out ? 2 : 1] + m.vertex_count, c[inside_out ? 1 : 2] + m.vertex_count);
    }
    mesh_clear(&m);
    mesh_clear(&more);
    return all;
}

// A strip of rings: ring j holds `around` vertices from first + j * around, counter-clockwise seen against the direction from ring to ring.
static inline void mesh_join_rings(TriangleMesh *m, int first, int second, int around)
{
    for (int i = 0; i < around; i++) {
        int a = first + i, b = first + (i + 1) % around, c = second + i, d = second + (i + 1) % around;
        mesh_triangle(m, a, b, d);
        mesh_triangle(m, a, d, c);
    }
}

// About the z axis.
static inline TriangleMesh torus_mesh(double radius, double tube, int rings, int around)
{
    TriangleMesh m = mesh_room(rings * around, 2 * rings * around);
    for (int j = 0; j < rings; j++)
        for (int i = 0; i < around; i++) {
            double a = 2 * PI * j / rings, b = 2 * PI * i / around;
            Vec3 out = vec3(cos(b) * cos(a), cos(b) * sin(a), sin(b)), center = vec3(radius * cos(a), radius * sin(a), 0);
            mesh_vertex(&m, vec3_add_scaled(center, tube, out), out);
        }
    for (int j = 0; j < rings; j++)
        mesh_join_rings(&m, j * around, (j + 1) % rings * around, around);
    for (int t = 0; t < m.triangle_count; t++) {     // these rings have the opposite orientation
        int b = m.triangle[t][1];
        m.triangle[t][1] = m.triangle[t][2], m.triangle[t][2] = b;
    }
    return m;
}

// An open tube of `radius` along +x from `start` on, then an arc of `bend` towards +y by `angle`, then a line of `after`; rings about `step` apart.
static inline TriangleMesh bent_tube_mesh(double radius, double start, double straight, double bend, double angle, double after, double step, int around)
{
    double length = straight - start + bend * angle + after;
    int rings = (int)ceil(length / step) + 1;
    TriangleMesh m = mesh_room(rings * around, 2 * rings * around);
    for (int j = 0; j < rings; j++) {
        double s = start + length * j / (rings - 1), turn = fmin(fmax((s - straight) / bend, 0), angle), past = fmax(s - straight - bend * angle, 0);
        Vec3 t = vec3(cos(turn), sin(turn), 0), n = vec3(-sin(turn), cos(turn), 0);
        Vec3 center = vec3(fmin(s, straight) + bend * sin(turn), bend * (1 - cos(turn)), 0);
        center = vec3_add_scaled(center, past, t);
        for (int i = 0; i < around; i++) {
            double b = 2 * PI * i / around;
            Vec3 out = vec3_add(vec3_scale(n, cos(b)), vec3(0, 0, sin(b)));
            mesh_vertex(&m, vec3_add_scaled(center, radius, out), out);
        }
        if (j > 0)
            mesh_join_rings(&m, (j - 1) * around, j * around, around);
    }
    return m;
}

// The prism over a polygon in the x-y plane (counter-clockwise, star-shaped about its first corner) from z = 0 to `height`.
static inline TriangleMesh prism_mesh(const Vec3 *corner, int count, double height)
{
    TriangleMesh m = mesh_room(2 * count, 4 * count);
    for (int i = 0; i < count; i++) {
        mesh_vertex(&m, corner[i], vec3(0, 0, -1));
        mesh_vertex(&m, vec3_add(corner[i], vec3(0, 0, height)), vec3(0, 0, 1));
    }
    for (int i = 0; i < count; i++) {
        int a = 2 * i, b = 2 * ((i + 1) % count);
        mesh_triangle(&m, a, b, b + 1);
        mesh_triangle(&m, a, b + 1, a + 1);
        if (i > 0 && i + 1 < count) {
            mesh_triangle(&m, 0, b, a);
            mesh_triangle(&m, 1, a + 1, b + 1);
        }
    }
    return m;
}

// A pyramid over a square of 0.2 x 0.2, 1 high; one of its sides is divided into `fan` triangles at the tip.
static inline TriangleMesh spike_mesh(int fan)
{
    TriangleMesh m = mesh_room(fan + 5, fan + 3 + fan + 1);
    Vec3 base[4] = {{-0.1, -0.1, 0}, {-0.1, 0.1, 0}, {0.1, 0.1, 0}, {0.1, -0.1, 0}};
    int tip = mesh_vertex(&m, vec3(0, 0, 1), vec3(0, 0, 1)), corners[4], last;
    for (int i = 0; i < 4; i++)
        corners[i] = mesh_vertex(&m, base[i], vec3(0, 0, -1));
    for (int i = 0; i < 3; i++)
        mesh_triangle(&m, corners[i + 1], corners[i], tip);
    last = corners[3];
    for (int i = 1; i <= fan; i++) {
        int next = i == fan ? corners[0] : mesh_vertex(&m, vec3_mix(base[3], base[0], (double)i / fan), vec3(0, 0, -1));
        mesh_triangle(&m, next, last, tip);
        mesh_triangle(&m, last, next, corners[1]);
        last = next;
    }
    mesh_triangle(&m, corners[1], corners[2], corners[3]);
    return m;
}

// Rotates by q and moves; optionally first mirrors in x and reverses the triangles so that they still face outwards.
static inline void mesh_move(TriangleMesh *m, Quat q, Vec3 by, bool mirrored)
{
    for (int v = 0; v < m->vertex_count; v++) {
        Vec3 p = m->vertex[v], n = m->normal[v];
        if (mirrored)
            p.x = -p.x, n.x = -n.x;
        m->vertex[v] = vec3_add(quat_rotate(q, p), by);
        m->normal[v] = quat_rotate(q, n);
    }
    for (int t = 0; mirrored && t < m->triangle_count; t++) {
        int b = m->triangle[t][1];
        m->triangle[t][1] = m->triangle[t][2], m->triangle[t][2] = b;
    }
}

// Moves the vertices of a star-shaped mesh in and out along their rays by up to `part` of their distance, which gives edges and corners of all kinds.
static inline void mesh_crumple(TriangleMesh *m, double part, uint64_t seed)
{
    for (int v = 0; v < m->vertex_count; v++)
        m->vertex[v] = vec3_scale(m->vertex[v], 1 + random_in(&seed, -part, part));
}

#endif
