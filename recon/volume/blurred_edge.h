// In a blurred image the edges of a vessel lie inside the true ones. Estimates the blur and corrects a tree for it.
#ifndef SELDINGER_BLURRED_EDGE_H
#define SELDINGER_BLURRED_EDGE_H

#include "geom/geom.h"
#include "recon/volume/volume.h"

// Radius [mm] at which a disc of radius R, blurred by b (standard deviation), is steepest: its slope is R/b^2 exp(-(R^2 + x^2) / (2 b^2)) I1(R x / b^2),
// steepest where x = R I0(z) / I1(z) - b^2 / x, z = R x / b^2. Tends to R - b^2 / (2 R) for b << R and to b for R << b.
double blurred_edge_of(double radius, double blur);

// The inverse: the disc's radius from the radius at which it is steepest. A disc whose radius is below 1.24 b appears wider than it is, and its radius
// becomes indeterminate: then the edge itself is returned. The result exceeds the edge by at most 0.2 b.
double blurred_edge_undo(double edge, double blur);

// Estimates b [mm] of the volume as sampled by bspline_sample: the blur of imaging, voxels and spline. For each node wider than three voxels, a step blurred
// by b is fitted to the mean profile across its wall points; the result is the median of up to 400 nodes. Returns 0 if there are fewer than ten such nodes.
double blurred_edge_measure(const Volume *volume, const VesselTree *tree);

// b^2 [mm^2] that an angiogram's grid adds: partial voxels (v^2 / 12) and the spline (v^2 / 3), for the mean square v2 of its voxels' edges.
static inline double blurred_edge_grid2(double v2) { return v2 / 12 + v2 / 3; }
// b^2 [mm^2] of a moving average along the rays over so many voxels.
static inline double blurred_edge_average2(double voxels, double v2) { return voxels * voxels * v2 / 12; }

// Moves the points of each node away from its axis (in an aneurysm, from its centre) by the shift due to `blur`, and increases the radii accordingly. An
// aneurysm is curved in both directions, so its shift is twice that of a vessel of its radius. Returns false if out of memory.
bool blurred_edge_correct(VesselTree *tree, double blur);

#endif
