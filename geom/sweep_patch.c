// Patches of the swept model's mesh (sweep_mesh.h): the wall where branches and sacs blend.
//
// The lattice lies at multiples of the cell, which is the least edge of the patch's rings. At a lattice point F is seen from the place of the patch in whose
// tube it lies deepest, and, where the part of largest share is another one, from there. Vertices move along the gradient onto F = 0.
// A vertex on a branch is inside the patch if its t lies within one of the branch's runs; how far, is its value. Vertices close to a cut are first moved onto
// it. Triangles are cut where the value is 0, and the cut's vertices are put onto the ring's section. The other vertices are evened out: each moves half of the
// way to the mean of its neighbours, and back onto F = 0.
#include "geom/sweep_mesh_parts.h"

#include "base/base.h"
#include "geom/sparse_march.h"

#include <stdlib.h>
#include <string.h>

// A place of the patch from which F may be seen, and the ball of the lattice around it.
typedef struct Sample {
    SweepPlace place;
    Vec3 center;
    double radius, reach;
} Sample;

typedef struct Patch {
    March march;             // must be first: callbacks convert their March * to Patch *
    const SweepMeshParts *parts;
    MeshPatch *out;
    double cell, widest;     // widest: of the blends [mm]
    int samples, sample_capacity;
    Sample *sample;
    SweepPlace of_point[MARCH_POINTS];   // of the current block's lattice points
    int places, place_capacity;
    SweepPlace *place;       // (vertices)
    double *value;           // (vertices) > 0: inside the patch
    int *cut;                // (vertices) the cut on which the vertex lies, or that it lies beyond; -1
    int cut_capacity;
} Patch;

static const SweepField *field_of(const Patch *p) { return p->parts->feet.field; }

// --- Samples ---

static void add_sample(Patch *p, Sample sample)
{
    if (p->samples == p->sample_capacity) {
        p->sample_capacity = p->sample_capacity > 0 ? 2 * p->sample_capacity : 64;
        p->sample = HEAP_GROWN(p->sample, (size_t)p->sample_capacity, sizeof *p->sample);
    }
    p->sample[p->samples++] = sample;
}

static double widest_blend(const SweepField *field, int branch, double t)
{
    const SweepView *view = &field->view[sweep_field_segment(field, branch, t)];
    double width = view->sac >= 0 ? field->sac[view->sac].delta : 0;
    for (int i = 0; i < view->count; i++)
        width = fmax(width, field->fork[view->of[i].branch].delta);
    return width;
}

static void add_place(Patch *p, int branch, double t)
{
    const SweepField *field = field_of(p);
    double length = field->curve[branch]->length;
    t = fmax(0, fmin(length, t));
    double largest = sweep_field_largest(field, branch, t), blend = widest_blend(field, branch, t);
    p->widest = fmax(p->widest, blend);
    // beyond an end the section runs on with its slope
    if (t >= length)
        largest = fmax(largest, fmax(sweep_field_largest(field, branch, 2 * length + largest), sweep_field_largest(field, branch, length * (1 - 1e-12))));
    add_sample(p, (Sample){.place = {.branch = branch, .t = t, .sac = -1},
                           .center = sweep_curve_at(field->curve[branch], t).s,
                           .radius = largest,
                           .reach = 1.1 * largest + blend + 2 * p->cell});
}

// Places along the patch's runs, and two steps beyond its cuts.
static void fill_samples(Patch *p)
{
    static const double SHORTEST = 1e-6;
    const SweepField *field = field_of(p);
    for (int r = 0; r < p->out->run_count; r++) {
        const MeshRun *run = &p->out->run[r];
        double length = field->curve[run->branch]->length, from = fmax(0, run->t_from - 3 * p->cell), to = fmin(length, run->t_to + 3 * p->cell), t = from;
        while (t < to) {
            add_place(p, run->branch, t);
            t += fmax(fmax(0.4 * sweep_field_mean(field, run->branch, t), 0.5 * p->cell), SHORTEST * length);
        }
        add_place(p, run->branch, to);
    }
    const VesselTree *sac = field->model->sac;
    for (int s = 0; s < p->out->sac_count; s++)
        for (int i = 0; i < sac->node_count; i++) {
            if (field->sac_group[i] != p->out->sac[s])
                continue;
            for (int64_t k = sac->blob_offset[i]; k < sac->blob_offset[i + 1]; k++)
                add_sample(p, (Sample){.place = {.branch = -1, .sac = i}, .center = sac->blob_center[k], .radius = -1e9, .reach = sac->blob_width[k]});
            add_sample(p, (Sample){.place = {.branch = -1, .sac = i}, .center = sac->center[i], .radius = sac->radius[i], .reach = sac->radius[i]});
        }
}

