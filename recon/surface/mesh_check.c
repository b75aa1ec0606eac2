// Implements mesh_check.h. Edges are sorted records (low vertex, high vertex, triangle); orientation is propagated breadth first over edges of exactly
// two triangles, then each component is oriented outwards by the sign of its volume, with openings closed by fans around their loops' middles.
#include "recon/surface/mesh_check.h"

#include "base/base.h"
#include "recon/surface/mesh_edges.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double WELD = 1e-6, SMALL = 1, LARGE = 5000;

static void note(MeshFinding *finding, int index, Vec3 place)
{
    if (finding->count++ == 0) {
        finding->first = index;
        finding->place = place;
    }
}

static Vec3 corner(const SurfaceMesh *mesh, int triangle, int k) { return mesh->vertex[mesh->triangle[triangle][k]]; }

static Vec3 area_vector(const SurfaceMesh *mesh, int t)
{
    Vec3 a = corner(mesh, t, 0);
    return vec3_scale(vec3_cross(vec3_sub(corner(mesh, t, 1), a), vec3_sub(corner(mesh, t, 2), a)), 0.5);
}

// --- welding ---

typedef struct Cell {
    int64_t x, y, z;
} Cell;

static uint64_t hash_cell(Cell c)
{
    uint64_t h = (uint64_t)c.x * 0x9E3779B97F4A7C15u ^ (uint64_t)c.y * 0xC2B2AE3D27D4EB4Fu ^ (uint64_t)c.z * 0x165667B19E3779F9u;
    h ^= h >> 29;
    h *= 0xBF58476D1CE4E5B9u;
    return h ^ h >> 32;
}

// Fills same[i] with the first vertex within `near` of vertex i. Returns false if out of memory.
static bool find_same(const SurfaceMesh *mesh, Vec3 low, double near, int *same)
{
    int n = mesh->vertex_count;
    size_t room = 16;
    while (room < 2 * (size_t)n)
        room *= 2;
    int *head = malloc(room * sizeof *head), *next = malloc(((size_t)n + 1) * sizeof *next);
    if (!head || !next) {
        free(head);
        free(next);
        return false;
    }
    memset(head, -1, room * sizeof *head);
    double size = 2 * near;
    for (int i = 0; i < n; i++) {
        Vec3 p = vec3_scale(vec3_sub(mesh->vertex[i], low), 1 / size);
        same[i] = i;
        // a cell is twice the distance wide, so along each axis only the nearer neighbour can hold a vertex within that distance
        Cell own = {(int64_t)floor(p.x), (int64_t)floor(p.y), (int64_t)floor(p.z)};
        int sx = p.x - (double)own.x < 0.5 ? -1 : 1, sy = p.y - (double)own.y < 0.5 ? -1 : 1, sz = p.z - (double)own.z < 0.5 ? -1 : 1;
        for (int k = 0; k < 8; k++) {
            Cell cell = {own.x + (k & 1 ? sx : 0), own.y + (k & 2 ? sy : 0), own.z + (k & 4 ? sz : 0)};
            for (int j = head[hash_cell(cell) & (room - 1)]; j >= 0; j = next[j])
                if (j < same[i] && vec3_distance(mesh->vertex[i], mesh->vertex[j]) <= near)
                    same[i] = j;
        }
        if (same[i] == i) {
            size_t slot = hash_cell(own) & (room - 1);
            next[i] = head[slot];
            head[slot] = i;
        }
    }
    free(head);
    free(next);
    return true;
}

typedef struct Work {
    int *same;               // (V) see find_same
    int *parent;             // (V) union-find of components
    int *number;             // (V) component number of a vertex that is a union-find root
    int *source;             // (T) index of the triangle in the file
    int *component;          // (T)
    int *queue;              // (T)
    bool *turned;            // (T)
    bool *seen;              // (T)
    bool *used;              // (V) used by the file's triangles
    MeshEdge *edge;          // (3 T) sorted
    int (*across)[3];        // (T) the other triangle of an edge of exactly two triangles, else -1
} Work;

static void weld(SurfaceMesh *mesh, MeshCheck *check, const int *same)
{
    for (int i = 0; i < mesh->vertex_count; i++)
        if (same[i] != i)
            note(&check->duplicate_vertices, i, mesh->vertex[i]);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            mesh->triangle[t][k] = same[mesh->triangle[t][k]];
}

