// Files to read. What a user or a file names may be a pipe, a device or a folder: reading those could wait for ever or never end, so they are refused.
#ifndef SELDINGER_BASE_REGULAR_FILE_H
#define SELDINGER_BASE_REGULAR_FILE_H

#include <stddef.h>
#include <sys/stat.h>

// A descriptor of the regular file `path` for reading, closed on exec; never waits. -1 with the reason in *why.
int regular_file_open(const char *path, struct stat *status, const char **why);
// At most `capacity` bytes; fewer at the end of the file, or where reading fails: errno is 0 but there.
size_t regular_file_read(int descriptor, void *bytes, size_t capacity);

#endif
