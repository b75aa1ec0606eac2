// The tray: devices that may replace the selected tool, with their stress-free shape and stiffness; the tip of a wire is shaped here.
#include "render/panel_tray.h"

#include "render/panel_internal.h"
#include "render/tick_step.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>

static void box(Gui *gui, GuiRect at, const char *title)
{
    float pad = floorf(4 * gui_scale(gui));
    gui_draw_fill(gui, at, gui_colors.window);
    gui_draw_text(gui, at.x + pad, at.y + pad / 2, GUI_SMALL, gui_colors.dim, title);
}

// The distal part of the device at equal scale on both axes, its proximal end at the left, with a scale bar.
static void draw_shape(Gui *gui, GuiRect at, const PanelTrayDevice *device)
{
    box(gui, at, "Unloaded shape of its distal end");
    if (device->point_count < 2)
        return;
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < device->point_count; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], device->point[i][k]);
            high[k] = fmax(high[k], device->point[i][k]);
        }
    float s = gui_scale(gui), margin = floorf(10 * s), head = gui_line_height(gui, GUI_SMALL) + margin / 2;
    double width = at.width - 2 * margin, height = at.height - head - margin;
    double scale = fmin(width / fmax(high[0] - low[0], 1e-6), height / fmax(high[1] - low[1], 1e-6));
    scale = fmin(scale, 24 * s);         // [pixel/mm] upper limit, so that a short straight tip does not fill the box
    double x0 = at.x + margin + (width - scale * (high[0] - low[0])) / 2, y0 = at.y + head + (height + scale * (high[1] - low[1])) / 2;
    for (int i = 1; i < device->point_count; i++) {
        const double *a = device->point[i - 1], *b = device->point[i];
        gui_draw_line(gui, (float)(x0 + scale * (a[0] - low[0])), (float)(y0 - scale * (a[1] - low[1])), (float)(x0 + scale * (b[0] - low[0])),
                      (float)(y0 - scale * (b[1] - low[1])), gui_colors.accent, fmaxf(2, floorf(2 * s)));
    }
    // a bar of 1, 2, 5, 10 … mm, about a fifth of the box
    double bar = round_length(width / 5 / scale);
    char text[32];
    float text_width, text_height, right = at.x + at.width - margin, bottom = at.y + at.height - floorf(5 * s);
    snprintf(text, sizeof text, "%g mm", bar);
    gui_text_extent(gui, GUI_SMALL, text, &text_width, &text_height);
    gui_draw_line(gui, right - (float)(bar * scale), bottom, right, bottom, gui_colors.text, floorf(2 * s));
    gui_draw_text(gui, right - text_width, bottom - text_height - 2, GUI_SMALL, gui_colors.text, text);
}

// Stiffness as steps over the length, the tip at the right; logarithmic, because stiffness spans decades.
static void draw_stiffness(Gui *gui, GuiRect at, const PanelTrayDevice *device)
{
    box(gui, at, "Bending stiffness along the device [N mm\u00b2], the tip at the right");
    int count = device->step_count;
    if (count < 1 || !(device->end_mm[count - 1] > 0))
        return;
    double low = HUGE_VAL, high = 0, total = device->end_mm[count - 1];
    for (int i = 0; i < count; i++) {
        low = fmin(low, device->bending_n_mm2[i]);
        high = fmax(high, device->bending_n_mm2[i]);
    }
    float s = gui_scale(gui), line = gui_line_height(gui, GUI_SMALL), margin = floorf(10 * s), thick = fmaxf(2, floorf(2 * s));
    float top = at.y + 2 * line + margin / 2, bottom = at.y + at.height - margin / 2 - thick;
    double decades = fmax(log10(high / low), 0.3);
    float before = NAN, words_end = -HUGE_VALF;
    double begin = 0;
    for (int i = 0; i < count; i++) {
        float left = at.x + margin + (float)((at.width - 2 * margin) * begin / total),
              right = at.x + margin + (float)((at.width - 2 * margin) * device->end_mm[i] / total);
        float y = bottom - (bottom - top) * (float)((log10(device->bending_n_mm2[i] / low) + (high > low ? 0 : 0.15)) / decades);
        gui_draw_fill(gui, (GuiRect){left, y, fmaxf(right - left, 1), thick}, gui_colors.accent);
        if (!isnan(before))
            gui_draw_fill(gui, (GuiRect){left, fminf(before, y), thick, fabsf(y - before) + thick}, gui_colors.accent);
        // one figure for adjoining stretches of the same stiffness, if there is room
        bool is_new = i == 0 || fabs(device->bending_n_mm2[i] / device->bending_n_mm2[i - 1] - 1) > 0.01;
        char text[24];
        float width, height;
        snprintf(text, sizeof text, "%.3g", device->bending_n_mm2[i]);
        gui_text_extent(gui, GUI_SMALL, text, &width, &height);
        float x = fminf(left + 2 * thick, at.x + at.width - margin / 2 - width);
        if (is_new && x >= words_end + margin / 2) {
            gui_draw_text(gui, x, fmaxf(y - height, at.y + line), GUI_SMALL, gui_colors.text, text);
            words_end = x + width;
        }
        before = y;
        begin = device->end_mm[i];
    }
}

static void draw_list(Panel *panel, const PanelTray *tray)
{
    for (int i = 0; i < tray->device_count; i++) {
        char id[24], name[96];
        const PanelTrayDevice *device = &tray->device[i];
        snprintf(id, sizeof id, "tray%d", i);
        snprintf(name, sizeof name, "%.80s", panel_text(device->name));
        bool is_chosen = i == panel->tray.device;
        if (gui_button(panel->gui, id, name, device->is_in ? "in" : "", 0, is_chosen).pressed)
            panel_move_in_tray(panel, i - panel->tray.device);
        if (is_chosen && panel->tray_shown != i) {
            gui_scroll_here(panel->gui);
            panel->tray_shown = i;
        }
    }
}