// Removes triangles with fewer than three corners and repeated ones; fills work->source.
typedef struct Key {
    int v[3], triangle;
} Key;

static int compare_keys(const void *a, const void *b)
{
    const Key *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->v[k] != y->v[k])
            return x->v[k] < y->v[k] ? -1 : 1;
    return (x->triangle > y->triangle) - (x->triangle < y->triangle);
}

static bool drop_triangles(SurfaceMesh *mesh, MeshCheck *check, Work *work, double size)
{
    int n = mesh->triangle_count, kept = 0;
    Key *key = malloc(((size_t)n + 1) * sizeof *key);
    bool *repeated = calloc((size_t)n + 1, sizeof *repeated);
    if (!key || !repeated) {
        free(key);
        free(repeated);
        return false;
    }
    for (int t = 0; t < n; t++) {
        Key k = {{mesh->triangle[t][0], mesh->triangle[t][1], mesh->triangle[t][2]}, t};
        for (int pass = 0; pass < 2; pass++)
            for (int i = 0; i < 2; i++)
                if (k.v[i] > k.v[i + 1]) {
                    int swap = k.v[i];
                    k.v[i] = k.v[i + 1];
                    k.v[i + 1] = swap;
                }
        key[t] = k;
    }
    qsort(key, (size_t)n, sizeof *key, compare_keys);
    for (int i = 1; i < n; i++)
        repeated[key[i].triangle] = !memcmp(key[i].v, key[i - 1].v, sizeof key[i].v);
    for (int t = 0; t < n; t++) {
        const int *v = mesh->triangle[t];
        bool collapsed = v[0] == v[1] || v[1] == v[2] || v[0] == v[2];
        if (collapsed || vec3_norm(area_vector(mesh, t)) < 1e-14 * size * size)
            note(&check->degenerate_triangles, t, corner(mesh, t, 0));
        else if (repeated[t])
            note(&check->duplicate_triangles, t, corner(mesh, t, 0));
        if (collapsed || repeated[t])
            continue;
        memmove(mesh->triangle[kept], mesh->triangle[t], sizeof mesh->triangle[t]);
        work->source[kept++] = t;
    }
    mesh->triangle_count = kept;
    free(key);
    free(repeated);
    return true;
}

static bool drop_vertices(SurfaceMesh *mesh, MeshCheck *check, const int *same, const bool *used_before)
{
    int n = mesh->vertex_count, kept = 0;
    int *place = malloc(((size_t)n + 1) * sizeof *place);
    if (!place)
        return false;
    memset(place, 0, ((size_t)n + 1) * sizeof *place);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            place[mesh->triangle[t][k]] = 1;
    for (int i = 0; i < n; i++) {
        if (!used_before[i] && same[i] == i)
            note(&check->unreferenced_vertices, i, mesh->vertex[i]);
        if (place[i]) {
            mesh->vertex[kept] = mesh->vertex[i];
            place[i] = kept++;
        }
    }
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            mesh->triangle[t][k] = place[mesh->triangle[t][k]];
    mesh->vertex_count = kept;
    free(place);
    return true;
}

// --- edges, components, orientation ---

static void find_components(SurfaceMesh *mesh, MeshCheck *check, Work *work)
{
    for (int i = 0; i < mesh->vertex_count; i++)
        work->parent[i] = i;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 1; k < 3; k++)
            disjoint_join(work->parent, mesh->triangle[t][0], mesh->triangle[t][k]);
    int *number = work->number;
    for (int i = 0; i < mesh->vertex_count; i++)
        number[i] = -1;
    for (int t = 0; t < mesh->triangle_count; t++) {
        int root = disjoint_root(work->parent, mesh->triangle[t][0]);
        if (number[root] < 0)
            number[root] = check->component_count++;
        work->component[t] = number[root];
    }
}

// Counts open and non-manifold edges and links the triangles at the others.
static void link_triangles(const SurfaceMesh *mesh, MeshCheck *check, Work *work)
{
    int count = 3 * mesh->triangle_count;
    const MeshEdge *edge = work->edge;
    mesh_edges_link(mesh, edge, work->across);
    for (int e = 0, run; e < count; e += run) {
        run = mesh_edges_run(edge, count, e);
        if (run == 1)
            note(&check->open_edges, work->source[edge[e].triangle], mesh->vertex[edge[e].low]);
        else if (run > 2)
            note(&check->nonmanifold_edges, work->source[edge[e].triangle], mesh->vertex[edge[e].low]);
    }
}

