#include "render/check_figures.h"

#include "geom/geom.h"
#include "render/silhouette.h"
#include "render/svg_chart.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE = 460 };

// --- both tools at one moment ---

// The tips' ways: most of a tool lies in the sheath.
static Silhouette frame(const ToolPath *golden, const ToolPath *run)
{
    Vec3 low = golden->row[golden->row_count - 1].position, high = low;
    const ToolPath *const path[2] = {golden, run};
    for (int p = 0; p < 2; p++)
        for (int i = 0; i < path[p]->row_count; i++) {
            const PathRow *row = &path[p]->row[i];
            if (i + 1 == path[p]->row_count || row[1].t_s > row->t_s || row[1].tool != row->tool)
                silhouette_widen(row->position, &low, &high);
        }
    return silhouette_frame(low, high, SIDE);
}

// The tools at a time, a line for each.
static void draw_tools(FILE *out, const Silhouette *view, const ToolPath *path, double t_s, const char *class)
{
    for (int tool = 0; tool < path->tool_count; tool++) {
        fprintf(out, "<polyline class=\"line %s\" points=\"", class);
        for (int i = 0; i < path->row_count; i++)
            if (path->row[i].tool == tool && fabs(path->row[i].t_s - t_s) < 1e-5)
                fprintf(out, "%.2f,%.2f ", silhouette_x(view, path->row[i].position), silhouette_y(view, path->row[i].position));
        fprintf(out, "\"/>\n");
    }
}

static void draw_moment(FILE *out, const GoldenComparison *comparison, const Silhouette *view, double t_s, int number, const char *name, const char *caption)
{
    char id[40], title[60];
    const PathDifference *path = &comparison->path;
    snprintf(id, sizeof id, "overlay-%s-%d", name, number);
    snprintf(title, sizeof title, "The two tools at %.3f s", t_s);
    fprintf(out, "<figure>");
    silhouette_begin(out, view, id, title);
    silhouette_wall(out, view, &comparison->wall);
    draw_tools(out, view, comparison->golden, t_s, "golden");
    draw_tools(out, view, comparison->run, t_s, "new");
    for (int i = 0; i < comparison->run->row_count; i++) {
        const PathRow *row = &comparison->run->row[i];
        if (path->first_node >= 0 && row->tool == path->first_tool && row->node == path->first_node && fabs(row->t_s - t_s) < 1e-5 &&
            fabs(t_s - path->first_t_s) < 1e-5)
            fprintf(out, "<circle class=\"mark failed\" cx=\"%.1f\" cy=\"%.1f\" r=\"7\"><title>node %d</title></circle>\n", silhouette_x(view, row->position),
                    silhouette_y(view, row->position), row->node);
    }
    silhouette_end(out, view);
    fprintf(
        out,
        "<figcaption><span class=\"golden\">golden ———</span> <span class=\"new\">this run – – –</span>. %s: %.3f s, seen along %c.</figcaption></figure>\n",
        caption, t_s, silhouette_axis(view));
}

// --- the deviation ---

typedef struct Deviation {
    int count;
    double *t_s, *inserted, *most;   // (count) by time; the largest distance of all nodes [mm]
    int worst;               // index of the largest
} Deviation;

static Deviation measure(const GoldenComparison *comparison)
{
    const ToolPath *golden = comparison->golden, *run = comparison->run;
    size_t rows = (size_t)golden->row_count + 1;
    Deviation deviation = {0, HEAP_ZEROED(rows, sizeof(double)), HEAP_ZEROED(rows, sizeof(double)), HEAP_ZEROED(rows, sizeof(double)), 0};
    int j = 0, f = 0;
    for (int i = 0; i < golden->row_count; i++) {
        const PathRow *row = &golden->row[i];
        int n = deviation.count - 1;
        while (j < run->row_count && run->row[j].t_s < row->t_s - 1e-5)
            j++;
        if (j == run->row_count)
            break;
        if (n < 0 || row->t_s > deviation.t_s[n] + 1e-5) {
            while (f + 1 < comparison->figures.row_count && comparison->figures.row[f].t_s < row->t_s - 1e-5)
                f++;
            n = deviation.count++;
            deviation.t_s[n] = row->t_s;
            deviation.inserted[n] = comparison->figures.row_count > 0 ? comparison->figures.row[f].value[TOLERANCE_INSERTED - FIGURE_FIRST] : 0;
        }
        for (int k = j; k < run->row_count && run->row[k].t_s < row->t_s + 1e-5; k++)
            if (run->row[k].tool == row->tool && run->row[k].node == row->node)
                deviation.most[n] = fmax(deviation.most[n], vec3_distance(run->row[k].position, row->position));
        if (deviation.most[n] > deviation.most[deviation.worst])
            deviation.worst = n;
    }
    return deviation;
}

