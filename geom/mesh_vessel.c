// Closest point of a triangle mesh (Embree 3's point query, Kerrien et al. 2017, section 6.3 and Table 6).
//
// The closest point p of a triangle to X lies in its face if X is within the prism over it; otherwise it is the closest of the three edges' points: this form
// has no determinant that thin triangles could make inaccurate. All of it is computed in double from a copy of the vertices, relative to the mesh's middle. The
// tree of boxes is in float and only selects candidates, with a radius enlarged by the rounding of box and point (see widened()). Of triangles at equal
// distance the one with the lowest index is taken.
//
// A search evaluates groups of eight adjacent triangles at once. Without a previous triangle, Embree's tree of the groups' boxes finds them. With a previous
// triangle, its group gives a distance that limits the search in the tree; and with the group's surroundings (proof in triangle_groups.h) usually no search is
// needed, because every triangle that can be closer is in the neighbourhood.
//
// Sign: (X - p) . N, N the pseudonormal of the feature that holds p: face; edge: sum of its two faces' normals; vertex: sum of its faces' normals, each
// weighted by its angle there (Baerentzen and Aanaes 2005, who prove that this is right for every closed mesh).
//
// Hessian of the gap. Faces: 0. An edge with direction t acts as a cylinder and a vertex as a sphere of radius |gap| about it: (I - n n' - t t') / gap and (I -
// n n') / gap. Inside the lumen these are the convex edges around which a wire bends (no point inside has its closest point on a concave edge). The Hessians
// are positive, as at any convex wall, and give the rotation of the normal as the wire slides on. MESH_SMOOTH and MESH_CURVED: with vertex normals n_i and the
// barycentric coordinates b_i of p the normal is N / |N|, N = sum b_i n_i, and S = sym(P sum n_i grad(b_i)' P), P = I - n n'; at X it is S (I + gap S)^-1.
#include "geom/mesh_vessel.h"

MeshVesselOptions mesh_vessel_default_options(void) { return (MeshVesselOptions){.search = MESH_SEARCH_CACHED}; }

#ifndef SELDINGER_EMBREE

bool mesh_vessel_available(void) { return false; }

Vessel *mesh_vessel_create(const TriangleMesh *mesh, const MeshVesselOptions *options, const char *name, Faults *faults)
{
    (void)mesh, (void)options;
    faults_add(faults, name, 0, 0, "cannot make a vessel from a mesh: this program was built without Embree; install libembree-dev and build again");
    return NULL;
}

#else

#include "base/base.h"
#include "geom/tree_surface.h"
#include "geom/triangle_groups.h"

#include <embree3/rtcore.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

typedef struct MeshVessel {
    Vessel vessel;           // first: a Vessel * points to its MeshVessel
    MeshVesselOptions options;
    RTCDevice device;
    RTCScene scene;
    ssize_t tree_bytes;
    Vec3 middle;             // origin of the following coordinates
    double size;             // [mm] largest coordinate
    int vertex_count, triangle_count;
    Vec3 *vertex;            // (V)
    Vec3 *vertex_normal;     // (V) pseudonormal, not normalised; all normals point into the lumen
    Vec3 *smooth_normal;     // (V) unit; NULL with MESH_FACES
    Sym3 *bend;              // (T) [1/mm] derivative of the interpolated normal over the triangle, symmetrised; NULL with MESH_FACES
    bool *on_rim;            // (V)
    int *keeper;             // (V) the triangle with the lowest index at the vertex
    int (*corner)[3];        // (T)
    int (*across)[3];        // (T) the triangle beyond the side from corner k to the next; -1: rim
    Vec3 *face;              // (T) unit normal
    GroupMesh mesh;          // the same arrays, for the groups
    const GroupKernels *kernels;
    int group_count;
    TriangleGroup *group;    // (G)
    int *group_of;           // (T)
    GroupSurroundings *around;   // (G); only with MESH_SEARCH_CACHED
} MeshVessel;

// --- The closest point of one triangle ---

enum { ON_EDGE = 0, ON_VERTEX = 3, ON_FACE = 6 };    // edge k: from corner k to the next

typedef struct Foot {
    Vec3 p;
    double distance2;
    int feature;             // ON_EDGE + k, ON_VERTEX + k or ON_FACE
    double weight[3];        // barycentric coordinates
} Foot;

static void closest_of_triangle(const MeshVessel *m, int triangle, Vec3 x, Foot *foot)
{
    const int *corner = m->corner[triangle];
    Vec3 v[3] = {m->vertex[corner[0]], m->vertex[corner[1]], m->vertex[corner[2]]}, n = m->face[triangle], q[3], e[3];
    double beyond[3], all = 0;       // area of each side with X, < 0 within the prism (normals point inwards, corners run in the opposite sense)
    for (int k = 0; k < 3; k++) {
        q[k] = vec3_sub(x, v[k]);
        e[k] = vec3_sub(v[(k + 1) % 3], v[k]);
        beyond[k] = vec3_dot(n, vec3_cross(e[k], q[k]));
        all += beyond[k];
    }
    if (beyond[0] <= 0 && beyond[1] <= 0 && beyond[2] <= 0 && all < 0) {
        double height = vec3_dot(n, q[0]);
        foot->p = vec3_add_scaled(x, -height, n);
        foot->distance2 = height * height;
        foot->feature = ON_FACE;
        for (int k = 0; k < 3; k++)
            foot->weight[k] = beyond[(k + 1) % 3] / all;
        return;
    }
    foot->distance2 = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3;
        double t = vec3_dot(q[k], e[k]) / vec3_norm2(e[k]);
        t = t > 0 ? t < 1 ? t : 1 : 0;
        Vec3 p = t < 1 ? vec3_add_scaled(v[k], t, e[k]) : v[next];
        double d2 = vec3_norm2(vec3_sub(x, p));
        if (!(d2 < foot->distance2))
            continue;
        foot->p = p;
        foot->distance2 = d2;
        foot->feature = t <= 0 ? ON_VERTEX + k : t >= 1 ? ON_VERTEX + next : ON_EDGE + k;
        foot->weight[k] = 1 - t;
        foot->weight[next] = t;
        foot->weight[3 - k - next] = 0;
    }
}

