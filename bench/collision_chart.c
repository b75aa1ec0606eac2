// Five panels: detection by surface, error against time, growth, artificial friction, work lost. All axes but the lists' are logarithmic: a decade
// has the same length everywhere. Representations differ by colour (Okabe and Ito's, which the colour-blind can distinguish) and by shape.
#include "bench/collision_chart.h"

#include "base/output.h"
#include "render/page.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAMES_MOST = 40, WIDTH = 1200, MARGIN = 24, LABELS = 190, HEAD = 34, FOOT = 46, LANE = 9, HALF_HEIGHT = 380, LEGEND_LINE = 22 };

typedef struct Names {       // in the order of their first appearance
    int count;
    const char *name[NAMES_MOST];
} Names;

typedef struct Axis {        // logarithmic, in pixels
    double low, high;        // of the data, > 0, low < high once it is closed
    double from, to;         // pixels at low and high
} Axis;

typedef struct Chart {
    FILE *out;
    const cJSON *rows, *growth, *sizes;
    Names representations, surfaces;
} Chart;

static const char *const colour[] = {"#0072b2", "#d55e00", "#009e73", "#a6548a", "#8a6d00", "#3a95cf", "#000000", "#b3001b"};
// about 11 pixels wide, around 0,0
static const char *const shape[] = {"M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z",
                                    "M-4.5-4.5h9v9h-9z",
                                    "M0-6L5.5 4.5h-11z",
                                    "M0-6.2L6.2 0L0 6.2L-6.2 0z",
                                    "M0 6L5.5-4.5h-11z",
                                    "M-1.8-5.5h3.6v3.7h3.7v3.6h-3.7v3.7h-3.6v-3.7h-3.7v-3.6h3.7z",
                                    "M-6-2.5h12v5h-12z"};
enum { COLOURS = sizeof colour / sizeof colour[0], SHAPES = sizeof shape / sizeof shape[0] };

static int name_index(const Names *names, const char *name)
{
    for (int i = 0; i < names->count; i++)
        if (!strcmp(names->name[i], name))
            return i;
    return -1;
}

static void add_name(Names *names, const cJSON *item)
{
    if (cJSON_IsString(item) && names->count < NAMES_MOST && name_index(names, item->valuestring) < 0)
        names->name[names->count++] = item->valuestring;
}

// The number at `keys`, "a.b" for a within which b; NAN if there is none.
static double number_at(const cJSON *item, const char *keys)
{
    char key[64];
    const char *dot = strchr(keys, '.');
    snprintf(key, sizeof key, "%.*s", dot ? (int)(dot - keys) : (int)strlen(keys), keys);
    const cJSON *found = cJSON_GetObjectItemCaseSensitive(item, key);
    return dot ? number_at(found, dot + 1) : cJSON_IsNumber(found) && isfinite(found->valuedouble) ? found->valuedouble : NAN;
}

static const char *text_at(const cJSON *item, const char *key)
{
    const cJSON *found = cJSON_GetObjectItemCaseSensitive(item, key);
    return cJSON_IsString(found) ? found->valuestring : "";
}

// --- axes ---

static void axis_hold(Axis *axis, double value)
{
    if (!(value > 0) || value > 1e300)
        return;
    axis->low = axis->low > 0 ? fmin(axis->low, value) : value;
    axis->high = fmax(axis->high, value);
}

static double power_of_ten(int exponent) { return pow(10, exponent); }

// Widened to whole decades, at least one.
static bool axis_close(Axis *axis, double from, double to)
{
    if (!(axis->low > 0))
        return false;
    int low = (int)floor(log10(axis->low) + 1e-9), high = (int)ceil(log10(axis->high) - 1e-9);
    axis->low = power_of_ten(low);
    axis->high = power_of_ten(high > low ? high : low + 1);
    axis->from = from;
    axis->to = to;
    return true;
}

static double place(const Axis *axis, double value) { return axis->from + (axis->to - axis->from) * log(value / axis->low) / log(axis->high / axis->low); }

static void print_number(FILE *out, double value)
{
    if (value >= 1e6)
        fprintf(out, "%gM", value / 1e6);
    else if (value >= 1e4)
        fprintf(out, "%gk", value / 1e3);
    else if (value < 0.99e-4)
        fprintf(out, "1e%.0f", log10(value));
    else
        fprintf(out, "%g", value);
}

