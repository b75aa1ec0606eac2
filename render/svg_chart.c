#include "render/svg_chart.h"

#include "render/page.h"
#include "render/tick_step.h"

#include <math.h>

enum { LEFT = 66, TOP = 12, RIGHT = 14, FOOT = 38 };

static double scaled(const SvgAxis *axis, double value) { return axis->is_log ? log10(value) : value; }

static double part(const SvgAxis *axis, double value)
{
    double low = scaled(axis, axis->low), high = scaled(axis, axis->high);
    return fmin(fmax((scaled(axis, value) - low) / (high - low), 0), 1);
}

double svg_chart_x(const SvgChart *chart, double value) { return LEFT + chart->width * part(&chart->x, value); }
double svg_chart_y(const SvgChart *chart, double value) { return TOP + chart->height * (1 - part(&chart->y, value)); }

static void make_valid(SvgAxis *axis)
{
    axis->is_log &= axis->low > 0 && isfinite(axis->high);
    if (!isfinite(axis->low) || !isfinite(axis->high))
        axis->low = 0, axis->high = 1;
    // a range that rounding cannot resolve
    if (!(axis->high - axis->low > 1e-9 * fmax(fabs(axis->low), fabs(axis->high)))) {
        double around = fmax(0.5 * fabs(axis->low), 1e-9);
        axis->high = axis->low + around;
        axis->low -= axis->is_log ? 0 : around;
    }
}

static void draw_tick(FILE *out, const SvgChart *chart, bool is_x, double value, const char *text)
{
    if (is_x)
        fprintf(out, "<path class=\"grid\" d=\"M%.1f %d v%d\"/><text class=\"tick\" text-anchor=\"middle\" x=\"%.1f\" y=\"%d\">%s</text>\n",
                svg_chart_x(chart, value), TOP, chart->height, svg_chart_x(chart, value), TOP + chart->height + 14, text);
    else
        fprintf(out, "<path class=\"grid\" d=\"M%d %.1f h%d\"/><text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%.1f\">%s</text>\n", LEFT,
                svg_chart_y(chart, value), chart->width, LEFT - 5, svg_chart_y(chart, value) + 4, text);
}

static void draw_ticks(FILE *out, const SvgChart *chart, bool is_x)
{
    const SvgAxis *axis = is_x ? &chart->x : &chart->y;
    char text[40];
    double decades = axis->is_log ? log10(axis->high / axis->low) : 0;
    if (decades > 1) {
        double every = fmax(1, ceil(decades / (is_x ? chart->width / 60.0 : chart->height / 24.0)));
        for (double k = ceil(log10(axis->low) - 1e-9); k <= log10(axis->high) + 1e-9; k += every) {
            snprintf(text, sizeof text, "%g", pow(10, k));
            draw_tick(out, chart, is_x, pow(10, k), text);
        }
        return;
    }
    double tick = tick_step(axis->high - axis->low, is_x ? chart->width / 60 : chart->height / 26);
    for (double k = ceil(axis->low / tick - 1e-9); k * tick <= axis->high + 1e-9 * tick; k++) {
        tick_format(text, sizeof text, k * tick, tick);
        draw_tick(out, chart, is_x, k * tick, text);
    }
}

void svg_chart_begin(FILE *out, SvgChart *chart)
{
    make_valid(&chart->x);
    make_valid(&chart->y);
    int width = LEFT + chart->width + RIGHT, height = TOP + chart->height + FOOT;
    fprintf(out, "<svg id=\"%s\" role=\"img\" aria-labelledby=\"%s-t\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\">\n<title id=\"%s-t\">", chart->id,
            chart->id, width, height, width, height, chart->id);
    page_text(out, chart->title);
    fprintf(out, "</title>\n");
    draw_ticks(out, chart, true);
    draw_ticks(out, chart, false);
    fprintf(out, "<path class=\"axis\" d=\"M%d %d v%d h%d\"/><text text-anchor=\"middle\" x=\"%d\" y=\"%d\">", LEFT, TOP, chart->height, chart->width,
            LEFT + chart->width / 2, TOP + chart->height + 31);
    page_text(out, chart->x.title);
    fprintf(out, "</text><text text-anchor=\"middle\" transform=\"translate(13 %d) rotate(-90)\">", TOP + chart->height / 2);
    page_text(out, chart->y.title);
    fprintf(out, "</text>\n");
}

void svg_chart_end(FILE *out) { fprintf(out, "</svg>\n"); }
