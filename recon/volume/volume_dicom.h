// The reader of uncompressed DICOM. Internal to recon: volume_file.h chooses it.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_DICOM_H
#define SELDINGER_RECON_VOLUME_VOLUME_DICOM_H

#include "recon/volume/volume_format.h"

bool volume_is_dicom(const FileBytes *file);
// Reads a multi-frame file alone, and a slice with the other files of its series in the same folder.
Volume *volume_parse_dicom(const FileBytes *file, Faults *faults);
// Reads a whole DICOM file, of 4 GB at most.
bool dicom_bytes_read(const char *path, FileBytes *out, Faults *faults);
// Reads the only series of a folder. If there are several, the fault lists them.
Volume *volume_load_dicom_folder(const char *path, Faults *faults);

#endif