// Lines and numbers across [begin, end] of the other direction: numbers at every decade, and at 2 and 5 where there are few.
static void draw_axis(FILE *out, const Axis *axis, bool upwards, double begin, double end, const char *name)
{
    int low = (int)lround(log10(axis->low)), high = (int)lround(log10(axis->high));
    for (int decade = low; decade <= high; decade++)
        for (int digit = 1; digit < 10 && (decade < high || digit == 1); digit++) {
            double value = digit * power_of_ten(decade), at = place(axis, value);
            bool labelled = digit == 1 || (high - low <= 2 && (digit == 2 || digit == 5));
            if (digit > 1 && high - low > 4)
                continue;
            if (upwards)
                fprintf(out, "<path class=\"%s\" d=\"M%.1f %.1fH%.1f\"/>", digit == 1 ? "decade" : "grid", begin, at, end);
            else
                fprintf(out, "<path class=\"%s\" d=\"M%.1f %.1fV%.1f\"/>", digit == 1 ? "decade" : "grid", at, begin, end);
            if (!labelled)
                continue;
            fprintf(out, "<text class=\"tick %s\" x=\"%.1f\" y=\"%.1f\">", upwards ? "up" : "along", upwards ? begin - 6 : at, upwards ? at + 4 : end + 16);
            print_number(out, value);
            fprintf(out, "</text>\n");
        }
    double middle = 0.5 * (axis->from + axis->to);
    if (upwards)
        fprintf(out, "<text class=\"axis\" text-anchor=\"middle\" transform=\"translate(%.1f %.1f) rotate(-90)\">%s</text>\n", begin - 46, middle, name);
    else
        fprintf(out, "<text class=\"axis\" text-anchor=\"middle\" x=\"%.1f\" y=\"%.1f\">%s</text>\n", middle, end + 34, name);
}

static void open_panel(const Chart *chart, const char *id, double left, double top, const char *title)
{
    fprintf(chart->out, "<g class=\"panel\" id=\"%s\">\n<text class=\"title\" x=\"%.1f\" y=\"%.1f\">%s</text>\n", id, left, top + 18, title);
}

static void close_panel(const Chart *chart, bool filled, double left, double top)
{
    if (!filled)
        fprintf(chart->out, "<text class=\"axis\" x=\"%.1f\" y=\"%.1f\">not measured</text>\n", left, top + HEAD + 16);
    fprintf(chart->out, "</g>\n");
}

// --- marks ---

static void draw_shape(FILE *out, const char *class, int kind, double x, double y)
{
    fprintf(out, "<path class=\"%s\" transform=\"translate(%.2f %.2f)\" style=\"color:%s\" d=\"%s\"", class, x, y, colour[kind % COLOURS],
            shape[kind % SHAPES]);
}

// What a browser shows under the pointer.
static void draw_mark(const Chart *chart, const char *class, const cJSON *row, double x, double y, double value, const char *unit)
{
    int kind = name_index(&chart->representations, text_at(row, "representation"));
    if (kind < 0)
        return;
    draw_shape(chart->out, class, kind, x, y);
    fprintf(chart->out, "><title>");
    page_text(chart->out, text_at(row, "surface"));
    fprintf(chart->out, ", ");
    page_text(chart->out, text_at(row, "representation"));
    if (number_at(row, "triangles") > 0)
        fprintf(chart->out, " of %.0f triangles", number_at(row, "triangles"));
    fprintf(chart->out, ": %.6g %s</title></path>\n", value, unit);
}

