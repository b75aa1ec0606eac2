// The wall of a vessel as triangles: closed and facing outwards; area and volume of exact tubes by Pappus; orders of convergence; rims at open ends;
// refinement; no slivers; touching vessels and thin walls; thin beside wide vessels; rotated, mirrored and scaled shapes; fitted models; rejected input.
#include "base/disjoint_sets.h"
#include "blob_tube.h"
#include "geom/isosurface.h"
#include "geom/tree_surface.h"
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

// --- A tube with the balls that cover it ---

enum { BALLS_MAX = 400 };
typedef struct Tube {
    Vessel *vessel;
    int count;
    Vec3 center[BALLS_MAX];
    double reach[BALLS_MAX], length, radius;
    Vec3 start, direction, end, end_direction;
} Tube;

// Balls every `spacing` radii on the centreline, of `cover` radii.
static void cover_tube(Tube *tube, const TubeOptions *o, double spacing, double cover)
{
    Vec3 p = o->start, t = vec3_unit(o->direction), n = vec3_unit(vec3_add_scaled(o->normal, -vec3_dot(o->normal, t), t));
    tube->count = 0;
    tube->length = 0;
    for (int i = 0; i < o->piece_count; i++) {
        const TubePiece *piece = &o->piece[i];
        double length = piece->angle > 0 ? piece->arc_radius * piece->angle : piece->length, R = piece->arc_radius;
        int steps = (int)ceil(length / (spacing * o->radius));
        Vec3 from = p, along = t, across = n;
        for (int k = i > 0; k <= steps; k++) {
            double s = length * k / steps, angle = piece->angle > 0 ? s / R : 0;
            t = vec3_add_scaled(vec3_scale(along, cos(angle)), sin(angle), across);
            n = vec3_add_scaled(vec3_scale(across, cos(angle)), -sin(angle), along);
            p = piece->angle > 0 ? vec3_add_scaled(vec3_add_scaled(from, R * sin(angle), along), R * (1 - cos(angle)), across)
                                 : vec3_add_scaled(from, s, along);
            assert_true(tube->count < BALLS_MAX);
            tube->center[tube->count] = p;
            tube->reach[tube->count++] = cover * o->radius;
        }
        tube->length += length;
    }
    tube->end = p;
    tube->end_direction = t;
    tube->start = o->start;
    tube->direction = vec3_unit(o->direction);
    tube->radius = o->radius;
}

static Tube *make_tube(const TubeOptions *o)
{
    Faults faults = {0};
    Tube *tube = malloc(sizeof *tube);
    tube->vessel = tube_vessel_create(o, "test", &faults);
    assert_non_null(tube->vessel);
    cover_tube(tube, o, 0.3, 1.4);
    return tube;
}

static void free_tube(Tube *tube)
{
    tube->vessel->destroy(tube->vessel);
    free(tube);
}

static TriangleMesh *mesh_of(const Tube *tube, double cell)
{
    TriangleMesh *mesh = isosurface_of_vessel(tube->vessel, tube->count, tube->center, tube->reach, NULL, cell);
    assert_non_null(mesh);
    return mesh;
}

// A line, an arc and a line: J, in some direction.
static TubeOptions hook(TubePiece piece[3], Vec3 direction, Vec3 normal, bool closed, double scale)
{
    memcpy(piece, (TubePiece[3]){{3 * scale, 0, 0, 0}, {0, 3 * scale, 2, 0}, {2 * scale, 0, 0, 0}}, 3 * sizeof *piece);
    return (TubeOptions){.start = vec3_scale(vec3(0.11, -0.23, 0.37), scale),
                         .direction = direction,
                         .normal = normal,
                         .radius = scale,
                         .piece_count = 3,
                         .piece = piece,
                         .closed_ends = closed};
}

// --- Required properties of a mesh ---

static SurfaceCensus census_of(const TriangleMesh *mesh)
{
    SurfaceCensus c;
    assert_true(surface_census(mesh, &c));
    assert_int_equal(c.non_manifold_edges, 0);
    assert_int_equal(c.turned_edges, 0);
    assert_int_equal(c.vertices, mesh->vertex_count);   // none without a triangle
    return c;
}