// The least edge at a cut; ends without a cut may lie deep inside. Not below a sixth of the largest, for a thread on a wide vessel.
static double cell_of(const Patch *p)
{
    static const double LEAST = 1.0 / 6;
    const SweepField *field = field_of(p);
    double least = HUGE_VAL, most = 0;
    for (int r = 0; r < p->out->run_count; r++) {
        const MeshRun *run = &p->out->run[r];
        double length = field->curve[run->branch]->length, from = fmax(0, run->t_from), to = fmin(length, run->t_to);
        bool whole = !isfinite(run->t_from) && !isfinite(run->t_to);
        for (int end = 0; end < 2; end++) {
            double edge = mesh_edge(p->parts, run->branch, whole ? 0.5 * length : end ? to : from);
            most = fmax(most, edge);
            if (whole || isfinite(end ? run->t_to : run->t_from))
                least = fmin(least, edge);
        }
    }
    return fmax(least, LEAST * most);
}

// --- The lattice ---

typedef struct Queue {
    int count;
    int index[FOOT_BLOCK];
    Vec3 at[FOOT_BLOCK];
} Queue;

// F at the queued lattice points, from their places. Returns the bits of those whose largest part is another branch or sac than the place's.
static unsigned sample_queue(Patch *p, const Queue *q)
{
    SweepBlock b;
    unsigned other = 0;
    sweep_block_begin(&b);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        int k = i < q->count ? i : 0;
        mesh_set_place(&p->parts->feet, &b, i, &p->of_point[q->index[k]]);
        b.foot.at.x[i] = q->at[k].x, b.foot.at.y[i] = q->at[k].y, b.foot.at.z[i] = q->at[k].z;
    }
    sweep_block_sample(&p->parts->feet, &b, FOOT_ALL);
    for (int i = 0; i < q->count; i++) {
        SweepPlace owner = mesh_owner(&b, i);
        p->march.value[q->index[i]] = b.foot.at.f[i];
        other |= owner.branch != p->of_point[q->index[i]].branch ? 1u << i : 0;
        p->of_point[q->index[i]] = owner;
    }
    return other;
}

static void run_queue(Patch *p, Queue *q, Queue *again)
{
    if (q->count == 0)
        return;
    unsigned other = sample_queue(p, q);
    for (int i = 0; i < q->count; i++) {
        if (!(other >> i & 1) || fabs(p->march.value[q->index[i]]) > 4 * p->cell)
            continue;
        again->index[again->count] = q->index[i], again->at[again->count++] = q->at[i];
        if (again->count == FOOT_BLOCK) {
            sample_queue(p, again);
            again->count = 0;
        }
    }
    q->count = 0;
}

// The place from which F is seen at a lattice point: the sample in whose tube the point lies deepest. Returns -1, and a bound of F, where it is certainly
// negative.
static int best_sample(const Patch *p, Vec3 x, const int *near, int nears, double *bound)
{
    double deepest = -HUGE_VAL;
    int best = -1;
    bool reached = false;
    for (int n = 0; n < nears; n++) {
        const Sample *s = &p->sample[near[n]];
        double far2 = vec3_norm2(vec3_sub(x, s->center));
        reached |= far2 < s->reach * s->reach;
        if (s->radius < 0 || (deepest > -HUGE_VAL && s->radius - deepest > 0 && far2 > same_square(s->radius - deepest)))
            continue;
        double deep = s->radius - sqrt(far2);
        if (deep > deepest)
            deepest = deep, best = near[n];
    }
    *bound = fmin(-p->cell, deepest + p->widest);
    // a sac's blobs may reach where no other sample is near
    if (best < 0 && nears > 0)
        best = near[0];
    return reached ? best : -1;
}

// Evaluates the lattice points of a block that are `wanted`.
static void fill_points(Patch *p, const MarchBlock *block, const int *near, int nears, const bool *wanted)
{
    March *march = &p->march;
    Queue queue = {.count = 0}, again = {.count = 0};
    for (int i = 0; i < MARCH_SIDE; i++)
        for (int j = 0; j < MARCH_SIDE; j++)
            for (int k = 0; k < MARCH_SIDE; k++) {
                int at = march_index(i, j, k);
                if (!wanted[at])
                    continue;
                Vec3 x = march_point(march, block, i, j, k);
                int best = best_sample(p, x, near, nears, &march->value[at]);
                if (best < 0)
                    continue;
                p->of_point[at] = p->sample[best].place;
                queue.index[queue.count] = at, queue.at[queue.count++] = x;
                if (queue.count == FOOT_BLOCK)
                    run_queue(p, &queue, &again);
            }
    run_queue(p, &queue, &again);
    if (again.count > 0)
        sample_queue(p, &again);
}

enum { STRIDE = MARCH_BLOCK / 2 };

