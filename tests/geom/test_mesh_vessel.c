// A mesh as a vessel, compared with brute force (closest point by Voronoi regions, inside by the winding number) and with exact shapes.
#include "geom/mesh_vessel.h"

#include "base/simd.h"
#include "geom/triangle_groups.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "near.h"
#include "small_meshes.h"

static Faults faults;
static const char *const search_name[] = {"full", "warm", "cached"};
enum { SEARCHES = 3 };

static void need_embree(void)
{
    if (mesh_vessel_available())
        return;
    print_message("skipped: built without Embree\n");
    skip();
}

static Vessel *vessel_of(const TriangleMesh *mesh, MeshSearch search, MeshNormals normals)
{
    MeshVesselOptions options = mesh_vessel_default_options();
    options.search = search;
    options.normals = normals;
    faults_clear(&faults);
    Vessel *v = mesh_vessel_create(mesh, &options, "test", &faults);
    if (!v)
        fail_msg("%s", faults.text[0]);
    return v;
}

typedef struct Vessels {     // the same mesh by every search
    TriangleMesh mesh;
    Vessel *by[SEARCHES];
} Vessels;

static Vessels vessels_of(TriangleMesh mesh, MeshNormals normals)
{
    Vessels v = {.mesh = mesh};
    for (int k = 0; k < SEARCHES; k++)
        v.by[k] = vessel_of(&mesh, (MeshSearch)k, normals);
    return v;
}

static void vessels_free(Vessels *v)
{
    for (int k = 0; k < SEARCHES; k++)
        v->by[k]->destroy(v->by[k]);
    mesh_clear(&v->mesh);
}

static VesselHit ask(const Vessel *v, Vec3 x, VesselMemory *memory)
{
    VesselHit hit;
    vessel_query(v, 1, &x, HUGE_VAL, memory, &hit);
    return hit;
}

static VesselHit ask_afresh(const Vessel *v, Vec3 x)
{
    VesselMemory memory = {.node = -1};
    return ask(v, x, &memory);
}

// --- Brute force ---

// Closest point by the triangle's Voronoi regions (Ericson 2005, 5.1.5), a different method from the vessel's.
static double triangle_distance2(Vec3 p, Vec3 a, Vec3 b, Vec3 c)
{
    Vec3 ab = vec3_sub(b, a), ac = vec3_sub(c, a), ap = vec3_sub(p, a), bp = vec3_sub(p, b), cp = vec3_sub(p, c);
    double d1 = vec3_dot(ab, ap), d2 = vec3_dot(ac, ap), d3 = vec3_dot(ab, bp), d4 = vec3_dot(ac, bp), d5 = vec3_dot(ab, cp), d6 = vec3_dot(ac, cp);
    if (d1 <= 0 && d2 <= 0)
        return vec3_norm2(ap);
    if (d3 >= 0 && d4 <= d3)
        return vec3_norm2(bp);
    if (d6 >= 0 && d5 <= d6)
        return vec3_norm2(cp);
    double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0)
        return vec3_norm2(vec3_add_scaled(ap, -d1 / (d1 - d3), ab));
    if (vb <= 0 && d2 >= 0 && d6 <= 0)
        return vec3_norm2(vec3_add_scaled(ap, -d2 / (d2 - d6), ac));
    if (va <= 0 && d4 >= d3 && d5 >= d6)
        return vec3_norm2(vec3_add_scaled(bp, -(d4 - d3) / ((d4 - d3) + (d5 - d6)), vec3_sub(c, b)));
    double sum = va + vb + vc;
    return vec3_norm2(vec3_add_scaled(vec3_add_scaled(ap, -vb / sum, ab), -vc / sum, ac));
}

// Signed by the winding number.
static double true_gap(const TriangleMesh *m, Vec3 x)
{
    double least = HUGE_VAL, angle = 0;
    for (int t = 0; t < m->triangle_count; t++) {
        Vec3 a = m->vertex[m->triangle[t][0]], b = m->vertex[m->triangle[t][1]], c = m->vertex[m->triangle[t][2]];
        least = fmin(least, triangle_distance2(x, a, b, c));
        a = vec3_sub(a, x), b = vec3_sub(b, x), c = vec3_sub(c, x);
        double la = vec3_norm(a), lb = vec3_norm(b), lc = vec3_norm(c);
        angle += 2 * atan2(vec3_dot(a, vec3_cross(b, c)), la * lb * lc + vec3_dot(a, b) * lc + vec3_dot(b, c) * la + vec3_dot(c, a) * lb);
    }
    return angle > 2 * PI ? sqrt(least) : -sqrt(least);
}

enum { SHAPES = 8 };
static const char *const shape_name[SHAPES] = {
    "sphere", "crumpled sphere", "torus", "thin triangles", "two spheres that nearly touch", "crumpled, far from the origin", "two of 0.05 mm, 1000 mm apart",
    "slivers"};