static void free_deviation(Deviation *deviation)
{
    free(deviation->t_s);
    free(deviation->inserted);
    free(deviation->most);
}

static void draw_deviation(FILE *out, const GoldenComparison *comparison, const Deviation *deviation, const double *along, const char *axis, const char *name,
                           int number)
{
    char id[40];
    const double tolerance = comparison->quantity[TOLERANCE_POSITION].tolerance;
    double low = HUGE_VAL, high = fmax(tolerance, 1e-8), first = HUGE_VAL, last = -HUGE_VAL;
    snprintf(id, sizeof id, "deviation-%s-%d", name, number);
    for (int i = 0; i < deviation->count; i++) {
        low = fmin(low, fmax(deviation->most[i], 1e-8));
        high = fmax(high, deviation->most[i]);
        first = fmin(first, along[i]);
        last = fmax(last, along[i]);
    }
    SvgChart chart = {.id = id,
                      .title = "Largest distance of the two tools",
                      .width = 420,
                      .height = 220,
                      .x = {first, last, false, axis},
                      .y = {fmin(low, fmax(tolerance, 1e-8)), 2 * high, true, "largest distance [mm]"}};
    fprintf(out, "<figure>");
    svg_chart_begin(out, &chart);
    fprintf(out, "<g class=\"new\"><polyline class=\"line\" points=\"");
    for (int i = 0; i < deviation->count; i++)
        fprintf(out, "%.1f,%.1f ", svg_chart_x(&chart, along[i]), svg_chart_y(&chart, fmax(deviation->most[i], 1e-8)));
    fprintf(out, "\"/></g>\n");
    if (tolerance > 0)
        fprintf(out, "<path class=\"border\" d=\"M%.1f %.1f H%.1f\"/><text class=\"label\" x=\"%.1f\" y=\"%.1f\">tolerance</text>\n",
                svg_chart_x(&chart, first), svg_chart_y(&chart, tolerance), svg_chart_x(&chart, last), svg_chart_x(&chart, first) + 4,
                svg_chart_y(&chart, tolerance) - 4);
    for (int i = 0; i < deviation->count; i++)
        if (comparison->path.first_node >= 0 && fabs(deviation->t_s[i] - comparison->path.first_t_s) < 1e-5)
            fprintf(out, "<g class=\"failed\"><circle class=\"mark\" cx=\"%.1f\" cy=\"%.1f\" r=\"5\"><title>%.3f s, %.2f mm inserted</title></circle></g>\n",
                    svg_chart_x(&chart, along[i]), svg_chart_y(&chart, fmax(deviation->most[i], 1e-8)), deviation->t_s[i], deviation->inserted[i]);
    svg_chart_end(out);
    fprintf(out, "<figcaption>The circle is the first moment above the tolerance of the position.</figcaption></figure>\n");
}

void check_part_figures(FILE *out, const GoldenComparison *comparison, int number)
{
    if (comparison->golden->row_count == 0 || comparison->run->row_count == 0)
        return;
    Silhouette view = frame(comparison->golden, comparison->run);
    Deviation deviation = measure(comparison);
    double first = HUGE_VAL;
    for (int k = 0; k < TOLERANCE_COUNT; k++)
        if (comparison->quantity[k].is_compared && comparison->quantity[k].first_t_s >= 0)
            first = fmin(first, comparison->quantity[k].first_t_s);
    if (isfinite(first))
        draw_moment(out, comparison, &view, first, number, "first", "First moment above a tolerance");
    if (deviation.count > 0) {
        draw_moment(out, comparison, &view, deviation.t_s[deviation.worst], number, "worst", "Largest distance");
        draw_deviation(out, comparison, &deviation, deviation.inserted, "inserted length [mm]", "inserted", number);
        draw_deviation(out, comparison, &deviation, deviation.t_s, "time [s]", "time", number);
    }
    free_deviation(&deviation);
}
