// The reader of MetaImage. Internal to recon: volume_file.h chooses it.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_METAIMAGE_H
#define SELDINGER_RECON_VOLUME_VOLUME_METAIMAGE_H

#include "recon/volume/volume_format.h"

bool volume_is_metaimage(const FileBytes *file);
Volume *volume_parse_metaimage(const FileBytes *file, Faults *faults);

#endif