static TriangleMesh shape_mesh(int shape)
{
    TriangleMesh m = shape == 2 ? torus_mesh(2, 0.5, 40, 16) : shape == 3 ? torus_mesh(1.5, 0.6, 6, 300) : sphere_mesh(12);
    if (shape == 1 || shape == 5)
        mesh_crumple(&m, 0.12, 3);
    if (shape == 4)
        m = mesh_and(m, sphere_mesh(12), vec3(2.01, 0, 0), false);
    if (shape == 6) {    // coordinates of about 500 mm: floats there are 3e-5 mm apart
        TriangleMesh other = sphere_mesh(12);
        mesh_crumple(&m, 0.12, 3);
        mesh_crumple(&other, 0.12, 4);
        for (int v = 0; v < m.vertex_count; v++) {
            m.vertex[v] = vec3_scale(m.vertex[v], 0.05);
            other.vertex[v] = vec3_scale(other.vertex[v], 0.05);
        }
        m = mesh_and(m, other, vec3(1000, 700, 300), false);
    }
    if (shape == 7)      // every tenth triangle is nearly degenerate: 1e-10 mm high
        for (int t = 0; t < m.triangle_count; t += 10) {
            const int *c = m.triangle[t];
            m.vertex[c[2]] = vec3_add_scaled(vec3_mix(m.vertex[c[0]], m.vertex[c[1]], 0.4), 1e-10, vec3_sub(m.vertex[c[2]], m.vertex[c[0]]));
        }
    if (shape == 5)
        mesh_move(&m, quat_from_rotation_vector(vec3(0.3, 1.1, -0.4)), vec3(500, -310, 220), false);
    return m;
}

