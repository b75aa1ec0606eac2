// The wall of any vessel as triangles (isosurface.h): marching cubes over its gap, and refinement with new vertices on the wall.
//
// A lattice point is queried from the ball in which it lies deepest relative to the ball's size; if the result is outside, it is queried from the other balls
// around it too, and one result of inside is enough, because a thin vessel may run beside a wide one. Where two lumens are so close that there might be no
// lattice point between them, the points closest to the wall between are set to outside, so that the lumens stay separate for every cell size. The gap is
// 1-Lipschitz, so a block whose middle is further from the wall than its corners contains no wall. If a vessel is made of local models, the gap has small
// jumps; so a block into which the wall of a marched block continues is marched too, whatever the result at its middle.
//
// Vertices start near the middles of crossed edges, wherever the crossing is, and are then moved onto the wall along its normal: this keeps the vertices around
// one lattice point apart, and no triangle has an angle below about 10 degrees. (Starting at the crossings gave angles below 0.1 degrees.)
#include "base/base.h"
#include "geom/sparse_march.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum { BATCH = 256, STEPS_MAX = 30 };

static uint64_t edge_key(int a, int b) { return a < b ? (uint64_t)(uint32_t)a << 32 | (uint32_t)b : (uint64_t)(uint32_t)b << 32 | (uint32_t)a; }

static const double CLOSE = 2e-10;           // [mm] a vertex has converged if its gap is below this
static const double LEAST_SHARE = 0.4;       // of an edge, measured from its ends
// [cells] A vertex moves by at most this …
static const double MOVE = 1.2;
// … two lumens are kept at least this far apart on the lattice: every lattice line has a point between them …
static const double APART = 1.05;
// … and lattice points this far beyond the balls are evaluated too, so that all cells around a vertex within the balls have all their corners.
static const double MARGIN = 2.8;

// Points to query: lattice points of a block, or a block's middle.
typedef struct Queries {
    int count;
    int of[MARCH_POINTS], ball[MARCH_POINTS];
    Vec3 point[MARCH_POINTS];
    VesselMemory memory[MARCH_POINTS];
    VesselHit hit[MARCH_POINTS];
} Queries;

enum { NO_WALL = -1000 };    // [cells]

typedef struct VesselMarch {
    March march;             // first: a March * points to its VesselMarch
    const Vessel *vessel;
    const Vec3 *center;
    const double *reach;
    const int *from;
    Queries queries;
    double other[MARCH_POINTS];              // the largest gap below 0 among the other balls' results for a lattice point
    int capacity;
    int *made_in;            // block in which each vertex was made
    bool failed;
} VesselMarch;

// Signed gap; a point beyond an open end counts as inside.
static double gap_of(const VesselHit *hit) { return hit->flags & VESSEL_OPEN_END ? HUGE_VAL : hit->gap; }

static bool is_covered(const VesselMarch *job, const MarchBlock *b, Vec3 x)
{
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        int n = job->march.link[l].ball;
        if (vec3_norm2(vec3_sub(x, job->center[n])) < job->reach[n] * job->reach[n])
            return true;
    }
    return false;
}

// The ball in which x lies deepest relative to the ball's size; -1 if x is further than `margin` outside all balls.
static int deepest_ball(const VesselMarch *job, const MarchBlock *b, Vec3 x, double margin)
{
    int best = -1;
    double least = HUGE_VAL;
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        int n = job->march.link[l].ball;
        double reach = job->reach[n], most = reach + margin, d2 = vec3_norm2(vec3_sub(x, job->center[n]));
        if (d2 < most * most && d2 < least * reach * reach)
            least = d2 / (reach * reach), best = n;
    }
    return best;
}

static int node_from(const VesselMarch *job, int ball, Vec3 x) { return job->vessel->locate(job->vessel, x, job->from ? job->from[ball] : -1); }

static void add_query(VesselMarch *job, int of, int ball, Vec3 x, int node)
{
    Queries *queries = &job->queries;
    queries->of[queries->count] = of;
    queries->ball[queries->count] = ball;
    queries->point[queries->count] = x;
    queries->memory[queries->count++] = (VesselMemory){.node = node};
}

static void run_queries(VesselMarch *job, double reach)
{
    vessel_query(job->vessel, job->queries.count, job->queries.point, reach, job->queries.memory, job->queries.hit);
}

