// What is done with a surface before other tools get it: it is counted and measured, specks are dropped, the inlet is cut open, and each vertex is
// told how far it is from the data. Works on TriangleMesh (isosurface.h) in place; allocates while it works, keeps nothing.
#ifndef SELDINGER_GEOM_TREE_SURFACE_H
#define SELDINGER_GEOM_TREE_SURFACE_H

#include "geom/isosurface.h"

typedef struct SurfaceCensus {
    int vertices, triangles; // vertices that no triangle uses are not counted
    int64_t edges;
    int parts;               // connected components
    int64_t open_edges;      // with one triangle
    int64_t non_manifold_edges;  // with three or more
    int64_t turned_edges;    // whose two triangles run along it the same way: one of them faces inwards
    int64_t euler;           // V - E + F: 2 a part for closed parts without handles
    double area, volume;     // [mm2, mm3]; volume > 0 where triangles face outwards; of an open surface that of the cone to the middle of its rim too
} SurfaceCensus;

// False where memory lacks.
bool surface_census(const TriangleMesh *mesh, SurfaceCensus *census);

// Removes connected parts with an enclosed volume of less than `least_volume` [mm3], bubbles inside the lumen (which face inwards) among them, and
// vertices without a triangle. Of a part with a rim, which encloses nothing, the ball with its area counts. The largest part stays in any case. Returns the number of parts removed, -1 where memory lacks (the mesh is as it was).
// Such specks are where neighbouring local models disagree at the border of their power cells.
int surface_drop_specks(TriangleMesh *mesh, double least_volume);

// Cuts the tree's inlet open: what lies upstream of the root's plane (center[0], direction[0]) and hangs together there with the wall around the root is
// taken away. The rim lies in that plane and on the local models. False, with the mesh as it was, where the root is no open end
// (vessel_tree_root_is_open), where the part upstream reaches further than four radii from the root, or where memory lacks.
bool surface_open_inlet(TriangleMesh *mesh, const VesselTree *tree);

// For each vertex the data point next to it, of the vertex's node and those up to two links away (further where they have none):
//   error[v]     [mm] signed distance of that data point to the local model of the vertex's node, > 0 inside: there the model is too wide
//   distance[v]  [mm] from the vertex to it: large where there are no data, as on the caps of open ends
// Either may be NULL. Both NaN where none of the 64 nodes around has points. False where the tree has no points at all.
bool surface_point_error(const TriangleMesh *mesh, const VesselTree *tree, double *error, double *distance);

#endif