// Marks the points of the eighth of a block at (i, j, k) as wanted if the wall may run through it; else gives them the sign of its corners.
static void want_eighth(Patch *p, int i, int j, int k, const double *coarse, bool *wanted)
{
    static const double STEEPEST = 1.5;      // of F
    double least = HUGE_VAL, most = -HUGE_VAL, far = STEEPEST * 0.5 * sqrt(3) * STRIDE * p->cell;
    for (int c = 0; c < 8; c++) {
        double value = coarse[march_index(i + (c & 1) * STRIDE, j + (c >> 1 & 1) * STRIDE, k + (c >> 2 & 1) * STRIDE)];
        least = fmin(least, value), most = fmax(most, value);
    }
    bool skip = least > far || most < -far;
    for (int x = i; x <= i + STRIDE; x++)
        for (int y = j; y <= j + STRIDE; y++)
            for (int z = k; z <= k + STRIDE; z++) {
                int at = march_index(x, y, z);
                if (skip)
                    p->march.value[at] = wanted[at] ? p->march.value[at] : least;
                else
                    wanted[at] = true;
            }
}

// Values of a block's lattice points: first every fourth one. Returns whether both signs occur.
static bool fill_block(Patch *p, const MarchBlock *block, int *near)
{
    March *march = &p->march;
    bool wanted[MARCH_POINTS] = {false};
    double coarse[MARCH_POINTS];
    int nears = 0, inside = 0;
    for (int link = block->first; link >= 0; link = march->link[link].next)
        near[nears++] = march->link[link].ball;
    for (int i = 0; i < MARCH_SIDE; i += STRIDE)
        for (int j = 0; j < MARCH_SIDE; j += STRIDE)
            for (int k = 0; k < MARCH_SIDE; k += STRIDE)
                wanted[march_index(i, j, k)] = true;
    for (int i = 0; i < MARCH_POINTS; i++)
        march->owner[i] = i;
    fill_points(p, block, near, nears, wanted);
    memcpy(coarse, march->value, sizeof coarse);
    memset(wanted, 0, sizeof wanted);
    for (int i = 0; i < MARCH_BLOCK; i += STRIDE)
        for (int j = 0; j < MARCH_BLOCK; j += STRIDE)
            for (int k = 0; k < MARCH_BLOCK; k += STRIDE)
                want_eighth(p, i, j, k, coarse, wanted);
    fill_points(p, block, near, nears, wanted);
    for (int i = 0; i < MARCH_POINTS; i++)
        inside += march->value[i] > 0;
    return inside > 0 && inside < MARCH_POINTS;
}

static void place_vertex(March *march, const MarchBlock *block, Vec3 x, int owner, Vec3 *vertex, Vec3 *normal, int *node)
{
    Patch *p = (Patch *)march;
    (void)block;
    *vertex = x, *normal = vec3(0, 0, 0), *node = -1;
    if (p->places == p->place_capacity) {
        p->place_capacity = p->place_capacity > 0 ? 2 * p->place_capacity : 4096;
        p->place = HEAP_GROWN(p->place, (size_t)p->place_capacity, sizeof *p->place);
    }
    p->place[p->places++] = p->of_point[owner];
}

static bool march_patch(Patch *p)
{
    March *march = &p->march;
    march->place = place_vertex;
    if (!march_begin(march, p->cell, 0.1))
        return false;
    for (int i = 0; i < p->samples; i++)
        if (!march_add_ball(march, i, p->sample[i].center, p->sample[i].reach))
            return false;
    int *near = HEAP_ZEROED((size_t)p->samples, sizeof *near);
    bool good = true;
    for (int n = 0; good && n < march->block_count; n++)
        if (fill_block(p, &march->block[n], near))
            good = march_block(march, &march->block[n]);
    free(near);
    return good;
}

// --- Onto the wall ---

// Newton along the gradient for the vertices with `moves` (NULL: all), and their normals.
static void project(Patch *p, int count, Vec3 *at, Vec3 *normal, SweepPlace *place, const bool *moves, int rounds)
{
    static const double CLOSE = 1e-11, LONGEST = 0.5;       // [cells]
    int which[FOOT_BLOCK], next = 0;
    while (next < count) {
        int lanes = 0;
        for (; next < count && lanes < FOOT_BLOCK; next++)
            if (!moves || moves[next])
                which[lanes++] = next;
        if (lanes == 0)
            return;
        SweepBlock b;
        FootSample *f = &b.foot.at;
        sweep_block_begin(&b);
        for (int i = 0; i < FOOT_BLOCK; i++) {
            int v = which[i < lanes ? i : 0];
            mesh_set_place(&p->parts->feet, &b, i, &place[v]);
            f->x[i] = at[v].x, f->y[i] = at[v].y, f->z[i] = at[v].z;
        }
        bool close = false;
        for (int round = 0; round < rounds && !close; round++) {
            sweep_block_sample(&p->parts->feet, &b, FOOT_ALL);
            close = true;
            for (int i = 0; i < lanes; i++) {
                double slope2 = fmax(f->gx[i] * f->gx[i] + f->gy[i] * f->gy[i] + f->gz[i] * f->gz[i], 1e-6), step = -f->f[i] / slope2,
                       far = fabs(step) * sqrt(slope2);
                if (far > LONGEST * p->cell)
                    step *= LONGEST * p->cell / far;
                f->x[i] += step * f->gx[i], f->y[i] += step * f->gy[i], f->z[i] += step * f->gz[i];
                close &= far < CLOSE * p->cell;
            }
        }
        for (int i = 0; i < lanes; i++) {
            int v = which[i];
            at[v] = vec3(f->x[i], f->y[i], f->z[i]);
            normal[v] = vec3_unit(vec3(-f->gx[i], -f->gy[i], -f->gz[i]));
            place[v] = mesh_owner(&b, i);
        }
    }
}