static Vec3 middle_of(const TriangleMesh *m)
{
    Vec3 low = m->vertex[0], high = low;
    for (int v = 0; v < m->vertex_count; v++) {
        Vec3 p = m->vertex[v];
        low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    return vec3_mix(low, high, 0.5);
}

static bool same_hit(const VesselHit *a, const VesselHit *b)
{
    return a->gap == b->gap && a->node == b->node && a->flags == b->flags && memcmp(&a->normal, &b->normal, sizeof a->normal) == 0 &&
           memcmp(&a->hessian, &b->hessian, sizeof a->hessian) == 0;
}

static void agrees_with_brute_force(void **state)
{
    (void)state;
    need_embree();
    for (int shape = 0; shape < SHAPES; shape++) {
        Vessels v = vessels_of(shape_mesh(shape), MESH_FACES);
        const TriangleMesh *m = &v.mesh;
        Vec3 middle = middle_of(m);
        uint64_t seed = 17;
        double worst = 0;
        for (int i = 0; i < 400; i++) {
            // half of the points near the wall: beside a random place of a random triangle
            Vec3 x = vec3_add(middle, random_in_box(&seed, 2.6));
            if (i % 2) {
                const int *c = m->triangle[(int)random_in(&seed, 0, m->triangle_count)];
                x = vec3_mix(vec3_mix(m->vertex[c[0]], m->vertex[c[1]], random_in(&seed, 0, 1)), m->vertex[c[2]], random_in(&seed, 0, 1));
                x = vec3_add(x, vec3_scale(random_unit_vector(&seed), pow(10, random_in(&seed, -6, -0.5))));
            }
            double exact = true_gap(m, x);
            VesselHit full = ask_afresh(v.by[0], x);
            worst = fmax(worst, fabs(full.gap - exact));
            for (int k = 1; k < SEARCHES; k++) {
                VesselHit hit = ask_afresh(v.by[k], x);
                assert_true(same_hit(&full, &hit));
            }
            assert_near(vec3_norm(full.normal), 1, 1e-12);
        }
        print_message("%-32s %5d triangles: gap within %.1e mm of brute force\n", shape_name[shape], m->triangle_count, worst);
        // coordinates of 500 and 1000 mm are known to 6e-14 and 1e-13 mm
        assert_true(worst < (shape == 5 || shape == 6 ? 1e-12 : 1e-13));
        vessels_free(&v);
    }
}

// Steps of all sizes with memory, and jumps: bit-identical to results without memory.
static void memory_changes_nothing(void **state)
{
    (void)state;
    need_embree();
    for (int shape = 0; shape < SHAPES; shape++) {
        Vessels v = vessels_of(shape_mesh(shape), MESH_SMOOTH);
        Vec3 middle = middle_of(&v.mesh);
        uint64_t seed = 5;
        for (int walk = 0; walk < 20; walk++) {
            VesselMemory memory[SEARCHES] = {{.node = -1}, {.node = -1}, {.node = -1}};
            Vec3 x = vec3_add(middle, random_in_box(&seed, 1.5));
            double step = pow(10, random_in(&seed, -3, -0.5));
            for (int i = 0; i < 200; i++) {
                x = i % 50 == 49 ? vec3_add(middle, random_in_box(&seed, 3)) : vec3_add(x, vec3_scale(random_unit_vector(&seed), step));
                VesselHit full = ask(v.by[0], x, &memory[0]);
                for (int k = 1; k < SEARCHES; k++) {
                    VesselHit hit = ask(v.by[k], x, &memory[k]);
                    assert_true(same_hit(&full, &hit));
                    assert_int_equal(memory[k].node, full.node);
                    assert_int_equal(v.by[k]->locate(v.by[k], x, memory[k].node), full.node);
                }
                assert_int_equal(v.by[1]->locate(v.by[1], x, -1), full.node);
            }
        }
        vessels_free(&v);
    }
}

// Beyond reach a bound may replace the gap, but only inside, and it must be a valid bound.
static void far_points_are_bounded(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = shape_mesh(1);
    Vessel *full = vessel_of(&m, MESH_SEARCH_FULL, MESH_FACES);
    for (int k = 1; k < SEARCHES; k++) {
        Vessel *v = vessel_of(&m, (MeshSearch)k, MESH_FACES);
        uint64_t seed = 9;
        int passed_over = 0;
        VesselMemory memory = {.node = -1};
        Vec3 x = {0, 0, 0};
        for (int i = 0; i < 3000; i++) {
            Vec3 next = vec3_add(x, vec3_scale(random_unit_vector(&seed), 0.05));
            x = i % 30 == 29 ? random_in_box(&seed, 1.5) : vec3_norm(next) < 1.3 ? next : vec3(0, 0, 0);     // jumps out of the mesh, too
            double reach = 0.2;
            VesselHit hit, exact = ask_afresh(full, x);
            vessel_query(v, 1, &x, reach, &memory, &hit);
            if (!(hit.flags & VESSEL_FAR)) {
                assert_true(same_hit(&hit, &exact));
                continue;
            }
            passed_over++;
            assert_true(hit.gap > reach && hit.gap <= exact.gap);
            assert_true(vec3_norm(hit.normal) == 0);
        }
        print_message("%s: %d of 3000 points are answered by a bound\n", search_name[k], passed_over);
        assert_true(passed_over > 300);
        v->destroy(v);
    }
    full->destroy(full);
    mesh_clear(&m);
}

// --- Edges and corners ---

// An L-shaped room: five convex vertical edges of the solid and one that protrudes into the lumen.
static const Vec3 room_corner[6] = {{1, 1, 0}, {0, 1, 0}, {0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}};
static TriangleMesh room_mesh(void)
{
    // star-shaped about its first corner: the notch at (1, 1)
    return prism_mesh(room_corner, 6, 1);
}

// Blunt and sharp edges that protrude out of the lumen and into it, and a tip at which one side has far more triangles than the others.
static TriangleMesh edged_mesh(int kind)
{
    static const Vec3 blade[3] = {{0, 0, 0}, {1.5, -0.06, 0}, {1.5, 0.06, 0}};
    static const Vec3 box[4] = {{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}};
    TriangleMesh m = kind % 3 == 0 ? room_mesh() : kind % 3 == 1 ? prism_mesh(blade, 3, 1) : spike_mesh(40);
    return kind < 3 ? m : mesh_and(prism_mesh(box, 4, 6), m, vec3(0, 0, 2), true);
}

static void sign_is_right_at_edges_and_corners(void **state)
{
    (void)state;
    need_embree();
    for (int kind = 0; kind < 6; kind++) {
        TriangleMesh m = edged_mesh(kind);
        Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES);
        uint64_t seed = 4;
        int inside = 0, asked = 0;
        for (int t = 0; t < m.triangle_count; t++)
            for (int i = 0; i < 60; i++) {
                // about a corner, and about the middle of an edge
                Vec3 at = m.vertex[m.triangle[t][i % 3]], x;
                if (i % 2)
                    at = vec3_mix(at, m.vertex[m.triangle[t][(i + 1) % 3]], 0.5);
                x = vec3_add(at, vec3_scale(random_unit_vector(&seed), pow(10, random_in(&seed, -5, -0.7))));
                double gap = true_gap(&m, x);
                assert_near(ask_afresh(v, x).gap, gap, 1e-14);
                inside += gap > 0;
                asked++;
            }
        assert_true(inside > asked / 50 && inside < asked * 49 / 50);
        v->destroy(v);
        mesh_clear(&m);
    }
}

