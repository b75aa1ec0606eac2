// The figures of a run that differs from its golden run (check_page.h).
#ifndef SELDINGER_RENDER_CHECK_FIGURES_H
#define SELDINGER_RENDER_CHECK_FIGURES_H

#include "sim/sim.h"

#include <stdio.h>

// Both tools at the first moment above a tolerance and at the largest distance, in the vessel's silhouette; the largest distance of the two over the inserted
// length and over time. `number` makes ids unique in the page.
void check_part_figures(FILE *out, const GoldenComparison *comparison, int number);

#endif
