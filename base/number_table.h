// CSV of numbers: a header with the column names, `#` comments, blank lines, one row per line. One pass reports all faults.
#ifndef SELDINGER_BASE_NUMBER_TABLE_H
#define SELDINGER_BASE_NUMBER_TABLE_H

#include "base/faults.h"

#include <stdbool.h>
#include <stddef.h>

enum { NUMBER_TABLE_COLUMNS = 32 };

typedef struct NumberTable {
    int row_count, column_count;
    double *value;           // (row_count, column_count), all finite
    int *line;               // (row_count) 1-based line in the file
} NumberTable;

// `header` is the exact first line that is not a comment, such as "t_s,push_mm_s,twist_deg_s" (spaces around names are allowed). `text` need not be
// NUL-terminated. Returns NULL with faults if the header differs, a field is not a finite number, a row has a different number of fields, or if out of memory.
NumberTable *number_table_parse(const char *text, size_t length, const char *file, const char *header, Faults *faults);
void number_table_free(NumberTable *table);

typedef struct NumberColumn {    // a field of the header, without the spaces around it
    const char *name;        // points into the text, `length` bytes
    size_t length;
    int column;              // 1-based column in its line
} NumberColumn;
// Splits the header, for callers that accept several headers. Returns the number of fields (at most `capacity` are written) and their line, or 0 if there is no
// header.
int number_table_columns(const char *text, size_t length, NumberColumn *column, int capacity, int *line);

// Parses all of text[0, length) as a finite decimal number; hexadecimal, nan, inf and spaces are not accepted. False if it is not one.
bool number_of_text(const char *text, size_t length, double *value);

#endif