static Sym3 hessian_by_differences(const Vessel *v, Vec3 x, double h)
{
    Vec3 axis[3] = {{h, 0, 0}, {0, h, 0}, {0, 0, h}};
    double d[3][3], middle = ask_afresh(v, x).gap;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            if (i == k) {
                d[i][i] = ask_afresh(v, vec3_add(x, axis[i])).gap - 2 * middle + ask_afresh(v, vec3_sub(x, axis[i])).gap;
                continue;
            }
            double pp = ask_afresh(v, vec3_add(vec3_add(x, axis[i]), axis[k])).gap, pm = ask_afresh(v, vec3_sub(vec3_add(x, axis[i]), axis[k])).gap;
            double mp = ask_afresh(v, vec3_add(vec3_sub(x, axis[i]), axis[k])).gap, mm = ask_afresh(v, vec3_sub(vec3_sub(x, axis[i]), axis[k])).gap;
            d[i][k] = (pp - pm - mp + mm) / 4;
        }
    return (Sym3){d[0][0] / (h * h), d[0][1] / (h * h), d[0][2] / (h * h), d[1][1] / (h * h), d[1][2] / (h * h), d[2][2] / (h * h)};
}

static void near_hessian(const Sym3 *a, const Sym3 *b, double tolerance)
{
    assert_near(a->xx, b->xx, tolerance);
    assert_near(a->xy, b->xy, tolerance);
    assert_near(a->xz, b->xz, tolerance);
    assert_near(a->yy, b->yy, tolerance);
    assert_near(a->yz, b->yz, tolerance);
    assert_near(a->zz, b->zz, tolerance);
}

// Normal and Hessian are the gap's derivatives over faces, edges and corners, inside and outside.
static void derivatives_are_the_gaps(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = room_mesh();
    Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES);
    const Vec3 place[] = {{1.2, 0.1, 0.5}, {1.15, 0.8, 0.4}, {-0.1, -0.2, 0.3}, {2.2, 2.1, 1.3}, {1.9, 1.4, 0.45}, {0.4, -0.3, -0.2}, {0.9, 1.2, 0.7}};
    for (size_t i = 0; i < sizeof place / sizeof *place; i++) {
        double h = 1e-4;
        VesselHit hit = ask_afresh(v, place[i]);
        Vec3 slope = {ask_afresh(v, vec3_add(place[i], vec3(h, 0, 0))).gap - ask_afresh(v, vec3_sub(place[i], vec3(h, 0, 0))).gap,
                      ask_afresh(v, vec3_add(place[i], vec3(0, h, 0))).gap - ask_afresh(v, vec3_sub(place[i], vec3(0, h, 0))).gap,
                      ask_afresh(v, vec3_add(place[i], vec3(0, 0, h))).gap - ask_afresh(v, vec3_sub(place[i], vec3(0, 0, h))).gap};
        // differences over 1e-4 mm at about 0.2 mm from the edge: relative error (h / d)^2 = 2.5e-7
        assert_near(vec3_distance(vec3_scale(slope, 0.5 / h), hit.normal), 0, 1e-6);
        Sym3 differences = hessian_by_differences(v, place[i], h);
        near_hessian(&hit.hessian, &differences, 1e-4);
    }
    // at the edge that protrudes into the lumen the wall acts as a cylinder
    VesselHit notch = ask_afresh(v, place[1]);
    assert_near(sym3_trace(&notch.hessian), 1 / notch.gap, 1e-9);
    assert_true(notch.gap > 0);
    v->destroy(v);
    mesh_clear(&m);
}

// --- Exact shapes ---

typedef struct Errors {
    double gap, facet, smooth, hessian;
} Errors;

// Exact results inside a ball (kind 0), a torus of 2 and 0.5 (1), and a tube of 0.5 along x (2).
static VesselHit exact_hit(int kind, Vec3 x)
{
    double axis_radius = 2;
    Vec3 round = vec3_unit(vec3(x.x, x.y, 0)), foot = kind == 0 ? vec3(0, 0, 0) : kind == 1 ? vec3_scale(round, axis_radius) : vec3(x.x, 0, 0);
    Vec3 away = vec3_sub(x, foot), along = kind == 1 ? vec3_cross(vec3(0, 0, 1), round) : vec3(1, 0, 0);
    double d = vec3_norm(away), rho = hypot(x.x, x.y);
    VesselHit hit = {.gap = (kind == 0 ? 1 : 0.5) - d, .normal = vec3_scale(away, -1 / d)};
    Vec3 other = vec3_cross(hit.normal, along);
    double k1 = -1 / d, k2 = kind == 1 ? -(rho - axis_radius) / (rho * d) : 0;
    if (kind == 0) {     // equal principal curvatures: any two directions across the normal
        along = vec3_normal_to(hit.normal);
        other = vec3_cross(hit.normal, along);
        k2 = k1;
    }
    Vec3 a = vec3_scale(other, k1), b = vec3_scale(along, k2);
    hit.hessian = (Sym3){a.x * other.x + b.x * along.x, a.x * other.y + b.x * along.y, a.x * other.z + b.x * along.z,
                         a.y * other.y + b.y * along.y, a.y * other.z + b.y * along.z, a.z * other.z + b.z * along.z};
    return hit;
}

