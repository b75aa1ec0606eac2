// A small copy of a volume for pictures, and the brightness range in which vessels are seen.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_REDUCE_H
#define SELDINGER_RECON_VOLUME_VOLUME_REDUCE_H

#include "recon/volume/volume.h"

// A copy with at most `most` voxels along each axis: the brightest voxel of each block, so that thin vessels stay. NULL if out of memory.
Volume *volume_reduced(const Volume *volume, int most);
// Blackens bone, which hides vessels in projections: voxels of more than CT_NUMBER_BONE that touch each other and fill at least 50 mm3, and all within 2 mm of them, so
// that the blurred border of bone does not look like contrast agent. Spongy bone far from cortical bone stays. Returns false if out of memory.
bool volume_hide_bone(Volume *volume);
// The brightness of most of the volume, and of its brightest two-thousandth.
void volume_brightness(const Volume *volume, float *low, float *high);

#endif