static void check_closed(const TriangleMesh *mesh, int parts)
{
    SurfaceCensus c = census_of(mesh);
    assert_int_equal(c.open_edges, 0);
    assert_int_equal(c.parts, parts);
    assert_int_equal(c.euler, 2 * parts);
    assert_true(c.volume > 0);
}

static VesselHit ask(const Vessel *vessel, Vec3 x, int from)
{
    VesselMemory memory = {.node = vessel->locate(vessel, x, from)};
    VesselHit hit;
    vessel_query(vessel, 1, &x, 1e6, &memory, &hit);
    return hit;
}

// Checks that all vertices are within `most` of the wall; returns the number of those not within 1e-9 mm.
static int count_off(const TriangleMesh *mesh, const Vessel *vessel, double most)
{
    int off = 0;
    for (int v = 0; v < mesh->vertex_count; v++) {
        VesselHit hit = ask(vessel, mesh->vertex[v], mesh->node[v]);
        assert_int_equal(hit.flags & (VESSEL_FAR | VESSEL_OPEN_END | VESSEL_UNSURE), 0);
        assert_near(hit.gap, 0, most);
        assert_true(vec3_distance(mesh->normal[v], vec3_negate(hit.normal)) < 1e-9);
        off += fabs(hit.gap) > 1e-9;
    }
    return off;
}

static void check_vertices(const TriangleMesh *mesh, const Vessel *vessel) { count_off(mesh, vessel, 1e-9); }

static double least_angle(const TriangleMesh *mesh)
{
    double least = PI;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            const int *v = mesh->triangle[t];
            Vec3 p = mesh->vertex[v[k]], a = vec3_sub(mesh->vertex[v[(k + 1) % 3]], p), b = vec3_sub(mesh->vertex[v[(k + 2) % 3]], p);
            least = fmin(least, vec3_angle(a, b));
        }
    return least * 180 / PI;
}

typedef struct Errors {
    double distance, normal; // of facets: from points on them to the wall; of their normal to the wall's there
} Errors;

static Errors errors_of(const TriangleMesh *mesh, const Vessel *vessel)
{
    Errors e = {0, 0};
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        Vec3 a = mesh->vertex[v[0]], b = mesh->vertex[v[1]], c = mesh->vertex[v[2]], n = vec3_unit(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
        const Vec3 on[4] = {vec3_scale(vec3_add(a, vec3_add(b, c)), 1.0 / 3), vec3_mix(a, b, 0.5), vec3_mix(b, c, 0.5), vec3_mix(c, a, 0.5)};
        for (int k = 0; k < 4; k++) {
            VesselHit hit = ask(vessel, on[k], mesh->node[v[0]]);
            e.distance = fmax(e.distance, fabs(hit.gap));
            e.normal = fmax(e.normal, vec3_distance(n, vec3_negate(hit.normal)));
        }
    }
    return e;
}

typedef struct Rim {
    int loops, edges;
    Vec3 middle[8];          // of each loop's vertices
} Rim;

typedef struct Side {
    int a, b;
} Side;

static int compare_sides(const void *x, const void *y)
{
    const Side *s = x, *t = y;
    return s->a != t->a ? (s->a < t->a ? -1 : 1) : (s->b > t->b) - (s->b < t->b);
}

// next[v]: the vertex after v on the rim, -1 off it. Each vertex of a rim is on it once.
static int find_rims(const TriangleMesh *mesh, int *next)
{
    size_t n = 3 * (size_t)mesh->triangle_count;
    Side *side = malloc((n + 1) * sizeof *side);
    int edges = 0;
    for (size_t i = 0; i < n; i++)
        side[i] = (Side){mesh->triangle[i / 3][i % 3], mesh->triangle[i / 3][(i + 1) % 3]};
    qsort(side, n, sizeof *side, compare_sides);
    memset(next, 0xff, (size_t)mesh->vertex_count * sizeof *next);
    for (size_t i = 0; i < n; i++) {
        Side back = {side[i].b, side[i].a};
        if (bsearch(&back, side, n, sizeof *side, compare_sides))
            continue;
        assert_int_equal(next[side[i].a], -1);
        next[side[i].a] = side[i].b;
        edges++;
    }
    free(side);
    return edges;
}

