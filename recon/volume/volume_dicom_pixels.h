// Pixels of a DICOM file that are compressed, unpacked by a program of their own.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_DICOM_PIXELS_H
#define SELDINGER_RECON_VOLUME_VOLUME_DICOM_PIXELS_H

#include "recon/volume/volume_format.h"

// The file `path` in explicit little endian, uncompressed, into *out, to be freed (file_bytes_free): at most `most` bytes. `place` and `syntax` stand in the fault:
// where the pixels begin, and how they are compressed. False with a fault: what cannot be unpacked, takes too long, or yields more; or where there is no such program.
bool dicom_unpack(const char *path, size_t place, const char *syntax, size_t most, FileBytes *out, Faults *faults);

#endif
