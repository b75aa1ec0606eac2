// A triangle mesh as a vessel: the closest triangle, found with Embree 3. It is the reference for LIM (Kerrien et al. 2017, section 6.3 and Table 6), and the
// wall of a scene with `contact: mesh`.
//
// gap: distance to the closest point of the whole mesh, > 0 inside; the sign is that of the angle-weighted pseudonormal of the face, edge or vertex that holds
// the closest point (Baerentzen and Aanaes 2005). normal: direction of the line from the closest point; the face's normal if the query point lies on the mesh.
// hessian: 0 over faces; over edges and vertices that of a cylinder or sphere around them, limited to its value at a distance of 0.02 mm. node: index of the
// triangle, the lowest of those that share the closest point.
// Where the closest point lies on a rim (an edge of a single triangle), the query point is beyond the rim and the result is VESSEL_OPEN_END.
// The closest point is that of the whole mesh, so a point can change to another branch whose wall is closer.
// Points that are not finite (or beyond 1e100 mm) give VESSEL_UNSURE. VESSEL_FAR is returned only for points that were inside and cannot have left.
// Results do not depend on the kind of search, on a point's memory, on the instruction set or on threads: all find the same triangle.
// A build without Embree cannot make a mesh vessel and reports a fault.
#ifndef SELDINGER_GEOM_MESH_VESSEL_H
#define SELDINGER_GEOM_MESH_VESSEL_H

#include "geom/isosurface.h"

typedef enum {
    MESH_FACES,              // the mesh as it is: plane faces
    MESH_CURVED,             // gap and normal of MESH_FACES, Hessian of MESH_SMOOTH, so that the solver knows that the next face has another direction. With
                             // plane faces alone, a stiff tip pushed into a hollow between two of them is sent back and forth, and the step stalls
    MESH_SMOOTH              // normal and Hessian of the surface that interpolates the mesh's vertex normals (if the mesh has none, the angle-weighted mean of
                             // the faces' normals); the gap stays that of the triangle
} MeshNormals;

typedef enum {
    MESH_SEARCH_FULL,        // a full search for each query, without use of the point's memory
    MESH_SEARCH_WARM,        // the search radius is the distance to the triangles around the last closest one; points inside that cannot yet be within reach
                             // are skipped
    MESH_SEARCH_CACHED       // in addition, the surroundings of each triangle are computed when the vessel is made, with balls that prove that nothing else can
                             // be closer (geom/triangle_groups.h): usually no search is needed. Creation takes three times as long
} MeshSearch;

typedef struct MeshVesselOptions {
    MeshNormals normals;     // default MESH_FACES
    MeshSearch search;       // default MESH_SEARCH_CACHED
    bool has_inlet;          // false: the vessel has no inlet
    Vec3 inlet, direction;   // [mm]; unit, into the vessel
} MeshVesselOptions;
MeshVesselOptions mesh_vessel_default_options(void);

// Returns whether this build has Embree.
bool mesh_vessel_available(void);
// Copies what it needs of the mesh. Triangles must face out of the lumen. `name` appears in messages. Returns NULL with a fault if: no Embree; no triangle; an
// index is out of range; a coordinate is not finite, or 1e9 mm or more; a triangle has no area (thinner than 1e-12 of its length); three or more triangles
// share an edge; two neighbours face opposite sides; or the whole mesh faces inwards (with flat lids on its rims it encloses a volume < 0).
Vessel *mesh_vessel_create(const TriangleMesh *mesh, const MeshVesselOptions *options, const char *name, Faults *faults);

#endif
