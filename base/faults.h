// The faults found in one input, collected so that the user sees all of them at once.
//
// A parser receives a Faults, adds each fault it finds, and returns false if it added any; its output is then unchanged. Printed form:
// `FILE:LINE:COL: what is wrong; expected …` (or what to do), `FILE:byte OFFSET: …` for binary files, or `FILE: …`.
// Not thread-safe: one owner. Accesses no files.
#ifndef SELDINGER_BASE_FAULTS_H
#define SELDINGER_BASE_FAULTS_H

#include <stdbool.h>
#include <stddef.h>

#define FAULTS_CAPACITY 64
#define FAULT_LENGTH 512

typedef struct Faults {
    int count;   // all faults added, including those beyond the capacity
    char text[FAULTS_CAPACITY][FAULT_LENGTH];
} Faults;

void faults_clear(Faults *faults);
// `line` and `column` are 1-based; 0 leaves them out.
void faults_add(Faults *faults, const char *file, int line, int column, const char *format, ...) __attribute__((format(printf, 5, 6)));
// For binary files: the position is a byte offset.
void faults_add_at_byte(Faults *faults, const char *file, size_t offset, const char *format, ...) __attribute__((format(printf, 4, 5)));
// Prints all faults, one per line, into `out` (NUL-terminated, truncated at `capacity`), followed by the number of faults beyond FAULTS_CAPACITY.
void faults_print(const Faults *faults, char *out, size_t capacity);

#endif
