// Assembles the mesh of a swept model from rings and patches (sweep_mesh.h).
//
// Which gaps between rings belong to patches: those beside a ring with a blended vertex; those within an edge of the place, on another branch, that such a
// vertex blends with; one more on both sides; and a whole dome, if a part of it does. Patches are the connected sets of such gaps and of sacs, connected by
// these blends. A strip between two rings, or a ring and a patch's cut, is triangulated by merging the angles of both.
#include "geom/sweep_mesh.h"

#include "base/base.h"
#include "geom/sweep_mesh_parts.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

SweepMeshOptions sweep_mesh_default_options(void) { return (SweepMeshOptions){.around = 24}; }

// --- Which gaps belong to patches ---

static bool is_free(RingKind kind) { return kind == RING_POLE || kind == RING_MIDDLE; }

// Gaps in which a patch may not begin or end: those of a dome. Returns the first and last gap of the dome that holds gap j; false: it is no dome's.
static bool dome_of(const MeshRings *r, int j, int *from, int *to)
{
    if (j < r->first_section && r->ring[0].kind == RING_POLE) {
        *from = 0, *to = r->first_section - 1;
        return true;
    }
    if (j >= r->last_section && r->ring[r->count - 1].kind == RING_POLE) {
        *from = r->last_section, *to = r->count - 2;
        return true;
    }
    return false;
}

// The flat caps' gaps never belong to a patch.
static bool is_cap(const MeshRings *r, int j) { return r->ring[j].kind == RING_MIDDLE || r->ring[j + 1].kind == RING_MIDDLE; }

static void mark_gap(MeshRings *r, int j)
{
    if (j < 0 || j >= r->count - 1 || is_cap(r, j))
        return;
    int from = j, to = j;
    dome_of(r, j, &from, &to);
    for (int k = from; k <= to; k++)
        r->in_patch[k] = true;
}

