// A running plot: the last seconds of one quantity, with minimum and maximum of each bin so that no peak is lost.
#ifndef SELDINGER_RENDER_PLOT_H
#define SELDINGER_RENDER_PLOT_H

#include "render/gui.h"

#include <stdint.h>

enum { PLOT_BINS = 200 };
#define PLOT_SPAN_S 20.0

typedef struct RunningPlot {
    int64_t last;                  // number of the newest bin, PLOT_SPAN_S / PLOT_BINS seconds each, counted from time 0
    int count;                     // bins with a place, newest last; 0 before the first sample
    float least[PLOT_BINS], most[PLOT_BINS];   // by bin number modulo PLOT_BINS; NaN: no sample in it
    double value, time_s;          // newest sample
} RunningPlot;

void plot_clear(RunningPlot *plot);
// Time may stand still (a pause); if it goes backwards, or forwards by more than the span, the plot restarts. NaN is ignored.
void plot_add(RunningPlot *plot, double time_s, double value);
// Minimum and maximum shown; false without a sample.
bool plot_range(const RunningPlot *plot, double *least, double *most);
// Title and newest value with unit above, ticks with numbers at the left, a line every 5 s. `least_span`: the axis shows at least 0 to this, so that
// noise is not magnified. `height` of all.
void plot_draw(const RunningPlot *plot, Gui *gui, const char *title, const char *unit, int decimals, double least_span, float height);

#endif
