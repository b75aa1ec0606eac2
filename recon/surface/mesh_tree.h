// A tree of boxes over the triangles of a surface, to find the nearest point, the first hit of a ray, and inside or outside. It is read-only once created, so
// threads may share it.
#ifndef SELDINGER_RECON_SURFACE_MESH_TREE_H
#define SELDINGER_RECON_SURFACE_MESH_TREE_H

#include "recon/surface/surface_file.h"

typedef struct MeshTree MeshTree;

// Creates the tree. The mesh must outlive it. Returns NULL if out of memory.
MeshTree *mesh_tree_create(const SurfaceMesh *mesh);
void mesh_tree_free(MeshTree *tree);
// Distance [mm] to the nearest point `foot` of the surface, on `triangle`. Returns INFINITY and leaves the outputs unchanged if there is none within `reach`.
double mesh_tree_nearest(const MeshTree *tree, Vec3 point, double reach, Vec3 *foot, int *triangle);
// Distance to a triangle, and its nearest point.
double mesh_triangle_nearest(const SurfaceMesh *mesh, int triangle, Vec3 point, Vec3 *foot);
// Distance along the unit vector `direction` to the first hit within `reach`; INFINITY if there is none. `triangle` may be NULL.
double mesh_tree_ray(const MeshTree *tree, Vec3 from, Vec3 direction, double reach, int *triangle);
// Solid angle of the surface seen from the point, in units of 4 pi: 1 inside a closed surface with outward normals, 0 outside, values in between near
// openings. Visits all triangles.
double mesh_winding(const SurfaceMesh *mesh, Vec3 point);

#endif
