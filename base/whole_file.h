// Whole files: read at once, and written so that no partial file remains (base/part_file.h).
#ifndef SELDINGER_BASE_WHOLE_FILE_H
#define SELDINGER_BASE_WHOLE_FILE_H

#include "base/faults.h"

// The bytes of a regular file, followed by a NUL that `length` does not count. The caller frees them. Returns NULL with a fault.
char *whole_file_read(const char *path, size_t *length, Faults *faults);
// As whole_file_read(), but a file of more than `most` bytes is a fault and is not read.
char *whole_file_read_most(const char *path, size_t most, size_t *length, Faults *faults);
// Returns false with a fault; `path` is then unchanged. An existing device or pipe is written directly, not replaced.
bool whole_file_write(const char *path, const void *bytes, size_t length, Faults *faults);

#endif
