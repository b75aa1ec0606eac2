// Edges in a blurred image lie inside the true ones: estimates the blur and corrects a tree for it.
#ifndef SELDINGER_BLURRED_EDGE_H
#define SELDINGER_BLURRED_EDGE_H

#include "geom/geom.h"
#include "recon/volume/volume.h"

// Where a disc of radius R blurred by b (standard deviation) is steepest [mm]: its slope is R/b^2 exp(-(R^2 + x^2) / (2 b^2)) I1(R x / b^2),
// steepest where x = R I0(z) / I1(z) - b^2 / x, z = R x / b^2. Tends to R - b^2 / (2 R) for b << R and to b for R << b.
double blurred_edge_of(double radius, double blur);

// The disc's radius, from where it is steepest. Below 1.24 b a disc appears wider than it is, and its radius becomes indeterminate: then the edge
// itself is returned. The result exceeds the edge by at most 0.2 b.
double blurred_edge_undo(double edge, double blur);

// b [mm] of the volume as sampled by bspline_sample: the blur of imaging, voxels and spline. From the mean profile across the wall points of each
// node wider than three voxels, to which a step blurred by b is fitted; the median of up to 400 nodes. 0: fewer than ten such nodes.
double blurred_edge_measure(const Volume *volume, const VesselTree *tree);

// b^2 [mm^2] that an angiogram's grid adds: partial voxels (v^2 / 12) and the spline (v^2 / 3), for the mean square v2 of its voxels' edges.
static inline double blurred_edge_grid2(double v2) { return v2 / 12 + v2 / 3; }
// b^2 [mm^2] of a moving average along the rays over so many voxels.
static inline double blurred_edge_average2(double voxels, double v2) { return voxels * voxels * v2 / 12; }

// Moves the points of each node out from its axis, an aneurysm's from its centre, by the shift due to `blur`, and the radii with them. An aneurysm is
// curved in both directions: twice the shift of a vessel of its radius. False if out of memory.
bool blurred_edge_correct(VesselTree *tree, double blur);

#endif