// Returns true if two triangles traverse their common edge in the same direction, so that one of them must be flipped.
static bool run_alike(const SurfaceMesh *mesh, int t, int side, int other)
{
    int a = mesh->triangle[t][side], b = mesh->triangle[t][(side + 1) % 3];
    for (int k = 0; k < 3; k++)
        if (mesh->triangle[other][k] == a && mesh->triangle[other][(k + 1) % 3] == b)
            return true;
    return false;
}

static void spread_orientation(const SurfaceMesh *mesh, MeshCheck *check, Work *work)
{
    for (int start = 0; start < mesh->triangle_count; start++) {
        if (work->seen[start])
            continue;
        int head = 0, tail = 0;
        work->queue[tail++] = start;
        work->seen[start] = true;
        while (head < tail) {
            int t = work->queue[head++];
            for (int k = 0; k < 3; k++) {
                int other = work->across[t][k];
                if (other < 0)
                    continue;
                bool turn = run_alike(mesh, t, k, other) != work->turned[t];
                if (!work->seen[other]) {
                    work->seen[other] = true;
                    work->turned[other] = turn;
                    work->queue[tail++] = other;
                } else if (work->turned[other] != turn && t < other)
                    note(&check->one_sided_edges, work->source[t], corner(mesh, t, k));
            }
        }
    }
}

static void turn(int *triangle)
{
    int swap = triangle[1];
    triangle[1] = triangle[2];
    triangle[2] = swap;
}

// Finds loops of open edges by union-find over their vertices, and adds the volume of a lid over each loop to the components' volumes.
static void add_lids(const SurfaceMesh *mesh, MeshCheck *check, Work *work, double *volume, Vec3 from)
{
    int count = 3 * mesh->triangle_count, *parent = work->parent;
    for (int i = 0; i < mesh->vertex_count; i++)
        parent[i] = i;
    for (int pass = 0; pass < 2; pass++)
        for (int e = 0; e < count; e++) {
            const MeshEdge *edge = &work->edge[e];
            if (work->across[edge->triangle][edge->side] >= 0 || mesh_edges_run(work->edge, count, e) > 1 ||
                (e > 0 && edge[-1].low == edge->low && edge[-1].high == edge->high))
                continue;
            if (pass == 0)
                disjoint_join(parent, edge->low, edge->high);
            else {
                int a = disjoint_root(parent, edge->low);
                // the loop's first vertex is the lid's apex: any apex gives the same volume of a flat lid
                Vec3 p = vec3_sub(mesh->vertex[edge->low], from), q = vec3_sub(mesh->vertex[edge->high], from), apex = vec3_sub(mesh->vertex[a], from);
                double lid = vec3_dot(apex, vec3_cross(p, q)) / 6;
                bool forward = (mesh->triangle[edge->triangle][edge->side] == edge->low) != work->turned[edge->triangle];
                volume[work->component[edge->triangle]] += forward ? -lid : lid;
                if (!work->number[a])
                    check->opening_count++;
                work->number[a] = 1;
            }
        }
}

static bool orient(SurfaceMesh *mesh, MeshCheck *check, Work *work)
{
    spread_orientation(mesh, check, work);
    double *volume = calloc((size_t)check->component_count + 1, sizeof *volume);
    int *sizes = calloc(2 * (size_t)check->component_count + 2, sizeof *sizes);
    if (!volume || !sizes) {
        free(volume);
        free(sizes);
        return false;
    }
    Vec3 from = vec3_scale(vec3_add(check->low, check->high), 0.5);
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 a = vec3_sub(corner(mesh, t, 0), from), b = vec3_sub(corner(mesh, t, 1), from), c = vec3_sub(corner(mesh, t, 2), from);
        double six = vec3_dot(a, vec3_cross(b, c)) / 6;
        volume[work->component[t]] += work->turned[t] ? -six : six;
        check->area += vec3_norm(area_vector(mesh, t));
    }
    for (int i = 0; i < mesh->vertex_count; i++)
        work->number[i] = 0;
    add_lids(mesh, check, work, volume, from);
    int *all = sizes, *changed = sizes + check->component_count;
    for (int t = 0; t < mesh->triangle_count; t++) {
        work->turned[t] = work->turned[t] != (volume[work->component[t]] < 0);
        all[work->component[t]]++;
        changed[work->component[t]] += work->turned[t];
    }
    for (int c = 0; c < check->component_count; c++) {
        check->volume += fabs(volume[c]);
        check->inside_out_count += 2 * changed[c] > all[c];
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        int c = work->component[t];
        if (work->turned[t] != (2 * changed[c] > all[c]))
            note(&check->flipped_triangles, work->source[t], corner(mesh, t, 0));
        if (work->turned[t])
            turn(mesh->triangle[t]);
    }
    free(volume);
    free(sizes);
    return true;
}

