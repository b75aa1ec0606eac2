// Any bytes as the points of `query`: finite ones, or faults.
// Covers: cli/point_table.c
#include "cli/point_table.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    PointTable table = {0};
    char *text = malloc(size + 1);
    memcpy(text, data, size);
    text[size] = '\0';
    faults_clear(&faults);
    if (point_table_parse(text, size, "points.csv", &table, &faults) != (faults.count == 0))
        abort();
    for (int i = 0; i < table.count; i++)
        if (!vec3_is_finite(table.point[i]))
            abort();
    free(table.point);
    free(text);
    return 0;
}
