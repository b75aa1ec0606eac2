#include "recon/surface/mesh_edges.h"

#include <stdlib.h>

static int compare_edges(const void *a, const void *b)
{
    const MeshEdge *x = a, *y = b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return (x->triangle > y->triangle) - (x->triangle < y->triangle);
}

void mesh_edges_sort(const SurfaceMesh *mesh, MeshEdge *edge)
{
    size_t count = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = mesh->triangle[t][k], b = mesh->triangle[t][(k + 1) % 3];
            edge[count++] = (MeshEdge){a < b ? a : b, a < b ? b : a, t, k};
        }
    qsort(edge, count, sizeof *edge, compare_edges);
}

int mesh_edges_run(const MeshEdge *edge, int count, int at)
{
    int end = at + 1;
    while (end < count && edge[end].low == edge[at].low && edge[end].high == edge[at].high)
        end++;
    return end - at;
}

void mesh_edges_link(const SurfaceMesh *mesh, const MeshEdge *edge, int (*across)[3])
{
    int count = 3 * mesh->triangle_count;
    for (int t = 0; t < mesh->triangle_count; t++)
        across[t][0] = across[t][1] = across[t][2] = -1;
    for (int e = 0, run; e < count; e += run) {
        run = mesh_edges_run(edge, count, e);
        if (run == 2) {
            across[edge[e].triangle][edge[e].side] = edge[e + 1].triangle;
            across[edge[e + 1].triangle][edge[e + 1].side] = edge[e].triangle;
        }
    }
}
