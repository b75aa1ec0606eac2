// Output files named on the command line: "-" is standard output; a device or pipe is written directly; anything else is written to a temporary file and then
// renamed, so no partial file remains.
#ifndef SELDINGER_BASE_OUTPUT_H
#define SELDINGER_BASE_OUTPUT_H

#include "base/faults.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

// Call before long work: adds a fault if `path` is not writable (NULL: nothing to check). Leaves no file behind.
bool output_check(const char *path, Faults *faults);
// The same for formats that need a regular file (HDF5, PNG): a device, a pipe or "-" is a fault too.
bool output_check_file(const char *path, Faults *faults);
bool output_write(const char *path, const void *bytes, size_t length, Faults *faults);
// Writes `text` and a newline; takes ownership of `text`. NULL is a fault: out of memory.
bool output_write_line(const char *path, char *text, Faults *faults);
// A text that is built in memory and then written at once.
typedef struct OutputText {
    FILE *stream;
    char *bytes;
    size_t length;
} OutputText;
bool output_text_open(OutputText *text);                 // false: out of memory
bool output_text_write(OutputText *text, const char *path, Faults *faults);      // closes it
bool output_text_forget(OutputText *text);               // closes it without writing; returns false
// The last extension in lower case, including its dot; "" if there is none or it is longer than 15 bytes.
void output_extension(const char *path, char extension[16]);

#endif
