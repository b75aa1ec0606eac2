// Triangle meshes of a field's zero level (marching cubes with vertices projected onto the surface), and of a whole LIM tree: each local model's surface
// clipped to its power cell (Kerrien et al. 2017, 5.3.3).
#ifndef SELDINGER_GEOM_ISOSURFACE_H
#define SELDINGER_GEOM_ISOSURFACE_H

#include "geom/vessel.h"
#include "geom/vessel_tree.h"

typedef struct TriangleMesh {
    int vertex_count, triangle_count;
    Vec3 *vertex;            // (V) [mm]
    Vec3 *normal;            // (V) unit, OUT of the lumen
    int *node;               // (V) node of the tree whose model the vertex lies on
    int (*triangle)[3];      // (T) counter-clockwise seen from outside the lumen
} TriangleMesh;

// Surface of one local model in a box around its blobs, cell size `cell_mm` > 0. Vertices lie on their node's model to 1e-12 mm, except where neighbouring
// models disagree by more than three quarters of a cell: there the surface has a step, and the vertices stay on the lattice's edges.
// This and isosurface_of_tree give a closed manifold; blobs close the root's end too. Both return NULL if the tree has no model, if out of memory, or if the
// cell is not above 0 or so small that more than 2e7 blocks of 8 x 8 x 8 cells are needed.
TriangleMesh *isosurface_of_model(const VesselTree *tree, int node, double cell_mm);
// Surface of the tree on one sparse grid over the whole tree. The field at a grid point is that of its power-nearest node (among the nodes whose tube reaches
// the point), so that neighbouring models join without a gap. Vertices are projected onto their node's model. Memory grows with the surface, not with the
// bounding box.
TriangleMesh *isosurface_of_tree(const VesselTree *tree, double cell_mm);
// The wall of any vessel: the zero of its gap within `count` balls (center, reach [mm]) that cover it. A lattice point is queried from the ball in which it
// lies deepest relative to the ball's size; if the result is outside, it is queried from the other balls around it too, and one result of inside is enough. A
// query from a ball starts at its `from` (a node for vessel->locate; NULL: -1, which may search the whole vessel). A vertex's node is the node of the query's
// result.
// Vertices lie within 1e-9 mm of the wall that a query without memory gives, except where the vessel's gap jumps across zero: by about 1e-8 mm in LIM, whose
// weights are floats, and by more where local models disagree. Away from such jumps no angle is below about 10 degrees. The mesh has a rim where the wall
// leaves the balls (open ends); elsewhere it is closed. Two lumens that touch stay separate, however thin the wall between them, if the `from` of their balls
// lead to different nodes.
// Returns NULL if out of memory, if a ball is not finite, or if the cell is not above 0 or too small, as above.
TriangleMesh *isosurface_of_vessel(const Vessel *vessel, int count, const Vec3 *center, const double *reach, const int *from, double cell_mm);
// The zero level of a field, > 0 inside and 1-Lipschitz, within the balls, which must cover it. The field must not be 0 at the lattice points cell * (i, j, k).
// Vertices lie on the edges of the lattice, within 1e-11 mm of the zero level: sharp edges are cut off by at most a cell, and slivers are possible. Each vertex
// has node 0 and the normal of its triangles. Returns NULL as above.
TriangleMesh *isosurface_of_field(double (*field)(const void *of, Vec3 x), const void *of, int count, const Vec3 *center, const double *reach, double cell_mm);
// The same surface, finer: each triangle is divided into four, and the new vertices, at the middles of edges, are moved onto the wall. Returns NULL if out of
// memory or if there would be more than 5e8 triangles.
TriangleMesh *triangle_mesh_refine(const TriangleMesh *mesh, const Vessel *vessel);
// Keeps the triangles t with keep[t] and the vertices that they use, in their order. Returns false, with the mesh unchanged, if out of memory.
bool triangle_mesh_keep(TriangleMesh *mesh, const bool *keep);
// A cell size for display: about twenty cells around the thinnest branch; coarser (down to ten) where that would take more than about 300,000 triangles.
double isosurface_cell_for(const VesselTree *tree);
void triangle_mesh_free(TriangleMesh *mesh);

#endif