// --- The search ---

typedef struct Search {
    const MeshVessel *mesh;
    Vec3 x;
    double distance2;
    int triangle;            // -1: none found yet
    const GroupSurroundings *without;    // groups to skip; NULL: none
} Search;

// [mm] the radius within which boxes are visited for a closest triangle at sqrt(distance2), enlarged by more than the rounding of boxes and point to float.
static float widened(const Search *s)
{
    double margin = 1e-6 * (s->mesh->size + vec3_norm(s->x));
    return (float)(sqrt(s->distance2) * (1 + 1e-6) + margin);
}

static bool look_at(Search *s, int group)
{
    SEL_ASSERT(group >= 0 && group < s->mesh->group_count, "the group is one of the mesh's");
    const TriangleGroup *g = &s->mesh->group[group];
    double d2[GROUP_TRIANGLES];
    bool closer = false;
    if (!s->mesh->kernels->distances(g, s->x, s->distance2, d2))
        return false;
    for (int i = 0; i < GROUP_TRIANGLES; i++)
        if (d2[i] < s->distance2 || (d2[i] == s->distance2 && g->triangle[i] < s->triangle)) {
            s->distance2 = d2[i];
            s->triangle = g->triangle[i];
            closer = true;
        }
    return closer;
}

static bool visit(struct RTCPointQueryFunctionArguments *a)
{
    Search *s = a->userPtr;
    for (int i = 0; s->without && i < s->without->count; i++)
        if (s->without->group[i] == (int)a->primID)
            return false;
    if (group_is_beyond(&s->mesh->group[a->primID], s->x, s->distance2, s->mesh->size) || !look_at(s, (int)a->primID))
        return false;
    a->query->radius = widened(s);
    return true;
}

static void search_tree(Search *s)
{
    struct RTCPointQuery query = {.x = (float)s->x.x, .y = (float)s->x.y, .z = (float)s->x.z, .radius = widened(s)};
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(s->mesh->scene, &query, &context, visit, s);
}

// Returns whether a ball proves that nothing outside the neighbourhood is closer.
static bool is_proven(const GroupSurroundings *around, const Search *s)
{
    double d = sqrt(s->distance2);
    for (int i = 0; i < around->balls; i++) {
        double inside = around->ball[i].radius - d;
        if (inside > 0 && vec3_norm2(vec3_sub(s->x, around->ball[i].center)) < inside * inside)
            return true;
    }
    return false;
}

// Searches the neighbourhood of a group that has been evaluated, then that of any closer group found. Returns true if that proves the result.
static bool search_around(Search *s, int own)
{
    enum { ROUNDS = 3 };
    const MeshVessel *m = s->mesh;
    for (int round = 0; round < ROUNDS; round++) {
        const GroupSurroundings *around = &m->around[own];
        float d2[GROUP_NEAR];
        m->kernels->bounds(around, s->x, d2);
        for (int i = 1; i < around->count; i++)
            if (d2[i] <= s->distance2)
                look_at(s, around->group[i]);
        if (is_proven(around, s))
            return true;
        int next = s->triangle >= 0 ? m->group_of[s->triangle] : own;
        SEL_ASSERT(next >= 0 && next < m->group_count, "each triangle is in a group");
        if (next == own)
            return false;
        own = next;
    }
    return false;
}

// The triangle that represents a feature: the lowest of those that share it, because rounding decides which of them is the closest.
static int keeper_of(const MeshVessel *m, int triangle, int feature)
{
    SEL_ASSERT(feature >= ON_EDGE && feature <= ON_FACE, "a foot lies on an edge, a vertex or the face");
    if (feature == ON_FACE)
        return triangle;
    if (feature >= ON_VERTEX)
        return m->keeper[m->corner[triangle][feature - ON_VERTEX]];
    int other = m->across[triangle][feature - ON_EDGE];
    return other >= 0 && other < triangle ? other : triangle;
}

// The closest triangle; -1 if none is closer than `limit`. `from`: a triangle to start from; -1: none is known.
static int closest_triangle(const MeshVessel *m, Vec3 x, int from, double limit, Foot *foot)
{
    Search s = {.mesh = m, .x = x, .distance2 = limit * limit, .triangle = -1};
    if (from >= 0)
        look_at(&s, m->group_of[from]);
    if (from < 0 || !m->around || !search_around(&s, m->group_of[from]))
        search_tree(&s);
    if (s.triangle < 0)
        return -1;
    closest_of_triangle(m, s.triangle, x, foot);
    SEL_ASSERT(isfinite(foot->distance2), "a triangle with an area has a closest point");
    int keeper = keeper_of(m, s.triangle, foot->feature);
    if (keeper != s.triangle)
        closest_of_triangle(m, keeper, x, foot);
    SEL_ASSERT(keeper >= 0 && keeper < m->triangle_count, "features belong to triangles of the mesh");
    return keeper;
}

