// A surface is closed if it has no boundary as a chain: along each edge, the triangles that traverse it in one direction cancel those that traverse it in the
// other, however many there are. Triangles from each open edge to a common point close it.
#include "geom/mesh_closure.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

typedef struct OpenEdge {
    int from, to;            // in the direction in which its triangles traverse it more often, by one
    int times;
    bool is_turned;
} OpenEdge;

typedef struct Borders {
    int count, capacity;
    OpenEdge *edge;
} Borders;

static bool add_border(Borders *borders, OpenEdge edge)
{
    if (borders->count == borders->capacity) {
        int capacity = borders->capacity ? 2 * borders->capacity : 64;
        OpenEdge *grown = realloc(borders->edge, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        borders->edge = grown;
        borders->capacity = capacity;
    }
    borders->edge[borders->count++] = edge;
    return true;
}

// --- vertices at the same position ---

typedef struct Place {
    Vec3 x;
    int vertex;
} Place;

static int compare_places(const void *a, const void *b)
{
    const Place *p = a, *q = b;
    if (p->x.x != q->x.x)
        return p->x.x < q->x.x ? -1 : 1;
    if (p->x.y != q->x.y)
        return p->x.y < q->x.y ? -1 : 1;
    if (p->x.z != q->x.z)
        return p->x.z < q->x.z ? -1 : 1;
    return (p->vertex > q->vertex) - (p->vertex < q->vertex);
}

// same[v]: the lowest vertex at v's position.
static bool find_same_places(const TriangleMesh *mesh, int *same)
{
    size_t count = (size_t)mesh->vertex_count;
    Place *place = malloc((count + 1) * sizeof *place);
    if (!place)
        return false;
    for (int v = 0; v < mesh->vertex_count; v++)
        place[v] = (Place){mesh->vertex[v], v};
    qsort(place, count, sizeof *place, compare_places);
    for (size_t i = 0; i < count; i++) {
        bool is_same = i > 0 && vec3_norm2(vec3_sub(place[i].x, place[i - 1].x)) <= 0;
        same[place[i].vertex] = is_same ? same[place[i - 1].vertex] : place[i].vertex;
    }
    free(place);
    return true;
}

// --- edges ---

typedef struct Side {
    int to;                  // the vertex with the higher index
    int sign;                // +1 from the lower to the higher index
} Side;

static int compare_sides(const void *a, const void *b)
{
    const Side *p = a, *q = b;
    return (p->to > q->to) - (p->to < q->to);
}

static bool sort_out_sides(Side *side, int count, int lower, Borders *borders)
{
    qsort(side, (size_t)count, sizeof *side, compare_sides);
    for (int i = 0, n; i < count; i += n) {
        int net = 0;
        for (n = 0; i + n < count && side[i + n].to == side[i].to; n++)
            net += side[i + n].sign;
        if (net == 0)
            continue;
        int to = side[i].to;
        OpenEdge edge = {net > 0 ? lower : to, net > 0 ? to : lower, abs(net), n == 2};
        if (!add_border(borders, edge))
            return false;
    }
    return true;
}

static bool find_borders(const TriangleMesh *mesh, const int *same, Borders *borders)
{
    size_t vertices = (size_t)mesh->vertex_count, sides = 3 * (size_t)mesh->triangle_count;
    size_t *first = calloc(vertices + 2, sizeof *first);
    Side *side = malloc((sides + 1) * sizeof *side);
    bool good = first && side;
    // counting sort by the lower end: counted in the first pass, placed in the second
    for (int pass = 0; good && pass < 2; pass++) {
        for (size_t i = 0; i < sides; i++) {
            int a = same[mesh->triangle[i / 3][i % 3]], b = same[mesh->triangle[i / 3][(i + 1) % 3]], low = a < b ? a : b;
            if (a == b)
                continue;
            if (pass == 0)
                first[low + 2]++;
            else
                side[first[low + 1]++] = (Side){a < b ? b : a, a < b ? 1 : -1};
        }
        for (size_t v = 2; pass == 0 && v < vertices + 2; v++)
            first[v] += first[v - 1];
    }
    for (size_t v = 0; good && v < vertices; v++)
        good = sort_out_sides(side + first[v], (int)(first[v + 1] - first[v]), (int)v, borders);
    free(first);
    free(side);
    return good;
}

// --- lids ---

// Largest distance of the rim's edges from their mean plane, relative to their mean distance from the middle. The plane's normal is the rim's area vector.
static double rim_unevenness(const TriangleMesh *mesh, const Borders *borders, const int *rim_of, int rim, Vec3 middle)
{
    Vec3 area = {0, 0, 0};
    double radius = 0, furthest = 0, count = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < borders->count; i++) {
            const OpenEdge *e = &borders->edge[i];
            if (rim_of[e->from] != rim)
                continue;
            Vec3 a = vec3_sub(mesh->vertex[e->from], middle);
            if (pass == 0) {
                area = vec3_add(area, vec3_cross(a, vec3_sub(mesh->vertex[e->to], middle)));
                radius += vec3_norm(a);
                count++;
            } else
                furthest = fmax(furthest, fabs(vec3_dot(a, vec3_unit(area))));
        }
    return radius > 0 ? furthest * count / radius : 0;
}