// --- The cut ---

// How far a vertex is inside the patch, and the cut next to it.
static double inside(const Patch *p, const SweepPlace *place, int *cut)
{
    const MeshPatch *out = p->out;
    *cut = -1;
    if (place->branch < 0) {
        for (int s = 0; s < out->sac_count; s++)
            if (field_of(p)->sac_group[place->sac] == out->sac[s])
                return p->cell;
        return -p->cell;
    }
    double best = -HUGE_VAL;
    for (int r = 0; r < out->run_count; r++) {
        const MeshRun *run = &out->run[r];
        if (run->branch != place->branch)
            continue;
        double low = place->t - run->t_from, high = run->t_to - place->t, here = fmin(low, high);
        if (here <= best)
            continue;
        best = here;
        *cut = low < high ? run->cut_from : run->cut_to;
    }
    return best > -HUGE_VAL ? fmin(best, 1e3 * p->cell) : -p->cell;
}

// Puts a vertex onto the cut's ring.
static Vec3 onto_cut(const Patch *p, const MeshPlane *plane, bool is_blended, Vec3 x, SweepPlace *place)
{
    *place = (SweepPlace){.branch = plane->branch, .t = plane->t, .sac = -1};
    if (is_blended)
        return mesh_plane_blended(&p->parts->feet, plane, x);
    Vec3 u = vec3_sub(x, plane->s);
    double n = vec3_dot(u, plane->n), b = vec3_dot(u, plane->b), rho = fmax(same_hypot(n, b), 1e-12);
    return mesh_plane_point(plane, n / rho, b / rho);
}

typedef struct Cutter {
    Patch *p;
    MeshPlane *plane;        // (cuts)
    bool *is_blended;        // (cuts)
    KeyMap of_edge;
    int vertices, capacity;
    Vec3 *at;
    SweepPlace *place;
    double *value;
    int *cut;                // on which it lies, -1
    int triangles, triangle_capacity;
    int (*triangle)[3];
} Cutter;

static int add_vertex(Cutter *c, Vec3 at, SweepPlace place, double value, int cut)
{
    if (c->vertices == c->capacity) {
        c->capacity = c->capacity > 0 ? 2 * c->capacity : 4096;
        c->at = HEAP_GROWN(c->at, (size_t)c->capacity, sizeof *c->at);
        c->place = HEAP_GROWN(c->place, (size_t)c->capacity, sizeof *c->place);
        c->value = HEAP_GROWN(c->value, (size_t)c->capacity, sizeof *c->value);
        c->cut = HEAP_GROWN(c->cut, (size_t)c->capacity, sizeof *c->cut);
    }
    c->at[c->vertices] = at, c->place[c->vertices] = place, c->value[c->vertices] = value, c->cut[c->vertices] = cut;
    return c->vertices++;
}

static void add_triangle(Cutter *c, int a, int b, int d)
{
    if (c->triangles == c->triangle_capacity) {
        c->triangle_capacity = c->triangle_capacity > 0 ? 2 * c->triangle_capacity : 4096;
        c->triangle = HEAP_GROWN(c->triangle, (size_t)c->triangle_capacity, sizeof *c->triangle);
    }
    int *t = c->triangle[c->triangles++];
    t[0] = a, t[1] = b, t[2] = d;
}

// The vertex where the edge from a (inside) to b (beyond a cut) is cut.
static int cut_edge(Cutter *c, int a, int b)
{
    bool is_new;
    uint64_t key = (uint64_t)(a < b ? a : b) << 31 | (uint64_t)(a < b ? b : a);
    int *found = key_map_find_or_add(&c->of_edge, key, c->vertices, &is_new);
    if (!found)
        heap_is_empty(sizeof key, __FILE__);
    if (!is_new)
        return *found;
    int cut = c->cut[b];
    double share = c->value[a] / (c->value[a] - c->value[b]);
    Vec3 x = vec3_mix(c->at[a], c->at[b], share);
    SweepPlace place = c->place[b];
    if (cut >= 0)
        x = onto_cut(c->p, &c->plane[cut], c->is_blended[cut], x, &place);
    return add_vertex(c, x, place, 0, cut);
}