// --- The result ---

static Vec3 pseudonormal(const MeshVessel *m, int triangle, int feature)
{
    if (feature == ON_FACE)
        return m->face[triangle];
    if (feature >= ON_VERTEX)
        return m->vertex_normal[m->corner[triangle][feature - ON_VERTEX]];
    int other = m->across[triangle][feature - ON_EDGE];
    return other < 0 ? m->face[triangle] : vec3_add(m->face[triangle], m->face[other]);
}

static bool is_on_rim(const MeshVessel *m, int triangle, int feature)
{
    if (feature == ON_FACE)
        return false;
    return feature >= ON_VERTEX ? m->on_rim[m->corner[triangle][feature - ON_VERTEX]] : m->across[triangle][feature - ON_EDGE] < 0;
}

// [mm] At smaller distances from an edge or a vertex the curvature of this distance is used, because it grows without bound. No tool's centre comes so close.
static const double LEAST_DISTANCE = 0.02;

static Sym3 facet_hessian(const MeshVessel *m, int triangle, const Foot *foot, double gap, Vec3 normal)
{
    Sym3 h = {0, 0, 0, 0, 0, 0};
    if (foot->feature == ON_FACE)
        return h;
    double bend = copysign(1 / fmax(fabs(gap), LEAST_DISTANCE), gap);
    h.xx = h.yy = h.zz = bend;
    sym3_add_outer(&h, -bend, normal);
    if (foot->feature < ON_VERTEX) {
        const int *corner = m->corner[triangle];
        int k = foot->feature - ON_EDGE;
        sym3_add_outer(&h, -bend, vec3_unit(vec3_sub(m->vertex[corner[(k + 1) % 3]], m->vertex[corner[k]])));
    }
    return h;
}

static Sym3 smooth_hessian(const MeshVessel *m, int triangle, double gap, Vec3 normal)
{
    static const double LEAST_STRETCH = 0.1;     // of I + gap S, which vanishes at the wall's focal points
    const Sym3 *bend = &m->bend[triangle];
    Vec3 u = vec3_normal_to(normal), w = vec3_cross(normal, u), bend_u = sym3_mul_vec(bend, u);
    double uu = vec3_dot(u, bend_u), uw = vec3_dot(w, bend_u), ww = sym3_quadratic(bend, w);
    // k -> k / (1 + gap k) for both principal curvatures
    double mean = 0.5 * (uu + ww), half = sqrt(0.25 * (uu - ww) * (uu - ww) + uw * uw), k1 = mean + half, k2 = mean - half;
    k1 /= fmax(1 + gap * k1, LEAST_STRETCH);
    k2 /= fmax(1 + gap * k2, LEAST_STRETCH);
    double part = half > 0 ? 0.5 * (k1 - k2) / half : 0;
    mean = 0.5 * (k1 + k2) - part * mean;
    uu = mean + part * uu, ww = mean + part * ww, uw *= part;
    Sym3 h = {0, 0, 0, 0, 0, 0};
    sym3_add_outer(&h, uu - uw, u);
    sym3_add_outer(&h, ww - uw, w);
    sym3_add_outer(&h, uw, vec3_add(u, w));
    return h;
}

// [rad] a larger rotation is not meant to represent a smooth wall.
static const double TURN_MAX = 0.5;

static void set_hit(const MeshVessel *m, Vec3 x, int from, double limit, VesselHit *hit)
{
    Foot foot;
    int triangle = closest_triangle(m, x, from, limit, &foot);
    if (triangle < 0) {
        hit->gap = limit * (1 - 1e-12);
        hit->flags = VESSEL_FAR;
        return;
    }
    hit->node = triangle;
    Vec3 away = vec3_sub(x, foot.p), pseudo = pseudonormal(m, triangle, foot.feature);
    double d = sqrt(foot.distance2), tiny = 1e-9 * m->size;
    if (is_on_rim(m, triangle, foot.feature) && d > tiny) {
        hit->gap = HUGE_VAL;
        hit->flags = VESSEL_OPEN_END;
        return;
    }
    hit->gap = vec3_dot(away, pseudo) < 0 ? -d : d;
    hit->normal = foot.feature == ON_FACE ? pseudo : d > tiny ? vec3_scale(away, 1 / hit->gap) : vec3_unit(pseudo);
    if (m->options.normals == MESH_FACES) {
        hit->hessian = facet_hessian(m, triangle, &foot, hit->gap, hit->normal);
        return;
    }
    if (m->options.normals == MESH_SMOOTH) {
        const int *corner = m->corner[triangle];
        Vec3 sum = {0, 0, 0};
        for (int k = 0; k < 3; k++)
            sum = vec3_add_scaled(sum, foot.weight[k], m->smooth_normal[corner[k]]);
        hit->normal = vec3_unit_or(sum, hit->normal);
    }
    hit->hessian = smooth_hessian(m, triangle, hit->gap, hit->normal);
    if (m->options.normals == MESH_CURVED)
        return;
    // X lies above p along the face's normal; the smooth wall's normal at X differs from that at p by H (X - p)
    Vec3 turn = sym3_mul_vec(&hit->hessian, away);
    hit->normal = vec3_unit(vec3_add_scaled(hit->normal, TURN_MAX / fmax(vec3_norm(turn), TURN_MAX), turn));
}

