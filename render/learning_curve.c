#include "render/learning_curve.h"

#include "base/base.h"
#include "render/page.h"
#include "render/tick_step.h"

#include <math.h>
#include <stdlib.h>

enum { LEFT = 44, TOP = 24, FOOT = 24, RIGHT = 14, NAMES = 190 };

typedef struct Axes {
    double top, step_x;          // largest value; pixels from one session to the next
    int most;                    // sessions of the longest series
} Axes;

static Axes find_axes(const LearningCurve *curve)
{
    Axes axes = {.top = curve->least_top};
    for (int k = 0; k < curve->series_count; k++) {
        const CurveSeries *series = &curve->series[k];
        axes.most = series->count > axes.most ? series->count : axes.most;
        for (int i = 0; i < series->count; i++)
            axes.top = fmax(axes.top, series->point[i].value);
    }
    double tick = tick_step(axes.top, 4);
    axes.top = fmax(tick * ceil(axes.top / tick - 1e-9), tick);
    axes.step_x = axes.most > 1 ? (curve->width - 20.0) / (axes.most - 1) : 0;
    return axes;
}

static double place_x(const Axes *axes, int i) { return LEFT + 10 + axes->step_x * i; }
static double place_y(const LearningCurve *curve, const Axes *axes, double value) { return TOP + curve->height * (1 - value / axes->top); }

static void draw_axes(FILE *out, const LearningCurve *curve, const Axes *axes)
{
    const double tick = tick_step(axes->top, 4);
    const int every = (int)tick_step(axes->most, 10) > 1 ? (int)tick_step(axes->most, 10) : 1;
    for (int k = 0; k * tick <= axes->top * (1 + 1e-9); k++) {
        char text[32];
        double y = place_y(curve, axes, k * tick);
        tick_format(text, sizeof text, k * tick, tick);
        fprintf(out, "<path class=\"grid\" d=\"M%d %.1f h%d\"/><text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%.1f\">%s</text>\n", LEFT, y, curve->width,
                LEFT - 6, y + 4, text);
    }
    for (int i = every - 1; i < axes->most; i += every)
        fprintf(out, "<text class=\"tick\" text-anchor=\"middle\" x=\"%.1f\" y=\"%d\">%d</text>", place_x(axes, i), TOP + curve->height + 15, i + 1);
    fprintf(out, "\n");
}

static void draw_series(FILE *out, const LearningCurve *curve, const Axes *axes, int k)
{
    static const char *const dash[CURVE_STYLES] = {"none", "6 3", "2 3", "8 3 2 3", "12 4", "4 2 1 2"};
    const CurveSeries *series = &curve->series[k];
    if (series->count == 0)
        return;
    fprintf(out, "<g class=\"o%d\"><polyline class=\"line\" stroke-dasharray=\"%s\" points=\"", k % CURVE_STYLES + 1, dash[k % CURVE_STYLES]);
    for (int i = 0; i < series->count; i++)
        fprintf(out, "%.1f,%.1f ", place_x(axes, i), place_y(curve, axes, series->point[i].value));
    fprintf(out, "\"/>\n");
    for (int i = 0; i < series->count; i++) {
        const CurvePoint *point = &series->point[i];
        fprintf(out, "<circle class=\"%s\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"><title>", point->is_held ? "held" : "missed", place_x(axes, i),
                place_y(curve, axes, point->value));
        page_text(out, point->note);
        fprintf(out, "</title></circle>\n");
    }
    fprintf(out, "</g>\n");
}

typedef struct NamePlace {
    int series;
    double y;
} NamePlace;

static int compare_places(const void *a, const void *b)
{
    const NamePlace *x = a, *y = b;
    return x->y != y->y ? (x->y < y->y ? -1 : 1) : x->series - y->series;
}

// At the ends of their lines, pushed apart where they would touch.
static void draw_names(FILE *out, const LearningCurve *curve, const Axes *axes)
{
    NamePlace *place = HEAP_ZEROED((size_t)curve->series_count + 1, sizeof *place);
    int count = 0;
    for (int k = 0; k < curve->series_count; k++) {
        const CurveSeries *series = &curve->series[k];
        if (series->name && series->count > 0)
            place[count++] = (NamePlace){k, place_y(curve, axes, series->point[series->count - 1].value)};
    }
    qsort(place, (size_t)count, sizeof *place, compare_places);
    for (int i = 1; i < count; i++)
        place[i].y = fmax(place[i].y, place[i - 1].y + CURVE_NAME_LINE);
    for (int i = count - 1; i >= 0; i--)
        place[i].y = fmin(place[i].y, i == count - 1 ? TOP + curve->height : place[i + 1].y - CURVE_NAME_LINE);
    for (int i = 0; i < count; i++) {
        const CurveSeries *series = &curve->series[place[i].series];
        const double from = place_y(curve, axes, series->point[series->count - 1].value), x = LEFT + curve->width + 8;
        fprintf(out, "<g class=\"o%d\"><path class=\"grid\" d=\"M%.1f %.1f L%.1f %.1f\"/><text class=\"label name\" x=\"%.1f\" y=\"%.1f\">",
                place[i].series % CURVE_STYLES + 1, place_x(axes, series->count - 1) + 6, from, x - 2, place[i].y, x, place[i].y + 4);
        page_text(out, series->name);
        fprintf(out, "</text></g>\n");
    }
    free(place);
}

void learning_curve(FILE *out, const LearningCurve *curve)
{
    const Axes axes = find_axes(curve);
    bool has_names = false;
    for (int k = 0; k < curve->series_count; k++)
        has_names |= curve->series[k].name != NULL;
    const int width = LEFT + curve->width + RIGHT + (has_names ? NAMES : 0), height = TOP + curve->height + FOOT;
    fprintf(out, "<svg id=\"%s\" role=\"img\" aria-labelledby=\"%s-t\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\">\n<title id=\"%s-t\">", curve->id,
            curve->id, width, height, width, height, curve->id);
    page_text(out, curve->title);
    fprintf(out, " by session</title><text x=\"%d\" y=\"15\">", LEFT);
    page_text(out, curve->title);
    fprintf(out, "</text>\n");
    draw_axes(out, curve, &axes);
    for (int k = 0; k < curve->series_count; k++)
        draw_series(out, curve, &axes, k);
    draw_names(out, curve, &axes);
    fprintf(out, "</svg>\n");
}
