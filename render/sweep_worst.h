// The worst runs of a sweep's report (sweep_page.h).
#ifndef SELDINGER_RENDER_SWEEP_WORST_H
#define SELDINGER_RENDER_SWEEP_WORST_H

#include "render/sweep_page.h"

enum { SWEEP_WORST_MOST = 10 };

// A section with the worst ten: first those that failed, diverged or left the vessel, then the worst by one figure; each with its values, the command that
// repeats it and, where its recording was kept, its last picture.
void sweep_worst_section(FILE *out, const SweepPage *page);

#endif