static bool is_known(const MeshVessel *m, int triangle) { return triangle >= 0 && triangle < m->triangle_count; }

static void query_one(const MeshVessel *m, Vec3 point, double reach, VesselMemory *memory, VesselHit *hit)
{
    *hit = (VesselHit){.node = memory->node};
    if (!(vec3_norm2(point) < 1e200)) {
        hit->flags = VESSEL_UNSURE;
        return;
    }
    bool knows = is_known(m, memory->node) && m->options.search != MESH_SEARCH_FULL;
    double limit = HUGE_VAL;
    if (knows && memory->clearance > 0) {
        double bound = memory->clearance - vec3_distance(point, memory->clear_place);
        if (bound > reach) {
            hit->gap = bound;
            hit->flags = VESSEL_FAR;
            return;
        }
        if (bound > 0 && reach > 0)      // still inside: beyond reach it is enough to know a bound, which then holds for some steps
            limit = 2 * reach;
    }
    set_hit(m, vec3_sub(point, m->middle), knows ? memory->node : -1, limit, hit);
    memory->node = hit->node;
    // the distance changes by no more than the point moves
    memory->clearance = hit->gap > 0 && hit->gap < HUGE_VAL ? hit->gap * (1 - 1e-12) : 0;
    memory->clear_place = point;
}

static void mesh_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i++)
        query_one((const MeshVessel *)vessel, point[i], reach, &memory[i], &hit[i]);
}

static int mesh_locate(const Vessel *vessel, Vec3 point, int from)
{
    const MeshVessel *m = (const MeshVessel *)vessel;
    bool knows = is_known(m, from);
    if (!(vec3_norm2(point) < 1e200))
        return knows ? from : 0;
    Foot foot;
    return closest_triangle(m, vec3_sub(point, m->middle), knows ? from : -1, HUGE_VAL, &foot);
}

static bool mesh_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const MeshVessel *m = (const MeshVessel *)vessel;
    if (!m->options.has_inlet)
        return false;
    *point = m->options.inlet;
    *direction = m->options.direction;
    return true;
}

static void mesh_destroy(Vessel *vessel)
{
    MeshVessel *m = (MeshVessel *)vessel;
    if (!m)
        return;
    if (m->scene)
        rtcReleaseScene(m->scene);
    if (m->device)
        rtcReleaseDevice(m->device);
    free(m->vertex);
    free(m->vertex_normal);
    free(m->smooth_normal);
    free(m->bend);
    free(m->on_rim);
    free(m->keeper);
    free(m->corner);
    free(m->across);
    free(m->face);
    free(m->group);
    free(m->group_of);
    free(m->around);
    free(m);
}

// --- Creation ---

static const double COORDINATE_MAX = 1e9;        // [mm]
static const double THIN = 1e-12;                // height over length of a triangle that has an area

bool mesh_vessel_available(void) { return true; }

static bool has_area(const TriangleMesh *mesh, int triangle)
{
    TriangleFrame f = triangle_frame(mesh->vertex, mesh->triangle[triangle]);
    return f.length > 0 && f.top[1] > THIN * f.length;
}

// Checks the conditions that must hold before edges can be examined.
static bool check_triangles(const TriangleMesh *mesh, const char *name, Faults *faults)
{
    if (!mesh || mesh->triangle_count <= 0 || mesh->vertex_count <= 0) {
        faults_add(faults, name, 0, 0, "the mesh has no triangle; expected a vessel's wall");
        return false;
    }
    int before = faults->count, flat = 0, first_flat = 0;
    for (int v = 0; v < mesh->vertex_count && faults->count == before; v++) {
        Vec3 p = mesh->vertex[v];
        if (!(fabs(p.x) < COORDINATE_MAX && fabs(p.y) < COORDINATE_MAX && fabs(p.z) < COORDINATE_MAX))
            faults_add(faults, name, 0, 0, "vertex %d of the mesh is (%g, %g, %g); expected numbers below %g mm", v, p.x, p.y, p.z, COORDINATE_MAX);
    }
    for (int t = 0; t < mesh->triangle_count && faults->count == before; t++)
        for (int k = 0; k < 3; k++)
            if (mesh->triangle[t][k] < 0 || mesh->triangle[t][k] >= mesh->vertex_count) {
                faults_add(faults, name, 0, 0, "triangle %d of the mesh has vertex %d; expected 0 to %d", t, mesh->triangle[t][k], mesh->vertex_count - 1);
                break;
            }
    for (int t = 0; t < mesh->triangle_count && faults->count == before; t++)
        if (!has_area(mesh, t) && flat++ == 0)
            first_flat = t;
    if (flat > 0)
        faults_add(faults, name, 0, 0, "%d of the mesh's %d triangles have no area, triangle %d first; expected three distinct corners that are not collinear",
                   flat, mesh->triangle_count, first_flat);
    return faults->count == before;
}

