// Any bytes as centrelines: VTP, Markups, SWC. Accepted centrelines are written in each of these formats, and read again.
// Covers: recon/surface/centreline_file.c recon/surface/vtp_file.c
#include "recon/surface/centreline_file.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require_again(const CurveSet *set, const char *name)
{
    static Faults faults;
    size_t length;
    faults_clear(&faults);
    char *text = centreline_text(set, name, &length, &faults);
    CurveSet *again = curve_set_create();
    if (!text || !again || !centreline_parse(text, length, name, again, &faults) || again->point_count < 2)
        __builtin_trap();
    curve_set_free(again);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    faults_clear(&faults);
    CurveSet *set = curve_set_create();
    bool good = set && centreline_parse(data, size, "fuzz", set, &faults);
    if (good == (faults.count > 0))
        __builtin_trap();
    if (good && set->curve_count > 0) {
        require_again(set, "again.vtp");
        require_again(set, "again.mrk.json");
        require_again(set, "again.swc");
    }
    curve_set_free(set);
    return 0;
}