static Vec3 random_inside(int kind, uint64_t *seed)
{
    double off = random_in(seed, 0.05, 0.2), a = random_in(seed, 0, 2 * PI), b = random_in(seed, 0, 2 * PI);
    if (kind == 0)
        return vec3_scale(random_unit_vector(seed), 1 - off);
    double r = 0.5 - off;
    if (kind == 1)
        return vec3((2 + r * cos(b)) * cos(a), (2 + r * cos(b)) * sin(a), r * sin(b));
    return vec3(random_in(seed, 0.5, 3.5), r * cos(b), r * sin(b));
}

static Errors mean_errors(int kind, int fineness)
{
    TriangleMesh m = kind == 0   ? sphere_mesh(fineness)
                     : kind == 1 ? torus_mesh(2, 0.5, 4 * fineness, fineness)
                                 : bent_tube_mesh(0.5, 0, 4, 1, 0, 0, 3.0 / fineness, fineness);
    Vessel *facets = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES), *smooth = vessel_of(&m, MESH_SEARCH_CACHED, MESH_SMOOTH);
    Errors e = {0};
    uint64_t seed = 11;
    int count = 2000;
    for (int i = 0; i < count; i++) {
        Vec3 x = random_inside(kind, &seed);
        VesselHit exact = exact_hit(kind, x), f = ask_afresh(facets, x), s = ask_afresh(smooth, x);
        assert_true(f.gap == s.gap);
        e.gap += fabs(f.gap - exact.gap) / count;
        e.facet += vec3_distance(f.normal, exact.normal) / count;
        e.smooth += vec3_distance(s.normal, exact.normal) / count;
        const double *a = &s.hessian.xx, *b = &exact.hessian.xx;
        for (int k = 0; k < 6; k++)
            e.hessian += fabs(a[k] - b[k]) / (6 * count);
    }
    facets->destroy(facets);
    smooth->destroy(smooth);
    mesh_clear(&m);
    return e;
}

static void converges_to_exact_shapes(void **state)
{
    (void)state;
    need_embree();
    static const char *const name[3] = {"sphere", "torus", "tube"};
    for (int kind = 0; kind < 3; kind++) {
        Errors coarse = mean_errors(kind, 12), fine = mean_errors(kind, 48);
        // orders over two halvings of the edges
        double gap = log2(coarse.gap / fine.gap) / 2, facet = log2(coarse.facet / fine.facet) / 2, smooth = log2(coarse.smooth / fine.smooth) / 2,
               hessian = log2(coarse.hessian / fine.hessian) / 2;
        print_message("%-6s gap %.1e mm, order %.2f; face normal %.1e, order %.2f; smooth normal %.1e, order %.2f; its Hessian %.1e, order %.2f\n", name[kind],
                      fine.gap, gap, fine.facet, facet, fine.smooth, smooth, fine.hessian, hessian);
        assert_true(gap > 1.8 && gap < 2.2);
        assert_true(facet > 0.85 && facet < 1.15);
        assert_true(smooth > 1.8);
        assert_true(hessian > 0.85);
    }
}

static void moves_with_the_mesh(void **state)
{
    (void)state;
    need_embree();
    Quat q = quat_from_rotation_vector(vec3(0.7, -1.3, 0.4));
    for (int way = 0; way < 3; way++) {
        Vec3 by = way == 1 ? vec3(480, -20, 115) : vec3(0, 0, 0);
        Quat turn = way == 2 ? quat_identity() : q;
        for (int normals = MESH_FACES; normals <= MESH_SMOOTH; normals++) {
            TriangleMesh m = shape_mesh(1), moved = shape_mesh(1);
            mesh_move(&moved, turn, by, way == 2);
            Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, (MeshNormals)normals), *w = vessel_of(&moved, MESH_SEARCH_CACHED, (MeshNormals)normals);
            uint64_t seed = 21;
            for (int i = 0; i < 300; i++) {
                Vec3 x = random_in_box(&seed, 1.2), y = x;
                if (way == 2)
                    y.x = -y.x;
                y = vec3_add(quat_rotate(turn, y), by);
                VesselHit a = ask_afresh(v, x), b = ask_afresh(w, y);
                if (way == 2)
                    a.normal.x = -a.normal.x;
                // 500 mm away a coordinate is rounded by 6e-14; normals over edges and corners by that over the gap
                assert_near(a.gap, b.gap, 1e-12);
                assert_near(vec3_distance(quat_rotate(turn, a.normal), b.normal), 0, 1e-12 + 1e-12 / fabs(a.gap));
                // on the line between two faces, rounding may select either one
                assert_near(sym3_trace(&a.hessian), sym3_trace(&b.hessian), 1e-9 * fmax(1, fabs(sym3_trace(&a.hessian))));
            }
            v->destroy(v);
            w->destroy(w);
            mesh_clear(&m);
            mesh_clear(&moved);
        }
    }
}

