// Functions common to all triangle surfaces: keeping some of the triangles, memory, a cell size for display.
#include "geom/isosurface.h"

#include <stdlib.h>
#include <string.h>

bool triangle_mesh_keep(TriangleMesh *mesh, const bool *keep)
{
    int *renamed = malloc(((size_t)mesh->vertex_count + 1) * sizeof *renamed), vertices = 0, triangles = 0;
    if (!renamed)
        return false;
    memset(renamed, 0xff, (size_t)mesh->vertex_count * sizeof *renamed);
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; keep[t] && k < 3; k++)
            renamed[mesh->triangle[t][k]] = 0;
    for (int v = 0; v < mesh->vertex_count; v++) {
        if (renamed[v] < 0)
            continue;
        renamed[v] = vertices;
        mesh->vertex[vertices] = mesh->vertex[v];
        mesh->normal[vertices] = mesh->normal[v];
        mesh->node[vertices++] = mesh->node[v];
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!keep[t])
            continue;
        for (int k = 0; k < 3; k++)
            mesh->triangle[triangles][k] = renamed[mesh->triangle[t][k]];
        triangles++;
    }
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    free(renamed);
    return true;
}

void triangle_mesh_free(TriangleMesh *mesh)
{
    if (!mesh)
        return;
    free(mesh->vertex);
    free(mesh->normal);
    free(mesh->node);
    free(mesh->triangle);
    free(mesh);
}

double isosurface_cell_for(const VesselTree *tree)
{
    double least = HUGE_VAL, area = 0;
    for (int i = 0; i < tree->node_count; i++) {
        int parent = tree->parent[i];
        least = fmin(least, tree->radius[i]);
        area += parent < 0 ? 0 : 2 * PI * tree->radius[i] * vec3_distance(tree->center[i], tree->center[parent]);
    }
    // marching cubes give 2.3 triangles per cell face on average
    double wanted = sqrt(2.3 * area / 300000);
    return fmax(fmin(fmax(wanted, 0.3 * least), 0.6 * least), 0.02);
}
