// Fewer triangles for drawing while things move: edges are collapsed in the order of what each costs (Garland and Heckbert 1997, quadric error), never
// sampled coarser, so that thin branches stay.
#ifndef SELDINGER_GEOM_MESH_DECIMATE_H
#define SELDINGER_GEOM_MESH_DECIMATE_H

#include "geom/isosurface.h"

// A new mesh with about `triangles` triangles or fewer where collapses allow it, more where they do not: an edge stays where its collapse would
// open, pinch or fold over the surface, or move it by more than `furthest_mm` (HUGE_VAL: no limit). Each part of the surface stays, closed where it was closed,
// with its genus; rims stay where they are. Normals are the faces' mean, nodes the nearest kept vertex's. NULL where memory lacks.
// Same input, same output.
TriangleMesh *mesh_decimate(const TriangleMesh *mesh, int triangles, double furthest_mm);

#endif
