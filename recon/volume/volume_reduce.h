// A small copy of a volume for pictures, and the brightness range in which vessels are seen.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_REDUCE_H
#define SELDINGER_RECON_VOLUME_VOLUME_REDUCE_H

#include "recon/volume/volume.h"

// A copy with at most `most` voxels along each axis: the brightest voxel of each block, so that thin vessels stay. NULL if out of memory.
Volume *volume_reduced(const Volume *volume, int most);
// The brightness of most of the volume, and of its brightest two-thousandth.
void volume_brightness(const Volume *volume, float *low, float *high);

#endif