static double draw_legend(const Chart *chart, double top)
{
    FILE *out = chart->out;
    double x = MARGIN + 8, y = top;
    fprintf(out, "<g id=\"legend\">\n");
    for (int k = 0; k < chart->representations.count + 2; k++) {
        bool known = k < chart->representations.count;
        const char *name = known                               ? chart->representations.name[k]
                           : k == chart->representations.count ? "hollow: the paper's Table 6 (its machine, 2017)"
                                                               : "crossed: the run did not survive";
        double wide = 42 + 7.4 * (double)strlen(name);
        if (x + wide > WIDTH - MARGIN) {
            x = MARGIN + 8;
            y += LEGEND_LINE;
        }
        if (known)
            draw_shape(out, "key", k, x, y - 4);
        else
            draw_shape(out, k == chart->representations.count ? "paper" : "key", 0, x, y - 4);
        fprintf(out, "/>");
        if (k == chart->representations.count + 1)
            fprintf(out, "<path class=\"lost\" d=\"M%.1f %.1fl14 -14m0 14l-14 -14\"/>", x - 7, y + 3);
        fprintf(out, "<text x=\"%.1f\" y=\"%.1f\">", x + 12, y);
        page_text(out, name);
        fprintf(out, "</text>\n");
        x += wide;
    }
    fprintf(out, "</g>\n");
    return y + 12;
}

// --- detection by surface ---

// The paper's time of a row; false if it has none, or a row before has the same (its table knows one kind of mesh and of local models).
static bool paper_us(const Chart *chart, const cJSON *row, double *us)
{
    const cJSON *before;
    *us = 1000 * number_at(row, "paper.ms");
    if (!(*us > 0))
        return false;
    cJSON_ArrayForEach(before, chart->rows)
    {
        if (before == row)
            break;
        if (1000 * number_at(before, "paper.ms") == *us && !strcmp(text_at(before, "surface"), text_at(row, "surface")))
            return false;
    }
    return true;
}

// A cross over the mark of a run that ended badly.
static void draw_lost(FILE *out, const cJSON *row, const char *run, double x, double y)
{
    if (cJSON_IsFalse(cJSON_GetObjectItemCaseSensitive(cJSON_GetObjectItemCaseSensitive(row, run), "survived")))
        fprintf(out, "<path class=\"lost\" d=\"M%.1f %.1fl14 -14m0 14l-14 -14\"/>\n", x - 7, y + 7);
}

static double draw_detection(const Chart *chart, double top)
{
    const cJSON *row;
    FILE *out = chart->out;
    Axis x = {0};
    double us, band = LANE * chart->representations.count + 10, begin = top + HEAD, end = begin + band * chart->surfaces.count;
    open_panel(chart, "detect", MARGIN, top, "Detection: CPU time of 80 points on the same recorded motion");
    cJSON_ArrayForEach(row, chart->rows)
    {
        axis_hold(&x, number_at(row, "motion.us_per_80_points"));
        axis_hold(&x, paper_us(chart, row, &us) ? us : NAN);
    }
    bool filled = axis_close(&x, MARGIN + LABELS, WIDTH - MARGIN - 10);
    if (filled) {
        for (int k = 0; k < chart->surfaces.count; k++) {
            if (k % 2 == 0)
                fprintf(out, "<rect class=\"band\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>", x.from, begin + k * band, x.to - x.from, band);
            fprintf(out, "<text text-anchor=\"end\" x=\"%.1f\" y=\"%.1f\">", x.from - 10, begin + (k + 0.5) * band + 4);
            page_text(out, chart->surfaces.name[k]);
            fprintf(out, "</text>\n");
        }
        draw_axis(out, &x, false, begin, end, "microseconds for 80 points");
        cJSON_ArrayForEach(row, chart->rows)
        {
            int surface = name_index(&chart->surfaces, text_at(row, "surface")), kind = name_index(&chart->representations, text_at(row, "representation"));
            double y = begin + surface * band + 5 + LANE * (kind + 0.5), own = number_at(row, "motion.us_per_80_points");
            if (surface < 0 || kind < 0)
                continue;
            if (paper_us(chart, row, &us))
                draw_mark(chart, "paper", row, place(&x, us), y, us, "us in the paper");
            if (!(own > 0))
                continue;
            draw_mark(chart, "mark", row, place(&x, own), y, own, "us");
            draw_lost(out, row, "loop", place(&x, own), y);
        }
    }
    close_panel(chart, filled, MARGIN, top);
    return (filled ? end + FOOT : begin + 30) + 12;
}

// --- error against time ---