// Numbers the connected sets of open edges; rim_of[v] is set for their vertices. Returns their number; -1 if out of memory.
static int number_rims(const TriangleMesh *mesh, const Borders *borders, int *rim_of)
{
    int *set = malloc(((size_t)mesh->vertex_count + 1) * sizeof *set), rims = 0;
    if (!set)
        return -1;
    for (int v = 0; v < mesh->vertex_count; v++)
        set[v] = v, rim_of[v] = -1;
    for (int i = 0; i < borders->count; i++)
        disjoint_join(set, borders->edge[i].from, borders->edge[i].to);
    for (int i = 0; i < borders->count; i++) {
        int root = disjoint_root(set, borders->edge[i].from);
        if (rim_of[root] < 0)
            rim_of[root] = rims++;
    }
    for (int i = 0; i < borders->count; i++) {
        rim_of[borders->edge[i].from] = rim_of[disjoint_root(set, borders->edge[i].from)];
        rim_of[borders->edge[i].to] = rim_of[disjoint_root(set, borders->edge[i].to)];
    }
    free(set);
    return rims;
}

static bool make_lids(const TriangleMesh *mesh, const Borders *borders, MeshClosure *closure, MeshLids *lids)
{
    int *rim_of = malloc(((size_t)mesh->vertex_count + 1) * sizeof *rim_of), triangles = 0;
    closure->rims = rim_of ? number_rims(mesh, borders, rim_of) : -1;
    for (int i = 0; i < borders->count; i++)
        triangles += borders->edge[i].times;
    size_t rims = closure->rims > 0 ? (size_t)closure->rims : 0;
    double *length = calloc(rims + 1, sizeof *length);
    *lids = (MeshLids){.middle_count = (int)rims,
                       .triangle_count = triangles,
                       .middle = calloc(rims + 1, sizeof *lids->middle),
                       .middle_vertex = calloc(rims + 1, sizeof(int)),
                       .triangle = calloc((size_t)triangles + 1, sizeof *lids->triangle)};
    bool good = closure->rims >= 0 && length && lids->middle && lids->middle_vertex && lids->triangle;
    for (int i = 0, n = 0; good && i < borders->count; i++) {
        const OpenEdge *e = &borders->edge[i];
        int rim = rim_of[e->from];
        double l = vec3_distance(mesh->vertex[e->from], mesh->vertex[e->to]);
        lids->middle[rim] = vec3_add_scaled(lids->middle[rim], l, vec3_mix(mesh->vertex[e->from], mesh->vertex[e->to], 0.5));
        lids->middle_vertex[rim] = e->from;
        length[rim] += l;
        for (int k = 0; k < e->times; k++, n++) {
            lids->triangle[n][0] = e->to;
            lids->triangle[n][1] = e->from;
            lids->triangle[n][2] = mesh->vertex_count + rim;
        }
    }
    for (int rim = 0; good && rim < closure->rims; rim++) {
        lids->middle[rim] = length[rim] > 0 ? vec3_scale(lids->middle[rim], 1 / length[rim]) : mesh->vertex[lids->middle_vertex[rim]];
        closure->unevenness = fmax(closure->unevenness, rim_unevenness(mesh, borders, rim_of, rim, lids->middle[rim]));
    }
    free(rim_of);
    free(length);
    return good;
}

static double enclosed_volume(const TriangleMesh *mesh, const MeshLids *lids)
{
    double volume = 0;
    Vec3 apex = mesh->vertex_count > 0 ? mesh->vertex[0] : vec3(0, 0, 0);
    for (int t = 0; t < mesh->triangle_count + lids->triangle_count; t++) {
        const int *c = t < mesh->triangle_count ? mesh->triangle[t] : lids->triangle[t - mesh->triangle_count];
        Vec3 p[3];
        for (int k = 0; k < 3; k++)
            p[k] = vec3_sub(c[k] < mesh->vertex_count ? mesh->vertex[c[k]] : lids->middle[c[k] - mesh->vertex_count], apex);
        volume += vec3_dot(p[0], vec3_cross(p[1], p[2])) / 6;
    }
    return volume;
}

bool mesh_closure(const TriangleMesh *mesh, MeshClosure *closure, MeshLids *lids)
{
    *closure = (MeshClosure){0};
    Borders borders = {0};
    MeshLids own = {0};
    int *same = malloc(((size_t)mesh->vertex_count + 1) * sizeof *same);
    bool good = same != NULL;
    for (int v = 0; good && v < mesh->vertex_count; v++)
        same[v] = v;
    good = good && find_borders(mesh, same, &borders);
    // duplicate positions only matter if the surface seems open
    if (good && borders.count > 0) {
        borders.count = 0;
        good = find_same_places(mesh, same) && find_borders(mesh, same, &borders);
    }
    closure->open_edges = borders.count;
    for (int i = 0; good && i < borders.count; i++)
        closure->turned_edges += borders.edge[i].is_turned;
    good = good && make_lids(mesh, &borders, closure, &own);
    if (good)
        closure->volume = enclosed_volume(mesh, &own);
    if (good && lids)
        *lids = own;
    else
        mesh_lids_free(&own);
    free(borders.edge);
    free(same);
    return good;
}

void mesh_lids_free(MeshLids *lids)
{
    free(lids->middle);
    free(lids->middle_vertex);
    free(lids->triangle);
    *lids = (MeshLids){0};
}
