// See sweep_march.h.
//
// F depends on the place from which it is seen where vessels overlap that do not see each other, and where a curve bends more tightly than the lumen is wide. At a
// lattice point it is the largest F as seen from the samples of the patch in whose tubes the point lies, and from the part of largest share there: so the mesh is
// the surface of all lumens together. Cells are taken in waves: the points that a wave needs are evaluated in lanes, then each cell gives its triangles and asks for the neighbours
// that the wall enters. Beyond the patch the march goes on for a few cells only: far enough to tell islands, where t jumps, from what lies beyond a cut.
#include "geom/sweep_march.h"

#include "base/base.h"
#include "geom/sparse_march.h"

#include <stdlib.h>
#include <string.h>

// A place from which F may be seen, and the tube around it.
typedef struct Sample {
    SweepPlace place;
    Vec3 center;
    double radius, reach;
} Sample;

typedef struct Point {
    int at[3];
    double value, inside;
    SweepPlace place;
} Point;

typedef struct Cell {
    int at[3];
    int beyond;              // cells from the patch
    int corner[8];           // points
} Cell;

// A neighbour that the march did not enter, and the face by which it would have.
typedef struct Stop {
    int at[3];
    int face;
} Stop;

typedef struct Follow {
    March march;             // blocks with their samples, and the mesh
    const SweepMeshParts *parts;
    const MeshPatch *patch;
    double cell;
    int samples, sample_capacity;
    Sample *sample;          // those from sacs_from on are sacs
    int sacs_from;
    KeyMap point_of, cell_of;
    int points, point_capacity, evaluated;
    Point *point;
    int cells, cell_capacity;
    Cell *of_cell;
    int stops, stop_capacity;
    Stop *stop;
    int place_capacity;
    SweepPlace *place;       // (vertices)
    bool good;
} Follow;

static const SweepField *field_of(const Follow *f) { return f->parts->feet.field; }

double sweep_march_inside(const SweepField *field, const MeshPatch *patch, const SweepPlace *place, double least, int *cut)
{
    *cut = -1;
    if (place->branch < 0) {
        for (int s = 0; s < patch->sac_count; s++)
            if (field->sac_group[place->sac] == patch->sac[s])
                return least;
        return -least;
    }
    double best = -HUGE_VAL;
    for (int r = 0; r < patch->run_count; r++) {
        const MeshRun *run = &patch->run[r];
        if (run->branch != place->branch)
            continue;
        double low = place->t - run->t_from, high = run->t_to - place->t, here = fmin(low, high);
        if (here <= best)
            continue;
        best = here;
        *cut = low < high ? run->cut_from : run->cut_to;
    }
    return best > -HUGE_VAL ? fmin(best, 1e3 * least) : -least;
}

// --- Samples ---

static void add_sample(Follow *f, Sample sample)
{
    if (f->samples == f->sample_capacity) {
        f->sample_capacity = f->sample_capacity > 0 ? 2 * f->sample_capacity : 64;
        f->sample = HEAP_GROWN(f->sample, (size_t)f->sample_capacity, sizeof *f->sample);
    }
    f->sample[f->samples++] = sample;
}

static double widest_blend(const SweepField *field, int branch, double t)
{
    const SweepView *view = &field->view[sweep_field_segment(field, branch, t)];
    double width = view->sac >= 0 ? field->sac[view->sac].delta : 0;
    for (int i = 0; i < view->count; i++)
        width = fmax(width, field->fork[view->of[i].branch].delta);
    return width;
}

static void add_place(Follow *f, int branch, double t)
{
    const SweepField *field = field_of(f);
    double length = field->curve[branch]->length;
    t = fmax(0, fmin(length, t));
    double largest = sweep_field_largest(field, branch, t);
    // beyond an end the section runs on with its slope
    if (t >= length)
        largest = fmax(largest, fmax(sweep_field_largest(field, branch, 2 * length + largest), sweep_field_largest(field, branch, length * (1 - 1e-12))));
    Sample sample = {.place = {.branch = branch, .t = t, .sac = -1},
                     .center = sweep_curve_at(field->curve[branch], t).s,
                     .radius = largest,
                     .reach = 1.1 * largest + widest_blend(field, branch, t) + 2 * f->cell};
    f->good = f->good && march_add_ball(&f->march, f->samples, sample.center, sample.reach);
    add_sample(f, sample);
}

