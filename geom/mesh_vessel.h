// A triangle mesh as a vessel: the closest triangle, found by Embree 3. What LIM is measured against (Kerrien 2017, section 6.3 and Table 6), and what a
// scene's `contact: mesh` answers with.
//
// gap: distance to the closest point of the mesh, > 0 inside, the sign by the angle-weighted pseudonormal of the face, edge or vertex that holds it
// (Baerentzen and Aanaes 2005). normal: along the line from that point, or the face's own where the point lies on the mesh. hessian: 0 over faces;
// over edges and vertices that of a cylinder or sphere about them on the convex side. Where the closest point lies on a rim (an edge of one triangle) and
// the query point is beyond it, the answer is VESSEL_OPEN_END. node: index of a triangle.
// Built without Embree, no mesh vessel can be made, and the fault says so.
#ifndef SELDINGER_GEOM_MESH_VESSEL_H
#define SELDINGER_GEOM_MESH_VESSEL_H

#include "geom/isosurface.h"

typedef enum {
    MESH_FACES,              // the mesh as it is: a wall of planes
    MESH_SMOOTH              // normals (and so the Hessian) interpolated between the vertices' normals; the gap stays that of the triangle
} MeshNormals;

typedef enum {
    MESH_SEARCH_FULL,        // every query from nothing, as if the point had no past
    MESH_SEARCH_WARM,        // the search's radius is the distance to the last closest triangle
    MESH_SEARCH_CACHED       // besides, the triangles that can become the closest within some motion are remembered: no search until the point has moved so far
} MeshSearch;

typedef struct MeshVesselOptions {
    MeshNormals normals;     // MESH_FACES
    MeshSearch search;       // the fastest
    bool has_inlet;          // false: `inlet` of the vessel says there is none
    Vec3 inlet, direction;   // [mm], unit into the vessel
} MeshVesselOptions;
MeshVesselOptions mesh_vessel_default_options(void);

// Is Embree built in?
bool mesh_vessel_available(void);
// Copies what it needs of the mesh. Triangles must face out of the lumen. NULL with a fault: no Embree; no triangle; an index out of range, a coordinate that
// is not finite; a triangle without area; an edge of three triangles or more; two neighbours that face opposite ways. `name` stands in messages.
Vessel *mesh_vessel_create(const TriangleMesh *mesh, const MeshVesselOptions *options, const char *name, Faults *faults);

#endif
