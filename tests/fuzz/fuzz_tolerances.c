// Any bytes as a file of tolerances: what is given and accepted lies within its range, and what is not has its default.
// Covers: sim/tolerances.c
#include "sim/tolerances.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    Tolerances tolerances = {0};
    faults_clear(&faults);
    YamlReader *reader = yaml_reader_open((const char *)data, size, "tolerances.yaml", &faults);
    if (!reader != (faults.count > 0))
        abort();
    if (!reader)
        return 0;
    tolerances_read(yaml_root(reader), &tolerances);
    yaml_reader_close(reader);
    for (int i = 0; faults.count == 0 && i < TOLERANCE_COUNT; i++) {
        double value = tolerance_of(&tolerances, (ToleranceQuantity)i);
        if (!(value >= 0 && value <= tolerance_info[i].most) || (!tolerances.given[i] && value != tolerance_info[i].usual))
            abort();
    }
    return 0;
}