// Queues queries of x, which is lattice point `of`, from all balls of the block within `margin` of it that lead to nodes not yet queried. Returns false if
// there is not enough room for all.
static bool queue_others(VesselMarch *job, const MarchBlock *b, int of, Vec3 x, double margin, int first_node)
{
    enum { NODES_MAX = 16 };
    int queried[NODES_MAX] = {first_node}, count = 1;
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        int n = job->march.link[l].ball, k = 0;
        double most = job->reach[n] + margin;
        if (!(vec3_norm2(vec3_sub(x, job->center[n])) < most * most))
            continue;
        int node = node_from(job, n, x);
        while (k < count && queried[k] != node)
            k++;
        if (k < count)
            continue;
        if (count == NODES_MAX || job->queries.count == MARCH_POINTS)
            return false;
        queried[count++] = node;
        add_query(job, of, n, x, node);
    }
    return true;
}

static bool block_is_plain(VesselMarch *job, const MarchBlock *b)
{
    double h;
    Vec3 middle = march_block_ball(&job->march, b, &h);
    job->queries.count = 0;
    bool all_out = queue_others(job, b, 0, middle, h + MARGIN * job->march.cell, -1);
    run_queries(job, 1.01 * h);
    for (int n = 0; n < job->queries.count; n++) {
        const VesselHit *hit = &job->queries.hit[n];
        if (hit->flags & VESSEL_OPEN_END)
            return false;
        if (hit->gap > h)
            return true;
        all_out = all_out && hit->gap < -h;
    }
    return all_out;
}

// Applies the results of the second round: one result of inside is enough.
static void merge_others(VesselMarch *job)
{
    March *march = &job->march;
    run_queries(job, 2 * march->cell);
    for (int n = 0; n < job->queries.count; n++) {
        const VesselHit *hit = &job->queries.hit[n];
        int at = job->queries.of[n];
        if (hit->flags & (VESSEL_OPEN_END | VESSEL_BEYOND))
            continue;
        double lesser = fmin(hit->gap, march->value[at]);
        if (lesser < 0)
            job->other[at] = fmax(job->other[at], lesser);
        if (hit->gap > march->value[at]) {
            march->value[at] = hit->gap;
            march->owner[at] = job->queries.ball[n];
        }
    }
    job->queries.count = 0;
}

// For a point inside one lumen by g and outside another by s, the wall between the lumens has a thickness of s - g.
static void keep_apart(VesselMarch *job)
{
    double apart = APART * job->march.cell;
    for (int at = 0; at < MARCH_POINTS; at++) {
        double g = job->march.value[at], wall = -job->other[at] - g;
        if (g > 0 && wall > 0 && wall < apart)
            job->march.value[at] = g - 0.5 * (apart - wall);
    }
}

static void sample_block(VesselMarch *job, const MarchBlock *b)
{
    March *march = &job->march;
    int node[MARCH_POINTS];
    double margin = MARGIN * march->cell;
    job->queries.count = 0;
    for (int i = 0; i < MARCH_SIDE; i++)
        for (int j = 0; j < MARCH_SIDE; j++)
            for (int k = 0; k < MARCH_SIDE; k++) {
                Vec3 x = march_point(march, b, i, j, k);
                int at = march_index(i, j, k), ball = deepest_ball(job, b, x, margin);
                march->value[at] = NAN;
                march->owner[at] = ball;
                job->other[at] = NO_WALL * march->cell;
                if (ball >= 0)
                    add_query(job, at, ball, x, node_from(job, ball, x));
            }
    run_queries(job, 2 * march->cell);
    for (int n = 0; n < job->queries.count; n++) {
        march->value[job->queries.of[n]] = gap_of(&job->queries.hit[n]);
        node[job->queries.of[n]] = job->queries.hit[n].node;
    }
    job->queries.count = 0;
    for (int i = 0; i < MARCH_SIDE; i++)
        for (int j = 0; j < MARCH_SIDE; j++)
            for (int k = 0; k < MARCH_SIDE; k++) {
                int at = march_index(i, j, k);
                if (!(march->value[at] <= 0.5 * APART * march->cell))
                    continue;
                if (job->queries.count > MARCH_POINTS / 2)
                    merge_others(job);
                queue_others(job, b, at, march_point(march, b, i, j, k), margin, node[at]);
            }
    merge_others(job);
    keep_apart(job);
    for (int at = 0; at < MARCH_POINTS; at++)
        if (!isnan(march->value[at]))        // finite, so that the crossing of an edge can be interpolated
            march->value[at] = fmin(fmax(march->value[at], -march->cell), march->cell);
}

