// A triangle mesh as a vessel: the closest triangle, found by Embree 3. What LIM is measured against (Kerrien 2017, section 6.3 and Table 6), and what a
// scene's `contact: mesh` answers with.
//
// gap: distance to the closest point of the whole mesh, > 0 inside, the sign by the angle-weighted pseudonormal of the face, edge or vertex that holds it
// (Baerentzen and Aanaes 2005). normal: along the line from that point, or the face's own where the point lies on the mesh. hessian: 0 over faces; over
// edges and vertices that of a cylinder or sphere about them, held to what it is 0.02 mm away. Where the closest point lies on a rim (an edge of one
// triangle) the query point is beyond it, and the answer is VESSEL_OPEN_END. node: index of a triangle, the lowest of those that share the closest point.
// The closest point is the best of the whole mesh, so a point may change over to another branch whose wall is closer.
// Points that are not finite (or beyond 1e100 mm) are VESSEL_UNSURE. VESSEL_FAR: only for points that were inside and cannot have left.
// Answers do not depend on the search, on what a point remembers, on the instruction set or on threads: all of them find the same triangle.
// Built without Embree, no mesh vessel can be made, and the fault says so.
#ifndef SELDINGER_GEOM_MESH_VESSEL_H
#define SELDINGER_GEOM_MESH_VESSEL_H

#include "geom/isosurface.h"

typedef enum {
    MESH_FACES,              // the mesh as it is: a wall of planes
    MESH_CURVED,             // gap and normal are those, the Hessian is MESH_SMOOTH's: the solver knows that the next plane is turned. (Of planes alone it
                             // does not: a stiff tip pushed into a hollow between them is sent from one to the other, and the step stalls)
    MESH_SMOOTH              // normal and Hessian of the surface whose normals at the vertices are the mesh's (where it has none, the angle-weighted mean of
                             // its faces'), interpolated between; the gap stays that of the triangle
} MeshNormals;

typedef enum {
    MESH_SEARCH_FULL,        // every query from nothing, as if the point had no past
    MESH_SEARCH_WARM,        // the search's radius is the distance to the triangles about the last closest one; points inside that cannot be within reach yet
                             // are passed over
    MESH_SEARCH_CACHED       // besides, what lies around each triangle is found when the vessel is made, with balls that prove that nothing else can be
                             // closer (geom/triangle_groups.h): mostly no search at all. Takes three times as long to make
} MeshSearch;

typedef struct MeshVesselOptions {
    MeshNormals normals;     // MESH_FACES
    MeshSearch search;       // MESH_SEARCH_CACHED
    bool has_inlet;          // false: `inlet` of the vessel says there is none
    Vec3 inlet, direction;   // [mm], unit into the vessel
} MeshVesselOptions;
MeshVesselOptions mesh_vessel_default_options(void);

// Is Embree built in?
bool mesh_vessel_available(void);
// Copies what it needs of the mesh. Triangles must face out of the lumen. NULL with a fault: no Embree; no triangle; an index out of range, a coordinate that
// is not finite or 1e9 mm and more; a triangle without area (thinner than 1e-12 of its length); an edge of three triangles or more; two neighbours that face
// opposite ways; a mesh that faces inwards as a whole (it and flat lids on its rims enclose a volume < 0). `name` stands in messages.
Vessel *mesh_vessel_create(const TriangleMesh *mesh, const MeshVesselOptions *options, const char *name, Faults *faults);

#endif