// --- Open ends, bad points ---

static void beyond_a_rim_there_is_no_wall(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = bent_tube_mesh(0.5, 0, 4, 1, 0, 0, 0.1, 24);
    for (int k = 0; k < SEARCHES; k++) {
        Vessel *v = vessel_of(&m, (MeshSearch)k, MESH_FACES);
        uint64_t seed = 2;
        VesselMemory memory = {.node = -1};
        for (int i = 0; i < 1000; i++) {
            double s = random_in(&seed, -0.8, 4.8), r = random_in(&seed, 0, 0.45), a = random_in(&seed, 0, 2 * PI);
            VesselHit hit = ask(v, vec3(s, r * cos(a), r * sin(a)), &memory);
            if (s > 0 && s < 4) {
                assert_true(hit.flags == 0 && hit.gap > 0 && hit.gap <= 0.5 - r);
            } else {
                assert_int_equal(hit.flags, VESSEL_OPEN_END);
                assert_true(hit.gap == HUGE_VAL && vec3_norm(hit.normal) == 0);
            }
        }
        v->destroy(v);
    }
    mesh_clear(&m);
}

// A long thin vessel that begins at a wide mouth: the cone from its rim to the far one contains more than the vessel. The mesh nevertheless faces outwards.
static void a_funnel_is_no_inside_out(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = mesh_room(4 * 16, 6 * 16);
    const double x[4] = {0, 3, 6, 200}, radius[4] = {12, 12, 0.5, 0.5};
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 16; i++)
            mesh_vertex(&m, vec3(x[j], radius[j] * cos(PI * i / 8), radius[j] * sin(PI * i / 8)), vec3(0, cos(PI * i / 8), sin(PI * i / 8)));
        if (j > 0)
            mesh_join_rings(&m, 16 * (j - 1), 16 * j, 16);
    }
    Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES);
    assert_near(ask_afresh(v, vec3(100, 0, 0)).gap, 0.5 * cos(PI / 16), 1e-12);
    v->destroy(v);
    mesh_clear(&m);
}

static void points_that_are_none(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = shape_mesh(0);
    for (int k = 0; k < SEARCHES; k++) {
        Vessel *v = vessel_of(&m, (MeshSearch)k, MESH_FACES);
        VesselMemory memory = {.node = -1};
        const Vec3 bad[] = {{NAN, 0, 0}, {0, HUGE_VAL, 0}, {0, 0, -HUGE_VAL}, {1e300, 0, 0}};
        ask(v, vec3(0.3, 0.2, 0.1), &memory);
        int node = memory.node;
        for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
            VesselHit hit = ask(v, bad[i], &memory), fresh = ask_afresh(v, bad[i]);
            assert_int_equal(hit.flags, VESSEL_UNSURE);
            assert_int_equal(fresh.flags, VESSEL_UNSURE);
            assert_int_equal(memory.node, node);
            assert_int_equal(v->locate(v, bad[i], node), node);
            assert_int_equal(v->locate(v, bad[i], -1), 0);
        }
        VesselHit hit = ask(v, vec3(0.3, 0.2, 0.1), &memory), fresh = ask_afresh(v, vec3(0.3, 0.2, 0.1));
        assert_true(same_hit(&hit, &fresh));
        // far off, but a point
        hit = ask(v, vec3(1e7, 0, 0), &memory);
        assert_near(hit.gap, 1 - 1e7, 1e-8);
        // memory of another vessel
        VesselMemory foreign = {.node = 1 << 30};
        hit = ask(v, vec3(0.3, 0.2, 0.1), &foreign);
        assert_true(same_hit(&hit, &fresh));
        v->destroy(v);
    }
    mesh_clear(&m);
}