// Sacs are few and wide: their samples belong to no blocks.
static void add_sacs(Follow *f)
{
    const SweepField *field = field_of(f);
    const VesselTree *sac = field->model->sac;
    for (int s = 0; s < f->patch->sac_count; s++)
        for (int i = 0; i < sac->node_count; i++) {
            if (field->sac_group[i] != f->patch->sac[s])
                continue;
            Blobby blobs = blobby_of(sac, i);
            double reach = sac->radius[i];
            for (int k = 0; k < blobs.count; k++) {
                int row = blobby_row(&blobs, k);
                reach = fmax(reach, vec3_distance(blobs.center[row], sac->center[i]) + blobs.width[row]);
            }
            add_sample(f, (Sample){.place = {.branch = -1, .sac = i}, .center = sac->center[i], .radius = sac->radius[i], .reach = reach});
        }
}

// Places along the patch's runs, and as far beyond its cuts as the march goes.
static void add_samples(Follow *f)
{
    static const double SHORTEST = 1e-6;
    const SweepField *field = field_of(f);
    for (int r = 0; r < f->patch->run_count; r++) {
        const MeshRun *run = &f->patch->run[r];
        double length = field->curve[run->branch]->length, more = (MESH_BEYOND + 2) * f->cell;
        double from = fmax(0, run->t_from - more), to = fmin(length, run->t_to + more), t = from;
        while (t < to) {
            add_place(f, run->branch, t);
            t += fmax(fmax(0.4 * sweep_field_mean(field, run->branch, t), 0.5 * f->cell), SHORTEST * length);
        }
        add_place(f, run->branch, to);
    }
    f->sacs_from = f->samples;
    add_sacs(f);
}

// --- Lattice points ---

// The index of the block that holds a lattice point; -1: the point is far from all samples.
static int block_of(const Follow *f, const int at[3])
{
    int base[3];
    for (int a = 0; a < 3; a++)
        base[a] = (at[a] >= 0 ? at[a] / MARCH_BLOCK : -((-at[a] + MARCH_BLOCK - 1) / MARCH_BLOCK)) * MARCH_BLOCK;
    return key_map_find(&f->march.block_of, march_key(base[0], base[1], base[2]));
}

static Vec3 lattice_point(const Follow *f, const int at[3]) { return vec3(at[0] * f->cell, at[1] * f->cell, at[2] * f->cell); }

enum { VIEWS = 4 };

// Keeps the deepest samples in order.
static void add_best(int *best, double *deep, int *count, int sample, double here)
{
    int at = *count;
    for (; at > 0 && here > deep[at - 1]; at--)
        if (at < VIEWS)
            deep[at] = deep[at - 1], best[at] = best[at - 1];
    if (at < VIEWS)
        deep[at] = here, best[at] = sample;
    *count += *count < VIEWS;
}

// The samples from which F at x is to be seen: those in whose tubes x lies deepest, deeper than in the samples beside them. The first is the deepest of all.
static int best_samples(const Follow *f, Vec3 x, int block, int *best)
{
    static const double OUTSIDE = 0.25;      // [radii] how far outside of a sample's tube the wall may still be its own
    double deep[VIEWS], before = -HUGE_VAL;
    int count = 0, last = -2;
    bool rises = false;
    for (int link = block >= 0 ? f->march.block[block].first : -1;; link = f->march.link[link].next) {
        int ball = link >= 0 ? f->march.link[link].ball : -1;
        const Sample *s = ball >= 0 ? &f->sample[ball] : NULL;
        bool follows = s && ball == last + 1 && s->place.branch >= 0 && s->place.branch == f->sample[last].place.branch;
        double here = s ? s->radius - vec3_distance(x, s->center) : 0;
        // the sample before is deeper than both beside it
        if (rises && !(follows && here > before))
            add_best(best, deep, &count, last, before);
        if (!s)
            break;
        rises = !follows || here > before;
        before = here, last = ball;
    }
    int sac = -1;
    for (int i = f->sacs_from; i < f->samples; i++) {
        const Sample *s = &f->sample[i];
        double away = vec3_distance(x, s->center), here = s->radius - away;
        if (away < s->reach && (sac < 0 || here > before))
            sac = i, before = here;
    }
    if (sac >= 0)
        add_best(best, deep, &count, sac, before);
    while (count > 1 && deep[count - 1] < -OUTSIDE * f->sample[best[count - 1]].radius)
        count--;
    return count;
}

