// Volumes from files and to them: NRRD (raw, gzip; attached and detached), MetaImage, NIfTI, uncompressed DICOM (a folder, one file of a series, or a
// multi-frame file). Every header figure is checked before memory is taken: an inconsistent header is a fault with its line (or byte) and what was
// expected. So is a voxel that is not a finite number.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_FILE_H
#define SELDINGER_RECON_VOLUME_VOLUME_FILE_H

#include "recon/volume/volume.h"

// By content, not by extension. A folder is read as a DICOM series; for one file of a series the others are found in its folder. NULL with faults.
Volume *volume_load(const char *path, Faults *faults);
// The same from memory; `path` is used in messages, and detached data files are searched in its folder.
Volume *volume_parse(const void *bytes, size_t length, const char *path, Faults *faults);
// Whether a file that begins with these bytes (4096 tell) is one for volume_load; by `path` the samples of a NIfTI pair.
bool volume_is_known(const void *bytes, size_t length, const char *path);
// Calls for each file, there or not, from which volume_load(path) would take samples besides `path` itself: those that a header names, the other half
// of a NIfTI pair, every file of a DICOM series' folder.
void volume_each_data_file(const char *path, void (*call)(void *context, const char *path), void *context);
// Writes .nrrd (gzip, float or uint8 / int16 as `type` says: "float", "uint8", "int16").
bool volume_save_nrrd(const Volume *volume, const char *path, const char *type, Faults *faults);

#endif
