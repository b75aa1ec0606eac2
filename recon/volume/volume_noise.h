// Estimates the noise of a volume and smooths it, for angiograms in which vessels are fainter than the noise of a single voxel.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_NOISE_H
#define SELDINGER_RECON_VOLUME_VOLUME_NOISE_H

#include "recon/volume/volume.h"

// Standard deviation of the noise [grey values], from the differences of voxels `lag` (1 or more) apart along each axis: it uses the median absolute
// deviation from their median, so vessels, edges and slow background variations hardly matter. Returns 0 if most of the volume has one value.
double volume_noise(const Volume *volume, int lag);
// Returns a copy blurred by a Gaussian of standard deviation `sigma_mm`; outside the grid the border voxel repeats. The result does not depend on `threads`
// (0: all cores). Returns NULL if out of memory.
Volume *volume_smoothed(const Volume *volume, double sigma_mm, int threads);

#endif
