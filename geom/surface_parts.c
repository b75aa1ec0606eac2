// A part holds a node's centre if the field is above 0 on the straight line from the centre to some vertex of that part whose node it is. A few vertices per
// node and part are tried.
#include "geom/surface_parts.h"

#include "base/base.h"
#include "geom/key_map.h"

#include <stdlib.h>

enum { TRIES = 12, HELD = 1000 };

static double cone_volume(const TriangleMesh *mesh, int t, Vec3 apex)
{
    const int *corner = mesh->triangle[t];
    Vec3 a = vec3_sub(mesh->vertex[corner[0]], apex), b = vec3_sub(mesh->vertex[corner[1]], apex), c = vec3_sub(mesh->vertex[corner[2]], apex);
    return vec3_dot(a, vec3_cross(b, c)) / 6;
}

static bool number_parts(const TriangleMesh *mesh, SurfaceParts *parts)
{
    size_t vertices = (size_t)mesh->vertex_count;
    int *root = malloc((vertices + 1) * sizeof *root);
    parts->of_vertex = malloc((vertices + 1) * sizeof *parts->of_vertex);
    if (!root || !parts->of_vertex) {
        free(root);
        return false;
    }
    for (int v = 0; v < mesh->vertex_count; v++)
        root[v] = v;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 1; k < 3; k++)
            disjoint_join(root, mesh->triangle[t][0], mesh->triangle[t][k]);
    for (int v = 0; v < mesh->vertex_count; v++)
        parts->of_vertex[v] = disjoint_root(root, v) == v ? parts->count++ : parts->of_vertex[disjoint_root(root, v)];
    parts->part = calloc((size_t)parts->count + 1, sizeof *parts->part);
    for (int v = mesh->vertex_count - 1; v >= 0 && parts->part; v--) {
        SurfacePart *part = &parts->part[parts->of_vertex[v]];
        part->place = mesh->vertex[v];
        part->node = mesh->node[v];
    }
    for (int t = 0; t < mesh->triangle_count && parts->part; t++) {
        SurfacePart *part = &parts->part[parts->of_vertex[mesh->triangle[t][0]]];
        part->triangles++;
        part->volume += cone_volume(mesh, t, part->place);
    }
    free(root);
    return parts->part != NULL;
}

static bool sees(const VesselTree *tree, int node, Vec3 x)
{
    Vec3 c = tree->center[node];
    double far = vec3_distance(c, x), pieces = ceil(far / (0.1 * tree->radius[node]));
    int count = pieces > 100 ? 100 : (int)pieces, at = node;
    for (int k = 0; k <= count; k++)
        if (!(reach_blob_field(tree, vec3_mix(c, x, 0.98 * k / fmax(count, 1)), &at) > 0))
            return false;
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++)
        if (tree->near[k] == at)
            return true;
    return at == node;       // otherwise the line has led into another lumen
}

// Determines which nodes the parts hold; reached[part]: a point reaches one of them.
static bool find_nodes(const TriangleMesh *mesh, const VesselTree *tree, const Reach *reach, SurfaceParts *parts, bool *reached)
{
    KeyMap tries = {0};
    bool good = true;
    for (int v = 0; v < mesh->vertex_count && good; v++) {
        int node = mesh->node[v], index = parts->of_vertex[v];
        bool is_new;
        int *count = key_map_find_or_add(&tries, (uint64_t)index << 32 | (uint32_t)node, 0, &is_new);
        good = count != NULL;
        if (!good || ++*count > TRIES)
            continue;
        if (!sees(tree, node, mesh->vertex[v]))
            continue;
        *count = HELD;
        parts->part[index].nodes++;
        reached[index] = reached[index] || reach->share[node][REACH_POINT] >= 1;
    }
    key_map_free(&tries);
    return good;
}

typedef struct Rank {
    double volume;
    int part;
} Rank;

static int by_volume(const void *a, const void *b)
{
    const Rank *x = a, *y = b;
    return x->volume != y->volume ? (x->volume < y->volume) - (x->volume > y->volume) : (x->part > y->part) - (x->part < y->part);
}

static bool sort_parts(const TriangleMesh *mesh, SurfaceParts *parts)
{
    size_t count = (size_t)parts->count;
    Rank *rank = malloc((count + 1) * sizeof *rank);
    SurfacePart *sorted = malloc((count + 1) * sizeof *sorted);
    int *place = malloc((count + 1) * sizeof *place);
    bool good = rank && sorted && place;
    for (int p = 0; p < parts->count && good; p++)
        rank[p] = (Rank){parts->part[p].volume, p};
    if (good && count > 0)
        qsort(rank, count, sizeof *rank, by_volume);
    for (int p = 0; p < parts->count && good; p++) {
        sorted[p] = parts->part[rank[p].part];
        place[rank[p].part] = p;
    }
    for (int v = 0; v < mesh->vertex_count && good; v++)
        parts->of_vertex[v] = place[parts->of_vertex[v]];
    free(rank);
    free(place);
    if (good) {
        free(parts->part);
        parts->part = sorted;
    } else {
        free(sorted);
    }
    return good;
}

SurfaceParts *surface_parts_create(const TriangleMesh *mesh, const VesselTree *tree, const Reach *reach)
{
    SurfaceParts *parts = calloc(1, sizeof *parts);
    bool *reached = parts && number_parts(mesh, parts) ? calloc((size_t)parts->count + 1, sizeof *reached) : NULL;
    bool good = reached && find_nodes(mesh, tree, reach, parts, reached), inlet = false;
    for (int p = 0; p < (good ? parts->count : 0); p++) {
        SurfacePart *part = &parts->part[p];
        part->kind = !(part->volume > 0) ? PART_BUBBLE : reached[p] ? PART_INLET : part->nodes > 0 ? PART_SHUT : PART_GHOST;
        inlet = inlet || part->kind == PART_INLET;
    }
    good = good && sort_parts(mesh, parts);
    if (good && !inlet && parts->count > 0 && parts->part[0].volume > 0)
        parts->part[0].kind = PART_INLET;
    free(reached);
    if (!good) {
        surface_parts_free(parts);
        parts = NULL;
    }
    return parts;
}

void surface_parts_free(SurfaceParts *parts)
{
    if (!parts)
        return;
    free(parts->part);
    free(parts->of_vertex);
    free(parts);
}

bool surface_parts_keep(TriangleMesh *mesh, const SurfaceParts *parts, const bool kinds[PART_KINDS])
{
    bool *keep = malloc((size_t)mesh->triangle_count + 1);
    bool good = keep;
    for (int t = 0; t < mesh->triangle_count && good; t++)
        keep[t] = kinds[parts->part[parts->of_vertex[mesh->triangle[t][0]]].kind];
    good = good && triangle_mesh_keep(mesh, keep);
    free(keep);
    return good;
}
