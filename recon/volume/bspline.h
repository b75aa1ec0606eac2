// Cubic B-spline approximation of a volume: the voxel values themselves are the coefficients, so sampling smooths (standard deviation 1/sqrt(3)
// voxel: 0.1155 mm at 0.2 mm) and needs no prefilter. Kerrien et al. 2017, 3.2. Outside the grid the value is the volume's minimum.
#ifndef SELDINGER_RECON_VOLUME_BSPLINE_H
#define SELDINGER_RECON_VOLUME_BSPLINE_H

#include "recon/volume/volume.h"

// The value at continuous voxel coordinates.
float bspline_sample(const Volume *volume, Vec3 voxel);
// out[i] = the value at start + i step, i = 0 … count-1, in voxel coordinates.
void bspline_sample_line(const Volume *volume, Vec3 start, Vec3 step, int count, float *out);

#endif
