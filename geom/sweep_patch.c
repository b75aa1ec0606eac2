// Patches of the swept model's mesh (sweep_mesh.h): the wall where branches and sacs blend.
//
// The wall comes from marching cubes (sweep_march.h), in cells of the least edge of the patch's rings. A vertex on a branch is inside the patch if its t lies
// within one of the branch's runs; how far, is its value. Triangles are cut where the value is 0: that gives closed loops which do not touch each other, and
// the loop that runs around a branch is put onto the cut's ring. The other vertices move along the gradient onto F = 0 and are evened out: each moves half of
// the way to the mean of its neighbours along the wall.
#include "geom/sweep_mesh_parts.h"

#include "base/base.h"
#include "geom/key_map.h"
#include "geom/sweep_march.h"

#include <stdlib.h>
#include <string.h>

typedef struct Patch {
    const SweepMeshParts *parts;
    MeshPatch *out;
    double cell;
    SweepMarch march;
} Patch;

static const SweepField *field_of(const Patch *p) { return p->parts->feet.field; }

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

// --- Onto the wall ---

// Newton along the gradient for the vertices with `moves`, and their normals; `rounds` 0: normals alone.
static void project(Patch *p, int count, Vec3 *at, Vec3 *normal, SweepPlace *place, const bool *moves, int rounds)
{
    // [cells]; the error after a step is of the order of its square
    static const double CLOSE = 1e-7, LONGEST = 0.5;
    int which[FOOT_BLOCK], next = 0;
    while (next < count) {
        int lanes = 0;
        for (; next < count && lanes < FOOT_BLOCK; next++)
            if (moves[next])
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
        for (int round = 0; round < (rounds > 0 ? rounds : 1) && !close; round++) {
            sweep_block_slope(&p->parts->feet, &b, FOOT_ALL);
            close = true;
            for (int i = 0; i < lanes && rounds > 0; i++) {
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
    bool *is_upper;          // (cuts) the patch lies below it on the branch
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

// Vertices that a part needs to reach around a ring.
static int least_turn(const Patch *p) { return p->parts->options.edge_mm > 0 ? 6 : p->parts->options.around / 2; }

// The connected parts of the surface inside the patch and beyond its cuts: parent[v], and the vertices of each part at its root.
static void connect_parts(const SweepMarch *march, const double *value, int *parent, int *size)
{
    for (int v = 0; v < march->vertices; v++)
        parent[v] = v, size[v] = 0;
    for (int t = 0; t < march->triangles; t++)
        for (int k = 0; k < 3; k++) {
            int a = march->triangle[t][k], b = march->triangle[t][(k + 1) % 3];
            if ((value[a] > 0) == (value[b] > 0))
                disjoint_join(parent, a, b);
        }
    for (int v = 0; v < march->vertices; v++)
        size[disjoint_root(parent, v)]++;
}

// For each part beyond the cuts, the cut on which most of its vertices lie: t may jump past a cut to another one's side.
static void name_parts(const Patch *p, const double *value, const int *parent, const int *cut, int *name)
{
    int n = p->march.vertices, *votes = HEAP_ZEROED((size_t)n + 1, sizeof *votes), *most = HEAP_ZEROED((size_t)n + 1, sizeof *most);
    for (int i = -1; i < p->out->cut_count; i++) {
        memset(votes, 0, ((size_t)n + 1) * sizeof *votes);
        for (int v = 0; v < n; v++)
            if (!(value[v] > 0) && cut[v] == i) {
                int root = disjoint_root((int *)parent, v);
                if (++votes[root] > most[root])
                    most[root] = votes[root], name[root] = i;
            }
    }
    free(votes);
    free(most);
}

// In a bend, and where another branch is blended, t may jump from vertex to vertex near a cut. Parts of the patch that are too small to reach around a ring are
// left out. A part beyond a cut stays there if the march did not finish it, or if no such part exists, the largest; the others become parts of the patch. So do
// small parts on branches that have no run in the patch. All vertices of a part that stays are beyond the same cut.
static void remove_islands(const Patch *p, double *value, int *cut)
{
    const SweepMarch *march = &p->march;
    int n = march->vertices, cuts = p->out->cut_count, least = least_turn(p);
    size_t room = (size_t)n + 1;
    int *parent = HEAP_ZEROED(room, sizeof *parent), *size = HEAP_ZEROED(room, sizeof *size), *name = HEAP_ZEROED(room, sizeof *name);
    int *largest = HEAP_ZEROED((size_t)cuts + 1, sizeof *largest);
    bool *is_end = HEAP_ZEROED(room, sizeof *is_end), *has_end = HEAP_ZEROED((size_t)cuts + 1, sizeof *has_end);
    connect_parts(march, value, parent, size);
    for (int v = 0; v < n; v++)
        if (value[v] > 0 && size[disjoint_root(parent, v)] < least)
            value[v] = -p->cell;
    connect_parts(march, value, parent, size);
    name_parts(p, value, parent, cut, name);
    for (int v = 0; v < n; v++)
        if (march->is_end[v])
            is_end[disjoint_root(parent, v)] = true;
    for (int i = 0; i < cuts; i++)
        largest[i] = n;          // size[n] = 0
    for (int v = 0; v < n; v++) {
        int root = disjoint_root(parent, v);
        if (value[v] > 0 || name[root] < 0)
            continue;
        has_end[name[root]] |= is_end[root];
        if (size[root] > size[largest[name[root]]])
            largest[name[root]] = root;
    }
    for (int v = 0; v < n; v++) {
        int root = disjoint_root(parent, v);
        if (value[v] > 0)
            continue;
        bool stays = is_end[root] || (name[root] >= 0 ? !has_end[name[root]] && largest[name[root]] == root : size[root] >= least * least);
        if (!stays)
            value[v] = p->cell;
        else if (cut[v] != name[root])
            cut[v] = name[root], value[v] = -p->cell;
    }
    free(parent);
    free(size);
    free(name);
    free(largest);
    free(is_end);
    free(has_end);
}

static void cut_patch(Cutter *c)
{
    Patch *p = c->p;
    const SweepMarch *march = &p->march;
    double *value = HEAP_ZEROED((size_t)march->vertices + 1, sizeof *value);
    int *cut = HEAP_ZEROED((size_t)march->vertices + 1, sizeof *cut);
    for (int v = 0; v < march->vertices; v++)
        value[v] = sweep_march_inside(field_of(p), p->out, &march->place[v], p->cell, &cut[v]);
    remove_islands(p, value, cut);
    for (int v = 0; v < march->vertices; v++)
        add_vertex(c, march->at[v], march->place[v], value[v], value[v] > 0 ? -1 : cut[v]);
    free(value);
    free(cut);
    for (int t = 0; t < march->triangles; t++)
        cut_triangle(c, march->triangle[t]);
}

// --- Loops ---

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

// next[v]: the vertex that follows v on the rim, against the direction of the triangles there; -1. A rim is where the value is 0 on a closed surface: loops that
// do not touch each other.
static void rim_of(const Cutter *c, int *next)
{
    int(*edge)[3] = HEAP_ZEROED((size_t)c->triangles * 3 + 1, sizeof *edge), count = 0;
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
        SEL_ASSERT(next[from] < 0, "a rim does not touch itself");
        next[from] = to;
    }
    free(edge);
}

// Reads the loop through `start` into the cut, by increasing angle. Returns false, with the cut unchanged, if it does not run once around the branch, with the
// patch on its side.
static bool read_loop(const Cutter *c, int start, const int *next, int index)
{
    MeshCut *cut = &c->p->out->cut[index];
    const MeshPlane *plane = &c->plane[index];
    const double turn = 6.283185307179586476925;
    int count = 1;
    for (int v = next[start]; v != start; v = next[v])
        count++;
    int *vertex = HEAP_ZEROED((size_t)count, sizeof *vertex);
    double *angle = HEAP_ZEROED((size_t)count, sizeof *angle), total = 0, last = 0;
    for (int i = 0, v = start; i <= count; i++, v = next[v]) {
        Vec3 u = vec3_sub(c->at[v], plane->s);
        double here = same_atan2(vec3_dot(u, plane->b), vec3_dot(u, plane->n)), step = i > 0 ? here - last : 0;
        step -= turn * floor(step / turn + 0.5);
        total += step;
        last = here;
        if (i < count)
            vertex[i] = v, angle[i] = i == 0 ? here : angle[0] + total;
    }
    if (!(fabs(total - (c->is_upper[index] ? turn : -turn)) < 0.1)) {
        free(vertex), free(angle);
        return false;
    }
    for (int i = 0; total < 0 && i < count / 2; i++) {
        int other = count - 1 - i, v = vertex[i];
        double a = angle[i];
        vertex[i] = vertex[other], vertex[other] = v;
        angle[i] = angle[other], angle[other] = a;
    }
    free(cut->vertex), free(cut->angle);
    cut->vertex = vertex, cut->angle = angle, cut->count = count;
    return true;
}

// The connected parts of the cut surface: parent[v], and the triangles of each at its root.
static void connect_surface(const Cutter *c, int *parent, int *size)
{
    for (int v = 0; v < c->vertices; v++)
        parent[v] = v, size[v] = 0;
    for (int t = 0; t < c->triangles; t++) {
        disjoint_join(parent, c->triangle[t][0], c->triangle[t][1]);
        disjoint_join(parent, c->triangle[t][0], c->triangle[t][2]);
    }
    for (int t = 0; t < c->triangles; t++)
        size[disjoint_root(parent, c->triangle[t][0])]++;
}

// Reads the loops of all cuts; of several around a branch, that on the largest part of the surface. Small parts that have none of these loops are left out, and
// so are parts without any; without cuts, all but the part with most triangles. Returns whether each cut has a loop, and no other loop is left; else the cuts
// that are concerned are marked.
static bool read_loops(Cutter *c)
{
    MeshPatch *out = c->p->out;
    size_t room = (size_t)c->vertices + 1;
    int *next = HEAP_ZEROED(room, sizeof *next), *parent = HEAP_ZEROED(room, sizeof *parent), *size = HEAP_ZEROED(room, sizeof *size);
    bool *stays = HEAP_ZEROED(room, sizeof *stays), *seen = HEAP_ZEROED(room, sizeof *seen), good = true;
    rim_of(c, next);
    connect_surface(c, parent, size);
    for (int v = 0; v < c->vertices; v++) {
        if (next[v] < 0 || seen[v])
            continue;
        for (int w = v; !seen[w]; w = next[w])
            seen[w] = true;
        MeshCut *cut = c->cut[v] >= 0 ? &out->cut[c->cut[v]] : NULL;
        if (cut && (cut->count == 0 || size[disjoint_root(parent, v)] > size[disjoint_root(parent, cut->vertex[0])]))
            read_loop(c, v, next, c->cut[v]);
    }
    memset(seen, 0, room * sizeof *seen);
    for (int i = 0; i < out->cut_count; i++) {
        out->cut[i].is_failed = out->cut[i].count == 0;
        for (int k = 0; k < out->cut[i].count; k++)
            seen[out->cut[i].vertex[k]] = true, stays[disjoint_root(parent, out->cut[i].vertex[k])] = true;
    }
    int most = 0, kept = 0, least = least_turn(c->p), large = least * least;
    for (int v = 0; v < c->vertices; v++)
        most = size[v] > size[most] ? v : most;
    stays[most] |= out->cut_count == 0;
    for (int v = 0; v < c->vertices; v++)
        if (next[v] >= 0 && !seen[v] && (stays[disjoint_root(parent, v)] || size[disjoint_root(parent, v)] > large)) {
            fail_cut(c, c->cut[v]);
            good = false;
        }
    for (int i = 0; i < out->cut_count; i++)
        good = good && !out->cut[i].is_failed;
    for (int t = 0; t < c->triangles; t++)
        if (stays[disjoint_root(parent, c->triangle[t][0])])
            memmove(c->triangle[kept++], c->triangle[t], sizeof *c->triangle);
    c->triangles = kept;
    free(next);
    free(parent);
    free(size);
    free(stays);
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

// The vertices move onto F = 0, and are evened out there. Those of the cuts stay, and get their normals.
static void even_out(Cutter *c, Vec3 *normal)
{
    enum { ROUNDS = 3, FIRST = 1, LAST = 12 };
    size_t room = (size_t)c->vertices + 1;
    Vec3 *sum = HEAP_ZEROED(room, sizeof *sum);
    int *count = HEAP_ZEROED(room, sizeof *count);
    bool *moves = HEAP_ZEROED(room, sizeof *moves), *stays = HEAP_ZEROED(room, sizeof *stays);
    for (int t = 0; t < c->triangles; t++)
        for (int k = 0; k < 3; k++)
            count[c->triangle[t][k]]++;
    for (int v = 0; v < c->vertices; v++)
        moves[v] = count[v] > 0 && c->value[v] > 0, stays[v] = count[v] > 0 && c->value[v] == 0;
    project(c->p, c->vertices, c->at, normal, c->place, moves, FIRST);
    for (int round = 0; round < ROUNDS; round++) {
        memset(sum, 0, room * sizeof *sum);
        for (int t = 0; t < c->triangles; t++)
            for (int k = 0; k < 3; k++)
                sum[c->triangle[t][k]] = vec3_add(sum[c->triangle[t][k]], c->at[c->triangle[t][(k + 1) % 3]]);
        for (int v = 0; v < c->vertices; v++) {
            if (!moves[v])
                continue;
            Vec3 to = vec3_scale(vec3_sub(vec3_scale(sum[v], 1.0 / count[v]), c->at[v]), 0.5);
            to = vec3_add_scaled(to, -vec3_dot(to, normal[v]), normal[v]);
            c->at[v] = vec3_add(c->at[v], to);
        }
    }
    project(c->p, c->vertices, c->at, normal, c->place, moves, LAST);
    SweepPlace *place = HEAP_ZEROED(room, sizeof *place);
    memcpy(place, c->place, (size_t)c->vertices * sizeof *place);
    project(c->p, c->vertices, c->at, normal, place, stays, 0);
    free(place);
    free(sum);
    free(count);
    free(moves);
    free(stays);
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
static bool try_patch(const SweepMeshParts *parts, MeshPatch *out, double cell, bool last)
{
    Patch p = {.parts = parts, .out = out};
    p.cell = cell * cell_of(&p);
    bool good = sweep_march(parts, out, p.cell, &p.march);
    if (good) {
        SweepMarch *march = &p.march;
        Vec3 *normal = HEAP_ZEROED((size_t)march->vertices + 1, sizeof *normal);
        Cutter c = {.p = &p,
                    .plane = HEAP_ZEROED((size_t)out->cut_count + 1, sizeof *c.plane),
                    .is_blended = HEAP_ZEROED((size_t)out->cut_count + 1, 1),
                    .is_upper = HEAP_ZEROED((size_t)out->cut_count + 1, 1)};
        for (int r = 0; r < out->run_count; r++)
            if (out->run[r].cut_to >= 0)
                c.is_upper[out->run[r].cut_to] = true;
        for (int i = 0; i < out->cut_count; i++) {
            const MeshRing *ring = &parts->rings[out->cut[i].branch].ring[out->cut[i].ring];
            c.plane[i] = mesh_plane(&parts->feet, out->cut[i].branch, ring->t);
            c.is_blended[i] = ring->is_blended;
        }
        cut_patch(&c);
        good = read_loops(&c);
        if (good || last) {
            if (!good)
                clear_cuts(out);
            normal = HEAP_GROWN(normal, (size_t)c.vertices + 1, sizeof *normal);
            for (int v = march->vertices; v < c.vertices; v++)
                normal[v] = vec3(0, 0, 0);
            if (good)
                space_cuts(&c), even_out(&c, normal);
            else
                c.triangles = 0;
            keep_result(&c, normal);
        } else {
            clear_cuts(out);
        }
        free(normal);
        free_cutter(&c);
        free(c.plane);
        free(c.is_blended);
        free(c.is_upper);
    }
    sweep_march_free(&p.march);
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
    static const double cell[] = {1, 0.83};  // lattices, relative to the edges
    enum { ATTEMPTS = sizeof cell / sizeof *cell };
    for (int i = 0; i < ATTEMPTS; i++) {
        for (int k = 0; k < patch->cut_count; k++)
            patch->cut[k].is_failed = false;
        if (try_patch(parts, patch, cell[i], i == ATTEMPTS - 1))
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