static Rim rim_of(const TriangleMesh *mesh)
{
    int *next = malloc(((size_t)mesh->vertex_count + 1) * sizeof *next);
    Rim rim = {.edges = find_rims(mesh, next)};
    for (int v = 0; v < mesh->vertex_count; v++) {
        int at = v, count = 0;
        while (next[at] >= 0) {
            int to = next[at];
            assert_true(rim.loops < 8);
            rim.middle[rim.loops] = vec3_add(rim.middle[rim.loops], mesh->vertex[at]);
            next[at] = -1;
            at = to;
            count++;
        }
        if (count == 0)
            continue;
        assert_int_equal(at, v);             // the loop is closed
        rim.middle[rim.loops] = vec3_scale(rim.middle[rim.loops], 1.0 / count);
        rim.loops++;
    }
    free(next);
    return rim;
}

// --- Exact tubes ---

// Pappus: a tube with round ends has the area 2 pi r (L + 2 r) and the volume pi r^2 (L + 4 r / 3), however it bends.
static void tubes_converge(void **state)
{
    (void)state;
    double area_error[3], volume_error[3];
    Errors e[3];
    TubePiece piece[3];
    TubeOptions o = hook(piece, vec3(1, 0.3, -0.2), vec3(0.2, 1, 0.5), true, 1);
    Tube *tube = make_tube(&o);
    double r = tube->radius, area = 2 * PI * r * (tube->length + 2 * r), volume = PI * r * r * (tube->length + 4 * r / 3);
    for (int i = 0; i < 3; i++) {
        TriangleMesh *mesh = mesh_of(tube, 0.4 / (1 << i));
        check_closed(mesh, 1);
        check_vertices(mesh, tube->vessel);
        SurfaceCensus c = census_of(mesh);
        area_error[i] = 1 - c.area / area;
        volume_error[i] = 1 - c.volume / volume;
        e[i] = errors_of(mesh, tube->vessel);
        assert_true(least_angle(mesh) > 8);
        triangle_mesh_free(mesh);
    }
    for (int i = 0; i < 2; i++) {   // halving the cell quarters errors of place and halves those of direction
        assert_true(volume_error[i] > 0 && fabs(volume_error[i] / volume_error[i + 1] - 4) < 0.4);
        assert_true(area_error[i] > 0 && fabs(area_error[i] / area_error[i + 1] - 4) < 0.4);
        assert_true(fabs(e[i].distance / e[i + 1].distance - 4) < 1);
        assert_true(fabs(e[i].normal / e[i + 1].normal - 2) < 0.5);
    }
    assert_true(volume_error[2] < 0.005);
    free_tube(tube);
}

// Rotated at random, mirrored, moved and scaled: the same area and volume within the error of the cell; no slivers for any position of the lattice.
static void turned_tubes_are_the_same(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int trial = 0; trial < 16; trial++) {
        TubePiece piece[3];
        Vec3 d = random_unit_vector(&seed), n = random_unit_vector(&seed);
        double scale = trial % 4 == 0 ? 0.01 : trial % 4 == 1 ? 1000 : 1;
        if (trial == 2)
            d = vec3(1, 0, 0), n = vec3(0, 1, 0);
        if (trial == 3)
            d = vec3(1, 0, 0), n = vec3(0, -1, 0);
        TubeOptions o = hook(piece, d, n, true, scale);
        if (trial == 2 || trial == 3)   // the lattice's own planes are the tube's
            o.start = vec3(0, 0, 0);
        Tube *tube = make_tube(&o);
        double r = tube->radius, cell = 0.2 * scale;
        TriangleMesh *mesh = mesh_of(tube, cell);
        check_closed(mesh, 1);
        check_vertices(mesh, tube->vessel);
        SurfaceCensus c = census_of(mesh);
        assert_near(c.area / (2 * PI * r * (tube->length + 2 * r)), 1, 0.01);
        assert_near(c.volume / (PI * r * r * (tube->length + 4 * r / 3)), 1, 0.02);
        assert_true(least_angle(mesh) > 8);
        triangle_mesh_free(mesh);
        free_tube(tube);
    }
}

