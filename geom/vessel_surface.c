// The wall of any vessel as triangles (isosurface.h): marching cubes over its gap, and refinement with new vertices on the wall.
//
// The gap is 1-Lipschitz, so that a block whose middle is further from the wall than its corners has none of it. Where a vessel answers from local models
// the gap jumps a little; so a block that a marched one passes the wall on to is marched too, whatever its middle says.
#include "geom/sparse_march.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

enum { BATCH = 256, STEPS_MAX = 30 };

static const double CLOSE = 2e-10;           // [mm] to the wall: a step ends where the gap is that small
// Vertices keep away from lattice points by a seventh of a cell, so that those round one lattice point are apart: settled, they make no slivers.
static const double LEAST_SHARE = 0.15;
// [cells] Lattice points that far beyond the balls are known too, so that cells through which the wall runs within the balls have all their corners.
static const double MARGIN = 1.8;

typedef struct VesselMarch {
    March march;             // first: a March * to us is a VesselMarch *
    const Vessel *vessel;
    const Vec3 *center;
    const double *reach;
    const int *from;
    int known_count;
    int known[MARCH_POINTS];                 // lattice points of the block within balls
    Vec3 point[MARCH_POINTS];                // in the order of `known`
    VesselMemory memory[MARCH_POINTS];
    VesselHit hit[MARCH_POINTS];
} VesselMarch;

// Signed gap: open ends are inside.
static double gap_of(const VesselHit *hit) { return hit->flags & VESSEL_OPEN_END ? HUGE_VAL : hit->gap; }

// The ball of the block in which x lies deepest, and how deep.
static int deepest_ball(const VesselMarch *job, const MarchBlock *b, Vec3 x, double *depth)
{
    int best = -1;
    *depth = -HUGE_VAL;
    for (int l = b->first; l >= 0; l = job->march.link[l].next) {
        int n = job->march.link[l].ball;
        double room = job->reach[n] - *depth;   // nearer than that is deeper
        if (room > 0 && vec3_norm2(vec3_sub(x, job->center[n])) < room * room) {
            *depth = job->reach[n] - vec3_distance(x, job->center[n]);
            best = n;
        }
    }
    return best;
}

static VesselMemory located(const VesselMarch *job, int ball, Vec3 x)
{
    return (VesselMemory){.node = job->vessel->locate(job->vessel, x, job->from ? job->from[ball] : -1)};
}

static bool block_is_plain(const VesselMarch *job, const MarchBlock *b)
{
    double h, depth;
    Vec3 middle = march_block_ball(&job->march, b, &h);
    VesselMemory memory = located(job, deepest_ball(job, b, middle, &depth), middle);
    VesselHit hit;
    vessel_query(job->vessel, 1, &middle, 1.01 * h, &memory, &hit);
    return !(hit.flags & VESSEL_OPEN_END) && fabs(hit.gap) > h;
}

static void sample_block(VesselMarch *job, const MarchBlock *b)
{
    March *march = &job->march;
    job->known_count = 0;
    for (int i = 0; i < MARCH_SIDE; i++)
        for (int j = 0; j < MARCH_SIDE; j++)
            for (int k = 0; k < MARCH_SIDE; k++) {
                Vec3 x = march_point(march, b, i, j, k);
                double depth;
                int at = march_index(i, j, k), ball = deepest_ball(job, b, x, &depth);
                march->value[at] = NAN;
                march->owner[at] = ball;
                if (!(depth > -MARGIN * march->cell))
                    continue;
                job->memory[job->known_count] = located(job, ball, x);
                job->point[job->known_count] = x;
                job->known[job->known_count++] = at;
            }
    vessel_query(job->vessel, job->known_count, job->point, 2 * march->cell, job->memory, job->hit);
    for (int n = 0; n < job->known_count; n++)
        march->value[job->known[n]] = fmin(fmax(gap_of(&job->hit[n]), -march->cell), march->cell);
}

static void place_vertex(March *march, const MarchBlock *b, Vec3 p, int inside, Vec3 *vertex, Vec3 *normal, int *node)
{
    const VesselMarch *job = (const VesselMarch *)march;
    double depth;
    int ball = deepest_ball(job, b, p, &depth);
    *vertex = p;
    *normal = vec3(0, 0, 0);
    *node = located(job, ball >= 0 ? ball : inside, p).node;
}

// Moves points onto the wall, none further than most[i]; where there is no wall that near the point comes as near as it can. `node` is where they are
// asked from, and then the node that answers; `normal` looks out.
static void settle(const Vessel *vessel, int count, Vec3 *point, const double *most, Vec3 *normal, int *node)
{
    VesselMemory memory[BATCH];
    VesselHit hit[BATCH];
    Vec3 x[BATCH], start[BATCH];
    double least[BATCH];
    int of[BATCH], going = count;
    double reach = 0;
    for (int i = 0; i < count; i++) {
        memory[i] = (VesselMemory){.node = node[i]};
        x[i] = start[i] = point[i];
        least[i] = HUGE_VAL;
        of[i] = i;
        reach = fmax(reach, 4 * most[i]);
    }
    for (int step = 0; step < STEPS_MAX && going > 0; step++) {
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
            x[left] = next;
            memory[left++] = memory[n];
        }
        going = left;
    }
}

// All vertices from `first` on. most == NULL: all may move by `same`.
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

// Puts the blocks beside b across whose faces the wall goes on in the queue, if they were left out.
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
        good = march_block(march, &march->block[queue[q]]);
        pass_on(job, queue[q], is_plain, is_queued, queue, &queued);
    }
    free(is_plain);
    free(is_queued);
    free(queue);
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
        settle_all(vessel, mesh, 0, NULL, 0.75 * cell_mm);
    else {
        triangle_mesh_free(mesh);
        mesh = NULL;
    }
    march_end(&job->march);
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
    // at most 3 T / 2 edges with two triangles and as many again on rims; found as they come
    KeyMap edge_of = {0};
    TriangleMesh *fine = calloc(1, sizeof *fine);
    int(*middle)[3] = malloc((triangles + 1) * sizeof *middle);
    int(*end)[2] = malloc((3 * triangles + 1) * sizeof *end);
    bool good = fine && middle && end && key_map_reserve(&edge_of, triangles + triangles / 2 + 1);
    for (size_t t = 0; good && t < triangles; t++)
        for (int k = 0; good && k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3], low = a < b ? a : b, high = a < b ? b : a;
            bool is_new;
            int *edge = key_map_find_or_add(&edge_of, (uint64_t)(uint32_t)low << 32 | (uint32_t)high, (int)edges, &is_new);
            good = edge != NULL && edges < (size_t)INT_MAX - old;
            if (!good)
                break;
            if (is_new)
                end[edges][0] = low, end[edges++][1] = high;
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
            fine->node[old + e] = vessel->locate(vessel, m, mesh->node[end[e][0]]);
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
