// Text over the views: mode and angles of the image as in an angio suite, warnings, names of the views.
#include "render/panel_internal.h"

#include "render/vessel_scene.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>

enum { LABELS_PLACED = 32 };   // labels placed without overlap; further ones may overlap

// "LAO 30  CRA 10": rounded first, so that there is no "RAO 0".
static const char *angles(char *text, size_t capacity, const XrayControl *xray)
{
    int lao = (int)lround(xray->lao_deg), cra = (int)lround(xray->cra_deg);
    if (lao == 0 && cra == 0)
        snprintf(text, capacity, "AP 0");
    else
        snprintf(text, capacity, "%s %d  %s %d", lao < 0 ? "RAO" : "LAO", lao < 0 ? -lao : lao, cra < 0 ? "CAU" : "CRA", cra < 0 ? -cra : cra);
    return text;
}

// Text readable on light and dark pictures.
static void label(Panel *panel, float x, float y, GuiFont font, Color color, const char *text)
{
    Gui *gui = panel->gui;
    float width, height, pad = floorf(4 * gui_scale(gui));
    gui_text_extent(gui, font, text, &width, &height);
    gui_draw_fill(gui, (GuiRect){x - pad, y - pad / 2, width + 2 * pad, height + pad}, color_with_alpha(gui_colors.window, 0.6));
    gui_draw_text(gui, x, y, font, color, text);
}

static void label_right(Panel *panel, float right, float y, GuiFont font, Color color, const char *text)
{
    float width, height;
    gui_text_extent(panel->gui, font, text, &width, &height);
    label(panel, right - width, y, font, color, text);
}

// Above `y`, from below: what a dose display shows (IEC 60601-2-43); of two planes the sum, and below it each plane's part.
static void draw_dose(Panel *panel, const PanelState *state, float right, float y, float line)
{
    char text[64];
    if (!(state->tube_kv > 0))
        return;
    if (state->second_kerma_mgy > 0) {
        const double kerma = state->second_kerma_mgy, area = state->second_kerma_area_gy_cm2;
        snprintf(text, sizeof text, tr("A %.2f  B %.2f Gy cm\u00b2"), state->kerma_area_gy_cm2 - area, area);
        label_right(panel, right, y, GUI_NORMAL, gui_colors.text, text);
        snprintf(text, sizeof text, tr("A %.1f  B %.1f mGy"), state->kerma_mgy - kerma, kerma);
        label_right(panel, right, y - line, GUI_NORMAL, gui_colors.text, text);
        y -= 2 * line;
    }
    snprintf(text, sizeof text, tr("DAP %.2f Gy cm\u00b2"), state->kerma_area_gy_cm2);
    label_right(panel, right, y, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, tr("air kerma %.1f mGy"), state->kerma_mgy);
    label_right(panel, right, y - line, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, tr("%.1f mGy/min"), state->kerma_rate_mgy_min);
    label_right(panel, right, y - 2 * line, GUI_NORMAL, gui_colors.text, text);
    if (state->second_kv > 0) {
        snprintf(text, sizeof text, "B %.0f kV  %.0f mA", state->second_kv, state->second_ma);
        label_right(panel, right, y - 3 * line, GUI_NORMAL, gui_colors.text, text);
        y -= line;
    }
    snprintf(text, sizeof text, "%s%.0f kV  %.0f mA", state->second_kv > 0 ? "A " : "", state->tube_kv, state->tube_ma);
    label_right(panel, right, y - 3 * line, GUI_NORMAL, gui_colors.text, text);
}

