// Reads a text file into memory. Refuses anything but regular files (a device or a pipe could block or never end) and files that are too long.
#ifndef SELDINGER_BASE_TEXT_FILE_H
#define SELDINGER_BASE_TEXT_FILE_H

#include "base/faults.h"

#include <stddef.h>

enum { TEXT_FILE_LIMIT = 64 * 1024 * 1024 };

// NUL-terminated (the NUL is not counted in `length`); the caller frees it. NULL with a fault.
char *text_file_read(const char *path, size_t *length, Faults *faults);
// `name` resolved relative to the folder of file `base`; absolute paths stay. The caller frees it.
char *text_file_beside(const char *base, const char *name);

#endif