// The lattice is scaled with the shape: the triangles are the same except where rounding decides; with powers of two all are the same.
static void scale_is_no_matter(void **state)
{
    (void)state;
    TriangleMesh *mesh[2];
    for (int i = 0; i < 2; i++) {
        TubePiece piece[3];
        TubeOptions o = hook(piece, vec3(0, 1, 0.4), vec3(1, 0, 0), true, i == 0 ? 1 : 1024);
        Tube *tube = make_tube(&o);
        mesh[i] = mesh_of(tube, i == 0 ? 0.25 : 256);
        free_tube(tube);
    }
    assert_int_equal(mesh[0]->vertex_count, mesh[1]->vertex_count);
    assert_int_equal(mesh[0]->triangle_count, mesh[1]->triangle_count);
    assert_memory_equal(mesh[0]->triangle, mesh[1]->triangle, (size_t)mesh[0]->triangle_count * sizeof *mesh[0]->triangle);
    for (int v = 0; v < mesh[0]->vertex_count; v++)
        assert_true(vec3_distance(vec3_scale(mesh[0]->vertex[v], 1024), mesh[1]->vertex[v]) < 1024 * 1e-9);
    triangle_mesh_free(mesh[0]);
    triangle_mesh_free(mesh[1]);
}

// A cylinder upstream, a bell downstream, and a rim at the end of each, where the balls end.
static void open_ends_have_rims(void **state)
{
    (void)state;
    uint64_t seed = 8;
    for (int trial = 0; trial < 10; trial++) {
        TubePiece piece[3];
        TubeOptions o = hook(piece, random_unit_vector(&seed), random_unit_vector(&seed), false, 1);
        Tube *tube = make_tube(&o);
        double cell = trial % 2 ? 0.1 : 0.21;
        TriangleMesh *mesh = mesh_of(tube, cell);
        SurfaceCensus c = census_of(mesh);
        Rim rim = rim_of(mesh);
        assert_int_equal(c.parts, 1);
        assert_int_equal(c.euler, 0);
        assert_int_equal(rim.loops, 2);
        assert_int_equal(rim.edges, c.open_edges);
        check_vertices(mesh, tube->vessel);
        assert_true(least_angle(mesh) > 8);
        // the cylinder leaves the first ball sqrt(1.4^2 - 1) radii upstream; the rim may stay a cell's triangles behind
        int first = vec3_distance(rim.middle[0], tube->start) < vec3_distance(rim.middle[1], tube->start) ? 0 : 1;
        double upstream = vec3_dot(vec3_sub(tube->start, rim.middle[first]), tube->direction), most = sqrt(1.4 * 1.4 - 1);
        assert_true(upstream <= most && upstream > most - 1.5 * cell);
        assert_true(vec3_norm(vec3_cross(vec3_sub(rim.middle[first], tube->start), tube->direction)) < cell);
        assert_true(vec3_dot(vec3_sub(rim.middle[1 - first], tube->end), tube->end_direction) > 0.3);
        for (int v = 0; v < mesh->vertex_count; v++)   // inside the balls
            for (int k = 0; k <= tube->count; k++) {
                assert_true(k < tube->count);
                if (vec3_distance(mesh->vertex[v], tube->center[k]) < tube->reach[k])
                    break;
            }
        triangle_mesh_free(mesh);
        free_tube(tube);
    }
}

// --- Refinement ---