static void draw_error(const Chart *chart, double left, double top, double width)
{
    static const char *const error = "motion.gap_error_um.rms", *const time = "motion.us_per_80_points";
    const cJSON *row;
    Axis x = {0}, y = {0};
    double begin = top + HEAD, end = top + HALF_HEIGHT - FOOT;
    open_panel(chart, "error", left, top, "Error of the gap against the price");
    cJSON_ArrayForEach(row, chart->rows)
    {
        if (number_at(row, time) > 0 && number_at(row, error) > 0) {
            axis_hold(&x, number_at(row, time));
            axis_hold(&y, number_at(row, error));
        }
    }
    bool filled = axis_close(&x, left + 70, left + width) && axis_close(&y, end, begin);
    if (filled) {
        draw_axis(chart->out, &x, false, begin, end, "microseconds for 80 points");
        draw_axis(chart->out, &y, true, x.from, x.to, "micrometres, rms");
        cJSON_ArrayForEach(row, chart->rows)
        {
            if (number_at(row, time) > 0 && number_at(row, error) > 0)
                draw_mark(chart, "mark", row, place(&x, number_at(row, time)), place(&y, number_at(row, error)), number_at(row, error), "um");
        }
    }
    close_panel(chart, filled, left, top);
}

// --- growth ---

typedef struct Curve {
    const cJSON *list;
    const char *group, *is;          // of those whose `group` is `is` …
    const char *also, *too;          // … and whose `also` is `too`
    const char *across, *up, *name;
    int kind;
    bool dashed;
} Curve;

static bool is_on_curve(const Curve *curve, const cJSON *item, double *x, double *y)
{
    *x = number_at(item, curve->across);
    *y = number_at(item, curve->up);
    return !strcmp(text_at(item, curve->group), curve->is) && (!curve->also || !strcmp(text_at(item, curve->also), curve->too)) && *x > 0 && *y > 0;
}

typedef struct Tail {        // where a curve ends, for its name
    double y;
    const Curve *curve;
} Tail;

static int lower_first(const void *a, const void *b)
{
    const Tail *s = a, *t = b;
    return s->y != t->y ? (s->y > t->y) - (s->y < t->y) : (s->curve > t->curve) - (s->curve < t->curve);
}

static void draw_curve(FILE *out, const Curve *curve, const Axis *x, const Axis *y)
{
    const cJSON *item;
    double across, up;
    fprintf(out, "<polyline class=\"curve%s\" style=\"color:%s\" points=\"", curve->dashed ? " dashed" : "", colour[curve->kind % COLOURS]);
    cJSON_ArrayForEach(item, curve->list)
    {
        if (is_on_curve(curve, item, &across, &up))
            fprintf(out, "%.2f,%.2f ", place(x, across), place(y, up));
    }
    fprintf(out, "\"><title>%s</title></polyline>\n", curve->name);
    cJSON_ArrayForEach(item, curve->list)
    {
        if (is_on_curve(curve, item, &across, &up)) {
            draw_shape(out, "dot", curve->kind, place(x, across), place(y, up));
            fprintf(out, "><title>%s, %.0f: %.4g ns</title></path>\n", curve->name, across, up);
        }
    }
}

// The colour and shape that the rows give it.
static int kind_of(const Chart *chart, const char *representation, int otherwise)
{
    int kind = name_index(&chart->representations, representation);
    return kind >= 0 ? kind : otherwise;
}

