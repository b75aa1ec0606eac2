// Writes a table row by row, as CSV or HDF5, with one interface.
#ifndef SELDINGER_STUDY_TABLE_FILE_H
#define SELDINGER_STUDY_TABLE_FILE_H

#include "base/base.h"

#include <stdint.h>

typedef struct TableFile TableFile;

// NULL with a fault. The file appears at table_file_close().
TableFile *table_csv(const char *path, Faults *faults);
TableFile *table_hdf5(const char *path, const char *specification, int64_t rows, Faults *faults);
// All columns, before the first row. `width`: bytes of the longest text with its NUL; 0: numbers.
void table_file_column(TableFile *file, const char *name, size_t width);
// The values of a row, in the order of the columns.
void table_file_number(TableFile *file, double value);
void table_file_text(TableFile *file, const char *text);
void table_file_value(TableFile *file, const char *text);        // a number or a text, as the column is
void table_file_nothing(TableFile *file);
bool table_file_end_row(TableFile *file);                        // false: writing failed, table_file_close() says why
// `good` false: drops the file. Frees. False with a fault if it could not be written. NULL is allowed.
bool table_file_close(TableFile *file, bool good, Faults *faults);

#endif
