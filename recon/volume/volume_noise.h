// Noise of a volume and its smoothing, for angiograms whose vessels are fainter than the noise of a single voxel.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_NOISE_H
#define SELDINGER_RECON_VOLUME_VOLUME_NOISE_H

#include "recon/volume/volume.h"

// Standard deviation of the noise [grey values], from the differences of voxels `lag` (1 or more) apart along each axis: the median of their absolute
// values about their median, so vessels, edges and slow background variations hardly matter. 0 where most of the volume is one value.
double volume_noise(const Volume *volume, int lag);
// A copy blurred by a Gaussian of standard deviation `sigma_mm`; beyond the border the last voxel repeats. The same for any number of threads (0: all
// cores). NULL: out of memory.
Volume *volume_smoothed(const Volume *volume, double sigma_mm, int threads);

#endif
