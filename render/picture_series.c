// Time series, one panel above the other on one time axis. Where several samples fall on a pixel column, their least and greatest are drawn, so
// that no spike is lost.
#include "render/message.h"
#include "render/picture_page.h"
#include "render/tick_step.h"

#include <stdlib.h>

static const int LINE_COLOR[6] = {6, 4, 2, 5, 0, 1};   // of the qualitative map: the ones that stand out on white

typedef struct Chart {
    double x, y, width, height;   // of the plotting area
    double t0, t1, low, high;     // its range; log10 if logarithmic
    bool logarithmic;
} Chart;

static double mapped(const Chart *chart, double v)
{
    if (chart->logarithmic)
        v = v > 0 ? log10(v) : NAN;
    return isfinite(v) ? v : NAN;
}

static void find_range(Chart *chart, int count, const PicturePanel *panel)
{
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k < panel->line_count; k++)
        for (int i = 0; i < count; i++) {
            double v = mapped(chart, panel->line[k].value[i]);
            if (!isnan(v)) {
                low = fmin(low, v);
                high = fmax(high, v);
            }
        }
    if (!(low <= high))
        low = 0, high = 1;
    if (!chart->logarithmic) {   // zero belongs to the picture where it is near
        if (low > 0 && low < 0.5 * high)
            low = 0;
        if (high < 0 && high > 0.5 * low)
            high = 0;
    }
    double room = high > low ? 0.06 * (high - low) : fmax(0.1 * fabs(high), 1e-3);
    chart->low = low == 0 ? 0 : low - room;
    chart->high = high == 0 && low < 0 ? 0 : high + room;     // all zeros need a range too
}

// Cut at sharp turns: ImGui's mitred joints tear there, as noisy data shows.
static void stroke(PicturePage *page, int count, const float (*point)[2], Color color)
{
    int first = 0;
    for (int i = 1; i < count; i++) {
        bool is_sharp = i + 1 == count;
        if (!is_sharp) {
            double ax = point[i][0] - point[i - 1][0], ay = point[i][1] - point[i - 1][1];
            double bx = point[i + 1][0] - point[i][0], by = point[i + 1][1] - point[i][1];
            is_sharp = ax * bx + ay * by < 0.5 * hypot(ax, ay) * hypot(bx, by);
        }
        if (is_sharp) {
            overlay_polyline(page->overlay, i + 1 - first, point + first, color, 1.6 * page->scale);
            first = i;
        }
    }
}

static void draw_line(PicturePage *page, const Chart *chart, int count, const double *time, const double *value, Color color, float (*point)[2])
{
    double sx = chart->width / (chart->t1 - chart->t0), sy = chart->height / (chart->high - chart->low);
    int n = 0;
    for (int i = 0; i < count;) {
        double v = mapped(chart, value[i]);
        if (isnan(v)) {
            stroke(page, n, (const float(*)[2])point, color);
            n = 0;
            i++;
            continue;
        }
        // all samples of this pixel column
        int column = (int)(sx * (time[i] - chart->t0)), first = i;
        double least = v, greatest = v, last = v;
        bool least_first = true;
        while (++i < count && (int)(sx * (time[i] - chart->t0)) == column) {
            double w = mapped(chart, value[i]);
            if (isnan(w))
                break;
            if (w < least)
                least = w, least_first = false;
            if (w > greatest)
                greatest = w, least_first = true;
            last = w;
        }
        double x = chart->x + sx * (time[first] - chart->t0);
        const double way[4] = {v, least_first ? least : greatest, least_first ? greatest : least, last};
        for (int k = 0; k < (i - first > 1 ? 4 : 1); k++) {
            if (k > 0 && way[k] == way[k - 1])
                continue;
            point[n][0] = (float)x;
            point[n++][1] = (float)(chart->y + chart->height - sy * (way[k] - chart->low));
        }
    }
    stroke(page, n, (const float(*)[2])point, color);
}

static void draw_level(PicturePage *page, const Chart *chart, double level, const char *text, bool is_zero)
{
    double s = page->scale, y = chart->y + chart->height * (1 - (level - chart->low) / (chart->high - chart->low)), height;
    if (y < chart->y - 1e-6 || y > chart->y + chart->height + 1e-6)
        return;
    overlay_line(page->overlay, chart->x, y, chart->x + chart->width, y, is_zero ? PAGE_MUTED : PAGE_FAINT, s);
    overlay_text_size(page->overlay, TEXT_SMALL, text, NULL, &height);
    picture_page_text_anchored(page, chart->x - 7 * s, y - height / 2, 1, TEXT_SMALL, PAGE_INK, text);
}

