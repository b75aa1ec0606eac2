// Charts of report pages: axes with round numbers around a rectangle, inline SVG with the classes of page_style. The caller draws inside.
#ifndef SELDINGER_RENDER_SVG_CHART_H
#define SELDINGER_RENDER_SVG_CHART_H

#include <stdbool.h>
#include <stdio.h>

typedef struct SvgAxis {
    double low, high;        // svg_chart_begin() widens them to a valid range
    bool is_log;             // both > 0
    const char *title;       // with its unit; may hold any text
} SvgAxis;

typedef struct SvgChart {
    const char *id;          // unique in the page: letters, digits, "-"
    const char *title;       // for readers that do not see it; any text
    int width, height;       // of the rectangle [px]
    SvgAxis x, y;
} SvgChart;

// Draws the axes; the caller draws and then ends.
void svg_chart_begin(FILE *out, SvgChart *chart);
void svg_chart_end(FILE *out);
// Places in the chart [px], clamped to the rectangle.
double svg_chart_x(const SvgChart *chart, double value);
double svg_chart_y(const SvgChart *chart, double value);

#endif
