// Any bytes as the table of a sweep: refused with a fault, or columns whose numbers are finite or missing.
// Covers: sim/sweep_results.c
#include "sim/sweep_results.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    SweepResults *results = sweep_results_parse((const char *)data, size, "table.csv", &faults);
    if (!results != (faults.count > 0))
        abort();
    for (int c = 0; results && c < results->column_count; c++)
        for (int i = 0; i < results->row_count; i++)
            if (isinf(results->column[c].value[i]) || (!results->column[c].is_number && isnan(results->column[c].value[i])))
                abort();
    sweep_results_free(results);
    return 0;
}
