// The report of a sweep: distributions of its figures, pairs of varied keys and figures, first-order Sobol indices, the worst runs with pictures.
#ifndef SELDINGER_RENDER_SWEEP_PAGE_H
#define SELDINGER_RENDER_SWEEP_PAGE_H

#include "sim/sim.h"

#include <stdio.h>

typedef struct SweepPage {
    const char *folder;          // RESULTS
    const SweepResults *results;
    const char *specification;   // the text of spec.yaml
    const char *path;            // of the specification itself, for commands: the copy's relative paths do not hold; NULL: unknown
} SweepPage;

// A self-contained HTML document without a date: the same results give the same page. Recordings of the worst runs are read from FOLDER/recordings.
void sweep_page(FILE *out, const SweepPage *page);

#endif
