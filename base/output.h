// Output files named on the command line: "-" is standard output, a device or pipe is written as it is, anything else is written beside
// and renamed, so that no half file is left.
#ifndef SELDINGER_BASE_OUTPUT_H
#define SELDINGER_BASE_OUTPUT_H

#include "base/faults.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

// Before long work: a fault where `path` (NULL: nothing to check) will not be writable. Leaves nothing behind.
bool output_check(const char *path, Faults *faults);
// The same for what only whole files can hold (HDF5, PNG): a device, a pipe or "-" is a fault too.
bool output_check_file(const char *path, Faults *faults);
bool output_write(const char *path, const void *bytes, size_t length, Faults *faults);
// `text` and a newline; takes it over and frees it. NULL is a fault: no memory.
bool output_write_line(const char *path, char *text, Faults *faults);
// A text that grows in memory, then is written at once.
typedef struct OutputText {
    FILE *stream;
    char *bytes;
    size_t length;
} OutputText;
bool output_text_open(OutputText *text);                 // false: out of memory
bool output_text_write(OutputText *text, const char *path, Faults *faults);      // and closes it
bool output_text_forget(OutputText *text);               // closes it; false
// The last extension in lower case, with its dot; "" where there is none or it is long.
void output_extension(const char *path, char extension[16]);

#endif