static void refinement_converges(void **state)
{
    (void)state;
    for (int open = 0; open < 2; open++) {
        TubePiece piece[3];
        TubeOptions o = hook(piece, vec3(0.4, 1, 0.2), vec3(1, 0, -0.3), !open, 1);
        Tube *tube = make_tube(&o);
        TriangleMesh *mesh = mesh_of(tube, 0.35);
        Errors before = errors_of(mesh, tube->vessel);
        double angle = least_angle(mesh);
        for (int i = 0; i < 2; i++) {
            SurfaceCensus was = census_of(mesh), is;
            TriangleMesh *fine = triangle_mesh_refine(mesh, tube->vessel);
            assert_non_null(fine);
            assert_int_equal(fine->triangle_count, 4 * mesh->triangle_count);
            is = census_of(fine);
            assert_int_equal(is.vertices, was.vertices + was.edges);
            assert_int_equal(is.open_edges, 2 * was.open_edges);
            assert_int_equal(is.euler, was.euler);
            assert_int_equal(rim_of(fine).loops, open ? 2 : 0);
            assert_memory_equal(fine->vertex, mesh->vertex, (size_t)mesh->vertex_count * sizeof *mesh->vertex);   // the old ones stay
            check_vertices(fine, tube->vessel);
            assert_true(least_angle(fine) > 0.7 * angle);
            Errors after = errors_of(fine, tube->vessel);
            assert_true(fabs(before.distance / after.distance - 4) < 1);
            assert_true(fabs(before.normal / after.normal - 2) < 0.5);
            before = after;
            triangle_mesh_free(mesh);
            mesh = fine;
        }
        triangle_mesh_free(mesh);
        free_tube(tube);
    }
}

// Rounded to float as in a ray tracer, no triangle of a fine mesh has zero area or is reversed.
static void fine_meshes_survive_floats(void **state)
{
    (void)state;
    TubePiece piece[3];
    TubeOptions o = hook(piece, vec3(0.4, 1, 0.2), vec3(1, 0, -0.3), true, 1);
    Tube *tube = make_tube(&o);
    TriangleMesh *mesh = mesh_of(tube, 0.08);
    for (int i = 0; i < 2; i++) {
        TriangleMesh *fine = triangle_mesh_refine(mesh, tube->vessel);
        assert_non_null(fine);
        triangle_mesh_free(mesh);
        mesh = fine;
    }
    assert_true(mesh->triangle_count > 400000);
    int bad = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            Vec3 x = mesh->vertex[mesh->triangle[t][k]];
            p[k] = vec3((double)(float)x.x, (double)(float)x.y, (double)(float)x.z);
        }
        Vec3 n = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
        bad += !(vec3_dot(n, mesh->normal[mesh->triangle[t][0]]) > 0.9 * vec3_norm(n));
    }
    assert_int_equal(bad, 0);
    triangle_mesh_free(mesh);
    free_tube(tube);
}

// --- Vessels whose results depend on the node ---

// Balls, one per node, each with its own wall.
typedef struct Balls {
    Vessel vessel;
    int count;
    Vec3 center[3];
    double radius[3];
} Balls;

static void balls_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    const Balls *balls = (const Balls *)vessel;
    (void)reach;
    for (int i = 0; i < count; i++) {
        int n = memory[i].node;
        Vec3 d = vec3_sub(balls->center[n], point[i]);
        hit[i] = (VesselHit){.gap = balls->radius[n] - vec3_norm(d), .normal = vec3_unit(d), .node = n};
    }
}

static int balls_locate(const Vessel *vessel, Vec3 point, int from)
{
    (void)vessel, (void)point;
    return from;
}

// A small ball 0.2 mm beside a large one, well within the ball by which the large one is covered, and a third far away.
static void thin_beside_wide_is_whole(void **state)
{
    (void)state;
    const int from[3] = {0, 1, 2};
    for (int swapped = 0; swapped < 2; swapped++) {
        Balls balls = {
            .vessel = {.query = balls_query, .locate = balls_locate}, .count = 3, .center = {{0, 0, 0}, {0, 3.2, 0}, {0, 0, 20}}, .radius = {2.5, 0.5, 1}};
        if (swapped) {
            balls.center[0] = vec3(0, 3.2, 0), balls.radius[0] = 0.5;
            balls.center[1] = vec3(0, 0, 0), balls.radius[1] = 2.5;
        }
        for (int cover = 0; cover < 4; cover++) {
            double reach[3], area = 0, volume = 0;
            for (int i = 0; i < 3; i++) {
                reach[i] = cover == 0 ? balls.radius[i] + 0.8 : (1 + 0.4 * cover) * balls.radius[i];
                area += 4 * PI * pow(balls.radius[i], 2);
                volume += 4 * PI / 3 * pow(balls.radius[i], 3);
            }
            TriangleMesh *mesh = isosurface_of_vessel(&balls.vessel, 3, balls.center, reach, from, 0.1);
            assert_non_null(mesh);
            check_closed(mesh, 3);
            check_vertices(mesh, &balls.vessel);
            SurfaceCensus c = census_of(mesh);
            assert_near(c.area / area, 1, 0.01);
            assert_near(c.volume / volume, 1, 0.01);
            assert_true(least_angle(mesh) > 8);
            triangle_mesh_free(mesh);
        }
    }
}

