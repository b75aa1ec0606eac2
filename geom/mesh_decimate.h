// Reduces the number of triangles for drawing during motion: edges are collapsed in order of cost (Garland and Heckbert 1997, quadric error). The surface is
// never sampled coarser, so that thin branches survive.
#ifndef SELDINGER_GEOM_MESH_DECIMATE_H
#define SELDINGER_GEOM_MESH_DECIMATE_H

#include "geom/isosurface.h"

// Returns a new mesh with about `triangles` triangles or fewer, or with more where collapses do not allow that: an edge stays if its collapse would open, pinch
// or fold the surface, or move it by more than `furthest_mm` (HUGE_VAL: no limit). Each part of the surface stays, closed if it was closed, with its genus;
// rims stay in place. Normals are the mean of the faces', nodes those of the nearest kept vertex. The same input gives the same output. Returns NULL if out of
// memory.
TriangleMesh *mesh_decimate(const TriangleMesh *mesh, int triangles, double furthest_mm);

#endif
