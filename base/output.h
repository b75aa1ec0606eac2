// Output files named on the command line: "-" is standard output, a device or pipe is written directly, anything else is written to a temporary file
// and renamed, so no partial file remains.
#ifndef SELDINGER_BASE_OUTPUT_H
#define SELDINGER_BASE_OUTPUT_H

#include "base/faults.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

// To be called before long work: a fault if `path` (NULL: nothing to check) is not writable. Leaves no file behind.
bool output_check(const char *path, Faults *faults);
// The same for formats that need a regular file (HDF5, PNG): a device, a pipe or "-" is a fault too.
bool output_check_file(const char *path, Faults *faults);
bool output_write(const char *path, const void *bytes, size_t length, Faults *faults);
// Writes `text` and a newline; takes ownership of it. NULL is a fault: out of memory.
bool output_write_line(const char *path, char *text, Faults *faults);
// A text built in memory, then written at once.
typedef struct OutputText {
    FILE *stream;
    char *bytes;
    size_t length;
} OutputText;
bool output_text_open(OutputText *text);                 // false: out of memory
bool output_text_write(OutputText *text, const char *path, Faults *faults);      // and closes it
bool output_text_forget(OutputText *text);               // closes it; false
// The last extension in lower case, with its dot; "" if there is none or it is too long.
void output_extension(const char *path, char extension[16]);

#endif