// A wall between two lumens that is much thinner than a cell stays a wall in any orientation.
static void thin_walls_stay_whole(void **state)
{
    (void)state;
    uint64_t seed = 17;
    const int from[3] = {0, 1, 2};
    for (int trial = 0; trial < 30; trial++) {
        double wall = random_in(&seed, 0.005, 0.1), cell = random_in(&seed, 0.1, 0.4);
        Balls balls = {.vessel = {.query = balls_query, .locate = balls_locate}, .count = 3, .radius = {1.3, 0.8, 1}};
        Vec3 towards = trial == 0 ? vec3(1, 0, 0) : random_unit_vector(&seed), across = vec3_normal_to(towards);
        balls.center[0] = random_in_box(&seed, 0.5);
        balls.center[1] = vec3_add_scaled(balls.center[0], balls.radius[0] + balls.radius[1] + wall, towards);
        balls.center[2] = vec3_add_scaled(balls.center[0], balls.radius[0] + balls.radius[2] + wall, across);
        double reach[3];
        for (int i = 0; i < 3; i++)
            reach[i] = 1.6 * balls.radius[i];
        TriangleMesh *mesh = isosurface_of_vessel(&balls.vessel, 3, balls.center, reach, from, cell);
        check_closed(mesh, 3);
        check_vertices(mesh, &balls.vessel);
        Errors e = errors_of(mesh, &balls.vessel);
        assert_true(e.distance < cell * cell);
        assert_true(least_angle(mesh) > 5);
        triangle_mesh_free(mesh);
    }
}

// A hairpin whose legs are 0.2 mm apart.
static void kissing_legs_stay_apart(void **state)
{
    (void)state;
    TubePiece piece[3] = {{4, 0, 0, 0}, {0, 1.1, PI, 0}, {4, 0, 0, 0}};
    TubeOptions o = {
        .start = {0.1, 0.2, 0.3}, .direction = {0.3, 1, 0.2}, .normal = {1, 0, 0.4}, .radius = 1, .piece_count = 3, .piece = piece, .closed_ends = true};
    Tube *tube = make_tube(&o);
    TriangleMesh *mesh = mesh_of(tube, 0.1);
    check_closed(mesh, 1);
    SurfaceCensus c = census_of(mesh);
    assert_near(c.area / (2 * PI * (tube->length + 2)), 1, 0.005);
    assert_near(c.volume / (PI * (tube->length + 4.0 / 3)), 1, 0.005);
    TriangleMesh *fine = triangle_mesh_refine(mesh, tube->vessel);
    check_closed(fine, 1);
    check_vertices(fine, tube->vessel);
    triangle_mesh_free(fine);
    triangle_mesh_free(mesh);
    free_tube(tube);
}

enum { NODES = 60, OVERLAP = 3 };

