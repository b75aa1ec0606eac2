// Decodes the compressed pixels of a DICOM file with a separate program.
#ifndef SELDINGER_RECON_VOLUME_VOLUME_DICOM_PIXELS_H
#define SELDINGER_RECON_VOLUME_VOLUME_DICOM_PIXELS_H

#include "recon/volume/volume_format.h"

// Decodes the file `path` to explicit little endian, uncompressed, at most `most` bytes, into *out; the caller frees it (file_bytes_free). `place` (the byte
// where the pixels begin) and `syntax` (their compression) are used in faults. Returns false with a fault if decoding fails, takes too long or yields more
// bytes, or if the program is missing.
bool dicom_unpack(const char *path, size_t place, const char *syntax, size_t most, FileBytes *out, Faults *faults);

#endif
