// Opens regular files only. Pipes, devices and folders are refused because reading them could block or never end.
#ifndef SELDINGER_BASE_REGULAR_FILE_H
#define SELDINGER_BASE_REGULAR_FILE_H

#include <stddef.h>
#include <sys/stat.h>

// Opens the regular file `path` for reading, closed on exec; never blocks. Returns the descriptor, or -1 with the reason in *why.
int regular_file_open(const char *path, struct stat *status, const char **why);
// Reads at most `capacity` bytes. Returns fewer at the end of the file (errno 0) or if reading fails (errno set).
size_t regular_file_read(int descriptor, void *bytes, size_t capacity);

#endif
