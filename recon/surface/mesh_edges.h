// The edges of a triangle mesh: the sides of all triangles, sorted so that those of one edge are consecutive.
#ifndef SELDINGER_RECON_SURFACE_MESH_EDGES_H
#define SELDINGER_RECON_SURFACE_MESH_EDGES_H

#include "recon/surface/surface_file.h"

typedef struct MeshEdge {
    int low, high;           // indices of its vertices
    int triangle, side;      // the side from vertex `side` of the triangle to the next vertex
} MeshEdge;

// Fills edge (3 T), sorted by vertices, then by triangles.
void mesh_edges_sort(const SurfaceMesh *mesh, MeshEdge *edge);
// Number of consecutive sides from `at` on that are the same edge; `count` is 3 T.
int mesh_edges_run(const MeshEdge *edge, int count, int at);
// Fills across[t][k] with the triangle beyond side k, or -1 if the edge has one triangle or more than two. `edge` must be sorted.
void mesh_edges_link(const SurfaceMesh *mesh, const MeshEdge *edge, int (*across)[3]);

#endif