// On the mesh itself: gap 0, and the face's own normal.
static void points_on_the_mesh(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = shape_mesh(1);
    Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES);
    for (int i = 0; i < m.vertex_count; i++) {
        VesselHit hit = ask_afresh(v, m.vertex[i]);
        assert_near(hit.gap, 0, 1e-15);
        assert_near(vec3_norm(hit.normal), 1, 1e-12);
        assert_true(vec3_dot(hit.normal, m.vertex[i]) < 0 && isfinite(sym3_trace(&hit.hessian)));
    }
    for (int t = 0; t < m.triangle_count; t++) {
        Vec3 a = m.vertex[m.triangle[t][0]], b = m.vertex[m.triangle[t][1]], c = m.vertex[m.triangle[t][2]];
        Vec3 inwards = vec3_unit(vec3_cross(vec3_sub(c, a), vec3_sub(b, a)));
        VesselHit hit = ask_afresh(v, vec3_scale(vec3_add(vec3_add(a, b), c), 1.0 / 3));
        assert_int_equal(hit.node, t);
        assert_near(hit.gap, 0, 1e-15);
        assert_near(vec3_distance(hit.normal, inwards), 0, 1e-12);
    }
    v->destroy(v);
    mesh_clear(&m);
}

// --- Sizes, instruction sets, threads ---

static void says_what_it_holds(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh small = sphere_mesh(8), large = sphere_mesh(24);
    for (int k = 0; k < SEARCHES; k++) {
        Vessel *a = vessel_of(&small, (MeshSearch)k, MESH_FACES), *b = vessel_of(&large, (MeshSearch)k, MESH_FACES);
        print_message("%s: %lld triangles, %.0f bytes each\n", search_name[k], (long long)b->primitives, (double)b->bytes / (double)b->primitives);
        assert_true(a->primitives == 8 * 8 * 8 && b->primitives == 8 * 24 * 24);
        // vertices, normals and neighbours alone need 100 bytes
        assert_true(b->bytes > 100 * (size_t)b->primitives && b->bytes > 5 * a->bytes);
        Vec3 point, direction;
        assert_false(a->inlet(a, &point, &direction));
        a->destroy(a);
        b->destroy(b);
    }
    MeshVesselOptions options = mesh_vessel_default_options();
    options.has_inlet = true;
    options.inlet = vec3(0.5, 0, 0);
    options.direction = vec3(0, 1, 0);
    Vessel *v = mesh_vessel_create(&small, &options, "test", &faults);
    Vec3 point, direction;
    assert_true(v->inlet(v, &point, &direction));
    assert_true(point.x == 0.5 && direction.y == 1);
    v->destroy(v);
    mesh_clear(&small);
    mesh_clear(&large);
}

static void every_instruction_set_gives_the_same_bits(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = shape_mesh(1);
    uint64_t seed = 31;
    enum { POINTS = 500 };
    static Vec3 x[POINTS];
    static VesselHit first[POINTS];
    for (int i = 0; i < POINTS; i++)
        x[i] = random_in_box(&seed, 1.3);
    for (int isa = SIMD_SSE2; isa <= (int)simd_widest(); isa++) {
        simd_force((SimdLevel)isa);
        Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES);
        VesselMemory memory = {.node = -1};
        for (int i = 0; i < POINTS; i++) {
            VesselHit hit = ask(v, x[i], &memory);
            if (isa == SIMD_SSE2)
                first[i] = hit;
            assert_true(same_hit(&hit, &first[i]));
        }
        v->destroy(v);
    }
    simd_force(simd_widest());
    mesh_clear(&m);
}

typedef struct Job {
    const Vessel *vessel;
    uint64_t seed, hash;
} Job;

static void *walk_about(void *data)
{
    Job *job = data;
    uint64_t seed = job->seed;
    VesselMemory memory = {.node = -1};
    Vec3 x = {0, 0, 0};
    job->hash = 0;
    for (int i = 0; i < 5000; i++) {
        Vec3 next = vec3_add(x, vec3_scale(random_unit_vector(&seed), 0.05));
        x = vec3_norm(next) < 1.3 ? next : vec3(0, 0, 0);
        VesselHit hit = ask(job->vessel, x, &memory);
        uint64_t bits;
        memcpy(&bits, &hit.gap, sizeof bits);
        job->hash = (job->hash ^ bits ^ (uint64_t)hit.node) * UINT64_C(0x100000001b3);
    }
    return NULL;
}

static void threads_do_not_disturb_each_other(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh m = shape_mesh(1);
    Vessel *v = vessel_of(&m, MESH_SEARCH_CACHED, MESH_FACES);
    enum { THREADS = 4 };
    pthread_t thread[THREADS];
    Job job[THREADS], alone[THREADS];
    for (int i = 0; i < THREADS; i++)
        alone[i] = job[i] = (Job){v, 100 + (uint64_t)i, 0};
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pthread_create(&thread[i], NULL, walk_about, &job[i]), 0);
    for (int i = 0; i < THREADS; i++) {
        pthread_join(thread[i], NULL);
        walk_about(&alone[i]);
        assert_true(alone[i].hash == job[i].hash);
    }
    assert_true(job[0].hash != job[1].hash);
    v->destroy(v);
    mesh_clear(&m);
}

// --- Rejected meshes ---