static void draw_growth(const Chart *chart, double left, double top, double width)
{
    enum { CURVES = 8 };
    const char *surface = text_at(cJSON_GetArrayItem(chart->growth, 0), "surface");
    const cJSON *g = chart->growth, *s = chart->sizes, *item;
    int lim = kind_of(chart, "lim", 0), full = kind_of(chart, "mesh full", 1), warm = kind_of(chart, "mesh warm", 2), cached = kind_of(chart, "mesh cached", 3);
    const Curve curve[CURVES] = {{g, "surface", surface, "search", "full", "triangles", "ns_per_query.spread", "mesh, full, all over", full, true},
                                 {g, "surface", surface, "search", "full", "triangles", "ns_per_query.wire", "mesh, full, wire", full, false},
                                 {g, "surface", surface, "search", "warm", "triangles", "ns_per_query.spread", "mesh, warm, all over", warm, true},
                                 {g, "surface", surface, "search", "warm", "triangles", "ns_per_query.wire", "mesh, warm, wire", warm, false},
                                 {g, "surface", surface, "search", "cached", "triangles", "ns_per_query.spread", "mesh, cached, all over", cached, true},
                                 {g, "surface", surface, "search", "cached", "triangles", "ns_per_query.wire", "mesh, cached, wire", cached, false},
                                 {s, "field", "blend", NULL, NULL, "nodes", "ns_cold", "LIM, far apart", lim, true},
                                 {s, "field", "blend", NULL, NULL, "nodes", "ns_warm", "LIM, wire", lim, false}};
    Axis x = {0}, y = {0};
    Tail tail[CURVES];
    int tails = 0;
    double begin = top + HEAD, end = top + HALF_HEIGHT - FOOT, across, up, labels = 166;
    open_panel(chart, "growth", left, top, "Growth of the model: time of one query");
    for (int k = 0; k < CURVES; k++)
        cJSON_ArrayForEach(item, curve[k].list)
        {
            if (is_on_curve(&curve[k], item, &across, &up)) {
                axis_hold(&x, across);
                axis_hold(&y, up);
            }
        }
    bool filled = axis_close(&x, left + 70, left + width - labels) && axis_close(&y, end, begin);
    if (filled) {
        draw_axis(chart->out, &x, false, begin, end, "triangles of the mesh, or nodes of the tree");
        draw_axis(chart->out, &y, true, x.from, x.to, "nanoseconds a query");
        for (int k = 0; k < CURVES; k++) {
            double last = NAN;
            cJSON_ArrayForEach(item, curve[k].list)
            {
                if (is_on_curve(&curve[k], item, &across, &up))
                    last = place(&y, up);
            }
            if (isnan(last))
                continue;
            draw_curve(chart->out, &curve[k], &x, &y);
            tail[tails++] = (Tail){last, &curve[k]};
        }
        // names at the right, in the order of the curves' ends, none on another
        qsort(tail, (size_t)tails, sizeof *tail, lower_first);
        double room = 16, at = begin;
        for (int k = 0; k < tails; k++) {
            at = fmax(at, fmin(tail[k].y, end - room * (tails - 1 - k)));
            const Curve *c = tail[k].curve;
            fprintf(chart->out, "<g style=\"color:%s\"><path class=\"curve%s\" d=\"M%.1f %.1fh18\"/><text class=\"tail\" x=\"%.1f\" y=\"%.1f\">%s</text></g>\n",
                    colour[c->kind % COLOURS], c->dashed ? " dashed" : "", x.to + 6, at, x.to + 28, at + 4, c->name);
            at += room;
        }
    }
    close_panel(chart, filled, left, top);
}

// --- friction and work lost: a line for each representation, a mark for each surface ---

static double list_height(const Chart *chart) { return HEAD + 22.0 * chart->representations.count + FOOT; }

static void draw_list(const Chart *chart, const char *id, const char *title, const char *keys, const char *name, const char *unit, double left, double top,
                      double width)
{
    const cJSON *row;
    Axis x = {0};
    double begin = top + HEAD, end = top + list_height(chart) - FOOT;
    open_panel(chart, id, left, top, title);
    cJSON_ArrayForEach(row, chart->rows) axis_hold(&x, fabs(number_at(row, keys)));
    x.low = fmax(x.low, 1e-9 * x.high);   // smaller values are not drawn
    bool filled = axis_close(&x, left + 150, left + width - 10);
    if (filled) {
        for (int k = 0; k < chart->representations.count; k++) {
            double y = begin + 22 * (k + 0.5);
            if (k % 2 == 0)
                fprintf(chart->out, "<rect class=\"band\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"22\"/>", x.from, y - 11, x.to - x.from);
            fprintf(chart->out, "<text text-anchor=\"end\" x=\"%.1f\" y=\"%.1f\">", x.from - 10, y + 4);
            page_text(chart->out, chart->representations.name[k]);
            fprintf(chart->out, "</text>\n");
        }
        draw_axis(chart->out, &x, false, begin, end, name);
        cJSON_ArrayForEach(row, chart->rows)
        {
            double value = number_at(row, keys);
            int kind = name_index(&chart->representations, text_at(row, "representation"));
            if (kind < 0 || !(fabs(value) >= x.low))
                continue;
            draw_mark(chart, "mark", row, place(&x, fabs(value)), begin + 22 * (kind + 0.5), value, unit);
            draw_lost(chart->out, row, "frictionless", place(&x, fabs(value)), begin + 22 * (kind + 0.5));
        }
    }
    close_panel(chart, filled, left, top);
}

