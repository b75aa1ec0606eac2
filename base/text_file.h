// Reads a text file into memory. Refuses anything but regular files (a device or a pipe could block or never end) and files above TEXT_FILE_LIMIT bytes.
#ifndef SELDINGER_BASE_TEXT_FILE_H
#define SELDINGER_BASE_TEXT_FILE_H

#include "base/faults.h"

#include <stddef.h>

enum { TEXT_FILE_LIMIT = 64 * 1024 * 1024 };

// Returns a NUL-terminated text (the NUL is not counted in `length`); the caller frees it. Returns NULL with a fault.
char *text_file_read(const char *path, size_t *length, Faults *faults);
// `name` resolved relative to the folder of the file `base`; absolute paths are unchanged. The caller frees it.
char *text_file_beside(const char *base, const char *name);
// The file `name` in a folder. The caller frees it. NULL: out of memory.
char *text_file_in(const char *folder, const char *name);

#endif