static void place_vertex(March *march, const MarchBlock *b, Vec3 p, int inside, Vec3 *vertex, Vec3 *normal, int *node)
{
    VesselMarch *job = (VesselMarch *)march;
    int v = (int)(vertex - march->mesh->vertex);
    if (march->vertex_capacity > job->capacity) {
        int *made_in = realloc(job->made_in, (size_t)march->vertex_capacity * sizeof *made_in);
        job->failed = job->failed || !made_in;
        job->made_in = made_in ? made_in : job->made_in;
        job->capacity = made_in ? march->vertex_capacity : job->capacity;
    }
    if (!job->failed)
        job->made_in[v] = (int)(b - march->block);
    *vertex = p;
    *normal = vec3(0, 0, 0);
    *node = job->from ? job->from[inside] : -1;
}

// Moves points onto the wall, none further than most[i]; if the wall is further away, the point comes as close as it can. `node` is the node from which a point
// is queried, and then that of the result; `normal` points outwards. Every step uses a fresh memory, because a point's memory could change the result.
static void settle(const Vessel *vessel, int count, Vec3 *point, const double *most, Vec3 *normal, int *node)
{
    VesselMemory memory[BATCH];
    VesselHit hit[BATCH];
    Vec3 x[BATCH], start[BATCH];
    double least[BATCH];
    int of[BATCH], going = count;
    double reach = 0;
    for (int i = 0; i < count; i++) {
        x[i] = start[i] = point[i];
        least[i] = HUGE_VAL;
        of[i] = i;
        reach = fmax(reach, 4 * most[i]);
    }
    for (int step = 0; step < STEPS_MAX && going > 0; step++) {
        for (int n = 0; n < going; n++)
            memory[n] = (VesselMemory){.node = vessel->locate(vessel, x[n], node[of[n]])};
        vessel_query(vessel, going, x, reach, memory, hit);
        int left = 0;
        for (int n = 0; n < going; n++) {
            int i = of[n];
            double gap = gap_of(&hit[n]);
            bool has_wall = !(hit[n].flags & (VESSEL_FAR | VESSEL_OPEN_END)), last = step == STEPS_MAX - 1;
            if (fabs(gap) < least[i] || step == 0) {
                least[i] = fabs(gap);
                point[i] = x[n];
                normal[i] = has_wall ? vec3_negate(hit[n].normal) : vec3(0, 0, 0);
                node[i] = hit[n].node;
            }
            Vec3 next = vec3_add_scaled(x[n], -gap, hit[n].normal);
            if (!has_wall || fabs(gap) < CLOSE || last || !(vec3_norm2(vec3_sub(next, start[i])) <= most[i] * most[i]))
                continue;
            of[left] = i;
            x[left++] = next;
        }
        going = left;
    }
}

// Moves all vertices from `first` on. most == NULL: each may move by `same`.
static void settle_all(const Vessel *vessel, TriangleMesh *mesh, int first, const double *most, double same)
{
    double bound[BATCH];
    for (int i = first; i < mesh->vertex_count; i += BATCH) {
        int n = mesh->vertex_count - i < BATCH ? mesh->vertex_count - i : BATCH;
        for (int k = 0; k < n; k++)
            bound[k] = most ? most[i - first + k] : same;
        settle(vessel, n, mesh->vertex + i, bound, mesh->normal + i, mesh->node + i);
    }
}

// Queues the neighbours of block `index` across whose common face the wall continues, if they were skipped.
static void pass_on(VesselMarch *job, int index, const bool *is_plain, bool *is_queued, int *queue, int *count)
{
    const March *march = &job->march;
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, side = face & 1, steps[3] = {0, 0, 0}, at[3];
        bool inside = false, outside = false;
        at[axis] = side ? MARCH_BLOCK : 0;
        for (int u = 0; u < MARCH_SIDE; u++)
            for (int v = 0; v < MARCH_SIDE; v++) {
                at[(axis + 1) % 3] = u, at[(axis + 2) % 3] = v;
                double value = march->value[march_index(at[0], at[1], at[2])];
                inside = inside || value > 0;
                outside = outside || value <= 0;
            }
        steps[axis] = side ? 1 : -1;
        int next = inside && outside ? march_block_beside(march, &march->block[index], steps) : -1;
        if (next >= 0 && is_plain[next] && !is_queued[next]) {
            is_queued[next] = true;
            queue[(*count)++] = next;
        }
    }
}

