// The report of a sweep: distributions of its figures, pairs of varied keys and figures, first-order Sobol indices, the worst runs with pictures.
#ifndef SELDINGER_RENDER_SWEEP_PAGE_H
#define SELDINGER_RENDER_SWEEP_PAGE_H

#include "render/sweep_worst.h"

// A self-contained HTML document without a date: the same results give the same page. Recordings of the worst runs are read from FOLDER/recordings.
void sweep_page(FILE *out, const SweepPage *page);

#endif