typedef struct Queue {
    int count;
    int index[FOOT_BLOCK];
    SweepPlace place[FOOT_BLOCK];
    int views[FOOT_BLOCK], view[FOOT_BLOCK][VIEWS];      // other samples from which F may have to be seen
} Queue;

// Whether a sample's stretch of its branch is among the parts that were seen in a lane.
static bool is_seen(const Sample *s, const SweepBlock *b, int lane)
{
    if (s->place.branch < 0)
        return b->sac[lane] >= 0;
    for (int k = 0; k < b->view[lane]->count; k++)
        if (b->view[lane]->of[k].branch == s->place.branch && fabs(b->part[k].t[lane] - s->place.t) < s->radius)
            return true;
    return false;
}

static void put_place(Queue *q, int index, SweepPlace place)
{
    SEL_ASSERT(q->count < FOOT_BLOCK, "a full queue is sampled");
    q->index[q->count] = index, q->place[q->count] = place;
    q->views[q->count++] = 0;
}

// F at the queued points from their places; a point keeps the largest. Where the part of largest share is on another branch than the place, or where a sample
// that holds the point was not seen, the point is queued `again` (NULL: not).
static void sample_queue(Follow *f, Queue *q, Queue *again)
{
    SweepBlock b;
    if (q->count == 0)
        return;
    sweep_block_begin(&b);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        int k = i < q->count ? i : 0;
        Vec3 x = lattice_point(f, f->point[q->index[k]].at);
        mesh_set_place(&f->parts->feet, &b, i, &q->place[k]);
        b.foot.at.x[i] = x.x, b.foot.at.y[i] = x.y, b.foot.at.z[i] = x.z;
    }
    sweep_block_slope(&f->parts->feet, &b, FOOT_ALL);
    for (int i = 0; i < q->count; i++) {
        Point *point = &f->point[q->index[i]];
        SweepPlace owner = mesh_owner(&b, i);
        if (!(point->value > b.foot.at.f[i]))
            point->value = b.foot.at.f[i], point->place = owner;
        for (int k = -1; again && k < q->views[i]; k++) {
            const Sample *s = k >= 0 ? &f->sample[q->view[i][k]] : NULL;
            if (s ? is_seen(s, &b, i) : owner.branch == q->place[i].branch)
                continue;
            put_place(again, q->index[i], s ? s->place : owner);
            if (again->count == FOOT_BLOCK)
                sample_queue(f, again, NULL);
        }
    }
    q->count = 0;
}

// Values of the points that have none yet.
static void evaluate_points(Follow *f)
{
    Queue queue = {.count = 0}, again = {.count = 0};
    int first = f->evaluated;
    for (; f->evaluated < f->points; f->evaluated++) {
        Point *point = &f->point[f->evaluated];
        int best[VIEWS], views = best_samples(f, lattice_point(f, point->at), block_of(f, point->at), best);
        point->value = views > 0 ? -HUGE_VAL : -f->cell;
        point->place = (SweepPlace){.branch = -1, .sac = -1};
        if (views == 0)
            continue;
        put_place(&queue, f->evaluated, f->sample[best[0]].place);
        for (int k = 1; k < views; k++)
            queue.view[queue.count - 1][queue.views[queue.count - 1]++] = best[k];
        if (queue.count == FOOT_BLOCK)
            sample_queue(f, &queue, &again);
    }
    sample_queue(f, &queue, &again);
    sample_queue(f, &again, NULL);
    for (int i = first; i < f->points; i++) {
        Point *point = &f->point[i];
        int cut;
        point->inside = point->place.branch >= 0 || point->place.sac >= 0 ? sweep_march_inside(field_of(f), f->patch, &point->place, f->cell, &cut) : -f->cell;
    }
}

// The index of a cell's corner.
static int corner_of(Follow *f, const int at[3], int c)
{
    int corner[3] = {at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2 & 1)};
    bool is_new;
    int *found = key_map_find_or_add(&f->point_of, march_key(corner[0], corner[1], corner[2]), f->points, &is_new);
    if (!found)
        heap_is_empty(sizeof(Point), __FILE__);
    if (!is_new)
        return *found;
    if (f->points == f->point_capacity) {
        f->point_capacity = f->point_capacity > 0 ? 2 * f->point_capacity : 4096;
        f->point = HEAP_GROWN(f->point, (size_t)f->point_capacity, sizeof *f->point);
    }
    f->point[f->points] = (Point){.at = {corner[0], corner[1], corner[2]}};
    return f->points++;
}