static bool march_blocks(VesselMarch *job)
{
    March *march = &job->march;
    size_t blocks = (size_t)march->block_count + 1;
    bool *is_plain = calloc(blocks, sizeof *is_plain), *is_queued = calloc(blocks, sizeof *is_queued);
    int *queue = malloc(blocks * sizeof *queue), queued = 0;
    bool good = is_plain && is_queued && queue;
    for (int i = 0; good && i < march->block_count; i++)
        is_plain[i] = block_is_plain(job, &march->block[i]);
    for (int i = 0; good && i < march->block_count; i++)
        if (!is_plain[i])
            queue[queued++] = i;
    for (int q = 0; good && q < queued; q++) {
        sample_block(job, &march->block[queue[q]]);
        good = march_block(march, &march->block[queue[q]]) && !job->failed;
        pass_on(job, queue[q], is_plain, is_queued, queue, &queued);
    }
    free(is_plain);
    free(is_queued);
    free(queue);
    return good;
}

// --- The rim ---

// ends[v]: number of rim edges at v among the kept triangles. Returns false if out of memory.
static bool count_rim(const TriangleMesh *mesh, const bool *keep, KeyMap *edge_of, int (*edge)[3], int *ends)
{
    int count = 0;
    memset(ends, 0, (size_t)mesh->vertex_count * sizeof *ends);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; keep[t] && k < 3; k++) {
            bool is_new;
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            int *at = key_map_find_or_add(edge_of, edge_key(a, b), count, &is_new);
            if (!at)
                return false;
            if (is_new)
                memcpy(edge[count++], (int[3]){a, b, 0}, sizeof *edge);
            edge[*at][2]++;
        }
    for (int e = 0; e < count; e++)
        if (edge[e][2] == 1)
            ends[edge[e][0]]++, ends[edge[e][1]]++;
    return true;
}

// Removes fragments: parts whose triangles all touch the rim.
static void drop_scraps(const TriangleMesh *mesh, bool *keep, const int *ends, int *part, bool *is_whole)
{
    for (int v = 0; v < mesh->vertex_count; v++)
        part[v] = v, is_whole[v] = false;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 1; keep[t] && k < 3; k++)
            disjoint_join(part, mesh->triangle[t][0], mesh->triangle[t][k]);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        if (keep[t] && ends[v[0]] + ends[v[1]] + ends[v[2]] == 0)
            is_whole[disjoint_root(part, v[0])] = true;
    }
    for (int t = 0; t < mesh->triangle_count; t++)
        keep[t] = keep[t] && is_whole[disjoint_root(part, mesh->triangle[t][0])];
}

// Removes what lies outside the balls, then what is connected only by a single vertex of the rim, then fragments. Returns false if out of memory.
static bool trim(VesselMarch *job)
{
    TriangleMesh *mesh = job->march.mesh;
    size_t vertices = (size_t)mesh->vertex_count + 1, triangles = (size_t)mesh->triangle_count + 1;
    bool *is_bad = malloc(vertices), *keep = malloc(triangles), good = is_bad && keep, open = false, again = true;
    for (int v = 0; good && v < mesh->vertex_count; v++) {
        is_bad[v] = !is_covered(job, &job->march.block[job->made_in[v]], mesh->vertex[v]);
        open = open || is_bad[v];
    }
    int(*edge)[3] = open ? malloc(3 * triangles * sizeof *edge) : NULL, *ends = open ? malloc(vertices * sizeof *ends) : NULL;
    int *other = open ? malloc(vertices * sizeof *other) : NULL;
    good = good && (!open || (edge && ends && other));
    if (open && good)
        memset(keep, true, triangles);
    while (open && good && again) {
        KeyMap edge_of = {0};
        again = false;
        for (int t = 0; t < mesh->triangle_count; t++)
            for (int k = 0; k < 3; k++)
                keep[t] = keep[t] && !is_bad[mesh->triangle[t][k]];
        good = count_rim(mesh, keep, &edge_of, edge, ends);
        key_map_free(&edge_of);
        for (int v = 0; v < mesh->vertex_count; v++) {
            is_bad[v] = ends[v] > 2;
            again = again || is_bad[v];
        }
    }
    if (open && good) {
        drop_scraps(mesh, keep, ends, other, is_bad);
        good = triangle_mesh_keep(mesh, keep);
    }
    free(is_bad);
    free(keep);
    free(edge);
    free(ends);
    free(other);
    return good;
}

