// Any bytes as a table of points. An accepted table has its columns and only finite numbers, which are the same when printed and read again.
// Covers: base/number_table.c
#include "base/number_table.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    NumberColumn column[NUMBER_TABLE_COLUMNS];
    const char *text = (const char *)data;
    int line, columns = number_table_columns(text, size, column, NUMBER_TABLE_COLUMNS, &line);
    for (int i = 0; i < columns && i < NUMBER_TABLE_COLUMNS; i++)
        if (column[i].name < text || column[i].name + column[i].length > text + size || column[i].column < 1)
            abort();
    faults_clear(&faults);
    NumberTable *table = number_table_parse(text, size, "points.csv", "x_mm,y_mm,z_mm", &faults);
    if (!table != (faults.count > 0) || (table && (table->column_count != 3 || columns != 3)))
        abort();
    for (int i = 0; table && i < 3 * table->row_count; i++) {
        char digits[40];
        double again;
        int length = snprintf(digits, sizeof digits, "%.17g", table->value[i]);
        if (!number_of_text(digits, (size_t)length, &again) || again != table->value[i] || table->line[i / 3] < line)
            abort();
    }
    number_table_free(table);
    return 0;
}