// --- Cells ---

static bool fits(const int at[3])
{
    enum { MOST = (1 << 19) - 4 };
    return abs(at[0]) < MOST && abs(at[1]) < MOST && abs(at[2]) < MOST;
}

static void add_cell(Follow *f, const int at[3], int beyond)
{
    bool is_new;
    int *found = fits(at) ? key_map_find_or_add(&f->cell_of, march_key(at[0], at[1], at[2]), f->cells, &is_new) : NULL;
    if (!found) {
        f->good = false;
        return;
    }
    if (!is_new)
        return;
    if (f->cells == f->cell_capacity) {
        f->cell_capacity = f->cell_capacity > 0 ? 2 * f->cell_capacity : 4096;
        f->of_cell = HEAP_GROWN(f->of_cell, (size_t)f->cell_capacity, sizeof *f->of_cell);
    }
    f->of_cell[f->cells++] = (Cell){.at = {at[0], at[1], at[2]}, .beyond = beyond};
}

static void add_stop(Follow *f, const int at[3], int face)
{
    if (f->stops == f->stop_capacity) {
        f->stop_capacity = f->stop_capacity > 0 ? 2 * f->stop_capacity : 256;
        f->stop = HEAP_GROWN(f->stop, (size_t)f->stop_capacity, sizeof *f->stop);
    }
    f->stop[f->stops++] = (Stop){.at = {at[0], at[1], at[2]}, .face = face};
}

static uint64_t edge_key(const int at[3], int edge)
{
    int c = cube_edge_start(edge);
    return march_key(at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2 & 1)) << 2 | (uint64_t)(edge / 4);
}

// The vertex on an edge of a cell whose ends have the points a and b.
static int vertex_on(Follow *f, const int at[3], int edge, int a, int b)
{
    static const double LEAST = 0.1;         // [cells] from the lattice points, which several edges share
    March *march = &f->march;
    TriangleMesh *mesh = march->mesh;
    bool is_new;
    int *found = key_map_find_or_add(&march->vertex_of, edge_key(at, edge), mesh->vertex_count, &is_new);
    if (!found || (is_new && !march_reserve(march)))
        heap_is_empty(sizeof(Vec3), __FILE__);
    if (!is_new)
        return *found;
    const Point *p = &f->point[a], *q = &f->point[b];
    if (mesh->vertex_count == f->place_capacity) {
        f->place_capacity = f->place_capacity > 0 ? 2 * f->place_capacity : 4096;
        f->place = HEAP_GROWN(f->place, (size_t)f->place_capacity, sizeof *f->place);
    }
    double share = fmax(LEAST, fmin(1 - LEAST, p->value / (p->value - q->value)));
    SweepPlace *place = &f->place[mesh->vertex_count];
    *place = p->value > 0 ? p->place : q->place;
    if (p->place.branch >= 0 && p->place.branch == q->place.branch)
        place->t = p->place.t + share * (q->place.t - p->place.t);
    mesh->vertex[mesh->vertex_count] = vec3_mix(lattice_point(f, p->at), lattice_point(f, q->at), share);
    return mesh->vertex_count++;
}

// The triangles of a cell, and the neighbours that the wall enters.
static void march_cell(Follow *f, int index)
{
    Cell cell = f->of_cell[index];
    int of_edge[12], mask = 0;
    bool is_inside = false;
    for (int c = 0; c < 8; c++) {
        mask |= (f->point[cell.corner[c]].value > 0) << c;
        is_inside |= f->point[cell.corner[c]].inside > 0;
    }
    memset(of_edge, -1, sizeof of_edge);
    const CubeCase *cube = &f->march.table.of[mask];
    for (int t = 0; t < cube->count; t++) {
        int v[3];
        for (int k = 0; k < 3; k++) {
            int edge = cube->edge[t][k];
            if (of_edge[edge] < 0)
                of_edge[edge] = vertex_on(f, cell.at, edge, cell.corner[cube_edge_start(edge)], cell.corner[cube_edge_end(edge)]);
            v[k] = of_edge[edge];
        }
        if (!march_add_triangle(&f->march, v))
            heap_is_empty(sizeof v, __FILE__);
    }
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, side = face & 1, on = 0, to[3] = {cell.at[0], cell.at[1], cell.at[2]};
        for (int c = 0; c < 8; c++)
            on += (c >> axis & 1) == side ? mask >> c & 1 : 0;
        if (on == 0 || on == 4)
            continue;
        to[axis] += side ? 1 : -1;
        int beyond = is_inside ? 0 : cell.beyond + 1;
        if (beyond <= MESH_BEYOND)
            add_cell(f, to, beyond);
        else
            add_stop(f, to, face);
    }
}

