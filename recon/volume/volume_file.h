// Reads volumes from NRRD (raw, gzip; attached and detached), MetaImage, NIfTI and DICOM (a folder, one file of a series, or a multi-frame file), and writes
// NRRD. Every figure in a header is checked before memory is allocated: an inconsistent header is a fault with its line (or byte) and what was expected. A
// voxel that is not a finite number is a fault too.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_FILE_H
#define SELDINGER_RECON_VOLUME_VOLUME_FILE_H

#include "recon/volume/volume.h"

// Loads a volume; its format is detected by content, not by extension. A folder is read as a DICOM series; the other files of a series are found in the
// folder of the given one. Returns NULL with faults.
Volume *volume_load(const char *path, Faults *faults);
// The same with progress; it can be stopped.
Volume *volume_load_with(const char *path, const Progress *progress, Faults *faults);
// The same from memory; `path` is used in messages, and detached data files are searched in its folder.
Volume *volume_parse(const void *bytes, size_t length, const char *path, Faults *faults);
// Returns true if volume_load accepts a file that begins with these bytes (4096 are enough); the samples of a NIfTI pair are recognised by `path`.
bool volume_is_known(const void *bytes, size_t length, const char *path);
// Calls `call` for each file, existing or not, that volume_load(path) would read in addition to `path` itself: those that a header gives, the other half of a
// NIfTI pair, every file in a DICOM series' folder.
void volume_each_data_file(const char *path, void (*call)(void *context, const char *path), void *context);
// Writes a gzip-compressed .nrrd with samples of `type`: "float", "uint8" or "int16". Returns false with faults.
bool volume_save_nrrd(const Volume *volume, const char *path, const char *type, Faults *faults);

#endif
