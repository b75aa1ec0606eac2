// Reads points from CSV: a header with the columns x_mm, y_mm and z_mm in any order; other columns are ignored; `#` begins a comment.
#ifndef SELDINGER_CLI_POINT_TABLE_H
#define SELDINGER_CLI_POINT_TABLE_H

#include "base/base.h"
#include "geom/geom.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct PointTable {
    int count, capacity;
    Vec3 *point;             // [mm] finite, at most 1e9 in magnitude; the caller frees it
} PointTable;

// Reads a file of at most 1 GB. Returns false with all faults of the file; the table then contains the points before them.
bool point_table_read(const char *path, PointTable *table, Faults *faults);
// As point_table_read(), from memory: `text` ends in a zero byte that `length` does not count and is modified in place; `path` is used in messages.
bool point_table_parse(char *text, size_t length, const char *path, PointTable *table, Faults *faults);

#endif
