// Atomic output files. A file is written under a random temporary name in the same folder and renamed into place once complete, so a reader sees the
// old file or the new one. If the program ends early (except by SIGKILL or loss of power), the temporary file is removed: part_files_remove() is for
// the handler of a terminating signal.
#ifndef SELDINGER_BASE_PART_FILE_H
#define SELDINGER_BASE_PART_FILE_H

#include <stdbool.h>
#include <stdio.h>

typedef struct PartFile {
    int descriptor;          // open for reading and writing
    FILE *stream;            // from part_file_stream(), else NULL
    char *path, *name;       // final path, temporary path
    int slot;                // index in the table used by part_files_remove(); -1: the table was full
} PartFile;

// True if `path` must be written directly because renaming would replace it: a device, a pipe, /dev/stdout.
bool part_file_is_through(const char *path);
// Creates an empty temporary file for `path`. Its mode becomes that of the existing file, or 0666 minus the umask. Returns false with errno; nothing to undo.
bool part_file_begin(PartFile *part, const char *path);
// A buffered stream, closed when the part is finished or dropped. Returns NULL with errno.
FILE *part_file_stream(PartFile *part);
bool part_file_write(PartFile *part, const void *bytes, size_t length);
// Renames the part to its final path; `_synced` first flushes its bytes to disk. Returns false with errno: the part is removed and the old file unchanged.
bool part_file_finish_synced(PartFile *part);
bool part_file_finish(PartFile *part);
void part_file_drop(PartFile *part);    // preserves errno

// Removes all unfinished parts of the process. Async-signal-safe; the process must end afterwards.
void part_files_remove(void);

#endif