static const struct {
    const char *id, *format, *tip;
    float least, most, step;
} slider[] = {{"tip length", N_("bend %.0f mm long"), "from the tip back to the start of the bend; keys: Page down, Page up", 1, 80, 1},
              {"tip angle", N_("keeps %.0f\u00b0"), "the remaining angle after springback of the core; keys: Left, Right", 5, 330, 5},
              {"tip mandrel", N_("mandrel R %.1f mm"), "radius of the mandrel for bending the tip: the thinner, the tighter the final bend; keys: Home, End",
               0.3f, 10, 0.1f}};

static void draw_sliders(Panel *panel)
{
    Gui *gui = panel->gui;
    float gap = floorf(4 * gui_scale(gui)), width = floorf((gui_width(gui) - 2 * gap) / 3);
    for (int i = 0; i < 3; i++) {
        if (i > 0)
            gui_beside(gui, gap);
        panel->tray.is_shaped |= gui_slider(gui, slider[i].id, &panel->tray_value[i], slider[i].least, slider[i].most, slider[i].format, width);
        gui_tooltip(gui, NULL, slider[i].tip, NULL);
    }
}

static void draw_device(Panel *panel, const PanelTray *tray, GuiRect at)
{
    Gui *gui = panel->gui;
    const PanelTrayDevice *chosen = &tray->device[panel->tray.device], *shown = panel->tray.is_shaped && tray->shaped ? tray->shaped : chosen;
    float s = gui_scale(gui), gap = floorf(6 * s), button = floorf(26 * s), line = gui_line_height(gui, GUI_NORMAL) + 3 * s;
    const char *note = panel_text(shown->note)[0] ? shown->note : panel_text(tray->note);
    float note_height = note[0] ? gui_wrapped_height(gui, GUI_NORMAL, note, at.width - 24 * s) + gap : 0;
    bool has_remark = chosen->can_be_shaped || panel_text(shown->remark)[0];
    float room = at.height - 2 * line - note_height - (has_remark ? line : 0) - button - (chosen->can_be_shaped ? 2 * button : 0) - 5 * gap - 12 * s;
    gui_text(gui, GUI_LARGE, gui_colors.text, panel_text(shown->name));
    gui_text(gui, GUI_NORMAL, gui_colors.dim, panel_text(shown->what));
    draw_shape(gui, gui_place(gui, 0, floorf(fmaxf(room * 0.58f, 60 * s))), shown);
    draw_stiffness(gui, gui_place(gui, 0, floorf(fmaxf(room * 0.42f - gap, 44 * s))), shown);
    if (chosen->can_be_shaped) {
        if (gui_button(gui, "shape tip", "Shape its tip by hand", "S", 0, panel->tray.is_shaped).pressed)
            panel->tray.is_shaped = !panel->tray.is_shaped;
        draw_sliders(panel);
    }
    if (has_remark)
        gui_text(gui, GUI_NORMAL, gui_colors.dim, panel_text(shown->remark)[0] ? shown->remark : " ");
    if (note[0])
        gui_text_wrapped(gui, GUI_NORMAL, shown->is_in ? gui_colors.dim : gui_colors.warning, note);
    float half = floorf((gui_width(gui) - gap) / 2);
    if (gui_button(gui, "put in", panel->tray.is_shaped ? "Shape and insert" : "Insert", "Enter", half, false).pressed)
        panel->answer = 1;
    gui_beside(gui, gap);
    if (gui_button(gui, "close tray", "Close", "Esc", half, false).pressed)
        panel->answer = -1;
}

void panel_draw_tray(Panel *panel, const WindowInput *input, const PanelState *state)
{
    const PanelTray *tray = state->tray;
    if (!tray || tray->device_count < 1)
        return;
    panel->tray_count = tray->device_count;
    panel_move_in_tray(panel, 0);
    panel->tray.is_shaped &= tray->device[panel->tray.device].can_be_shaped;
    Gui *gui = panel->gui;
    char title[80];
    float s = gui_scale(gui), width = floorf(fminf(880 * s, (float)input->width - 24 * s)), height = floorf(fminf(520 * s, (float)input->height - 24 * s));
    float head = floorf(38 * s), list = floorf(fminf(300 * s, width * 0.4f));
    GuiRect at = {floorf(((float)input->width - width) / 2), floorf(((float)input->height - height) / 2), width, height};
    snprintf(title, sizeof title, "Tray: %.60s", panel_text(tray->tool));
    gui_window_begin(gui, "tray", at, GUI_ON_TOP | GUI_FRAMED);
    gui_text(gui, GUI_LARGE, gui_colors.text, title);
    gui_window_end(gui);
    GuiRect left = {at.x + 1, at.y + head, list, height - head - 1}, right = {at.x + list + 1, at.y + head, width - list - 2, height - head - 1};
    gui_window_begin(gui, "tray list", left, GUI_ON_TOP);
    draw_list(panel, tray);
    gui_window_end(gui);
    gui_window_begin(gui, "tray device", right, GUI_ON_TOP);
    draw_device(panel, tray, right);
    panel->tray_over = gui_window_end(gui);
}

void panel_shape_in_tray(Panel *panel, int i, int steps)
{
    panel->tray_value[i] = fminf(slider[i].most, fmaxf(slider[i].least, panel->tray_value[i] + slider[i].step * (float)steps));
}

void panel_move_in_tray(Panel *panel, int devices)
{
    int wanted = panel->tray.device + devices, last = panel->tray_count - 1;
    panel->tray.device = wanted < 0 ? 0 : wanted > last ? last : wanted;
    panel->tray.is_shaped &= devices == 0;
}
