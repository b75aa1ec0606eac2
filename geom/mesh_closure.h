// Whether a surface is closed, so that each ray through it goes in as often as out; and closing it where it has rims.
#ifndef SELDINGER_GEOM_MESH_CLOSURE_H
#define SELDINGER_GEOM_MESH_CLOSURE_H

#include "geom/isosurface.h"

typedef struct MeshClosure {
    int64_t open_edges;      // that their triangles do not run along as often one way as the other
    int64_t turned_edges;    // of these: two triangles that both run along them the same way, so that one faces inwards
    int rims;                // connected sets of open edges
    double unevenness;       // of the least flat rim: how far it is from its mean plane, in its mean radius
    double volume;           // [mm3] enclosed, once rims have flat lids; > 0 where triangles face outwards
} MeshClosure;

// Vertices at the same place are taken for one. `lids`: triangles from each rim to its middle, which close the surface: their corners are vertices of the
// mesh, or vertex_count + r for the middle of rim r. Both arrays are the caller's to free; NULL where there are none.
typedef struct MeshLids {
    int middle_count, triangle_count;
    Vec3 *middle;            // (middle_count)
    int *middle_vertex;      // (middle_count) a vertex of the rim
    int (*triangle)[3];      // (triangle_count)
} MeshLids;

// False where memory lacks. `lids` may be NULL.
bool mesh_closure(const TriangleMesh *mesh, MeshClosure *closure, MeshLids *lids);
void mesh_lids_free(MeshLids *lids);

#endif