TriangleMesh *isosurface_of_vessel(const Vessel *vessel, int count, const Vec3 *center, const double *reach, const int *from, double cell_mm)
{
    if (!vessel || !isfinite(cell_mm) || !(cell_mm > 0) || count < 0)
        return NULL;
    VesselMarch *job = calloc(1, sizeof *job);
    if (!job)
        return NULL;
    job->vessel = vessel;
    job->center = center;
    job->reach = reach;
    job->from = from;
    job->march.place = place_vertex;
    bool good = march_begin(&job->march, cell_mm, LEAST_SHARE);
    for (int i = 0; good && i < count; i++)
        good = vec3_is_finite(center[i]) && isfinite(reach[i]) && (!(reach[i] > 0) || march_add_ball(&job->march, i, center[i], reach[i] + MARGIN * cell_mm));
    good = good && march_blocks(job);
    TriangleMesh *mesh = job->march.mesh;
    if (good)
        settle_all(vessel, mesh, 0, NULL, MOVE * cell_mm);
    if (!good || !trim(job) || !march_repair_normals(mesh)) {
        triangle_mesh_free(mesh);
        mesh = NULL;
    }
    march_end(&job->march);
    free(job->made_in);
    free(job);
    return mesh;
}

// --- Refinement ---

TriangleMesh *triangle_mesh_refine(const TriangleMesh *mesh, const Vessel *vessel)
{
    enum { TRIANGLES_MAX = 500000000 };
    if (mesh->triangle_count > TRIANGLES_MAX / 4)
        return NULL;
    size_t old = (size_t)mesh->vertex_count, triangles = (size_t)mesh->triangle_count, edges = 0;
    // at most 3 T / 2 edges of two triangles, and as many again on rims; numbered as they are found
    KeyMap edge_of = {0};
    TriangleMesh *fine = calloc(1, sizeof *fine);
    int(*middle)[3] = malloc((triangles + 1) * sizeof *middle);
    int(*end)[2] = malloc((3 * triangles + 1) * sizeof *end);
    bool good = fine && middle && end && key_map_reserve(&edge_of, triangles + triangles / 2 + 1);
    for (size_t t = 0; good && t < triangles; t++)
        for (int k = 0; good && k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            bool is_new;
            int *edge = key_map_find_or_add(&edge_of, edge_key(a, b), (int)edges, &is_new);
            good = edge != NULL && edges < (size_t)INT_MAX - old;
            if (!good)
                break;
            if (is_new)
                end[edges][0] = a, end[edges++][1] = b;
            middle[t][k] = (int)old + *edge;
        }
    key_map_free(&edge_of);
    double *most = malloc((edges + 1) * sizeof *most);
    if (good) {
        fine->vertex_count = (int)(old + edges);
        fine->triangle_count = 4 * mesh->triangle_count;
        fine->vertex = malloc((old + edges + 1) * sizeof *fine->vertex);
        fine->normal = malloc((old + edges + 1) * sizeof *fine->normal);
        fine->node = malloc((old + edges + 1) * sizeof *fine->node);
        fine->triangle = malloc((4 * triangles + 1) * sizeof *fine->triangle);
        good = most && fine->vertex && fine->normal && fine->node && fine->triangle;
    }
    if (good && triangles > 0) {
        memcpy(fine->vertex, mesh->vertex, old * sizeof *fine->vertex);
        memcpy(fine->normal, mesh->normal, old * sizeof *fine->normal);
        memcpy(fine->node, mesh->node, old * sizeof *fine->node);
        for (size_t e = 0; e < edges; e++) {
            Vec3 a = mesh->vertex[end[e][0]], b = mesh->vertex[end[e][1]], m = vec3_mix(a, b, 0.5);
            fine->vertex[old + e] = m;
            fine->normal[old + e] = vec3(0, 0, 0);
            fine->node[old + e] = mesh->node[end[e][0]];
            most[e] = 0.5 * vec3_distance(a, b);
        }
        settle_all(vessel, fine, mesh->vertex_count, most, 0);
        for (size_t t = 0; t < triangles; t++) {
            const int *v = mesh->triangle[t], *m = middle[t];
            int(*out)[3] = fine->triangle + 4 * t;
            for (int k = 0; k < 3; k++)
                memcpy(out[k], (int[3]){v[k], m[k], m[(k + 2) % 3]}, sizeof out[k]);
            memcpy(out[3], m, sizeof out[3]);
        }
        good = march_repair_normals(fine);
    }
    free(middle);
    free(end);
    free(most);
    if (!good) {
        triangle_mesh_free(fine);
        fine = NULL;
    }
    return fine;
}