static void draw_grid(PicturePage *page, const Chart *chart, bool is_last)
{
    double s = page->scale;
    overlay_fill(page->overlay, chart->x, chart->y, chart->width, chart->height, PAGE_PANEL);
    char text[48];
    double step = tick_step(chart->high - chart->low, chart->height > 150 * s ? 6 : 4);
    if (chart->logarithmic) {
        // whole decades, and 2 and 5 between them where there is room
        static const double part[3] = {1, 2, 5};
        double decades = chart->high - chart->low;
        int parts = decades < 2.5 ? 3 : 1;
        step = fmax(1, ceil(decades / 6));
        for (double k = floor(chart->low / step); k * step <= chart->high; k++)
            for (int j = 0; j < parts; j++) {
                double value = part[j] * pow(10, k * step);
                snprintf(text, sizeof text, "%g", value);
                draw_level(page, chart, log10(value), text, false);
            }
    }
    for (double k = ceil(chart->low / step - 1e-9); !chart->logarithmic && k * step <= chart->high + 1e-9 * step; k++) {
        tick_format(text, sizeof text, k * step, step);
        draw_level(page, chart, k * step, text, k == 0);
    }
    step = tick_step(chart->t1 - chart->t0, 10);
    for (double k = ceil(chart->t0 / step - 1e-9); k * step <= chart->t1 + 1e-9 * step; k++) {
        double x = chart->x + chart->width * (k * step - chart->t0) / (chart->t1 - chart->t0);
        overlay_line(page->overlay, x, chart->y, x, chart->y + chart->height, PAGE_FAINT, s);
        tick_format(text, sizeof text, k * step, step);
        if (is_last)
            picture_page_text_anchored(page, x, chart->y + chart->height + 5 * s, 0.5, TEXT_SMALL, PAGE_INK, text);
    }
    if (is_last)
        picture_page_text_anchored(page, chart->x + chart->width / 2, chart->y + chart->height + 23 * s, 0.5, TEXT_SMALL, PAGE_INK, "time [s]");
}

static void draw_panel(PicturePage *page, Chart *chart, int count, const double *time, const PicturePanel *panel, bool is_last, float (*point)[2])
{
    double s = page->scale;
    find_range(chart, count, panel);
    draw_grid(page, chart, is_last);
    double key = chart->x + chart->width;
    picture_page_text(page, chart->x, chart->y - 22 * s, TEXT_NORMAL, PAGE_INK, "%s", panel->title ? panel->title : "");
    overlay_push_clip(page->overlay, chart->x, chart->y - 1, chart->width + 1, chart->height + 2);
    for (int k = 0; k < panel->line_count; k++)
        draw_line(page, chart, count, time, panel->line[k].value, color_qualitative(LINE_COLOR[k % 6]), point);
    overlay_pop_clip(page->overlay);
    for (int k = panel->line_count - 1; k >= 0; k--)
        if (panel->line[k].label) {
            Color color = color_qualitative(LINE_COLOR[k % 6]);
            key -= picture_page_text_anchored(page, key, chart->y - 20 * s, 1, TEXT_SMALL, PAGE_INK, panel->line[k].label) + 6 * s;
            overlay_fill(page->overlay, key - 18 * s, chart->y - 13 * s, 18 * s, 3 * s, color);
            key -= 36 * s;
        }
}

static const double LEAST_SPAN = 1e-3;   // [s] of the time axis, also of a single sample

bool picture_of_series(const char *path, const PictureOptions *options, int count, const double *time_s, int panel_count, const PicturePanel *panel,
                       int event_count, const PictureEvent *event, char *message, size_t capacity)
{
    if (count < 2 || panel_count < 1 || panel_count > 12)
        return message_fail(message, capacity, "a chart of %d samples in %d panels; expected at least 2 samples in 1 to 12 panels", count, panel_count);
    for (int i = 0; i < count; i++)
        if (!isfinite(time_s[i]) || (i > 0 && time_s[i] < time_s[i - 1]))
            return message_fail(message, capacity, "time %d of a chart is not a number or goes backwards: nothing is drawn", i);
    PicturePage page;
    if (!picture_page_open(&page, options, options->height, message, capacity))
        return false;
    double s = page.scale, top = options->title || event_count > 0 ? 54 * s : 10 * s, left = 84 * s, head = 32 * s, foot = 48 * s;
    double each = (page.height - top - foot) / panel_count;
    bool drawn = true;
    // four points a sample at most
    float(*point)[2] = malloc((4 * (size_t)count + 4) * sizeof *point);
    if (!point)
        drawn = message_fail(message, capacity, "not enough memory for a chart of %d samples", count);
    Chart chart = {
        .x = left, .width = page.width - left - 24 * s, .height = each - head, .t0 = time_s[0], .t1 = fmax(time_s[count - 1], time_s[0] + LEAST_SPAN)};
    if (!(chart.t1 > chart.t0))
        chart.t1 = chart.t0 + 1;
    for (int k = 0; drawn && k < panel_count; k++) {
        chart.y = top + k * each + head;
        chart.logarithmic = panel[k].logarithmic;
        draw_panel(&page, &chart, count, time_s, &panel[k], k + 1 == panel_count, point);
    }
    for (int i = 0; drawn && i < event_count; i++) {
        double x = chart.x + chart.width * (event[i].time_s - chart.t0) / (chart.t1 - chart.t0);
        if (!(x >= chart.x && x <= chart.x + chart.width))
            continue;
        overlay_line(page.overlay, x, top + head - 4 * s, x, page.height - foot, PAGE_MUTED, 1.2 * s);
        if (event[i].label)
            picture_page_label(&page, x, top - 12 * s, 0.5, TEXT_SMALL, PAGE_MUTED, event[i].label);
    }
    if (drawn)
        picture_page_title(&page, 20 * s, 12 * s, page.width - 40 * s, options->title);
    drawn = drawn && picture_page_save(&page, path);
    free(point);
    picture_page_close(&page);
    return drawn;
}