static bool repair(SurfaceMesh *mesh, MeshCheck *check, Work *work)
{
    double size = vec3_distance(check->low, check->high);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            work->used[mesh->triangle[t][k]] = true;
    if (!find_same(mesh, check->low, fmax(WELD * size, 1e-300), work->same))
        return false;
    weld(mesh, check, work->same);
    if (!drop_triangles(mesh, check, work, size) || !drop_vertices(mesh, check, work->same, work->used))
        return false;
    mesh_edges_sort(mesh, work->edge);
    find_components(mesh, check, work);
    link_triangles(mesh, check, work);
    return orient(mesh, check, work);
}

bool mesh_repair(SurfaceMesh *mesh, MeshCheck *check)
{
    size_t v = (size_t)mesh->vertex_count + 1, t = (size_t)mesh->triangle_count + 1;
    *check = (MeshCheck){.vertex_count = mesh->vertex_count, .triangle_count = mesh->triangle_count, .low = mesh->vertex[0], .high = mesh->vertex[0]};
    MeshFinding *findings[] = {&check->duplicate_vertices,  &check->unreferenced_vertices, &check->degenerate_triangles,
                               &check->duplicate_triangles, &check->flipped_triangles,     &check->open_edges,
                               &check->nonmanifold_edges,   &check->one_sided_edges};
    for (size_t i = 0; i < sizeof findings / sizeof findings[0]; i++)
        findings[i]->first = -1;
    for (int i = 0; i < mesh->vertex_count; i++) {
        Vec3 p = mesh->vertex[i];
        check->low = vec3(fmin(check->low.x, p.x), fmin(check->low.y, p.y), fmin(check->low.z, p.z));
        check->high = vec3(fmax(check->high.x, p.x), fmax(check->high.y, p.y), fmax(check->high.z, p.z));
    }
    Vec3 extent = vec3_sub(check->high, check->low);
    double most = fmax(extent.x, fmax(extent.y, extent.z));
    check->unit_is_doubtful = most < SMALL || most > LARGE;
    Work work = {.same = calloc(v, sizeof(int)),
                 .parent = calloc(v, sizeof(int)),
                 .number = calloc(v, sizeof(int)),
                 .source = calloc(t, sizeof(int)),
                 .component = calloc(t, sizeof(int)),
                 .queue = calloc(t, sizeof(int)),
                 .turned = calloc(t, sizeof(bool)),
                 .seen = calloc(t, sizeof(bool)),
                 .used = calloc(v, sizeof(bool)),
                 .edge = calloc(3 * t, sizeof(MeshEdge)),
                 .across = calloc(t, sizeof(int[3]))};
    bool good = work.same && work.parent && work.number && work.source && work.component && work.queue && work.turned && work.seen && work.used && work.edge &&
                work.across && repair(mesh, check, &work);
    free(work.same);
    free(work.parent);
    free(work.number);
    free(work.source);
    free(work.component);
    free(work.queue);
    free(work.turned);
    free(work.seen);
    free(work.used);
    free(work.edge);
    free(work.across);
    return good;
}

bool mesh_check(const SurfaceMesh *mesh, MeshCheck *check)
{
    SurfaceMesh copy = {mesh->vertex_count, mesh->triangle_count, malloc((size_t)mesh->vertex_count * sizeof(Vec3)),
                        malloc((size_t)mesh->triangle_count * sizeof(int[3]))};
    bool good = copy.vertex && copy.triangle;
    if (good) {
        memcpy(copy.vertex, mesh->vertex, (size_t)mesh->vertex_count * sizeof(Vec3));
        memcpy(copy.triangle, mesh->triangle, (size_t)mesh->triangle_count * sizeof(int[3]));
        good = mesh_repair(&copy, check);
    }
    free(copy.vertex);
    free(copy.triangle);
    return good;
}