static void cut_triangle(Cutter *c, const int *v)
{
    int corner[4], corners = 0, inside_count = 0, beyond = 0;
    for (int k = 0; k < 3; k++)
        inside_count += c->value[v[k]] > 0, beyond += c->value[v[k]] < 0;
    if (inside_count == 0)
        return;
    for (int k = 0; k < 3; k++) {
        int a = v[k], b = v[(k + 1) % 3];
        if (c->value[a] >= 0)
            corner[corners++] = a;
        if (beyond > 0 && c->value[a] > 0 && c->value[b] < 0)
            corner[corners++] = cut_edge(c, a, b);
        else if (beyond > 0 && c->value[a] < 0 && c->value[b] > 0)
            corner[corners++] = cut_edge(c, b, a);
    }
    if (corners == 3)
        add_triangle(c, corner[0], corner[1], corner[2]);
    if (corners != 4)
        return;
    bool first = vec3_distance(c->at[corner[0]], c->at[corner[2]]) < vec3_distance(c->at[corner[1]], c->at[corner[3]]);
    int shift = first ? 0 : 1;
    add_triangle(c, corner[shift], corner[shift + 1], corner[shift + 2]);
    add_triangle(c, corner[shift + 2], corner[(shift + 3) % 4], corner[shift]);
}

// The connected parts of the surface inside the patch and beyond its cuts: parent[v], and the vertices of each part at its root.
static void connect_parts(const TriangleMesh *mesh, const double *value, int *parent, int *size)
{
    for (int v = 0; v < mesh->vertex_count; v++)
        parent[v] = v, size[v] = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            if ((value[a] > 0) == (value[b] > 0))
                disjoint_join(parent, a, b);
        }
    for (int v = 0; v < mesh->vertex_count; v++)
        size[disjoint_root(parent, v)]++;
}

// In a bend, and where another branch is blended, t may jump from vertex to vertex near a cut. Parts of the patch that are too small to reach around a ring are
// left out; of the parts beyond a cut the largest stays, and the others become parts of the patch. So do small parts on branches that have no run in the patch.
static void remove_islands(const Patch *p, double *value, const int *cut)
{
    const TriangleMesh *mesh = p->march.mesh;
    int n = mesh->vertex_count, cuts = p->out->cut_count, least = p->parts->options.edge_mm > 0 ? 6 : p->parts->options.around / 2;
    int *parent = HEAP_ZEROED((size_t)n + 1, sizeof *parent), *size = HEAP_ZEROED((size_t)n + 1, sizeof *size);
    int *largest = HEAP_ZEROED((size_t)cuts + 1, sizeof *largest);
    bool *stays = HEAP_ZEROED((size_t)n + 1, sizeof *stays);
    connect_parts(mesh, value, parent, size);
    for (int v = 0; v < n; v++)
        if (value[v] > 0 && size[disjoint_root(parent, v)] < least)
            value[v] = -p->cell;
    connect_parts(mesh, value, parent, size);
    for (int i = 0; i < cuts; i++)
        largest[i] = n;          // size[n] = 0
    for (int v = 0; v < n; v++)
        if (!(value[v] > 0) && cut[v] >= 0 && size[disjoint_root(parent, v)] > size[largest[cut[v]]])
            largest[cut[v]] = disjoint_root(parent, v);
    for (int i = 0; i < cuts; i++)
        stays[largest[i]] = true;
    for (int v = 0; v < n; v++) {
        int root = disjoint_root(parent, v);
        if (!(value[v] > 0) && !stays[root] && (cut[v] >= 0 || size[root] < least * least))
            value[v] = p->cell;
    }
    free(stays);
    free(parent);
    free(size);
    free(largest);
}

static void cut_patch(Cutter *c, double snap)
{
    Patch *p = c->p;
    const TriangleMesh *mesh = p->march.mesh;
    double *value = HEAP_ZEROED((size_t)mesh->vertex_count + 1, sizeof *value);
    int *cut = HEAP_ZEROED((size_t)mesh->vertex_count + 1, sizeof *cut);
    for (int v = 0; v < mesh->vertex_count; v++)
        value[v] = inside(p, &p->place[v], &cut[v]);
    remove_islands(p, value, cut);
    for (int v = 0; v < mesh->vertex_count; v++) {
        SweepPlace place = p->place[v];
        Vec3 at = mesh->vertex[v];
        if (cut[v] >= 0 && fabs(value[v]) < snap * p->cell) {
            at = onto_cut(p, &c->plane[cut[v]], c->is_blended[cut[v]], at, &place);
            value[v] = 0;
        }
        add_vertex(c, at, place, value[v], value[v] > 0 ? -1 : cut[v]);
    }
    free(value);
    free(cut);
    for (int t = 0; t < mesh->triangle_count; t++)
        cut_triangle(c, mesh->triangle[t]);
}

// --- Loops ---