// Returns the y below the labels at the upper left.
static float draw_fluoroscopy_labels(Panel *panel, const PanelState *state, GuiRect at, bool is_main)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), pad = floorf(10 * s), normal = gui_line_height(gui, GUI_NORMAL) + floorf(5 * s);
    GuiFont large = is_main ? GUI_HUGE : GUI_NORMAL;
    char text[64], time[32];
    label(panel, at.x + pad, at.y + at.height - pad - gui_line_height(gui, large), large, gui_colors.text, angles(text, sizeof text, &state->xray));
    if (!is_main)
        return at.y;
    float right = at.x + at.width - pad, y = at.y + at.height - pad - normal;
    snprintf(text, sizeof text, tr("contrast %.1f ml"), isfinite(state->contrast_ml) ? state->contrast_ml : 0);
    label_right(panel, right, y, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, tr("fluoroscopy %s"), panel_minutes(time, sizeof time, state->fluoro_s));
    label_right(panel, right, y - normal, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, tr("%g pulses/s"), (double)state->xray.pulses_s);
    label_right(panel, right, y - 2 * normal, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, tr("field %.0f mm"), (double)state->xray.field_mm);
    label_right(panel, right, y - 3 * normal, GUI_NORMAL, gui_colors.text, text);
    draw_dose(panel, state, right, y - 4 * normal, normal);
    label(panel, at.x + pad, at.y + pad / 2, GUI_LARGE, gui_colors.text, panel_mode_name[state->mode]);
    y = at.y + pad / 2 + gui_line_height(gui, GUI_LARGE) + floorf(6 * s);
    if (state->mode == PANEL_CINE) {
        snprintf(text, sizeof text, tr("frame %d of %d"), state->cine_frame + 1, state->cine_frames);
        label(panel, at.x + pad, y, GUI_NORMAL, gui_colors.text, text);
        y += normal;
    }
    if (state->xray.pedal > 0) {
        label(panel, at.x + pad, y, GUI_NORMAL, gui_colors.warning, "\u25cf X-RAY ON");
        y += normal;
    }
    if (state->is_recording_cine) {
        label(panel, at.x + pad, y, GUI_NORMAL, gui_colors.bad, "\u25a0 recording cine");
        y += normal;
    }
    if ((state->mode == PANEL_DSA || state->mode == PANEL_ROADMAP) && !state->is_roadmap_ready) {
        label(panel, at.x + pad, y, GUI_NORMAL, gui_colors.warning, "\u25b2 no mask yet: take one with the X-ray on");
        y += normal;
    }
    return y;
}

// Text in a box, centred in the view; returns the box.
static GuiRect banner(Panel *panel, GuiRect at, float y, Color ground, const char *text)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), pad = floorf(8 * s), room = at.width - 4 * pad, width, height;
    gui_text_extent(gui, GUI_NORMAL, text, &width, &height);
    width = fminf(width + 1, room);
    height = gui_wrapped_height(gui, GUI_NORMAL, text, width);
    GuiRect box = {floorf(at.x + (at.width - width) / 2 - pad), y, width + 2 * pad, height + pad};
    gui_draw_fill(gui, box, ground);
    gui_draw_wrapped(gui, box.x + pad, y + pad / 2, GUI_NORMAL, gui_colors.window, text, width);
    return box;
}

static void draw_banners(Panel *panel, const PanelState *state, GuiRect at, float y)
{
    static const struct {
        unsigned bit;
        const char *text;
    } warning[] = {{WARN_OUTSIDE, "The tool is outside the vessel: forces are not valid"},
                   {WARN_STALLED, "The simulation has stopped"},
                   {WARN_DEVICE_LOST, "A device is lost: the tool does not move until it is connected again"},
                   {WARN_NOT_CONVERGED, "Contact forces did not converge in the last step"},
                   {WARN_SLOW, "Simulation slower than real time"},
                   {WARN_NO_FIFO, "No real-time priority (SCHED_FIFO): steps may be late"}};
    float gap = floorf(3 * gui_scale(panel->gui));
    char text[300], line[280];
    y = fmaxf(y, at.y + floorf(52 * gui_scale(panel->gui)));
    if (state->is_finished && !panel->is_interactive && panel_first_line(state->instructions, line, sizeof line)) {
        bool is_reached = state->hold_needed_s > 0 && state->hold_s >= state->hold_needed_s;
        snprintf(text, sizeof text, "%s%s", panel_sign[is_reached ? MARK_GOOD : MARK_NONE], line);
        GuiRect box = banner(panel, at, y, gui_colors.accent, text);
        y = box.y + box.height + gap;
    }
    for (size_t i = 0; i < sizeof warning / sizeof warning[0]; i++) {
        if (!(state->warnings & warning[i].bit))
            continue;
        snprintf(text, sizeof text, "%s%s", panel_sign[MARK_WARNING], warning[i].text);
        if (warning[i].bit == WARN_SLOW && isfinite(state->real_time_factor))
            snprintf(text, sizeof text, "%s%s: \u00d7%.2f", panel_sign[MARK_WARNING], warning[i].text, state->real_time_factor);
        GuiRect box = banner(panel, at, y, gui_colors.warning, text);
        y = box.y + box.height + gap;
    }
    if (panel_text(state->warning)[0]) {
        snprintf(text, sizeof text, "%s%s", panel_sign[MARK_WARNING], state->warning);
        banner(panel, at, y, gui_colors.warning, text);
    }
}

