// The figures of a sweep's report (sweep_page.h), inline SVG. `number` makes ids unique in the page.
#ifndef SELDINGER_RENDER_SWEEP_FIGURES_H
#define SELDINGER_RENDER_SWEEP_FIGURES_H

#include "sim/sim.h"

#include <stdio.h>

// How often values of a column occur among the runs that are done.
void sweep_histogram(FILE *out, const SweepResults *results, int column, int number);
enum { SWEEP_DOTS_MOST = 1000 };     // of more runs, every n-th is drawn
// A dot for each run that is done.
void sweep_scatter(FILE *out, const SweepResults *results, int key, int figure, int number);
// The index of one key as a bar with its interval.
void sweep_index_bar(FILE *out, const FirstOrder *index);

#endif