// Keeps the parts of the surface that touch a cut; without cuts, the part with most triangles.
static void keep_parts(Cutter *c)
{
    int *parent = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *parent), *count = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *count), most = 0, kept = 0;
    for (int v = 0; v < c->vertices; v++)
        parent[v] = v;
    for (int t = 0; t < c->triangles; t++) {
        disjoint_join(parent, c->triangle[t][0], c->triangle[t][1]);
        disjoint_join(parent, c->triangle[t][0], c->triangle[t][2]);
    }
    for (int t = 0; t < c->triangles; t++) {
        int root = disjoint_root(parent, c->triangle[t][0]);
        count[root]++;
        most = count[root] > count[most] ? root : most;
    }
    if (c->p->out->cut_count > 0) {
        memset(count, 0, (size_t)c->vertices * sizeof *count);
        for (int t = 0; t < c->triangles; t++)
            for (int k = 0; k < 3; k++)
                if (c->value[c->triangle[t][k]] == 0)
                    count[disjoint_root(parent, c->triangle[t][0])] = 1;
    } else {
        memset(count, 0, (size_t)c->vertices * sizeof *count);
        count[most] = 1;
    }
    for (int t = 0; t < c->triangles; t++)
        if (count[disjoint_root(parent, c->triangle[t][0])])
            memmove(c->triangle[kept++], c->triangle[t], sizeof *c->triangle);
    c->triangles = kept;
    free(parent);
    free(count);
}

static int compare_edges(const void *a, const void *b)
{
    const int *x = a, *y = b;
    return x[0] != y[0] ? (x[0] > y[0] ? 1 : -1) : (x[1] > y[1]) - (x[1] < y[1]);
}

static void fail_cut(const Cutter *c, int cut)
{
    if (cut >= 0)
        c->p->out->cut[cut].is_failed = true;
}

// next[v]: the vertex that follows v on the rim, against the direction of the triangles there; -1. Returns false if the rim touches itself.
static bool rim_of(const Cutter *c, int *next)
{
    int(*edge)[3] = HEAP_ZEROED((size_t)c->triangles * 3 + 1, sizeof *edge), count = 0;
    bool good = true;
    for (int t = 0; t < c->triangles; t++)
        for (int k = 0; k < 3; k++) {
            int a = c->triangle[t][k], b = c->triangle[t][(k + 1) % 3];
            if (c->value[a] == 0 && c->value[b] == 0)
                edge[count][0] = a < b ? a : b, edge[count][1] = a < b ? b : a, edge[count++][2] = a < b;
        }
    qsort(edge, (size_t)count, sizeof *edge, compare_edges);
    for (int v = 0; v < c->vertices; v++)
        next[v] = -1;
    for (int i = 0; i < count; i++) {
        if (i + 1 < count && compare_edges(edge[i], edge[i + 1]) == 0) {
            i++;
            continue;
        }
        int from = edge[i][2] ? edge[i][1] : edge[i][0], to = edge[i][2] ? edge[i][0] : edge[i][1];
        if (next[from] >= 0) {
            fail_cut(c, c->cut[from]);
            good = false;
        }
        next[from] = to;
    }
    free(edge);
    return good;
}

// Reads the loop through `start` into the cut, by increasing angle. Returns false if it does not run once around the branch.
static bool read_loop(const Cutter *c, int start, const int *next, MeshCut *cut, const MeshPlane *plane, bool *seen)
{
    const double turn = 6.283185307179586476925;
    int count = 0;
    for (int v = start; v >= 0 && !seen[v]; v = next[v])
        seen[v] = true, count++;
    cut->vertex = HEAP_ZEROED((size_t)count, sizeof *cut->vertex);
    cut->angle = HEAP_ZEROED((size_t)count, sizeof *cut->angle);
    cut->count = count;
    double total = 0, last = 0;
    for (int i = 0, v = start; i < count; i++, v = next[v]) {
        Vec3 u = vec3_sub(c->at[v], plane->s);
        double angle = same_atan2(vec3_dot(u, plane->b), vec3_dot(u, plane->n));
        if (i > 0) {
            double step = angle - last;
            step -= turn * floor(step / turn + 0.5);
            total += step;
        }
        cut->vertex[i] = v;
        cut->angle[i] = i == 0 ? angle : cut->angle[0] + total;
        last = angle;
    }
    double step = cut->angle[0] - last;
    step -= turn * floor(step / turn + 0.5);
    total += step;
    if (total < 0)
        for (int i = 0; i < count / 2; i++) {
            int other = count - 1 - i, v = cut->vertex[i];
            double angle = cut->angle[i];
            cut->vertex[i] = cut->vertex[other], cut->vertex[other] = v;
            cut->angle[i] = cut->angle[other], cut->angle[other] = angle;
        }
    return fabs(fabs(total) - turn) < 0.1 && next[cut->vertex[total < 0 ? 0 : count - 1]] == cut->vertex[total < 0 ? count - 1 : 0];
}