static void refused(const TriangleMesh *m, const char *because)
{
    MeshVesselOptions options = mesh_vessel_default_options();
    faults_clear(&faults);
    assert_null(mesh_vessel_create(m, &options, "wall.stl", &faults));
    assert_true(faults.count > 0);
    if (!strstr(faults.text[0], because) || !strstr(faults.text[0], "wall.stl") || !strstr(faults.text[0], "expected"))
        fail_msg("%s: expected \"%s\"", faults.text[0], because);
}

static void bad_meshes_are_refused(void **state)
{
    (void)state;
    need_embree();
    TriangleMesh none = {0}, m = sphere_mesh(3);
    refused(&none, "no triangle");
    int *t = m.triangle[10], kept[3];
    memcpy(kept, t, sizeof kept);
    t[1] = m.vertex_count;
    refused(&m, "triangle 10 of the mesh has vertex");
    t[1] = -1;
    refused(&m, "has vertex -1");
    t[1] = t[0];
    refused(&m, "no area");
    memcpy(t, kept, sizeof kept);
    t[1] = kept[2], t[2] = kept[1];
    refused(&m, "face opposite sides");
    memcpy(t, kept, sizeof kept);
    // three collinear vertices
    Vec3 place = m.vertex[t[2]];
    m.vertex[t[2]] = vec3_mix(m.vertex[t[0]], m.vertex[t[1]], 0.5);
    refused(&m, "no area");
    m.vertex[t[2]] = place;
    place = m.vertex[5];
    m.vertex[5].y = NAN;
    refused(&m, "vertex 5");
    m.vertex[5].y = -HUGE_VAL;
    refused(&m, "vertex 5");
    m.vertex[5] = place;
    // all of it inside out
    mesh_move(&m, quat_identity(), vec3(0, 0, 0), true);
    for (int v = 0; v < m.vertex_count; v++)
        m.vertex[v].x = -m.vertex[v].x;
    refused(&m, "faces into the lumen");
    mesh_clear(&m);
    // an open one, inside out
    TriangleMesh tube = bent_tube_mesh(0.5, 0, 4, 1, 0, 0, 0.1, 24);
    for (int i = 0; i < tube.triangle_count; i++) {
        int b = tube.triangle[i][1];
        tube.triangle[i][1] = tube.triangle[i][2], tube.triangle[i][2] = b;
    }
    refused(&tube, "faces into the lumen");
    mesh_clear(&tube);
    // a fin on an edge; a triangle twice
    for (int twice = 0; twice < 2; twice++) {
        TriangleMesh full = sphere_mesh(3), more = mesh_room(full.vertex_count + 1, full.triangle_count + 1);
        for (int v = 0; v < full.vertex_count; v++)
            mesh_vertex(&more, full.vertex[v], full.normal[v]);
        for (int i = 0; i < full.triangle_count; i++)
            mesh_triangle(&more, full.triangle[i][0], full.triangle[i][1], full.triangle[i][2]);
        const int *c = full.triangle[0];
        mesh_triangle(&more, c[0], c[1], twice ? c[2] : mesh_vertex(&more, vec3(2, 2, 2), vec3(1, 0, 0)));
        refused(&more, "three triangles or more");
        mesh_clear(&full);
        mesh_clear(&more);
    }
}

static void without_embree_is_a_fault(void **state)
{
    (void)state;
    if (mesh_vessel_available())
        skip();
    TriangleMesh m = sphere_mesh(3);
    MeshVesselOptions options = mesh_vessel_default_options();
    faults_clear(&faults);
    assert_null(mesh_vessel_create(&m, &options, "wall.stl", &faults));
    assert_int_equal(faults.count, 1);
    assert_non_null(strstr(faults.text[0], "built without Embree"));
    mesh_clear(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(agrees_with_brute_force),
                                       cmocka_unit_test(memory_changes_nothing),
                                       cmocka_unit_test(far_points_are_bounded),
                                       cmocka_unit_test(sign_is_right_at_edges_and_corners),
                                       cmocka_unit_test(derivatives_are_the_gaps),
                                       cmocka_unit_test(converges_to_exact_shapes),
                                       cmocka_unit_test(moves_with_the_mesh),
                                       cmocka_unit_test(beyond_a_rim_there_is_no_wall),
                                       cmocka_unit_test(a_funnel_is_no_inside_out),
                                       cmocka_unit_test(points_that_are_none),
                                       cmocka_unit_test(points_on_the_mesh),
                                       cmocka_unit_test(says_what_it_holds),
                                       cmocka_unit_test(every_instruction_set_gives_the_same_bits),
                                       cmocka_unit_test(threads_do_not_disturb_each_other),
                                       cmocka_unit_test(bad_meshes_are_refused),
                                       cmocka_unit_test(without_embree_is_a_fault)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
