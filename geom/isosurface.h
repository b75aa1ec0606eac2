// Triangles of a field's zero level (marching cubes with vertices projected onto the surface), and of a whole LIM tree: each
// local model's surface cut to its power cell (Kerrien 2017, 5.3.3).
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

// Surface of one local model within a box around its blobs, cell size `cell_mm`.
// Both: NULL where the tree has no model, memory ends, or the cell is not above 0 or so small that 2e7 blocks of 8 x 8 x 8 cells would not do. The
// surface is a closed manifold; blobs close the root's end too. Vertices lie on their node's model to 1e-12 mm, save where neighbouring models disagree
// by more than three quarters of a cell: there the surface steps across, and the vertices stay on the lattice's edges.
TriangleMesh *isosurface_of_model(const VesselTree *tree, int node, double cell_mm);
// Surface of the tree: one sparse grid over the whole tree, the field at a grid point is that of its power-nearest node
// (candidates limited to nodes whose tube reaches the point), so neighbouring models join without a gap. Vertices are projected
// on their node's model. Memory grows with the surface, not with the bounding box.
TriangleMesh *isosurface_of_tree(const VesselTree *tree, double cell_mm);
// The wall of any vessel: the zero of its gap within `count` balls (center, reach [mm]) that cover it. A lattice point is asked from the ball in which it
// lies deepest for its size, and where that says outside from the other balls around it too, by their `from` (a node for vessel->locate; NULL: -1, which may
// search the whole vessel): inside is believed. A vertex's node is the one that answers. Vertices lie within 1e-9 mm of the wall, as it answers from there
// without memory, save where its gap steps over zero: by some 1e-8 mm in LIM, whose weights are floats, by more where local models disagree. No angle is below
// some 10 degrees away from such steps. Where the wall leaves the balls (open ends) the mesh has a rim; elsewhere it is closed. Two lumens that kiss stay
// apart, however thin the wall between, where their balls' `from` lead to different nodes.
// NULL where memory ends, a ball is not finite, or the cell is not above 0 or too small, as above.
TriangleMesh *isosurface_of_vessel(const Vessel *vessel, int count, const Vec3 *center, const double *reach, const int *from, double cell_mm);
// The zero of a field, > 0 inside and 1-Lipschitz, within the balls, which must cover it. Vertices lie on edges of the lattice of points cell * (i, j, k), on
// which the field must not be 0, within 1e-11 mm; so sharp edges are cut off by a cell at most, and there may be slivers. Their node is 0, their normal that of
// the triangles around. NULL as above.
TriangleMesh *isosurface_of_field(double (*field)(const void *of, Vec3 x), const void *of, int count, const Vec3 *center, const double *reach, double cell_mm);
// The same surface finer: each triangle in four, new vertices moved onto the wall from the middles of edges. NULL where memory ends or there would be more
// than 5e8 triangles.
TriangleMesh *triangle_mesh_refine(const TriangleMesh *mesh, const Vessel *vessel);
// Keeps the triangles for which keep[t], and the vertices that they use, in their order. False, with the mesh as it was, where memory lacks.
bool triangle_mesh_keep(TriangleMesh *mesh, const bool *keep);
// A cell size for looking: about twenty cells round the thinnest branch, coarser (to ten) where that would take more than some 300,000 triangles.
double isosurface_cell_for(const VesselTree *tree);
void triangle_mesh_free(TriangleMesh *mesh);

#endif