// A colour bar for the wall force on the tool, lowest value at the bottom.
static void draw_force_legend(Panel *panel, GuiRect at, double full_scale_n)
{
    enum { STEPS = 32 };
    Gui *gui = panel->gui;
    float s = gui_scale(gui), pad = floorf(10 * s), width = floorf(12 * s), height = floorf(fminf(140 * s, at.height / 3));
    float line = gui_line_height(gui, GUI_SMALL), x = at.x + at.width - pad - width, bottom = at.y + at.height - pad - line;
    char text[32];
    for (int i = 0; i < STEPS; i++) {
        float top = bottom - height * (float)(i + 1) / STEPS;
        gui_draw_fill(gui, (GuiRect){x, top, width, height / STEPS + 1},
                      vessel_scene_force_color(full_scale_n * (i + 0.5) / STEPS, full_scale_n, gui_colors.dim));
    }
    snprintf(text, sizeof text, "%g N", full_scale_n);
    label_right(panel, x - pad / 2, bottom - height, GUI_SMALL, gui_colors.text, text);
    label_right(panel, x - pad / 2, bottom - line, GUI_SMALL, gui_colors.text, "0");
    label_right(panel, at.x + at.width - pad, bottom + floorf(2 * s), GUI_SMALL, gui_colors.dim, "wall force");
}

static bool overlap(GuiRect a, GuiRect b) { return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height; }

GuiRect panel_free_place(GuiRect wanted, const GuiRect *taken, int count)
{
    for (int shift = 0; shift <= 2 * count; shift++) {
        GuiRect place = wanted;
        place.y += wanted.height * (float)(shift % 2 ? -(shift + 1) / 2 : shift / 2);
        bool is_free = true;
        for (int i = 0; i < count; i++)
            is_free &= !overlap(place, taken[i]);
        if (is_free)
            return place;
    }
    return wanted;
}

// A line with an arrowhead from the foremost tip towards the target.
static void draw_way(Panel *panel, const PanelState *state, GuiRect at)
{
    float dx = (float)(state->goal[0] - state->tip[0]), dy = (float)(state->goal[1] - state->tip[1]), length = hypotf(dx, dy);
    float s = gui_scale(panel->gui), head = floorf(6 * s), x = at.x + (float)state->goal[0], y = at.y + (float)state->goal[1];
    if (!state->has_way || length < 2 * head)
        return;
    dx *= head / length;
    dy *= head / length;
    gui_draw_line(panel->gui, at.x + (float)state->tip[0], at.y + (float)state->tip[1], x, y, gui_colors.accent, floorf(s));
    gui_draw_line(panel->gui, x, y, x - dx - dy / 2, y - dy + dx / 2, gui_colors.accent, floorf(2 * s));
    gui_draw_line(panel->gui, x, y, x - dx + dy / 2, y - dy - dx / 2, gui_colors.accent, floorf(2 * s));
}

// The places of consequences: a ring with a word, and in the X-ray image the contrast agent that has leaked.
static void draw_spots(Panel *panel, const PanelState *state, GuiRect at, bool is_xray)
{
    enum { SIDES = 24, BANDS = 48, DISCS = 8 };
    Gui *gui = panel->gui;
    const float s = gui_scale(gui), ring = floorf(9 * s), side = fminf(at.width, at.height);
    for (int i = 0; i < state->spot_count; i++) {
        const PanelSpot *spot = &state->spot[i];
        if (!(is_xray ? spot->is_in_xray : spot->is_in_3d))
            continue;
        const float x = is_xray ? at.x + at.width / 2 + side * (float)spot->xray[0] : at.x + (float)spot->space[0];
        const float y = is_xray ? at.y + at.height / 2 - side * (float)spot->xray[1] : at.y + (float)spot->space[1];
        const float blot = is_xray ? side * (float)spot->blot : 0;
        // as a stack of discs: densest in the middle
        for (int disc = DISCS; blot > 1 && disc >= 1; disc--)
            for (int k = 0; k < BANDS; k++) {
                const float r = blot * (float)disc / DISCS, high = 2 * r / BANDS, v = -r + ((float)k + 0.5F) * high, half = sqrtf(r * r - v * v);
                gui_draw_fill(gui, (GuiRect){x - half, y + v - high / 2, 2 * half, high}, color_with_alpha(gui_colors.window, 0.13));
            }
        for (int k = 0; k < SIDES; k++) {
            const float a = 2 * (float)PI * (float)k / SIDES, b = 2 * (float)PI * (float)(k + 1) / SIDES;
            gui_draw_line(gui, x + ring * cosf(a), y + ring * sinf(a), x + ring * cosf(b), y + ring * sinf(b), gui_colors.bad, floorf(2 * s));
        }
        label(panel, x + ring + floorf(6 * s), y - gui_line_height(gui, GUI_SMALL) / 2, GUI_SMALL, gui_colors.bad, spot->text);
    }
}

