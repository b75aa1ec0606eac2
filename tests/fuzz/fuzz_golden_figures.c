// Any bytes as the figures of a golden run: accepted ones do not differ from themselves.
// Covers: sim/golden_figures.c
#include "sim/golden_figures.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    GoldenFigures figures;
    FigureDifference difference[TOLERANCE_COUNT];
    char remark[160];
    faults_clear(&faults);
    bool good = golden_figures_parse((const char *)data, size, "a.golden-figures.csv", &figures, &faults);
    if (good != (faults.count == 0))
        abort();
    if (good && golden_figures_compare(&figures, &figures, &(Tolerances){0}, difference, remark, sizeof remark))
        abort();
    if (good)
        golden_figures_free(&figures);
    return 0;
}
