// Any bytes as centrelines: VTP, Markups, SWC.
// Covers: recon/centreline_file.c recon/vtp_file.c
#include "recon/centreline_file.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    CurveSet *set = curve_set_create();
    if (set && centreline_parse(data, size, "fuzz", set, &faults) == (faults.count > 0))
        __builtin_trap();
    curve_set_free(set);
    return 0;
}