static bool check_edges(const TriangleMesh *mesh, const char *name, Faults *faults)
{
    SurfaceCensus census;
    int before = faults->count;
    if (!surface_census(mesh, &census)) {
        faults_add(faults, name, 0, 0, "not enough memory for a mesh of %d triangles", mesh->triangle_count);
        return false;
    }
    if (census.non_manifold_edges > 0)
        faults_add(faults, name, 0, 0, "%lld edges of the mesh are shared by three triangles or more; expected two, or one at an open end",
                   (long long)census.non_manifold_edges);
    if (census.turned_edges > 0)
        faults_add(faults, name, 0, 0, "at %lld edges of the mesh two neighbours face opposite sides; expected triangles that all face out of the lumen",
                   (long long)census.turned_edges);
    return faults->count == before;
}

typedef struct Side {
    int high, triangle, k;
} Side;

static int compare_sides(const void *a, const void *b)
{
    const Side *x = a, *y = b;
    return (x->high > y->high) - (x->high < y->high);
}

// across: sides are collected by their lower vertex and sorted by the other. No edge has more than two triangles.
static bool link_triangles(MeshVessel *m)
{
    size_t sides = 3 * (size_t)m->triangle_count;
    size_t *first = calloc((size_t)m->vertex_count + 2, sizeof *first);
    Side *side = malloc(sides * sizeof *side);
    bool good = first && side;
    for (size_t i = 0; good && i < sides; i++) {
        const int *c = m->corner[i / 3];
        int a = c[i % 3], b = c[(i + 1) % 3];
        first[(a < b ? a : b) + 2]++;
    }
    for (int v = 2; good && v < m->vertex_count + 2; v++)
        first[v] += first[v - 1];
    for (size_t i = 0; good && i < sides; i++) {
        const int *c = m->corner[i / 3];
        int a = c[i % 3], b = c[(i + 1) % 3], low = a < b ? a : b;
        SEL_ASSERT(low >= 0 && a < m->vertex_count && b < m->vertex_count, "corners are vertices of the mesh");
        side[first[low + 1]++] = (Side){a < b ? b : a, (int)(i / 3), (int)(i % 3)};
        m->across[i / 3][i % 3] = -1;
    }
    for (int v = 0; good && v < m->vertex_count; v++) {
        Side *s = side + first[v];
        size_t count = first[v + 1] - first[v];
        qsort(s, count, sizeof *s, compare_sides);
        for (size_t i = 0; i < count; i++) {
            bool paired = i + 1 < count && s[i].high == s[i + 1].high;
            if (!paired) {
                m->on_rim[v] = m->on_rim[s[i].high] = true;
                continue;
            }
            m->across[s[i].triangle][s[i].k] = s[i + 1].triangle;
            SEL_ASSERT(s[i].triangle != s[i + 1].triangle, "an edge has two different triangles");
            m->across[s[i + 1].triangle][s[i + 1].k] = s[i].triangle;
            i++;
        }
    }
    free(first);
    free(side);
    return good;
}

typedef struct Hull {        // the mesh with each rim closed by a fan around its middle
    double volume, wall, caps;       // [mm3], [mm2]
} Hull;

