// Points of a CSV: a header with the columns x_mm, y_mm and z_mm in any order, other columns are passed over; `#` begins a comment.
#ifndef SELDINGER_CLI_POINT_TABLE_H
#define SELDINGER_CLI_POINT_TABLE_H

#include "base/base.h"
#include "geom/geom.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct PointTable {
    int count, capacity;
    Vec3 *point;             // [mm] finite, to 1e9; the caller frees it
} PointTable;

// A file of at most 1 GB. False with faults, all of the file in one pass; what was read before them is in the table.
bool point_table_read(const char *path, PointTable *table, Faults *faults);
// The same from memory: `text` ends in a zero byte, which `length` does not count, and is cut up in place; `path` stands in the messages.
bool point_table_parse(char *text, size_t length, const char *path, PointTable *table, Faults *faults);

#endif
