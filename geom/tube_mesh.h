// Display surfaces of vessels that are not trees: rings along a tube's centreline, and a square of a plane.
#ifndef SELDINGER_GEOM_TUBE_MESH_H
#define SELDINGER_GEOM_TUBE_MESH_H

#include "geom/isosurface.h"
#include "geom/vessel.h"

// Free with triangle_mesh_free. Returns NULL if out of memory or if the options describe no surface.
TriangleMesh *triangle_mesh_of_tube(const TubeOptions *tube);
TriangleMesh *triangle_mesh_of_plane(Vec3 point, Vec3 normal, double half_width);    // [mm] half of the square's side

#endif