static void add_to_hull(Hull *hull, double *area, Vec3 a, Vec3 b, Vec3 c)
{
    hull->volume += vec3_dot(a, vec3_cross(b, c)) / 6;
    *area += 0.5 * vec3_norm(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
}

// Returns false if out of memory.
static bool measure_hull(const MeshVessel *m, Hull *hull)
{
    size_t capacity = (size_t)m->vertex_count + 1;
    int *rim = malloc(capacity * sizeof *rim), *count = calloc(capacity, sizeof *count);
    Vec3 *sum = calloc(capacity, sizeof *sum);
    bool good = rim && count && sum;
    *hull = (Hull){0, 0, 0};
    for (int v = 0; good && v < m->vertex_count; v++)
        rim[v] = v;
    // pass 0 joins the rims, pass 1 finds their middles, pass 2 adds the fans
    for (int pass = 0; good && pass < 3; pass++)
        for (int i = 0; i < 3 * m->triangle_count; i++) {
            const int *c = m->corner[i / 3];
            int from = c[i % 3], to = c[(i + 1) % 3];
            if (pass == 2 && i % 3 == 0)
                add_to_hull(hull, &hull->wall, m->vertex[c[0]], m->vertex[c[1]], m->vertex[c[2]]);
            if (m->across[i / 3][i % 3] >= 0)
                continue;
            int root = disjoint_root(rim, from);
            if (pass == 0) {
                disjoint_join(rim, from, to);
            } else if (pass == 1) {
                sum[root] = vec3_add(sum[root], vec3_mix(m->vertex[from], m->vertex[to], 0.5));
                count[root]++;
            } else {
                add_to_hull(hull, &hull->caps, m->vertex[to], m->vertex[from], vec3_scale(sum[root], 1.0 / count[root]));
            }
        }
    free(rim);
    free(count);
    free(sum);
    return good;
}

static void set_normals(MeshVessel *m, const TriangleMesh *mesh)
{
    for (int t = 0; t < m->triangle_count; t++) {
        const int *corner = m->corner[t];
        m->face[t] = triangle_frame(m->vertex, corner).normal;
        for (int k = 0; k < 3; k++) {
            Vec3 p = m->vertex[corner[k]], a = vec3_sub(m->vertex[corner[(k + 1) % 3]], p), b = vec3_sub(m->vertex[corner[(k + 2) % 3]], p);
            Vec3 *sum = &m->vertex_normal[corner[k]];
            *sum = vec3_add_scaled(*sum, vec3_angle(a, b), m->face[t]);
        }
    }
    for (int v = 0; m->smooth_normal && v < m->vertex_count; v++)
        m->smooth_normal[v] = vec3_unit(mesh->normal ? vec3_negate(mesh->normal[v]) : m->vertex_normal[v]);
}

static void set_bends(MeshVessel *m)
{
    for (int t = 0; t < m->triangle_count; t++) {
        const int *corner = m->corner[t];
        Sym3 sum = {0, 0, 0, 0, 0, 0};
        for (int k = 0; k < 3; k++) {
            Vec3 a = m->vertex[corner[(k + 1) % 3]], side = vec3_sub(m->vertex[corner[(k + 2) % 3]], a), n = m->smooth_normal[corner[k]];
            // gradient of the barycentric coordinate: perpendicular to the opposite side, 1 over the height
            Vec3 g = vec3_cross(side, m->face[t]);
            g = vec3_scale(g, 1 / vec3_dot(g, vec3_sub(m->vertex[corner[k]], a)));
            // sym(n g') = ((n + g)(n + g)' - n n' - g g') / 2
            sym3_add_outer(&sum, 0.5, vec3_add(n, g));
            sym3_add_outer(&sum, -0.5, n);
            sym3_add_outer(&sum, -0.5, g);
        }
        m->bend[t] = sum;
    }
}

static bool count_bytes(void *mesh, ssize_t bytes, bool post)
{
    (void)post;
    ((MeshVessel *)mesh)->tree_bytes += bytes;
    return true;
}

static void set_bounds(const struct RTCBoundsFunctionArguments *a)
{
    const MeshVessel *m = a->geometryUserPtr;
    GroupBox box = group_box(&m->group[a->primID], &m->mesh);
    struct RTCBounds *b = a->bounds_o;
    b->lower_x = box.low[0], b->lower_y = box.low[1], b->lower_z = box.low[2];
    b->upper_x = box.high[0], b->upper_y = box.high[1], b->upper_z = box.high[2];
}

static bool build_tree(MeshVessel *m, const char *name, Faults *faults)
{
    m->device = rtcNewDevice("threads=1");
    if (!m->device) {
        faults_add(faults, name, 0, 0, "Embree does not start (error %d)", (int)rtcGetDeviceError(NULL));
        return false;
    }
    rtcSetDeviceMemoryMonitorFunction(m->device, count_bytes, m);
    m->scene = rtcNewScene(m->device);
    RTCGeometry geometry = rtcNewGeometry(m->device, RTC_GEOMETRY_TYPE_USER);
    if (m->scene && geometry) {
        rtcSetGeometryUserPrimitiveCount(geometry, (unsigned)m->group_count);
        rtcSetGeometryUserData(geometry, m);
        rtcSetGeometryBoundsFunction(geometry, set_bounds, NULL);
        rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
        rtcSetSceneBuildQuality(m->scene, RTC_BUILD_QUALITY_HIGH);
        rtcSetSceneFlags(m->scene, RTC_SCENE_FLAG_ROBUST);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(m->scene, geometry);
        rtcCommitScene(m->scene);
        rtcReleaseGeometry(geometry);
    }
    enum RTCError error = rtcGetDeviceError(m->device);
    if (error != RTC_ERROR_NONE)
        faults_add(faults, name, 0, 0, "Embree cannot hold the mesh of %d triangles (%s)", m->triangle_count,
                   error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory" : "internal error");
    return error == RTC_ERROR_NONE;
}

static bool set_groups(MeshVessel *m)
{
    size_t triangles = (size_t)m->triangle_count;
    m->kernels = group_kernels(0);
    m->mesh = (GroupMesh){m->vertex, (const int(*)[3])m->corner, m->size};
    m->group_count = group_count(m->triangle_count);
    m->group = aligned_alloc(_Alignof(TriangleGroup), (size_t)m->group_count * sizeof *m->group);
    m->group_of = malloc(triangles * sizeof *m->group_of);
    Vec3 *centroid = malloc(triangles * sizeof *centroid);
    int *order = malloc(triangles * sizeof *order);
    bool good = m->group && m->group_of && centroid && order;
    for (int t = 0; good && t < m->triangle_count; t++) {
        const int *c = m->corner[t];
        centroid[t] = vec3_scale(vec3_add(vec3_add(m->vertex[c[0]], m->vertex[c[1]]), m->vertex[c[2]]), 1.0 / 3);
    }
    if (good)
        group_order(m->triangle_count, centroid, order);
    for (int g = 0; good && g < m->group_count; g++) {
        int first = g * GROUP_TRIANGLES, count = m->triangle_count - first < GROUP_TRIANGLES ? m->triangle_count - first : GROUP_TRIANGLES;
        group_fill(&m->group[g], count, order + first, &m->mesh);
        for (int i = 0; i < count; i++)
            m->group_of[order[first + i]] = g;
    }
    free(centroid);
    free(order);
    return good;
}

// --- Neighbourhoods ---

typedef struct GroupMiddle {
    Vec3 place;              // mean of the triangles' centroids
    double radius;           // to the farthest corner
} GroupMiddle;

static GroupMiddle middle_of(const MeshVessel *m, const TriangleGroup *g)
{
    GroupMiddle middle = {{0, 0, 0}, 0};
    for (int i = 0; i < 3 * GROUP_TRIANGLES; i++)
        middle.place = vec3_add_scaled(middle.place, 1.0 / (3 * GROUP_TRIANGLES), m->vertex[m->corner[g->triangle[i / 3]][i % 3]]);
    for (int i = 0; i < 3 * GROUP_TRIANGLES; i++)
        middle.radius = fmax(middle.radius, vec3_norm2(vec3_sub(middle.place, m->vertex[m->corner[g->triangle[i / 3]][i % 3]])));
    middle.radius = sqrt(middle.radius);
    return middle;
}

typedef struct Ring {        // groups around a group, itself first, ordered by the distance of their middles
    int count;
    int group[GROUP_NEAR];
    double far2[GROUP_NEAR];
} Ring;

static void add_to_ring(Ring *ring, int group, const GroupMiddle *middle)
{
    SEL_ASSERT(ring->count > 0 && ring->count <= GROUP_NEAR, "a ring holds its own group first");
    int k = 0;
    while (k < ring->count && ring->group[k] != group)
        k++;
    double far2 = vec3_norm2(vec3_sub(middle[group].place, middle[ring->group[0]].place));
    if (k < ring->count || (ring->count == GROUP_NEAR && !(far2 < ring->far2[GROUP_NEAR - 1])))
        return;
    ring->count += ring->count < GROUP_NEAR;
    for (k = ring->count - 1; k > 1 && ring->far2[k - 1] > far2; k--) {
        ring->far2[k] = ring->far2[k - 1];
        ring->group[k] = ring->group[k - 1];
    }
    ring->far2[k] = far2;
    ring->group[k] = group;
}

// Adds the groups that share a vertex with it. first, of: the groups at each vertex.
static void gather_ring(const MeshVessel *m, int group, const GroupMiddle *middle, const size_t *first, const int *of, Ring *ring)
{
    *ring = (Ring){.count = 1, .group = {group}};
    for (int i = 0; i < 3 * GROUP_TRIANGLES; i++) {
        int v = m->corner[m->group[group].triangle[i / 3]][i % 3];
        for (size_t at = first[v]; at < first[v + 1]; at++)
            add_to_ring(ring, of[at], middle);
    }
}

// Adds the groups around these as far as there is room: the larger the neighbourhood, the larger the balls can be.
static void set_neighbourhood(const MeshVessel *m, int group, const GroupMiddle *middle, const Ring *ring, GroupSurroundings *around)
{
    Ring wide = ring[group];
    for (int i = 1; i < ring[group].count; i++) {
        const Ring *next = &ring[ring[group].group[i]];
        for (int k = 1; k < next->count; k++)
            add_to_ring(&wide, next->group[k], middle);
    }
    *around = (GroupSurroundings){.count = wide.count, .origin = middle[group].place, .axis = {[2] = m->group[group].facing}};
    memcpy(around->group, wide.group, sizeof around->group);
    around->axis[0] = vec3_normal_to(around->axis[2]);
    around->axis[1] = vec3_cross(around->axis[2], around->axis[0]);
    group_set_bounds(around, m->group, &m->mesh);
}

static void blow_balls(const MeshVessel *m, const GroupMiddle *middle, GroupSurroundings *around)
{
    double touching = 0.75 * middle->radius;
    int before = -1;
    around->balls = 0;
    for (int i = 0; i < GROUP_BALLS; i++, touching *= 2) {
        double most = touching + 2 * middle->radius;         // a larger ball would be of no use, because points do not move further
        Search s = {.mesh = m, .x = vec3_add_scaled(middle->place, touching, around->axis[2]), .distance2 = most * most, .triangle = -1, .without = around};
        if (before >= 0)
            look_at(&s, m->group_of[before]);
        search_tree(&s);
        before = s.triangle;
        SEL_ASSERT(around->balls < GROUP_BALLS, "there is room for a ball");
        double radius = sqrt(s.distance2) * (1 - 1e-9) - 1e-9 * m->size;
        if (!(radius > touching))
            return;          // larger balls would contain this one, so they fail too
        around->ball[around->balls].center = s.x;
        around->ball[around->balls++].radius = radius;
    }
}

static bool set_surroundings(MeshVessel *m)
{
    size_t groups = (size_t)m->group_count, sides = 3 * (size_t)m->triangle_count;
    m->around = aligned_alloc(_Alignof(GroupSurroundings), groups * sizeof *m->around);
    GroupMiddle *middle = malloc(groups * sizeof *middle);
    size_t *first = calloc((size_t)m->vertex_count + 2, sizeof *first);
    int *of = malloc(sides * sizeof *of);
    Ring *ring = malloc(groups * sizeof *ring);
    bool good = ring && m->around && middle && first && of;
    for (size_t i = 0; good && i < sides; i++)
        first[m->corner[i / 3][i % 3] + 2]++;
    for (int v = 2; good && v < m->vertex_count + 2; v++)
        first[v] += first[v - 1];
    for (size_t i = 0; good && i < sides; i++)
        of[first[m->corner[i / 3][i % 3] + 1]++] = m->group_of[i / 3];
    for (int g = 0; good && g < m->group_count; g++)
        middle[g] = middle_of(m, &m->group[g]);
    for (int g = 0; good && g < m->group_count; g++)
        gather_ring(m, g, middle, first, of, &ring[g]);
    for (int g = 0; good && g < m->group_count; g++) {
        set_neighbourhood(m, g, middle, ring, &m->around[g]);
        blow_balls(m, &middle[g], &m->around[g]);
    }
    free(ring);
    free(middle);
    free(first);
    free(of);
    return good;
}

static bool copy_mesh(MeshVessel *m, const TriangleMesh *mesh)
{
    size_t vertices = (size_t)mesh->vertex_count, triangles = (size_t)mesh->triangle_count;
    m->vertex_count = mesh->vertex_count;
    m->triangle_count = mesh->triangle_count;
    m->vertex = malloc(vertices * sizeof *m->vertex);
    m->vertex_normal = calloc(vertices, sizeof *m->vertex_normal);
    m->smooth_normal = m->options.normals != MESH_FACES ? malloc(vertices * sizeof *m->smooth_normal) : NULL;
    m->bend = m->options.normals != MESH_FACES ? malloc(triangles * sizeof *m->bend) : NULL;
    m->on_rim = calloc(vertices, sizeof *m->on_rim);
    m->keeper = malloc(vertices * sizeof *m->keeper);
    m->corner = malloc(triangles * sizeof *m->corner);
    m->across = malloc(triangles * sizeof *m->across);
    m->face = malloc(triangles * sizeof *m->face);
    if (!m->vertex || !m->vertex_normal || (m->options.normals != MESH_FACES && (!m->smooth_normal || !m->bend)) || !m->on_rim || !m->keeper || !m->corner ||
        !m->across || !m->face)
        return false;
    memcpy(m->corner, mesh->triangle, triangles * sizeof *m->corner);
    for (int t = mesh->triangle_count - 1; t >= 0; t--)
        for (int k = 0; k < 3; k++)
            m->keeper[m->corner[t][k]] = t;
    Vec3 low = mesh->vertex[m->corner[0][0]], high = low;
    for (size_t i = 0; i < 3 * triangles; i++) {
        Vec3 p = mesh->vertex[m->corner[i / 3][i % 3]];
        low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    m->middle = vec3_mix(low, high, 0.5);
    m->size = 0.5 * fmax(high.x - low.x, fmax(high.y - low.y, high.z - low.z));
    for (size_t v = 0; v < vertices; v++)
        m->vertex[v] = vec3_sub(mesh->vertex[v], m->middle);
    return true;
}

Vessel *mesh_vessel_create(const TriangleMesh *mesh, const MeshVesselOptions *options, const char *name, Faults *faults)
{
    if (!check_triangles(mesh, name, faults) || !check_edges(mesh, name, faults))
        return NULL;
    MeshVessel *m = calloc(1, sizeof *m);
    Hull hull;
    if (m)
        m->options = *options;
    bool good = m && copy_mesh(m, mesh) && link_triangles(m) && measure_hull(m, &hull), faces_out = true;
    if (good) {
        faces_out = hull.volume >= 0 || hull.caps > 0.5 * hull.wall;     // for a mere patch the orientation cannot be determined
        set_normals(m, mesh);
        if (m->bend)
            set_bends(m);
        good = set_groups(m);
    }
    if (!good)
        faults_add(faults, name, 0, 0, "not enough memory for a mesh of %d triangles", mesh->triangle_count);
    else if (!faces_out)
        faults_add(faults, name, 0, 0, "the mesh faces into the lumen (it encloses %g mm3); expected triangles that face out of it", hull.volume);
    good = good && faces_out && build_tree(m, name, faults);
    if (good && options->search == MESH_SEARCH_CACHED && !set_surroundings(m)) {
        faults_add(faults, name, 0, 0, "not enough memory for a mesh of %d triangles", mesh->triangle_count);
        good = false;
    }
    if (!good) {
        mesh_destroy(m ? &m->vessel : NULL);
        return NULL;
    }
    static const char *const kind[] = {[MESH_FACES] = "flat mesh", [MESH_CURVED] = "mesh", [MESH_SMOOTH] = "smooth mesh"};
    size_t vertices = (size_t)m->vertex_count, triangles = (size_t)m->triangle_count;
    m->vessel = (Vessel){.kind = kind[options->normals],
                         .query = mesh_query,
                         .locate = mesh_locate,
                         .inlet = mesh_inlet,
                         .destroy = mesh_destroy,
                         .primitives = m->triangle_count};
    size_t each_group = sizeof *m->group + (m->around ? sizeof *m->around : 0);
    size_t each_vertex = sizeof *m->vertex + sizeof *m->vertex_normal + sizeof *m->on_rim + sizeof *m->keeper + (m->smooth_normal ? sizeof(Vec3) : 0);
    size_t each_triangle = sizeof *m->corner + sizeof *m->across + sizeof *m->face + sizeof *m->group_of + (m->bend ? sizeof *m->bend : 0);
    m->vessel.bytes = sizeof *m + (size_t)m->tree_bytes + (size_t)m->group_count * each_group + vertices * each_vertex + triangles * each_triangle;
    return &m->vessel;
}

#endif
