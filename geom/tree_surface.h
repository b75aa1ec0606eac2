// Prepares a surface for other tools: counts and measures it, removes specks, cuts the inlet open, and computes for each vertex its distance from the data.
// Works on TriangleMesh (isosurface.h) in place; keeps no memory.
#ifndef SELDINGER_GEOM_TREE_SURFACE_H
#define SELDINGER_GEOM_TREE_SURFACE_H

#include "geom/isosurface.h"
#include "geom/model_field.h"

typedef struct SurfaceCensus {
    int vertices, triangles; // vertices that no triangle uses are not counted
    int64_t edges;
    int parts;               // connected components
    int64_t open_edges;      // edges of a single triangle
    int64_t non_manifold_edges;  // edges of three or more triangles
    int64_t turned_edges;    // edges that their two triangles traverse in the same direction, so that one of the two faces inwards
    int64_t euler;           // V - E + F: 2 per closed part without handles
    double area, volume;     // [mm2, mm3]; volume > 0 if triangles face outwards; for an open surface it includes the cone from the rim to its middle
} SurfaceCensus;

// Returns false if out of memory.
bool surface_census(const TriangleMesh *mesh, SurfaceCensus *census);

// Removes vertices without a triangle and connected parts with an enclosed volume of less than `least_volume` [mm3], among them bubbles inside the lumen (which
// face inwards). For a part with a rim, which encloses nothing, the volume of the ball with the same area counts. The largest part always stays. Such specks
// occur where neighbouring local models disagree at the border of their power cells. Returns the number of parts removed; -1 if out of memory (the mesh is
// unchanged).
int surface_drop_specks(TriangleMesh *mesh, double least_volume);

// Cuts the tree's inlet open: removes what lies upstream of the root's plane (center[0], direction[0]) and is connected there with the wall around the root.
// The rim lies in that plane and on the local models. Returns false, with the mesh unchanged, if the root is no open end (vessel_tree_root_is_open), if the
// part upstream reaches further than four radii from the root, or if out of memory.
bool surface_open_inlet(TriangleMesh *mesh, const VesselTree *tree);

// For each vertex, finds the nearest data point among those of the vertex's node and of nodes up to two links away (further if these have none):
//   error[v]     [mm] signed distance of that data point to the wall as the vertex's node sees it, > 0 inside: there the model is too wide
//   distance[v]  [mm] from the vertex to it: large where there are no data, as on the caps of open ends
// Either array may be NULL. Both are NaN where none of the 64 surrounding nodes has points. Nodes are those of
// model->tree. Returns false if it has no points.
bool surface_point_error(const TriangleMesh *mesh, const ModelField *model, double *error, double *distance);

#endif