// A fitted tube: open at the root, closed at the leaf.
static void model_has_one_rim(void **state)
{
    (void)state;
    Vec3 line[NODES + 2 * OVERLAP];
    helix_line(line, NODES + 2 * OVERLAP, 6, 9, 0.7);
    VesselTree *tree = blob_tube(line, NODES, OVERLAP, 10, 1);
    Vessel *vessel = lim_vessel_create(tree);
    assert_non_null(vessel);
    double reach[NODES];
    int from[NODES];
    for (int i = 0; i < NODES; i++)
        reach[i] = i == NODES - 1 ? 5 : 1.6, from[i] = i;   // the last model continues beyond its node
    TriangleMesh *mesh = isosurface_of_vessel(vessel, NODES, tree->center, reach, from, 0.2);
    assert_non_null(mesh);
    SurfaceCensus c = census_of(mesh);
    Rim rim = rim_of(mesh);
    assert_int_equal(c.parts, 1);
    assert_int_equal(rim.loops, 1);
    assert_int_equal(c.euler, 1);
    // weights of mixed models are floats: the gap steps by some 1e-8 mm here and there, so that it has no zero
    assert_true(count_off(mesh, vessel, 1e-7) < mesh->vertex_count / 1000);
    assert_true(vec3_dot(vec3_sub(rim.middle[0], tree->center[0]), tree->direction[0]) < -0.5);
    assert_true(least_angle(mesh) > 8);
    Errors e = errors_of(mesh, vessel);
    assert_true(e.distance < 0.2 * 0.2 && e.normal < 0.3);
    TriangleMesh *fine = triangle_mesh_refine(mesh, vessel);
    assert_true(count_off(fine, vessel, 1e-7) < fine->vertex_count / 1000);
    assert_int_equal(rim_of(fine).loops, 1);
    triangle_mesh_free(fine);
    triangle_mesh_free(mesh);
    vessel->destroy(vessel);
    vessel_tree_free(tree);
}

// A terrace: its wall steps up at x = 0 by more than a block of cells. The step is closed, although the neighbouring blocks do not show it.
static void terrace_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    (void)vessel, (void)memory;
    for (int i = 0; i < count; i++) {
        double gap = point[i].z - (point[i].x > 0.06 ? 1.1 : -1.05);
        hit[i] = gap > reach ? (VesselHit){.gap = reach, .flags = VESSEL_FAR} : (VesselHit){.gap = gap, .normal = {0, 0, 1}};
    }
}

static int terrace_locate(const Vessel *vessel, Vec3 point, int from)
{
    (void)vessel, (void)point, (void)from;
    return 0;
}

static void steps_are_closed(void **state)
{
    (void)state;
    const Vessel terrace = {.query = terrace_query, .locate = terrace_locate};
    Vec3 center = {0, 0, 0};
    double reach = 3;
    TriangleMesh *mesh = isosurface_of_vessel(&terrace, 1, &center, &reach, NULL, 0.09);
    assert_non_null(mesh);
    SurfaceCensus c = census_of(mesh);
    assert_int_equal(c.parts, 1);
    assert_int_equal(c.euler, 1);
    assert_int_equal(rim_of(mesh).loops, 1);
    for (int v = 0; v < mesh->vertex_count; v++)
        assert_near(vec3_norm(mesh->normal[v]), 1, 1e-12);
    triangle_mesh_free(mesh);
}

// Balls that cover a plane irregularly: rims are still simple loops, and no part consists only of rim vertices.
static void ragged_cover_has_clean_rims(void **state)
{
    (void)state;
    enum { COUNT = 60 };
    uint64_t seed = 12;
    Vessel *plane = plane_vessel_create(vec3(0, 0, 0.01), vec3(0.2, 0.1, 1));
    int parts = 0;
    for (int trial = 0; trial < 40; trial++) {
        Vec3 center[COUNT];
        double reach[COUNT];
        for (int i = 0; i < COUNT; i++) {
            center[i] = vec3(random_in(&seed, -2, 2), random_in(&seed, -2, 2), random_in(&seed, -0.3, 0.3));
            reach[i] = random_in(&seed, 0.1, 0.5);
        }
        TriangleMesh *mesh = isosurface_of_vessel(plane, COUNT, center, reach, NULL, 0.1);
        assert_non_null(mesh);
        SurfaceCensus c = census_of(mesh);
        parts += c.parts;
        size_t vertices = (size_t)mesh->vertex_count + 1;
        int whole = 0, *next = malloc(vertices * sizeof *next), *part = malloc(vertices * sizeof *part);
        find_rims(mesh, next);
        for (int v = 0; v < mesh->vertex_count; v++)
            part[v] = v;
        for (int t = 0; t < mesh->triangle_count; t++)
            for (int k = 1; k < 3; k++)
                disjoint_join(part, mesh->triangle[t][0], mesh->triangle[t][k]);
        bool *is_whole = calloc(vertices, sizeof *is_whole);
        for (int t = 0; t < mesh->triangle_count; t++) {
            const int *v = mesh->triangle[t];
            int root = disjoint_root(part, v[0]);
            bool inner = next[v[0]] < 0 && next[v[1]] < 0 && next[v[2]] < 0;
            whole += inner && !is_whole[root];
            is_whole[root] = is_whole[root] || inner;
        }
        free(is_whole);
        assert_int_equal(whole, c.parts);
        free(part);
        free(next);
        triangle_mesh_free(mesh);
    }
    assert_true(parts > 100);
    plane->destroy(plane);
}

