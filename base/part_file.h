// Files to write. A file is made beside its place, under a name that nobody can guess and that no other program has, and takes its place once it is
// whole: a reader sees the former file or the new one. Whatever ends a program in between, SIGKILL and loss of power aside, the part is removed:
// part_files_remove() is for the handler of a signal that ends it.
#ifndef SELDINGER_BASE_PART_FILE_H
#define SELDINGER_BASE_PART_FILE_H

#include <stdbool.h>
#include <stdio.h>

typedef struct PartFile {
    int descriptor;          // reads and writes
    FILE *stream;            // by part_file_stream; else NULL
    char *path, *name;       // of the place, of the part
    int slot;                // among those that part_files_remove removes; -1: too many at once
} PartFile;

// Whether what is at `path` is written through, as a part that takes its place would replace it: a device, a pipe, /dev/stdout.
bool part_file_is_through(const char *path);
// The part of a file that is to stand at `path`, empty. Its mode will be that of the file which is there now, else what the umask leaves of 0666.
// False with errno, nothing to be undone.
bool part_file_begin(PartFile *part, const char *path);
// Buffered, to be closed by what ends the part. NULL with errno.
FILE *part_file_stream(PartFile *part);
bool part_file_write(PartFile *part, const void *bytes, size_t length);
// The part takes its place, its bytes on the disk first; without `_synced` they may come there later. False with errno: the part is removed and the
// place as it was.
bool part_file_finish_synced(PartFile *part);
bool part_file_finish(PartFile *part);
void part_file_drop(PartFile *part);    // errno stays

// Removes all unfinished parts of the process. Safe in a signal's handler; the process is to end then.
void part_files_remove(void);

#endif
