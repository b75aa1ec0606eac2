// The reader of NIfTI, one file or a pair. Internal to recon: volume_file.h chooses it.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_NIFTI_H
#define SELDINGER_RECON_VOLUME_VOLUME_NIFTI_H

#include "recon/volume/volume_format.h"

bool volume_is_nifti(const FileBytes *file);
Volume *volume_parse_nifti(const FileBytes *file, Faults *faults);

#endif
