// Any bytes as a trace file of `segment`.
#include "recon/trace.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Trace *trace = trace_parse((const char *)data, size, "fuzz.yaml", &faults);
    if ((trace != NULL) == (faults.count > 0))
        __builtin_trap();
    trace_free(trace);
    return 0;
}
