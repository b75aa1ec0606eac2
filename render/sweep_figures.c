#include "render/sweep_figures.h"

#include "render/page.h"
#include "render/svg_chart.h"

#include <math.h>
#include <stdlib.h>

// Values over more than a decade and a half that are crowded at their lower end are shown by their logarithm.
static bool spans_decades(const SweepResults *results, const SweepColumn *column)
{
    double sum = 0;
    int count = 0;
    for (int i = 0; i < results->row_count; i++)
        if (results->is_done[i] && !isnan(column->value[i])) {
            sum += column->value[i];
            count++;
        }
    return column->is_number && column->least > 0 && column->most / column->least > 30 && sum / count < column->least + 0.3 * (column->most - column->least);
}

// What the numbers of an axis of names mean.
static void print_names(FILE *out, const SweepResults *results, const SweepColumn *column)
{
    enum { SHOWN = 12 };
    fprintf(out, "<figcaption>");
    for (int k = 0; k < SHOWN; k++)
        for (int i = 0; i < results->row_count; i++)
            if (column->value[i] == k) {
                fprintf(out, "%s%d ", k > 0 ? ", " : "", k);
                page_text(out, column->text[i]);
                break;
            }
    fprintf(out, "%s</figcaption>", column->most >= SHOWN ? ", …" : "");
}

static double place(double value, double low, double high, bool is_log) { return is_log ? log(value / low) / log(high / low) : (value - low) / (high - low); }

void sweep_histogram(FILE *out, const SweepResults *results, int c, int number)
{
    enum { MOST = 60 };
    const SweepColumn *column = &results->column[c];
    int in_bin[MOST] = {0}, runs = 0, highest = 0;
    bool is_log = spans_decades(results, column);
    for (int i = 0; i < results->row_count; i++)
        runs += results->is_done[i] && !isnan(column->value[i]);
    int bins = (int)fmin(fmax(ceil(sqrt(runs)), 5), MOST);
    for (int i = 0; i < results->row_count; i++)
        if (results->is_done[i] && !isnan(column->value[i])) {
            int bin = (int)(bins * place(column->value[i], column->least, column->most, is_log));
            bin = bin < bins ? bin : bins - 1;
            highest = ++in_bin[bin] > highest ? in_bin[bin] : highest;
        }
    char id[40];
    snprintf(id, sizeof id, "histogram-%d", number);
    SvgChart chart = {.id = id,
                      .title = column->name,
                      .width = 250,
                      .height = 120,
                      .x = {column->least, column->most, is_log, column->name},
                      .y = {0, highest, false, "runs"}};
    fprintf(out, "<figure>");
    svg_chart_begin(out, &chart);
    fprintf(out, "<g class=\"c2\">");
    for (int b = 0; b < bins; b++) {
        double from = (double)b / bins, to = (double)(b + 1) / bins, range = column->most - column->least, ratio = column->most / column->least;
        double left = svg_chart_x(&chart, is_log ? column->least * pow(ratio, from) : column->least + range * from);
        double right = svg_chart_x(&chart, is_log ? column->least * pow(ratio, to) : column->least + range * to), top = svg_chart_y(&chart, in_bin[b]);
        if (in_bin[b] > 0)
            fprintf(out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>", left + 0.5, top, fmax(right - left - 1, 0.5),
                    svg_chart_y(&chart, 0) - top);
    }
    fprintf(out, "</g>\n");
    svg_chart_end(out);
    fprintf(out, "</figure>\n");
}

void sweep_scatter(FILE *out, const SweepResults *results, int key, int figure, int number)
{
    const SweepColumn *x = &results->column[key], *y = &results->column[figure];
    int stride = results->row_count / (SWEEP_DOTS_MOST + 1) + 1;
    char id[40], title[300];
    snprintf(id, sizeof id, "pair-%d", number);
    snprintf(title, sizeof title, "%.140s over %.140s", y->name, x->name);
    SvgChart chart = {.id = id,
                      .title = title,
                      .width = 250,
                      .height = 180,
                      .x = {x->least, x->most, spans_decades(results, x), x->name},
                      .y = {y->least, y->most, spans_decades(results, y), y->name}};
    fprintf(out, "<figure>");
    svg_chart_begin(out, &chart);
    fprintf(out, "<g class=\"dots\">");
    for (int i = 0; i < results->row_count; i += stride)
        if (results->is_done[i] && !isnan(x->value[i]) && !isnan(y->value[i]))
            fprintf(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\"/>", svg_chart_x(&chart, x->value[i]), svg_chart_y(&chart, y->value[i]));
    fprintf(out, "</g>\n");
    svg_chart_end(out);
    if (!x->is_number)
        print_names(out, results, x);
    fprintf(out, "</figure>\n");
}

void sweep_index_bar(FILE *out, const FirstOrder *index)
{
    enum { WIDTH = 110, HEIGHT = 14 };
    double at = WIDTH * fmin(fmax(index->index, 0), 1), low = WIDTH * fmin(fmax(index->low, 0), 1), high = WIDTH * fmin(fmax(index->high, 0), 1);
    fprintf(out,
            "<svg class=\"index\" aria-hidden=\"true\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\"><rect class=\"c2\" x=\"0\" y=\"3\" width=\"%.1f\" "
            "height=\"8\"/><path class=\"axis\" d=\"M%.1f 7 H%.1f M%.1f 4 v6 M%.1f 4 v6\"/></svg>",
            WIDTH, HEIGHT, WIDTH, HEIGHT, at, low, high, low, high);
}