// The gap that holds t. Gaps of domes and caps are those of the ends.
static int gap_at(const MeshRings *r, double t)
{
    if (t < 0)
        return r->first_section > 0 ? r->first_section - 1 : 0;
    int low = r->first_section, high = r->last_section;
    if (t >= r->ring[high].t)
        return high < r->count - 1 ? high : high - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (r->ring[middle].t <= t)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void mark_gaps(SweepMeshParts *parts)
{
    for (int i = 0; i < parts->branch_count; i++) {
        MeshRings *r = &parts->rings[i];
        memset(r->in_patch, 0, (size_t)r->count * sizeof *r->in_patch);
        for (int k = 0; k < r->count; k++)
            if (r->ring[k].is_blended)
                mark_gap(r, k - 1), mark_gap(r, k);
    }
    for (int i = 0; i < parts->branch_count; i++)
        for (int m = 0; m < parts->rings[i].marks; m++) {
            const MeshMark *mark = &parts->rings[i].mark[m];
            if (mark->branch < 0)
                continue;
            MeshRings *r = &parts->rings[mark->branch];
            for (int j = gap_at(r, mark->from), to = gap_at(r, mark->to); j <= to; j++)
                mark_gap(r, j);
        }
    for (int i = 0; i < parts->branch_count; i++) {
        MeshRings *r = &parts->rings[i];
        bool *before = HEAP_ZEROED((size_t)r->count, sizeof *before);
        memcpy(before, r->in_patch, (size_t)r->count * sizeof *before);
        for (int j = 0; j < r->count - 1; j++)
            if (before[j])
                mark_gap(r, j - 1), mark_gap(r, j + 1);
        free(before);
    }
}

// --- Patches ---

static int run_of(const MeshRun *run, const int *first_run, int branch, int gap)
{
    for (int i = first_run[branch]; i < first_run[branch + 1]; i++)
        if (gap >= run[i].from && gap <= run[i].to)
            return i;
    return -1;
}

static int find_runs(const SweepMeshParts *parts, MeshRun **runs, int *first_run)
{
    int count = 0, capacity = 0;
    *runs = NULL;
    for (int i = 0; i < parts->branch_count; i++) {
        const MeshRings *r = &parts->rings[i];
        first_run[i] = count;
        for (int j = 0; j < r->count - 1; j++) {
            if (!r->in_patch[j])
                continue;
            int to = j;
            while (to + 1 < r->count - 1 && r->in_patch[to + 1])
                to++;
            if (count == capacity) {
                capacity = capacity > 0 ? 2 * capacity : 64;
                *runs = HEAP_GROWN(*runs, (size_t)capacity, sizeof **runs);
            }
            (*runs)[count++] = (MeshRun){.branch = i,
                                         .from = j,
                                         .to = to,
                                         .cut_from = -1,
                                         .cut_to = -1,
                                         .t_from = is_free(r->ring[j].kind) ? -HUGE_VAL : r->ring[j].t,
                                         .t_to = is_free(r->ring[to + 1].kind) ? HUGE_VAL : r->ring[to + 1].t};
            j = to;
        }
    }
    first_run[parts->branch_count] = count;
    return count;
}

static void join_marks(const SweepMeshParts *parts, const MeshRun *run, const int *first_run, int run_count, int *parent)
{
    for (int i = 0; i < parts->branch_count; i++) {
        const MeshRings *r = &parts->rings[i];
        for (int m = 0; m < r->marks; m++) {
            const MeshMark *mark = &r->mark[m];
            int gap = mark->ring < r->count - 1 ? mark->ring : mark->ring - 1, own = run_of(run, first_run, i, gap);
            if (own < 0)
                own = run_of(run, first_run, i, gap - 1);
            SEL_ASSERT(own >= 0, "gaps beside a blended ring belong to a patch");
            if (mark->branch < 0) {
                disjoint_join(parent, own, run_count + mark->sac);
                continue;
            }
            const MeshRings *other = &parts->rings[mark->branch];
            for (int j = gap_at(other, mark->from), to = gap_at(other, mark->to); j <= to; j++) {
                int its = run_of(run, first_run, mark->branch, j);
                if (its >= 0)
                    disjoint_join(parent, own, its);
            }
        }
    }
}

// Joins sacs whose nodes' balls overlap: they have one wall.
static void join_sacs(const SweepField *field, int run_count, int *parent)
{
    const VesselTree *sac = field->model->sac;
    for (int i = 0; sac && i < sac->node_count; i++)
        for (int k = 0; k < i; k++)
            if (sac->kind[i] == NODE_ANEURYSM && sac->kind[k] == NODE_ANEURYSM &&
                vec3_distance(sac->center[i], sac->center[k]) < sac->radius[i] + sac->radius[k])
                disjoint_join(parent, run_count + field->sac_group[i], run_count + field->sac_group[k]);
}

static void add_cut(MeshPatch *patch, int branch, int ring, int *index)
{
    *index = patch->cut_count;
    patch->cut[patch->cut_count++] = (MeshCut){.branch = branch, .ring = ring};
}

// Joins two runs of one patch that follow each other on a branch if the patch, followed beyond its cuts, could reach from one to the other. Returns whether there
// are such runs.
static bool join_close_runs(SweepMeshParts *parts, const MeshRun *run, int run_count, int *parent)
{
    bool any = false;
    for (int i = 0; i + 1 < run_count; i++) {
        const MeshRun *a = &run[i], *b = &run[i + 1];
        if (a->branch != b->branch || disjoint_root(parent, i) != disjoint_root(parent, i + 1) ||
            b->t_from - a->t_to > 2 * MESH_BEYOND * mesh_edge(parts, a->branch, 0.5 * (a->t_to + b->t_from)))
            continue;
        for (int j = a->to + 1; j < b->from; j++)
            mark_gap(&parts->rings[a->branch], j);
        any = true;
    }
    return any;
}

// The patches' definitions: runs, sacs and cuts.
static MeshPatch *define_patches(SweepMeshParts *parts, int *count)
{
    const VesselTree *sac = parts->feet.field->model->sac;
    int *first_run = HEAP_ZEROED((size_t)parts->branch_count + 1, sizeof *first_run), sacs = sac ? sac->node_count : 0, *parent = NULL, runs;
    MeshRun *run = NULL;
    do {
        free(run);
        runs = find_runs(parts, &run, first_run);
        parent = HEAP_GROWN(parent, (size_t)(runs + sacs) + 1, sizeof *parent);
        for (int i = 0; i < runs + sacs; i++)
            parent[i] = i;
        join_marks(parts, run, first_run, runs, parent);
        join_sacs(parts->feet.field, runs, parent);
    } while (join_close_runs(parts, run, runs, parent));
    MeshPatch *patch = HEAP_ZEROED((size_t)runs + 1, sizeof *patch);
    *count = 0;
    for (int root = 0; root < runs; root++) {
        if (disjoint_root(parent, root) != root)
            continue;
        MeshPatch *p = &patch[(*count)++];
        for (int i = root; i < runs + sacs; i++)
            if (disjoint_root(parent, i) == root) {
                if (i < runs)
                    p->run_count++;
                else
                    p->sac_count++;
            }
        p->run = HEAP_ZEROED((size_t)p->run_count, sizeof *p->run);
        p->sac = HEAP_ZEROED((size_t)p->sac_count, sizeof *p->sac);
        p->cut = HEAP_ZEROED(2 * (size_t)p->run_count, sizeof *p->cut);
        p->run_count = p->sac_count = 0;
        for (int i = root; i < runs + sacs; i++) {
            if (disjoint_root(parent, i) != root)
                continue;
            if (i >= runs) {
                p->sac[p->sac_count++] = i - runs;
                continue;
            }
            MeshRun *r = &p->run[p->run_count++];
            *r = run[i];
            if (isfinite(r->t_from))
                add_cut(p, r->branch, r->from, &r->cut_from);
            if (isfinite(r->t_to))
                add_cut(p, r->branch, r->to + 1, &r->cut_to);
        }
    }
    free(first_run);
    free(run);
    free(parent);
    return patch;
}

// Moves the failed cuts of patches `more` gaps outwards, where t may be clearer. Returns false if there are none.
static bool move_failed_cuts(SweepMeshParts *parts, int more)
{
    bool any = false;
    for (int p = 0; p < parts->patch_count; p++) {
        const MeshPatch *patch = &parts->patch[p];
        for (int r = 0; patch->is_failed && r < patch->run_count; r++) {
            const MeshRun *run = &patch->run[r];
            MeshRings *rings = &parts->rings[run->branch];
            bool low = run->cut_from >= 0 && patch->cut[run->cut_from].is_failed, high = run->cut_to >= 0 && patch->cut[run->cut_to].is_failed;
            for (int j = 1; j <= more; j++) {
                if (low)
                    mark_gap(rings, run->from - j);
                if (high)
                    mark_gap(rings, run->to + j);
            }
            any |= low || high;
        }
    }
    return any;
}

// --- Assembly ---

// A closed row of vertices of the mesh, by increasing angle; of one vertex: a pole.
typedef struct Row {
    int count;
    int *vertex;
    double *angle;
} Row;

typedef struct Assembly {
    const SweepMeshParts *parts;
    SweepMesh *mesh;
    int *first;              // (branches) …
    int **ring_first;        // … of each ring, its first vertex in the mesh; -1: not used
    int *patch_first;        // (patches) first vertex
    int triangle_capacity;
    bool good;
} Assembly;

enum { TRIANGLES_MAX = 100000000 };

static void put_triangle(Assembly *a, int x, int y, int z)
{
    TriangleMesh *s = a->mesh->surface;
    if (s->triangle_count == a->triangle_capacity) {
        a->good = a->good && s->triangle_count < TRIANGLES_MAX;
        if (!a->good)
            return;
        a->triangle_capacity = a->triangle_capacity > 0 ? 2 * a->triangle_capacity : 1 << 16;
        s->triangle = HEAP_GROWN(s->triangle, (size_t)a->triangle_capacity, sizeof *s->triangle);
    }
    int *t = s->triangle[s->triangle_count++];
    t[0] = x, t[1] = y, t[2] = z;
}

// The strip from row `low` to row `high`, which follows it on the branch.
static void zip(Assembly *a, const Row *low, const Row *high)
{
    static const double TURN = 6.283185307179586476925;
    if (low->count == 0 || high->count == 0)
        return;
    int i = 0, k = 0, n = low->count, m = high->count;
    double shift = 0;
    if (n == 1 || m == 1) {
        for (int j = 0; j < (n == 1 ? m : n); j++)
            if (n == 1)
                put_triangle(a, low->vertex[0], high->vertex[(j + 1) % m], high->vertex[j]);
            else
                put_triangle(a, low->vertex[j], low->vertex[(j + 1) % n], high->vertex[0]);
        return;
    }
    // high's vertex nearest to low's first
    double best = HUGE_VAL;
    for (int j = 0; j < m; j++) {
        double away = high->angle[j] - low->angle[0], turns = floor(away / TURN + 0.5);
        if (fabs(away - turns * TURN) < best)
            best = fabs(away - turns * TURN), k = j, shift = -turns * TURN;
    }
    int start = k;
    for (int step = 0; step < n + m; step++) {
        int done_low = i, done_high = k - start;
        double at_low = low->angle[i % n] + TURN * (i / n), next_low = low->angle[(i + 1) % n] + TURN * ((i + 1) / n);
        double at_high = high->angle[k % m] + TURN * (k / m) + shift, next_high = high->angle[(k + 1) % m] + TURN * ((k + 1) / m) + shift;
        bool go_low = done_low < n && (done_high == m || at_low + next_low <= at_high + next_high);
        if (go_low) {
            put_triangle(a, low->vertex[i % n], low->vertex[(i + 1) % n], high->vertex[k % m]);
            i++;
        } else {
            put_triangle(a, low->vertex[i % n], high->vertex[(k + 1) % m], high->vertex[k % m]);
            k++;
        }
    }
}

static void fill_row(const Assembly *a, int branch, int ring, Row *row)
{
    static const double TURN = 6.283185307179586476925;
    const MeshRing *r = &a->parts->rings[branch].ring[ring];
    row->count = r->count;
    for (int i = 0; i < r->count; i++)
        row->vertex[i] = a->ring_first[branch][ring] + i, row->angle[i] = TURN * i / r->count;
}

// The row at a ring: its own vertices, or those of the cut of the patch beside it.
static void row_at(const Assembly *a, int branch, int ring, bool is_cut, Row *row)
{
    if (!is_cut) {
        fill_row(a, branch, ring, row);
        return;
    }
    row->count = 0;
    for (int p = 0; p < a->parts->patch_count; p++)
        for (int c = 0; c < a->parts->patch[p].cut_count; c++) {
            const MeshCut *cut = &a->parts->patch[p].cut[c];
            if (cut->branch != branch || cut->ring != ring)
                continue;
            row->vertex = HEAP_GROWN(row->vertex, (size_t)cut->count + 256, sizeof *row->vertex);
            row->angle = HEAP_GROWN(row->angle, (size_t)cut->count + 256, sizeof *row->angle);
            row->count = cut->count;
            for (int i = 0; i < cut->count; i++)
                row->vertex[i] = a->patch_first[p] + cut->vertex[i], row->angle[i] = cut->angle[i];
        }
}

static bool is_used(const MeshRings *r, int ring) { return !(ring > 0 && r->in_patch[ring - 1]) && !(ring < r->count - 1 && r->in_patch[ring]); }

static void count_vertices(Assembly *a)
{
    int count = 0;
    a->mesh->rings = 0;
    for (int i = 0; i < a->parts->branch_count; i++) {
        const MeshRings *r = &a->parts->rings[i];
        a->ring_first[i] = HEAP_ZEROED((size_t)r->count, sizeof **a->ring_first);
        for (int k = 0; k < r->count; k++) {
            a->ring_first[i][k] = is_used(r, k) ? count : -1;
            count += is_used(r, k) ? r->ring[k].count : 0;
            a->mesh->rings += is_used(r, k);
        }
    }
    for (int p = 0; p < a->parts->patch_count; p++) {
        a->patch_first[p] = count;
        count += a->parts->patch[p].vertices;
    }
    a->mesh->surface->vertex_count = count;
}

// The tree's node nearest to t on a branch.
static int node_at(const SweepField *field, int branch, double t, int *knot)
{
    const SweepCurve *curve = field->curve[branch];
    int k = *knot;
    while (k + 1 < curve->knot_count && fabs(curve->knot_t[k + 1] - t) <= fabs(curve->knot_t[k] - t))
        k++;
    while (k > 0 && fabs(curve->knot_t[k - 1] - t) < fabs(curve->knot_t[k] - t))
        k--;
    *knot = k;
    return field->model->knot_node[field->model->branch[branch].first_knot + k];
}

static void put_vertices(Assembly *a)
{
    const SweepMeshParts *parts = a->parts;
    const SweepField *field = parts->feet.field;
    SweepMesh *mesh = a->mesh;
    TriangleMesh *s = mesh->surface;
    size_t n = (size_t)s->vertex_count + 1;
    s->vertex = HEAP_ZEROED(n, sizeof *s->vertex), s->normal = HEAP_ZEROED(n, sizeof *s->normal), s->node = HEAP_ZEROED(n, sizeof *s->node);
    mesh->branch = HEAP_ZEROED(n, sizeof *mesh->branch), mesh->along = HEAP_ZEROED(n, sizeof *mesh->along);
    mesh->boundary = HEAP_ZEROED(n, sizeof *mesh->boundary), mesh->sac = HEAP_ZEROED(n, sizeof *mesh->sac);
    for (int i = 0; i < parts->branch_count; i++) {
        const MeshRings *r = &parts->rings[i];
        for (int k = 0, knot = 0; k < r->count; k++) {
            if (a->ring_first[i][k] < 0)
                continue;
            const MeshRing *ring = &r->ring[k];
            int node = node_at(field, i, ring->t, &knot);
            for (int v = 0; v < ring->count; v++) {
                int to = a->ring_first[i][k] + v;
                s->vertex[to] = r->at[ring->first + v], s->normal[to] = r->normal[ring->first + v], s->node[to] = node;
                mesh->branch[to] = i, mesh->along[to] = ring->t, mesh->sac[to] = -1;
            }
        }
    }
    for (int p = 0; p < parts->patch_count; p++) {
        const MeshPatch *patch = &parts->patch[p];
        for (int v = 0, knot = 0; v < patch->vertices; v++) {
            int to = a->patch_first[p] + v, branch = patch->branch[v];
            double t = branch >= 0 ? fmax(0, fmin(field->curve[branch]->length, patch->t[v])) : 0;
            s->vertex[to] = patch->at[v], s->normal[to] = patch->normal[v];
            knot = branch >= 0 && knot < field->curve[branch]->knot_count ? knot : 0;
            s->node[to] = branch >= 0 ? node_at(field, branch, t, &knot) : field->model->sac_node[patch->sac_node[v]];
            mesh->branch[to] = branch, mesh->along[to] = t, mesh->sac[to] = branch >= 0 ? -1 : patch->sac_node[v];
        }
    }
}

// The gap of a cap at the start or the end of a branch; -1: there is none.
static int cap_gap(const MeshRings *r, int end)
{
    int gap = end == 0 ? 0 : r->count - 2;
    return !r->in_patch[gap] && is_cap(r, gap) ? gap : -1;
}

static void number_caps(Assembly *a)
{
    SweepMesh *mesh = a->mesh;
    const SweepModel *model = a->parts->feet.field->model;
    mesh->cap = HEAP_ZEROED(2 * (size_t)a->parts->branch_count + 3, sizeof *mesh->cap);
    mesh->cap[0].branch = mesh->cap[1].branch = -1;
    mesh->boundaries = 0;
    for (SweepTag flow = SWEEP_TAG_IN; flow <= SWEEP_TAG_OUT; flow++)
        for (int i = 0; i < a->parts->branch_count; i++)
            for (int end = 0; end < 2; end++)
                if (cap_gap(&a->parts->rings[i], end) >= 0 && sweep_model_tag(model, i, end) == flow) {
                    mesh->boundaries += flow == SWEEP_TAG_OUT && mesh->boundaries == 0 ? 2 : 1;
                    mesh->cap[mesh->boundaries] = (SweepCap){i, end, flow};
                }
}

// The strips of a branch, and the numbers of its caps.
static void put_strips(Assembly *a, int branch, Row *low, Row *high)
{
    const MeshRings *r = &a->parts->rings[branch];
    for (int j = 0; j < r->count - 1; j++) {
        if (r->in_patch[j])
            continue;
        row_at(a, branch, j, j > 0 && r->in_patch[j - 1], low);
        row_at(a, branch, j + 1, j + 1 < r->count - 1 && r->in_patch[j + 1], high);
        zip(a, low, high);
        if (!is_cap(r, j))
            continue;
        int number = sweep_mesh_cap(a->mesh, branch, j == 0 ? 0 : 1);
        for (int i = 0; i < low->count; i++)
            a->mesh->boundary[low->vertex[i]] = number;
        for (int i = 0; i < high->count; i++)
            a->mesh->boundary[high->vertex[i]] = number;
    }
}

// Turns the parts into the mesh's arrays. Returns false if it would be too large.
static bool assemble(SweepMesh *mesh, const SweepMeshParts *parts)
{
    mesh->surface = HEAP_ZEROED(1, sizeof *mesh->surface);
    Assembly a = {.parts = parts,
                  .mesh = mesh,
                  .good = true,
                  .ring_first = HEAP_ZEROED((size_t)parts->branch_count, sizeof *a.ring_first),
                  .patch_first = HEAP_ZEROED((size_t)parts->patch_count + 1, sizeof *a.patch_first)};
    Row low = {.vertex = HEAP_ZEROED(256, sizeof(int)), .angle = HEAP_ZEROED(256, sizeof(double))};
    Row high = {.vertex = HEAP_ZEROED(256, sizeof(int)), .angle = HEAP_ZEROED(256, sizeof(double))};
    count_vertices(&a);
    put_vertices(&a);
    number_caps(&a);
    mesh->failures = parts->failures, mesh->patches = parts->patch_count;
    for (int i = 0; i < parts->branch_count; i++)
        put_strips(&a, i, &low, &high);
    for (int p = 0; p < parts->patch_count; p++) {
        const MeshPatch *patch = &parts->patch[p];
        for (int t = 0; t < patch->triangles; t++)
            put_triangle(&a, a.patch_first[p] + patch->triangle[t][0], a.patch_first[p] + patch->triangle[t][1], a.patch_first[p] + patch->triangle[t][2]);
    }
    for (int i = 0; i < parts->branch_count; i++)
        free(a.ring_first[i]);
    free(a.ring_first);
    free(a.patch_first);
    free(low.vertex), free(low.angle), free(high.vertex), free(high.angle);
    return a.good;
}

static void free_parts(SweepMeshParts *parts)
{
    if (!parts)
        return;
    for (int i = 0; i < parts->branch_count; i++)
        mesh_rings_free(&parts->rings[i]);
    for (int i = 0; i < parts->patch_count; i++)
        mesh_patch_free(&parts->patch[i]);
    for (int i = 0; i < parts->failed_count; i++)
        mesh_patch_free(&parts->failed[i]);
    free(parts->failed);
    free(parts->rings);
    free(parts->patch);
    free(parts->first_segment);
    free(parts->segment);
    free(parts->view);
    free(parts->fork);
    free(parts->sacs);
    free(parts);
}

static SweepMeshParts *create_parts(const SweepField *field, const SweepMeshOptions *options)
{
    SweepMeshParts *parts = HEAP_ZEROED(1, sizeof *parts);
    SEL_ASSERT(options->edge_mm > 0 || (options->around >= 6 && options->around <= 256), "a ring has 6 to 256 vertices");
    parts->options = *options;
    parts->feet = (SweepFeet){.field = field, .kernels = sweep_kernels(options->isa), .harmonics = sweep_model_harmonics(field->model)};
    parts->branch_count = field->branch_count;
    parts->rings = HEAP_ZEROED((size_t)field->branch_count, sizeof *parts->rings);
    return parts;
}

// --- What the mesh was made from ---

static int sac_numbers(const VesselTree *sac) { return sac ? (int)(5 * sac->blob_count) : 0; }

static void list_sacs(const VesselTree *sac, double *numbers)
{
    for (int64_t i = 0; sac && i < sac->blob_count; i++) {
        Vec3 c = sac->blob_center[i];
        double row[5] = {c.x, c.y, c.z, sac->blob_width[i], sac->blob_amplitude[i]};
        memcpy(numbers + 5 * i, row, sizeof row);
    }
}

static void keep_source(SweepMeshParts *parts)
{
    const SweepField *field = parts->feet.field;
    int segments = field->first_segment[field->branch_count];
    free(parts->first_segment), free(parts->segment), free(parts->view), free(parts->fork), free(parts->sacs);
    parts->segment_count = segments;
    parts->first_segment = HEAP_ZEROED((size_t)field->branch_count + 1, sizeof *parts->first_segment);
    // rows of doubles need no alignment here: they are only compared
    parts->segment = HEAP_ZEROED((size_t)segments, sizeof(SweepSegment));
    parts->view = HEAP_ZEROED((size_t)segments, sizeof *parts->view);
    parts->fork = HEAP_ZEROED((size_t)field->branch_count, sizeof *parts->fork);
    parts->sac_numbers = sac_numbers(field->model->sac);
    parts->sacs = HEAP_ZEROED((size_t)parts->sac_numbers, sizeof *parts->sacs);
    memcpy(parts->first_segment, field->first_segment, ((size_t)field->branch_count + 1) * sizeof *parts->first_segment);
    memcpy((void *)parts->segment, field->segment, (size_t)segments * sizeof(SweepSegment));
    memcpy(parts->view, field->view, (size_t)segments * sizeof *parts->view);
    memcpy(parts->fork, field->fork, (size_t)field->branch_count * sizeof *parts->fork);
    list_sacs(field->model->sac, parts->sacs);
}

static bool same_view(const SweepView *a, const SweepView *b)
{
    bool same = a->count == b->count && a->sac == b->sac;
    for (int i = 0; same && i < a->count; i++)
        same = a->of[i].branch == b->of[i].branch && a->of[i].t == b->of[i].t && a->of[i].slope == b->of[i].slope;
    return same;
}

// What differs between the field that the parts were made from and another one.
typedef struct Changes {
    bool *segment;           // (segments) of the new field
    bool *branch;            // (branches) some segment
    bool sacs;
} Changes;

static Changes find_changes(const SweepMeshParts *parts, const SweepField *field)
{
    int segments = field->first_segment[field->branch_count];
    Changes c = {.segment = HEAP_ZEROED((size_t)segments, 1), .branch = HEAP_ZEROED((size_t)field->branch_count, 1)};
    const size_t field_part = offsetof(SweepSegment, around);    // what follows does not change the field
    for (int i = 0; i < field->branch_count; i++) {
        int first = field->first_segment[i], count = field->first_segment[i + 1] - first, before = parts->first_segment[i];
        bool whole =
            count != parts->first_segment[i + 1] - before || field->fork[i].delta != parts->fork[i].delta || field->fork[i].reach != parts->fork[i].reach;
        for (int k = 0; k < count; k++) {
            const SweepSegment *s = &field->segment[first + k];
            // sections of another kind are not in the row
            c.segment[first + k] = whole || s->is_shaped > 0 || memcmp(s, (const char *)parts->segment + (size_t)(before + k) * sizeof *s, field_part) != 0 ||
                                   !same_view(&field->view[first + k], &parts->view[before + k]);
            c.branch[i] |= c.segment[first + k];
        }
    }
    double *sacs = HEAP_ZEROED((size_t)sac_numbers(field->model->sac), sizeof *sacs);
    list_sacs(field->model->sac, sacs);
    c.sacs = sac_numbers(field->model->sac) != parts->sac_numbers || memcmp(sacs, parts->sacs, (size_t)parts->sac_numbers * sizeof *sacs) != 0;
    free(sacs);
    return c;
}

// Whether something changed on a branch between two places.
static bool is_changed(const SweepField *field, const Changes *c, int branch, double from, double to)
{
    if (!c->branch[branch])
        return false;
    for (int s = sweep_field_segment(field, branch, from), last = sweep_field_segment(field, branch, to); s <= last; s++)
        if (c->segment[s])
            return true;
    return false;
}

// Whether something changed that can be seen from a branch between two places.
static bool sees_change(const SweepField *field, const Changes *c, int branch, double from, double to)
{
    static const double ASIDE = 1.5;         // radii beside the place at which a candidate is expected
    for (int s = sweep_field_segment(field, branch, from), last = sweep_field_segment(field, branch, to); s <= last; s++) {
        const SweepView *view = &field->view[s];
        double near = fmax(0, field->segment[s].from), far = fmin(field->curve[branch]->length, field->segment[s].to);
        if (c->segment[s] || (view->sac >= 0 && c->sacs))
            return true;
        for (int i = 0; i < view->count; i++) {
            const SweepCandidate *other = &view->of[i];
            if (other->branch == branch || !c->branch[other->branch])
                continue;
            double a = other->t + other->slope * near, b = other->t + other->slope * far;
            double aside = ASIDE * (field->segment[s].largest + sweep_field_largest(field, other->branch, 0.5 * (a + b)));
            if (is_changed(field, c, other->branch, fmin(a, b) - aside, fmax(a, b) + aside))
                return true;
        }
    }
    return false;
}

static bool same_patch(const MeshPatch *a, const MeshPatch *b)
{
    bool same = a->run_count == b->run_count && a->sac_count == b->sac_count && a->cut_count == b->cut_count;
    for (int i = 0; same && i < a->run_count; i++)
        same = a->run[i].branch == b->run[i].branch && a->run[i].t_from == b->run[i].t_from && a->run[i].t_to == b->run[i].t_to;
    for (int i = 0; same && i < a->sac_count; i++)
        same = a->sac[i] == b->sac[i];
    return same;
}

// Whether a patch is the same in both fields: its definition, and what can be seen from it. `c` NULL: the fields are the same.
static bool is_kept(const SweepField *field, const Changes *c, const MeshPatch *old, const MeshPatch *now)
{
    static const double BEYOND = 1;          // [radii] beyond the cuts, more than a cell
    if (!(old->vertices > 0 || old->is_failed) || !same_patch(old, now) || (c && now->sac_count > 0 && c->sacs))
        return false;
    for (int i = 0; c && i < now->run_count; i++) {
        const MeshRun *run = &now->run[i];
        double length = field->curve[run->branch]->length, from = fmax(0, run->t_from), to = fmin(length, run->t_to);
        from -= BEYOND * sweep_field_largest(field, run->branch, from), to += BEYOND * sweep_field_largest(field, run->branch, to);
        if (sees_change(field, c, run->branch, from, to))
            return false;
    }
    return true;
}

typedef struct PatchList {
    int count;
    MeshPatch *patch;
} PatchList;

// Moves a patch to a list.
static void keep_patch(PatchList *list, MeshPatch *patch)
{
    list->patch = HEAP_GROWN(list->patch, (size_t)list->count + 1, sizeof *list->patch);
    list->patch[list->count++] = *patch;
    *patch = (MeshPatch){0};
}

static void free_patches(PatchList *list)
{
    for (int i = 0; i < list->count; i++)
        mesh_patch_free(&list->patch[i]);
    free(list->patch);
    *list = (PatchList){0};
}

// Takes the content of `now` from a list if it is there. The rings of its cuts may have other indices now.
static bool take_patch(const SweepField *field, const Changes *c, const PatchList *list, MeshPatch *now)
{
    for (int k = 0; k < list->count; k++) {
        MeshPatch *old = &list->patch[k];
        if (!is_kept(field, c, old, now))
            continue;
        for (int i = 0; i < now->cut_count; i++)
            old->cut[i].branch = now->cut[i].branch, old->cut[i].ring = now->cut[i].ring;
        for (int i = 0; i < now->run_count; i++)
            old->run[i] = now->run[i];
        MeshPatch empty = *now;
        *now = *old;
        *old = empty;
        return true;
    }
    return false;
}

// --- Creation ---

// The patches; a failed one is tried again with its cuts farther outwards. What can be is taken from `before`.
static void fill_patches(SweepMesh *mesh, SweepMeshParts *parts, const Changes *changes, const PatchList *before)
{
    static const int MORE[] = {3, 9, 27, 1 << 20, 1 << 20};      // gaps, at last to the end of the branch
    enum { TRIES = sizeof MORE / sizeof *MORE };
    const SweepField *field = parts->feet.field;
    PatchList tried = {0};
    MeshPatch *patch;
    int count;
    mark_gaps(parts);
    for (int try = 0;; try++) {
        patch = parts->patch = define_patches(parts, &parts->patch_count);
        count = parts->patch_count;
        for (int p = 0; p < count; p++)
            if (!take_patch(field, NULL, &tried, &patch[p]) && !(changes && take_patch(field, changes, before, &patch[p]))) {
                mesh_patch_fill(parts, &patch[p], try == TRIES);
                mesh->remade_patches++;
            }
        if (try == TRIES || !move_failed_cuts(parts, MORE[try]))
            break;
        for (int p = 0; p < count; p++)
            keep_patch(&tried, &patch[p]);
        free(patch);
    }
    // where even the last try failed the rings run through, and what should be blended stays apart
    parts->patch_count = parts->failures = 0;
    for (int p = 0; p < count; p++) {
        if (!patch[p].is_failed) {
            MeshPatch good = patch[p];
            parts->patch[parts->patch_count++] = good;
            continue;
        }
        for (int r = 0; r < patch[p].run_count; r++)
            for (int j = patch[p].run[r].from; j <= patch[p].run[r].to; j++)
                parts->rings[patch[p].run[r].branch].in_patch[j] = false;
        keep_patch(&tried, &patch[p]);
        parts->failures++;
    }
    // the next update need not try again what failed now
    PatchList failed = {0};
    for (int i = 0; i < tried.count; i++)
        if (tried.patch[i].is_failed)
            keep_patch(&failed, &tried.patch[i]);
    free_patches(&tried);
    parts->failed = failed.patch, parts->failed_count = failed.count;
}

// Rings, patches and strips, with patches taken from `before` where nothing changed.
static bool fill_mesh(SweepMesh *mesh, SweepMeshParts *parts, const Changes *changes, const PatchList *before)
{
    const SweepField *field = parts->feet.field;
    mesh->remade_rings = mesh->remade_patches = 0;
    for (int i = 0; i < parts->branch_count; i++) {
        if (changes && !sees_change(field, changes, i, -HUGE_VAL, HUGE_VAL))
            continue;
        mesh_rings_free(&parts->rings[i]);
        mesh_rings_fill(parts, i, &parts->rings[i]);
        mesh->remade_rings += parts->rings[i].count;
    }
    fill_patches(mesh, parts, changes, before);
    keep_source(parts);
    return assemble(mesh, parts);
}

SweepMesh *sweep_mesh_create(const SweepField *field, const SweepMeshOptions *options)
{
    SweepMeshOptions defaults = sweep_mesh_default_options();
    SweepMeshParts *parts = create_parts(field, options ? options : &defaults);
    SweepMesh *mesh = HEAP_ZEROED(1, sizeof *mesh);
    mesh->parts = parts;
    if (fill_mesh(mesh, parts, NULL, NULL))
        return mesh;
    sweep_mesh_free(mesh);
    return NULL;
}

static void free_surface(SweepMesh *mesh)
{
    triangle_mesh_free(mesh->surface);
    free(mesh->branch);
    free(mesh->along);
    free(mesh->sac);
    free(mesh->boundary);
    free(mesh->cap);
}

bool sweep_mesh_update(SweepMesh *mesh, const SweepField *field)
{
    SweepMeshParts *parts = mesh->parts;
    if (field->branch_count != parts->branch_count)
        return false;
    Changes changes = find_changes(parts, field);
    PatchList before = {parts->patch_count, parts->patch};
    for (int i = 0; i < parts->failed_count; i++)
        keep_patch(&before, &parts->failed[i]);
    free(parts->failed);
    parts->feet.field = field;
    parts->feet.harmonics = sweep_model_harmonics(field->model);
    free_surface(mesh);
    bool good = fill_mesh(mesh, parts, &changes, &before);
    free_patches(&before);
    free(changes.segment);
    free(changes.branch);
    return good;
}

int sweep_mesh_cap(const SweepMesh *mesh, int branch, int end)
{
    int number = mesh->boundaries;
    while (number > 0 && (mesh->cap[number].branch != branch || mesh->cap[number].end != end))
        number--;
    return number;
}

void sweep_mesh_free(SweepMesh *mesh)
{
    if (!mesh)
        return;
    free_parts(mesh->parts);
    free_surface(mesh);
    free(mesh);
}

TriangleMesh *triangle_mesh_of_sweep(const SweepModel *model, const SweepMeshOptions *options)
{
    SweepField *field = sweep_field_create(model);
    SweepMesh *mesh = field ? sweep_mesh_create(field, options) : NULL;
    TriangleMesh *surface = mesh ? mesh->surface : NULL;
    if (mesh)
        mesh->surface = NULL;
    sweep_mesh_free(mesh);
    sweep_field_free(field);
    return surface;
}
