// A figure of reports over several sessions: one quantity against the number of the session, a line for each series.
#ifndef SELDINGER_RENDER_LEARNING_CURVE_H
#define SELDINGER_RENDER_LEARNING_CURVE_H

#include <stdbool.h>
#include <stdio.h>

typedef struct CurvePoint {
    double value;
    bool is_held;                // the target was held: filled, otherwise open
    const char *note;            // shown under the mouse; borrowed
} CurvePoint;

typedef struct CurveSeries {
    const char *name;            // written at its end; NULL: none
    int count;
    const CurvePoint *point;     // (count)
} CurveSeries;

typedef struct LearningCurve {
    const char *id;              // of the figure, unique in the page: letters, digits, "-"
    const char *title;           // with its unit
    double least_top;            // the axis goes from 0 to at least this
    int width, height;           // of the plot itself [px]
    int series_count;
    const CurveSeries *series;   // (series_count)
} LearningCurve;

// Colours and dashes, one for each series, then they repeat; and the height that each name needs [px].
enum { CURVE_STYLES = 6, CURVE_NAME_LINE = 14 };

// Inline SVG with a title, for the classes of page_style.
void learning_curve(FILE *out, const LearningCurve *curve);

#endif