static void draw_3d_words(Panel *panel, const PanelState *state, GuiRect at)
{
    Gui *gui = panel->gui;
    GuiRect taken[LABELS_PLACED];
    float s = gui_scale(gui), gap = floorf(8 * s), pad = floorf(4 * s);
    for (int i = 0; i < state->label_count; i++) {
        const PanelLabel *words = &state->label[i];
        float width, height, x = at.x + (float)words->x, away = (float)words->radius + gap;
        gui_text_extent(gui, GUI_SMALL, words->text, &width, &height);
        bool is_left = words->x < (double)at.width / 2;      // outwards, because the vessel lies inwards
        GuiRect wanted = {is_left ? x - away - width - pad : x + away - pad, at.y + (float)words->y - height / 2 - pad / 2, width + 2 * pad, height + pad};
        wanted.x = fmaxf(at.x, fminf(wanted.x, at.x + at.width - wanted.width));
        GuiRect place = panel_free_place(wanted, taken, i < LABELS_PLACED ? i : LABELS_PLACED);
        if (i < LABELS_PLACED)
            taken[i] = place;
        label(panel, place.x + pad, place.y + pad / 2, GUI_SMALL, gui_colors.text, words->text);
    }
}

static void draw_3d_labels(Panel *panel, const PanelState *state, GuiRect at)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), pad = floorf(10 * s), half = gui_line_height(gui, GUI_SMALL) / 2;
    draw_way(panel, state, at);
    draw_3d_words(panel, state, at);
    if (state->force_full_scale_n > 0)
        draw_force_legend(panel, at, state->force_full_scale_n);
    if (state->bar_pixels > 0) {
        char text[32];
        float x = at.x + pad, y = at.y + at.height - pad, end = x + (float)state->bar_pixels, tick = floorf(4 * s);
        snprintf(text, sizeof text, "%g mm", state->bar_mm);
        gui_draw_line(gui, x, y, end, y, gui_colors.text, floorf(2 * s));
        gui_draw_line(gui, x, y - tick, x, y + 1, gui_colors.text, floorf(s));
        gui_draw_line(gui, end, y - tick, end, y + 1, gui_colors.text, floorf(s));
        label(panel, x, y - 2 * half - floorf(8 * s), GUI_SMALL, gui_colors.text, text);
    }
}

void panel_draw_over_views(Panel *panel, const PanelState *state)
{
    static const char *const view_name[VIEW_COUNT] = {"X-ray", "3D", "Angioscopy"};
    static const ActionId view_action[VIEW_COUNT] = {ACTION_VIEW_FLUOROSCOPY, ACTION_VIEW_3D, ACTION_VIEW_ANGIOSCOPY};
    Gui *gui = panel->gui;
    float pad = floorf(8 * gui_scale(gui));
    for (int i = 0; i < VIEW_COUNT; i++) {
        GuiRect at = panel->layout.view_rect[i];
        bool is_main = i == (int)panel->layout.main;
        if (at.width <= 0)
            continue;
        float below = at.y;
        gui_window_begin(gui, view_name[i], at, GUI_NO_BACKGROUND | GUI_NO_INPUT);
        if (i == VIEW_FLUOROSCOPY || i == VIEW_3D)
            draw_spots(panel, state, at, i == VIEW_FLUOROSCOPY);
        if (i == VIEW_FLUOROSCOPY)
            below = draw_fluoroscopy_labels(panel, state, at, is_main);
        if (i != VIEW_FLUOROSCOPY || !is_main) {
            char text[48], key[16];
            snprintf(text, sizeof text, "%s  (%s)", view_name[i], key_table_text(view_action[i], key, sizeof key));
            label(panel, at.x + pad, at.y + pad / 2, GUI_SMALL, gui_colors.dim, text);
        }
        if (i == VIEW_3D && is_main)
            draw_3d_labels(panel, state, at);
        if (is_main)
            draw_banners(panel, state, at, below);
        gui_window_end(gui);
    }
    if (panel->layout.second.width > 0 && state->second != SECOND_NONE) {
        char text[64], at[48];
        GuiRect rect = panel->layout.second_rect;
        gui_window_begin(gui, "second", rect, GUI_NO_BACKGROUND | GUI_NO_INPUT);
        snprintf(text, sizeof text, "%s  %s", state->second == SECOND_PLANE ? "Plane B" : "Reference", angles(at, sizeof at, &state->second_xray));
        label(panel, rect.x + pad, rect.y + pad / 2, GUI_SMALL, gui_colors.text, text);
        gui_window_end(gui);
    }
}