// --- the chart ---

static bool draw(const Chart *chart)
{
    static const char style[] =
        "text{font:13px system-ui,sans-serif;fill:#1a1d21}.title{font-size:16px;font-weight:600}.tick,.axis{fill:#545b64;font-size:12px}"
        ".tick.up{text-anchor:end}.tick.along{text-anchor:middle}.grid{stroke:#eceff2;fill:none}.decade{stroke:#b9c0c9;fill:none}.band{fill:#f4f6f8}"
        ".mark,.key,.dot{fill:currentColor;stroke:#fff;stroke-width:.8}.paper{fill:none;stroke:currentColor;stroke-width:2}"
        ".lost{stroke:#1a1d21;stroke-width:1.4;fill:none}.curve{fill:none;stroke:currentColor;stroke-width:2}.dashed{stroke-dasharray:5 4}"
        ".tail{fill:currentColor;font-size:12px}";
    double top = 84, half = 0.5 * (WIDTH - 3 * MARGIN), right = 2 * MARGIN + half;
    // the picture's height is known once all is drawn: panels come first into a text of their own
    char *body = NULL;
    size_t length = 0;
    Chart panels = *chart;
    panels.out = open_memstream(&body, &length);
    if (!panels.out)
        return false;
    top = draw_legend(&panels, top);
    top = draw_detection(&panels, top + 8);
    draw_error(&panels, MARGIN, top, half);
    draw_growth(&panels, right, top, half);
    top += HALF_HEIGHT + 12;
    draw_list(&panels, "friction", "Artificial friction with mu = 0", "frictionless.artificial_mu", "equivalent coefficient of friction", "", MARGIN, top,
              half);
    draw_list(&panels, "work", "Work lost along the wall with mu = 0", "frictionless.work_lost_n", "mJ a millimetre of slide (N)", "N", right, top, half);
    top += list_height(chart) + 8;
    if (fclose(panels.out) != 0 || !body) {
        free(body);
        return false;
    }
    fprintf(chart->out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-labelledby=\"chart-title chart-text\" viewBox=\"0 0 %d %.0f\" width=\"%d\" "
            "height=\"%.0f\">\n<title id=\"chart-title\">Collision: local blobby models against meshes, grids and the exact wall</title>\n"
            "<desc id=\"chart-text\">Detection time by surface, error against time, growth with the model, artificial friction and work lost; logarithmic "
            "axes.</desc>\n<style>%s</style>\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n"
            "<text x=\"%d\" y=\"34\" style=\"font-size:20px;font-weight:600\">Collision with the wall of a vessel, by representation</text>\n"
            "<text class=\"axis\" x=\"%d\" y=\"56\">seldinger bench collision; one run, CPU time of one core</text>\n%s</svg>\n",
            WIDTH, top, WIDTH, top, style, MARGIN, MARGIN, body);
    free(body);
    return true;
}

bool collision_chart(const cJSON *root, const char *path, Faults *faults)
{
    char *text = NULL;
    size_t length = 0;
    const cJSON *row;
    Chart chart = {.out = open_memstream(&text, &length),
                   .rows = cJSON_GetObjectItemCaseSensitive(root, "rows"),
                   .growth = cJSON_GetObjectItemCaseSensitive(root, "growth"),
                   .sizes = cJSON_GetObjectItemCaseSensitive(root, "sizes")};
    if (!chart.out) {
        faults_add(faults, path, 0, 0, "not enough memory for the chart");
        return false;
    }
    cJSON_ArrayForEach(row, chart.rows)
    {
        add_name(&chart.surfaces, cJSON_GetObjectItemCaseSensitive(row, "surface"));
        add_name(&chart.representations, cJSON_GetObjectItemCaseSensitive(row, "representation"));
    }
    bool drawn = draw(&chart), whole = fclose(chart.out) == 0 && text && drawn;
    if (!whole)
        faults_add(faults, path, 0, 0, "not enough memory for the chart");
    bool written = whole && output_write(path, text, length, faults);
    free(text);
    return written;
}
