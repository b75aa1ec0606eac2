// The reader of NRRD, attached and detached. Internal to recon: volume_file.h chooses it.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_NRRD_H
#define SELDINGER_RECON_VOLUME_VOLUME_NRRD_H

#include "recon/volume/volume_format.h"

bool volume_is_nrrd(const FileBytes *file);
Volume *volume_parse_nrrd(const FileBytes *file, Faults *faults);

#endif