// Reads the loops of all cuts. Returns whether each cut has one; else the cuts that do not are marked as failed.
static bool read_loops(Cutter *c)
{
    MeshPatch *out = c->p->out;
    int *next = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *next);
    bool *seen = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *seen), good = rim_of(c, next);
    for (int v = 0; good && v < c->vertices; v++) {
        if (next[v] < 0 || seen[v])
            continue;
        int cut = c->cut[v];
        if (cut < 0 || out->cut[cut].count > 0 || !read_loop(c, v, next, &out->cut[cut], &c->plane[cut], seen)) {
            fail_cut(c, cut);
            good = false;
            break;
        }
        for (int i = 0; i < out->cut[cut].count; i++) {
            int other = c->cut[out->cut[cut].vertex[i]];
            if (other != cut) {
                fail_cut(c, cut), fail_cut(c, other);
                good = false;
            }
        }
    }
    for (int i = 0; good && i < out->cut_count; i++)
        out->cut[i].is_failed = out->cut[i].count == 0;
    for (int i = 0; i < out->cut_count; i++)
        good = good && !out->cut[i].is_failed;
    free(next);
    free(seen);
    return good;
}

// Evens out the angles of the cuts' vertices, which lie as close together as the lattice happened to put them, and puts them onto their rings again.
static void space_cuts(Cutter *c)
{
    enum { ROUNDS = 12 };
    static const double TURN = 6.283185307179586476925;
    for (int i = 0; i < c->p->out->cut_count; i++) {
        const MeshCut *cut = &c->p->out->cut[i];
        const MeshPlane *plane = &c->plane[i];
        int n = cut->count;
        double *next = HEAP_ZEROED((size_t)n, sizeof *next);
        for (int round = 0; round < ROUNDS; round++) {
            for (int k = 0; k < n; k++) {
                double before = k > 0 ? cut->angle[k - 1] : cut->angle[n - 1] - TURN, after = k + 1 < n ? cut->angle[k + 1] : cut->angle[0] + TURN;
                next[k] = 0.25 * (before + after) + 0.5 * cut->angle[k];
            }
            memcpy(cut->angle, next, (size_t)n * sizeof *next);
        }
        for (int k = 0; k < n && !c->is_blended[i]; k++)
            c->at[cut->vertex[k]] = mesh_plane_point(plane, same_cos(cut->angle[k]), same_sin(cut->angle[k]));
        free(next);
    }
}

static void clear_cuts(MeshPatch *out)
{
    for (int i = 0; i < out->cut_count; i++) {
        free(out->cut[i].vertex);
        free(out->cut[i].angle);
        out->cut[i].vertex = NULL, out->cut[i].angle = NULL, out->cut[i].count = 0;
    }
}

// --- Smoothing, and the result ---

static void even_out(Cutter *c, Vec3 *normal)
{
    enum { ROUNDS = 3 };
    Vec3 *sum = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *sum);
    int *count = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *count);
    bool *moves = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *moves);
    for (int round = 0; round <= ROUNDS; round++) {
        memset(sum, 0, (size_t)c->vertices * sizeof *sum);
        memset(count, 0, (size_t)c->vertices * sizeof *count);
        for (int t = 0; t < c->triangles; t++)
            for (int k = 0; k < 3; k++) {
                int v = c->triangle[t][k];
                sum[v] = vec3_add(sum[v], c->at[c->triangle[t][(k + 1) % 3]]);
                count[v]++;
            }
        for (int v = 0; v < c->vertices; v++)
            moves[v] = count[v] > 0 && c->value[v] > 0;
        for (int v = 0; round < ROUNDS && v < c->vertices; v++) {
            if (!moves[v])
                continue;
            Vec3 to = vec3_scale(vec3_sub(vec3_scale(sum[v], 1.0 / count[v]), c->at[v]), 0.5);
            to = vec3_add_scaled(to, -vec3_dot(to, normal[v]), normal[v]);
            c->at[v] = vec3_add(c->at[v], to);
        }
        project(c->p, c->vertices, c->at, normal, c->place, moves, round < ROUNDS ? 1 : 12);
    }
    for (int v = 0; v < c->vertices; v++)
        moves[v] = count[v] > 0 && c->value[v] == 0;
    for (int v = 0; v < c->vertices; v++)
        if (moves[v]) {
            SweepPlace place = c->place[v];
            mesh_normals(&c->p->parts->feet, 1, &c->at[v], &place, &normal[v]);
        }
    free(sum);
    free(count);
    free(moves);
}