static void add_seed(Follow *f, Vec3 x)
{
    double at[3] = {floor(x.x / f->cell), floor(x.y / f->cell), floor(x.z / f->cell)};
    int cell[3];
    for (int a = 0; a < 3; a++)
        cell[a] = fabs(at[a]) < 1e6 ? (int)at[a] : 1 << 20;
    add_cell(f, cell, 0);
}

static void add_seeds(Follow *f)
{
    for (int r = 0; r < f->patch->run_count; r++) {
        const MeshRun *run = &f->patch->run[r];
        const MeshRings *rings = &f->parts->rings[run->branch];
        for (int k = run->from; k <= run->to + 1; k++) {
            bool is_cut = (k == run->from && run->cut_from >= 0) || (k == run->to + 1 && run->cut_to >= 0);
            if (!is_cut && f->patch->cut_count > 0)
                continue;
            const MeshRing *ring = &rings->ring[k];
            MeshPlane plane = {.branch = -1};
            if (ring->is_blended && ring->kind == RING_SECTION)
                plane = mesh_plane(&f->parts->feet, run->branch, ring->t);
            for (int v = 0; v < ring->count; v++) {
                Vec3 x = rings->at[ring->first + v];
                add_seed(f, plane.branch >= 0 ? mesh_plane_blended(&f->parts->feet, &plane, x) : x);
            }
        }
    }
}

// Marks the vertices on the faces through which the march did not go.
static void mark_ends(const Follow *f, bool *is_end)
{
    for (int s = 0; s < f->stops; s++) {
        const Stop *stop = &f->stop[s];
        if (key_map_find(&f->cell_of, march_key(stop->at[0], stop->at[1], stop->at[2])) >= 0)
            continue;
        int axis = stop->face / 2, side = 1 - (stop->face & 1);      // the face as seen from the cell that was left out
        for (int edge = 0; edge < 12; edge++) {
            if ((cube_edge_start(edge) >> axis & 1) != side || (cube_edge_end(edge) >> axis & 1) != side)
                continue;
            int v = key_map_find(&f->march.vertex_of, edge_key(stop->at, edge));
            if (v >= 0)
                is_end[v] = true;
        }
    }
}

bool sweep_march(const SweepMeshParts *parts, const MeshPatch *patch, double cell, SweepMarch *out)
{
    Follow *f = HEAP_ZEROED(1, sizeof *f);
    f->parts = parts, f->patch = patch, f->cell = cell;
    f->good = march_begin(&f->march, cell, 0);
    if (f->good)
        add_samples(f);
    if (f->good)
        add_seeds(f);
    for (int done = 0; f->good && done < f->cells;) {
        int wave = f->cells;
        for (int i = done; i < wave; i++)
            for (int c = 0; c < 8; c++)
                f->of_cell[i].corner[c] = corner_of(f, f->of_cell[i].at, c);
        evaluate_points(f);
        for (; done < wave; done++)
            march_cell(f, done);
    }
    TriangleMesh *mesh = f->march.mesh;
    *out = (SweepMarch){.place = f->place};
    if (mesh) {
        out->vertices = mesh->vertex_count, out->triangles = mesh->triangle_count;
        out->at = mesh->vertex, out->triangle = mesh->triangle;
        mesh->vertex = NULL, mesh->triangle = NULL;
        out->is_end = HEAP_ZEROED((size_t)out->vertices + 1, sizeof *out->is_end);
        mark_ends(f, out->is_end);
    }
    bool good = f->good;
    triangle_mesh_free(mesh);
    march_end(&f->march);
    key_map_free(&f->point_of);
    key_map_free(&f->cell_of);
    free(f->sample);
    free(f->point);
    free(f->of_cell);
    free(f->stop);
    free(f);
    return good;
}

void sweep_march_free(SweepMarch *march)
{
    free(march->at);
    free(march->place);
    free(march->is_end);
    free(march->triangle);
    *march = (SweepMarch){0};
}
