#include "render/plot.h"

#include "render/tick_step.h"

#include <math.h>
#include <stdio.h>

void plot_clear(RunningPlot *plot) { *plot = (RunningPlot){.value = NAN}; }

static int place(int64_t bin) { return (int)((bin % PLOT_BINS + PLOT_BINS) % PLOT_BINS); }

void plot_add(RunningPlot *plot, double time_s, double value)
{
    if (!isfinite(time_s) || !isfinite(value) || fabs(time_s) > 1e12)
        return;
    int64_t bin = (int64_t)floor(time_s * (PLOT_BINS / PLOT_SPAN_S));
    if (plot->count > 0 && (time_s < plot->time_s || bin - plot->last >= PLOT_BINS))
        plot_clear(plot);
    for (int64_t b = plot->count > 0 ? plot->last + 1 : bin; b <= bin; b++) {
        plot->least[place(b)] = plot->most[place(b)] = NAN;
        plot->count += plot->count < PLOT_BINS;
    }
    plot->last = bin;
    plot->time_s = time_s;
    plot->value = value;
    float *least = &plot->least[place(bin)], *most = &plot->most[place(bin)];
    *least = fminf(*least, (float)value);   // NaN is replaced
    *most = fmaxf(*most, (float)value);
}

bool plot_range(const RunningPlot *plot, double *least, double *most)
{
    bool is_found = false;
    for (int i = 0; i < plot->count; i++) {
        int at = place(plot->last - i);
        if (isnan(plot->most[at]))
            continue;
        *least = is_found ? fmin(*least, plot->least[at]) : plot->least[at];
        *most = is_found ? fmax(*most, plot->most[at]) : plot->most[at];
        is_found = true;
    }
    return is_found;
}

static void draw_ticks(Gui *gui, GuiRect at, double low, double high, double step, float label_right)
{
    float zero = at.y + at.height * (float)(high / (high - low)), last = INFINITY;
    for (double value = ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) {
        float y = floorf(at.y + at.height * (float)((high - value) / (high - low)));
        bool is_zero = fabs(value) < 1e-9 * step;
        gui_draw_fill(gui, (GuiRect){at.x, y, at.width, 1}, is_zero ? gui_colors.dim : gui_colors.line);
        char text[32];
        float width, height;
        tick_format(text, sizeof text, value, step);
        gui_text_extent(gui, GUI_SMALL, text, &width, &height);
        float top = fminf(fmaxf(y - height / 2, at.y - height / 3), at.y + at.height - 2 * height / 3);
        // numbers that would touch the one below, or the zero's, are left out
        if (!is_zero && (last - top < 0.9f * height || (top < zero && zero - top < 1.2f * height)))
            continue;
        last = top;
        gui_draw_text(gui, label_right - width, top, GUI_SMALL, gui_colors.dim, text);
    }
}

// One bar a bin, from least to most and on to the bin before: a line without joints, cheap in triangles.
static void draw_line(const RunningPlot *plot, Gui *gui, GuiRect at, double low, double high)
{
    float thick = fmaxf(1.5f, floorf(1.6f * gui_scale(gui))), scale = at.height / (float)(high - low), before = NAN;
    for (int i = plot->count - 1; i >= 0; i--) {
        int from = place(plot->last - i);
        bool is_empty = isnan(plot->most[from]);   // after a late frame the previous value is kept
        float least = is_empty ? before : plot->least[from], most = is_empty ? before : plot->most[from];
        if (isnan(most))
            continue;
        float middle = (least + most) / 2;
        if (before < least)   // NaN: neither
            least = before;
        if (before > most)
            most = before;
        before = middle;
        float left = at.x + at.width * (float)(PLOT_BINS - 1 - i) / PLOT_BINS, right = at.x + at.width * (float)(PLOT_BINS - i) / PLOT_BINS;
        float top = at.y + ((float)high - most) * scale, bottom = at.y + ((float)high - least) * scale;
        gui_draw_fill(gui, (GuiRect){left, top - thick / 2, right - left, bottom - top + thick}, gui_colors.accent);
    }
}

void plot_draw(const RunningPlot *plot, Gui *gui, const char *title, const char *unit, int decimals, double least_span, float height)
{
    GuiRect all = gui_place(gui, 0, height);
    float line = gui_line_height(gui, GUI_NORMAL), gap = floorf(3 * gui_scale(gui));
    char text[64];
    float width, text_height;
    gui_draw_text(gui, all.x, all.y, GUI_NORMAL, gui_colors.dim, title);
    if (plot->count > 0)
        snprintf(text, sizeof text, "%.*f %s", decimals, fabs(plot->value) < 0.5 * pow(10, -decimals) ? 0.0 : plot->value, unit);
    else
        snprintf(text, sizeof text, "\u2013 %s", unit);
    gui_text_extent(gui, GUI_NORMAL, text, &width, &text_height);
    gui_draw_text(gui, all.x + all.width - width, all.y, GUI_NORMAL, gui_colors.text, text);

    double low = 0, high = 0;
    if (!plot_range(plot, &low, &high))
        low = high = 0;
    low = fmin(low, 0);
    high = fmax(high, 0);
    if (high - low < least_span) {
        bool is_below = -low > high;
        *(is_below ? &low : &high) += (is_below ? -1 : 1) * (least_span - (high - low));
    }
    double margin = 0.06 * (high - low);
    low -= low < 0 ? margin : 0;
    high += high > 0 ? margin : 0;
    GuiRect at = {all.x, all.y + line + gap, all.width, all.height - line - gap};
    double step = tick_step(high - low, at.height > 4.5f * line ? 4 : 3);
    // room for the numbers: the widest of the two ends
    float label = 0;
    for (int i = 0; i < 2; i++) {
        tick_format(text, sizeof text, i ? ceil(low / step) * step : floor(high / step) * step, step);
        gui_text_extent(gui, GUI_SMALL, text, &width, &text_height);
        label = fmaxf(label, width);
    }
    at.x += label + gap;
    at.width -= label + gap;
    gui_draw_fill(gui, at, gui_colors.window);
    for (double t = floor(plot->time_s / 5) * 5; plot->count > 0 && t > plot->time_s - PLOT_SPAN_S; t -= 5) {
        float x = at.x + at.width * (float)(1 - (plot->time_s - t) / PLOT_SPAN_S);
        gui_draw_fill(gui, (GuiRect){floorf(x), at.y, 1, at.height}, gui_colors.line);
    }
    draw_ticks(gui, at, low, high, step, at.x - gap);
    draw_line(plot, gui, at, low, high);
}