SurfaceMesh *mesh_load_repaired(const char *path, double scale, const char *option, MeshCheck *check, Faults *faults)
{
    SurfaceMesh *mesh = surface_load(path, faults);
    if (!mesh)
        return NULL;
    for (int i = 0; i < mesh->vertex_count && scale > 0; i++)
        mesh->vertex[i] = vec3_scale(mesh->vertex[i], scale);
    if (!mesh_repair(mesh, check))
        faults_add(faults, path, 0, 0, "not enough memory");
    else if (check->unit_is_doubtful && !(scale > 0)) {
        Vec3 e = vec3_sub(check->high, check->low);
        faults_add(faults, path, 0, 0,
                   "is %g x %g x %g across, which cannot be the size of a vessel in mm; use %s1000 for metres, %s0.001 for micrometres, %s1 to accept it "
                   "as it is",
                   e.x, e.y, e.z, option, option, option);
    } else if (check->one_sided_edges.count)
        faults_add(faults, path, 0, 0, "is one-sided (first at triangle %d): inside and outside cannot be distinguished", check->one_sided_edges.first);
    else if (mesh->triangle_count == 0 || !(check->area > 0))
        faults_add(faults, path, 0, 0, "has no triangle with an area");
    else
        return mesh;
    surface_free(mesh);
    return NULL;
}

// --- text ---

typedef struct Text {
    char *at;
    size_t left;
    int lines;
} Text;

static void __attribute__((format(printf, 2, 3))) append_line(Text *text, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    int n = vsnprintf(text->at, text->left, format, list);
    va_end(list);
    size_t used = n < 0 ? 0 : (size_t)n < text->left ? (size_t)n : text->left - 1;
    text->at += used;
    text->left -= used;
    text->lines++;
}

static void append_finding(Text *text, const MeshFinding *f, const char *what, const char *of, const char *done)
{
    if (f->count)
        append_line(text, "%d %s, first: %s %d at (%g, %g, %g)%s\n", f->count, what, of, f->first, f->place.x, f->place.y, f->place.z, done);
}

int mesh_check_text(const MeshCheck *check, bool repaired, char *out, size_t capacity)
{
    Text text = {out, capacity, 0};
    out[0] = '\0';
    if (check->unit_is_doubtful) {
        Vec3 e = vec3_sub(check->high, check->low);
        append_line(&text, "size %g x %g x %g: probably not in millimetres%s\n", e.x, e.y, e.z, e.x < SMALL ? " but in metres; scale by 1000" : "");
    }
    append_finding(&text, &check->duplicate_vertices, "vertices repeat others", "vertex", repaired ? ": welded" : "");
    append_finding(&text, &check->unreferenced_vertices, "vertices are in no triangle", "vertex", repaired ? ": removed" : "");
    append_finding(&text, &check->degenerate_triangles, "triangles have no area", "triangle", repaired ? ": removed if two corners coincide" : "");
    append_finding(&text, &check->duplicate_triangles, "triangles repeat others", "triangle", repaired ? ": removed" : "");
    append_finding(&text, &check->flipped_triangles, "triangles are oriented against their neighbours", "triangle", repaired ? ": flipped" : "");
    if (check->inside_out_count)
        append_line(&text, "normals point into the lumen%s%s\n", check->component_count > 1 ? " in some components" : "", repaired ? ": all flipped" : "");
    if (check->component_count > 1)
        append_line(&text, "%d components that do not touch\n", check->component_count);
    if (check->open_edges.count) {
        char count[64];
        snprintf(count, sizeof count, ", in %d opening%s", check->opening_count, check->opening_count == 1 ? "" : "s");
        append_finding(&text, &check->open_edges, "edges are open", "triangle", count);
    }
    append_finding(&text, &check->nonmanifold_edges, "edges are shared by more than two triangles", "triangle", repaired ? ": kept" : "");
    append_finding(&text, &check->one_sided_edges, "edges have no consistent orientation (one-sided surface)", "triangle", "");
    return text.lines;
}
