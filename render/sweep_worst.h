// The worst runs of a sweep's report (sweep_page.h).
#ifndef SELDINGER_RENDER_SWEEP_WORST_H
#define SELDINGER_RENDER_SWEEP_WORST_H

#include "sim/sim.h"

#include <stdio.h>

// What the report shows.
typedef struct SweepPage {
    const char *folder;          // RESULTS
    const SweepResults *results;
    const char *specification;   // the text of spec.yaml
    const char *path;            // of the specification itself, for commands: the copy's relative paths do not hold; NULL: unknown
} SweepPage;

enum { SWEEP_WORST_MOST = 10 };

// The numbers of the worst runs, the worst first; returns how many.
int sweep_worst_runs(const SweepResults *results, int rows[SWEEP_WORST_MOST]);

// A section with the worst ten: first those that failed, diverged or left the vessel, then the worst by one figure; each with its values, the command that
// repeats it and, where its recording was kept, its last picture.
void sweep_worst_section(FILE *out, const SweepPage *page);

#endif
