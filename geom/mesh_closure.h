// Tests whether a surface is closed, so that each ray through it enters as often as it leaves, and closes surfaces that have rims.
#ifndef SELDINGER_GEOM_MESH_CLOSURE_H
#define SELDINGER_GEOM_MESH_CLOSURE_H

#include "geom/isosurface.h"

typedef struct MeshClosure {
    int64_t open_edges;      // edges that their triangles do not traverse equally often in both directions
    int64_t turned_edges;    // of these, edges that two triangles traverse in the same direction, so that one of them faces inwards
    int rims;                // connected sets of open edges
    double unevenness;       // of the least flat rim: its largest distance from its mean plane, relative to its mean radius
    double volume;           // [mm3] enclosed when the rims are closed by flat lids; > 0 if triangles face outwards
} MeshClosure;

// Triangles from each rim to its middle, which close the surface. Their corners are vertices of the mesh, or vertex_count + r for the middle of rim r. The
// arrays are owned by the caller (mesh_lids_free); NULL if there are none.
typedef struct MeshLids {
    int middle_count, triangle_count;
    Vec3 *middle;            // (middle_count)
    int *middle_vertex;      // (middle_count) a vertex of the rim
    int (*triangle)[3];      // (triangle_count)
} MeshLids;

// Vertices at the same position count as one. `lids` may be NULL. Returns false if out of memory.
bool mesh_closure(const TriangleMesh *mesh, MeshClosure *closure, MeshLids *lids);
void mesh_lids_free(MeshLids *lids);

#endif