// --- Rejected input ---

static void bad_input(void **state)
{
    (void)state;
    Vessel *plane = plane_vessel_create(vec3(0, 0, 0.01), vec3(0, 0, 1));
    Vec3 center = {0, 0, 0};
    double reach = 1;
    const double cells[] = {0, -1, NAN, HUGE_VAL, 1e-9};
    for (int i = 0; i < 5; i++)
        assert_null(isosurface_of_vessel(plane, 1, &center, &reach, NULL, cells[i]));
    assert_null(isosurface_of_vessel(NULL, 1, &center, &reach, NULL, 0.1));
    reach = NAN;
    assert_null(isosurface_of_vessel(plane, 1, &center, &reach, NULL, 0.1));
    reach = 1;
    center.y = HUGE_VAL;
    assert_null(isosurface_of_vessel(plane, 1, &center, &reach, NULL, 0.1));
    TriangleMesh *mesh = isosurface_of_vessel(plane, 0, NULL, NULL, NULL, 0.1);
    assert_non_null(mesh);
    assert_int_equal(mesh->triangle_count, 0);
    TriangleMesh *fine = triangle_mesh_refine(mesh, plane);
    assert_non_null(fine);
    assert_int_equal(fine->triangle_count, 0);
    triangle_mesh_free(fine);
    triangle_mesh_free(mesh);
    // a disc of a plane
    center = vec3(0, 0, 0);
    mesh = isosurface_of_vessel(plane, 1, &center, &reach, NULL, 0.1);
    assert_int_equal(rim_of(mesh).loops, 1);
    SurfaceCensus c = census_of(mesh);
    assert_true(c.area < PI && c.area > PI * 0.8 * 0.8);
    assert_int_equal(c.euler, 1);
    triangle_mesh_free(mesh);
    plane->destroy(plane);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void cost(void **state)
{
    (void)state;
    TubePiece piece[3];
    TubeOptions o = hook(piece, vec3(0.4, 1, 0.2), vec3(1, 0, -0.3), false, 1);
    Tube *tube = make_tube(&o);
    double a = seconds();
    TriangleMesh *mesh = mesh_of(tube, 0.08);
    double b = seconds();
    TriangleMesh *fine = triangle_mesh_refine(mesh, tube->vessel);
    double c = seconds();
    print_message("exact tube: %d triangles in %.3f s; refined to %d in %.3f s\n", mesh->triangle_count, b - a, fine->triangle_count, c - b);
    triangle_mesh_free(mesh);
    triangle_mesh_free(fine);
    free_tube(tube);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tubes_converge),
        cmocka_unit_test(turned_tubes_are_the_same),
        cmocka_unit_test(scale_is_no_matter),
        cmocka_unit_test(open_ends_have_rims),
        cmocka_unit_test(refinement_converges),
        cmocka_unit_test(fine_meshes_survive_floats),
        cmocka_unit_test(thin_beside_wide_is_whole),
        cmocka_unit_test(thin_walls_stay_whole),
        cmocka_unit_test(kissing_legs_stay_apart),
        cmocka_unit_test(model_has_one_rim),
        cmocka_unit_test(steps_are_closed),
        cmocka_unit_test(ragged_cover_has_clean_rims),
        cmocka_unit_test(bad_input),
        cmocka_unit_test(cost),
    };
    return cmocka_run_group_tests_name("vessel_surface", tests, NULL, NULL);
}
