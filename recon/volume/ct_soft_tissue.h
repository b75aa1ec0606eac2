// Leaves only soft tissue and vessels of a CT, for tracking and for projections.
#ifndef SELDINGER_RECON_VOLUME_CT_SOFT_TISSUE_H
#define SELDINGER_RECON_VOLUME_CT_SOFT_TISSUE_H

#include "recon/volume/volume.h"

// A copy of a volume with CT numbers in which bone and air have the CT number of soft tissue: an image like any other, no longer with CT numbers (volume.h).
// Bone: voxels of more than `bone` [HU] (0: there is none) that touch each other by faces and fill at least 50 mm3, with their blurred rim where it is too thin
// for a vessel, less than three voxels, and what is left in bone or on it of less than 50 mm3. A vessel that touches bone stays, with an edge where the CT
// number passes `bone`; a vessel brighter than that is taken for bone, and spongy bone of 50 mm3 or more below it stays. NULL if out of memory.
Volume *ct_soft_tissue(const Volume *volume, double bone);

#endif
