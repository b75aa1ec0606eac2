// Any bytes as a trace file of `segment`.
// Covers: recon/track/trace.c
#include "recon/track/trace.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    Trace *trace = trace_parse((const char *)data, size, "fuzz.yaml", &faults);
    if ((trace != NULL) == (faults.count > 0))
        __builtin_trap();
    // as the command line adds them
    if (trace && (!trace_add_point(trace, "until", vec3(1, 2, 3)) || !trace_add_point(trace, "not", vec3(4, 5, 6)) ||
                  trace->parameters.until[trace->until_count - 1].center.x != 1 || trace->parameters.rival[trace->rival_count - 1].center.x != 4))
        __builtin_trap();
    trace_free(trace);
    return 0;
}
