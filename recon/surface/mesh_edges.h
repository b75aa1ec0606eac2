// The edges of a triangle mesh: the sides of all triangles, sorted so that those of one edge stand together.
#ifndef SELDINGER_RECON_SURFACE_MESH_EDGES_H
#define SELDINGER_RECON_SURFACE_MESH_EDGES_H

#include "recon/surface/surface_file.h"

typedef struct MeshEdge {
    int low, high;           // its vertices by index
    int triangle, side;      // from vertex `side` of the triangle to the next
} MeshEdge;

// edge (3 T), by vertices, then by triangles.
void mesh_edges_sort(const SurfaceMesh *mesh, MeshEdge *edge);
// How many sides from `at` on are the same edge; `count` is 3 T.
int mesh_edges_run(const MeshEdge *edge, int count, int at);
// across[t][k]: the triangle beyond side k, -1 where the edge has one triangle or more than two. Of sorted edges.
void mesh_edges_link(const SurfaceMesh *mesh, const MeshEdge *edge, int (*across)[3]);

#endif