static void keep_result(Cutter *c, const Vec3 *normal)
{
    MeshPatch *out = c->p->out;
    int *to = HEAP_ZEROED((size_t)c->vertices + 1, sizeof *to);
    for (int v = 0; v < c->vertices; v++)
        to[v] = -1;
    for (int t = 0; t < c->triangles; t++)
        for (int k = 0; k < 3; k++)
            to[c->triangle[t][k]] = 0;
    for (int v = 0; v < c->vertices; v++)
        if (to[v] == 0)
            to[v] = out->vertices++;
    size_t n = (size_t)out->vertices + 1;
    out->at = HEAP_ZEROED(n, sizeof *out->at), out->normal = HEAP_ZEROED(n, sizeof *out->normal), out->t = HEAP_ZEROED(n, sizeof *out->t);
    out->branch = HEAP_ZEROED(n, sizeof *out->branch), out->sac_node = HEAP_ZEROED(n, sizeof *out->sac_node);
    for (int v = 0; v < c->vertices; v++)
        if (to[v] >= 0) {
            int k = to[v];
            out->at[k] = c->at[v], out->normal[k] = normal[v];
            out->branch[k] = c->place[v].branch, out->t[k] = c->place[v].branch >= 0 ? c->place[v].t : 0, out->sac_node[k] = c->place[v].sac;
        }
    out->triangle = c->triangle, out->triangles = c->triangles, c->triangle = NULL;
    for (int t = 0; t < out->triangles; t++)
        for (int k = 0; k < 3; k++)
            out->triangle[t][k] = to[out->triangle[t][k]];
    for (int i = 0; i < out->cut_count; i++)
        for (int k = 0; k < out->cut[i].count; k++)
            out->cut[i].vertex[k] = to[out->cut[i].vertex[k]];
    free(to);
}

static void free_cutter(Cutter *c)
{
    key_map_free(&c->of_edge);
    free(c->at);
    free(c->place);
    free(c->value);
    free(c->cut);
    free(c->triangle);
}

// One attempt. Returns whether each cut has its loop; the result is stored if so, or if it is the last attempt.
static bool try_patch(const SweepMeshParts *parts, MeshPatch *out, double cell, double snap, bool last)
{
    Patch *p = HEAP_ZEROED(1, sizeof *p);
    p->parts = parts, p->out = out, p->cell = cell;
    p->cell = cell * cell_of(p);
    fill_samples(p);
    bool good = march_patch(p);
    if (good) {
        TriangleMesh *mesh = p->march.mesh;
        project(p, mesh->vertex_count, mesh->vertex, mesh->normal, p->place, NULL, 20);
        Cutter c = {.p = p, .plane = HEAP_ZEROED((size_t)out->cut_count + 1, sizeof *c.plane), .is_blended = HEAP_ZEROED((size_t)out->cut_count + 1, 1)};
        for (int i = 0; i < out->cut_count; i++) {
            const MeshRing *ring = &parts->rings[out->cut[i].branch].ring[out->cut[i].ring];
            c.plane[i] = mesh_plane(&parts->feet, out->cut[i].branch, ring->t);
            c.is_blended[i] = ring->is_blended;
        }
        cut_patch(&c, snap);
        keep_parts(&c);
        good = read_loops(&c);
        if (good || last) {
            if (!good)
                clear_cuts(out);
            Vec3 *normal = HEAP_ZEROED((size_t)c.vertices + 1, sizeof *normal);
            for (int v = 0; v < mesh->vertex_count; v++)
                normal[v] = mesh->normal[v];
            if (good)
                space_cuts(&c), even_out(&c, normal);
            else
                c.triangles = 0;
            keep_result(&c, normal);
            free(normal);
        } else {
            clear_cuts(out);
        }
        free_cutter(&c);
        free(c.plane);
        free(c.is_blended);
    }
    triangle_mesh_free(p->march.mesh);
    march_end(&p->march);
    free(p->sample);
    free(p->place);
    free(p);
    return good;
}

static bool any_cut_failed(const MeshPatch *patch)
{
    for (int i = 0; i < patch->cut_count; i++)
        if (patch->cut[i].is_failed)
            return true;
    return false;
}

void mesh_patch_fill(const SweepMeshParts *parts, MeshPatch *patch, bool last)
{
    // lattices relative to the edges, and how close to a cut [cells] vertices are moved onto it
    static const struct {
        double cell, snap;
    } attempt[] = {{1, 0.3}, {0.83, 0}};
    enum { ATTEMPTS = sizeof attempt / sizeof *attempt };
    for (int i = 0; i < ATTEMPTS; i++) {
        for (int k = 0; k < patch->cut_count; k++)
            patch->cut[k].is_failed = false;
        if (try_patch(parts, patch, attempt[i].cell, attempt[i].snap, i == ATTEMPTS - 1))
            return;
        // moving a cut helps more than another lattice
        if (!last && any_cut_failed(patch))
            break;
    }
    patch->is_failed = true;
}

void mesh_patch_free(MeshPatch *patch)
{
    for (int i = 0; i < patch->cut_count; i++) {
        free(patch->cut[i].vertex);
        free(patch->cut[i].angle);
    }
    free(patch->run);
    free(patch->sac);
    free(patch->cut);
    free(patch->at);
    free(patch->normal);
    free(patch->branch);
    free(patch->sac_node);
    free(patch->t);
    free(patch->triangle);
    *patch = (MeshPatch){0};
}
