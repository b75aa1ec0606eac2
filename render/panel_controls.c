// The controls at the right: buttons, all from the table of keys, and the sliders of the X-ray system.
#include "render/panel_internal.h"
#include "render/translation.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>

static const float pulse_rate[] = {7.5f, 10, 15, 30};

// Row by row; the X-ray and C-arm tabs have their sliders in between (draw_tab).
enum { TAB_TOOL, TAB_XRAY, TAB_C_ARM, TAB_VIEWS, TAB_SESSION };
static const char *const tab_name[PANEL_TABS] = {"Tool", "X-ray", "C-arm", "Views", "Session"};
static const ButtonRow panel_button_row[] = {
    {TAB_TOOL, 1, {ACTION_PUSH}, false},
    {TAB_TOOL, 2, {ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT}, false},
    {TAB_TOOL, 1, {ACTION_PULL}, false},
    {TAB_TOOL, 2, {ACTION_FAST, ACTION_SLOW}, false},
    {TAB_TOOL, 3, {ACTION_STOP, ACTION_RELEASE, ACTION_EXCHANGE}, false},
    {TAB_TOOL, 5, {ACTION_TOOL_1, ACTION_TOOL_2, ACTION_TOOL_3, ACTION_TOOL_4, ACTION_LOCK}, true},
    {TAB_TOOL, 2, {ACTION_OTHER_PUSH, ACTION_OTHER_PULL}, true},
    {TAB_TOOL, 2, {ACTION_OTHER_TWIST_LEFT, ACTION_OTHER_TWIST_RIGHT}, true},
    {TAB_TOOL, 2, {ACTION_PEDAL_LATCH, ACTION_CONTRAST}, false},
    {TAB_XRAY, 2, {ACTION_PEDAL, ACTION_PEDAL_LATCH}, false},
    {TAB_XRAY, 1, {ACTION_CONTRAST}, false},
    {TAB_XRAY, 3, {ACTION_DSA, ACTION_ROADMAP, ACTION_MASK}, false},
    {TAB_XRAY, 2, {ACTION_REFERENCE, ACTION_BIPLANE}, false},
    {TAB_XRAY, 3, {ACTION_CINE_RECORD, ACTION_CINE_REPLAY, ACTION_CINE_SAVE}, false},
    {TAB_XRAY, 3, {ACTION_MAGNIFY, ACTION_DEMAGNIFY, ACTION_PULSES}, false},
    {TAB_C_ARM, 5, {ACTION_RAO, ACTION_LAO, ACTION_CRA, ACTION_CAU, ACTION_AP}, false},
    {TAB_C_ARM, 3, {ACTION_LATERAL, ACTION_STORE, ACTION_RECALL}, false},
    {TAB_C_ARM, 2, {ACTION_TABLE_LEFT, ACTION_TABLE_RIGHT}, false},
    {TAB_C_ARM, 2, {ACTION_TABLE_UP, ACTION_TABLE_DOWN}, false},
    {TAB_C_ARM, 4, {ACTION_SIDES_CLOSE, ACTION_SIDES_OPEN, ACTION_ENDS_CLOSE, ACTION_ENDS_OPEN}, false},
    {TAB_VIEWS, 2, {ACTION_VIEW_FLUOROSCOPY, ACTION_VIEW_3D}, false},
    {TAB_VIEWS, 2, {ACTION_VIEW_ANGIOSCOPY, ACTION_VIEW_ALL}, false},
    {TAB_VIEWS, 3, {ACTION_CAMERA_RESET, ACTION_CAMERA_FOLLOW, ACTION_CAMERA_C_ARM}, false},
    {TAB_VIEWS, 2, {ACTION_MODEL, ACTION_ARROWS}, false},
    {TAB_VIEWS, 3, {ACTION_SECTION, ACTION_SECTION_NEARER, ACTION_SECTION_FARTHER}, false},
    {TAB_VIEWS, 2, {ACTION_ORBIT_LEFT, ACTION_ORBIT_RIGHT}, false},
    {TAB_VIEWS, 2, {ACTION_ORBIT_UP, ACTION_ORBIT_DOWN}, false},
    {TAB_VIEWS, 2, {ACTION_CAMERA_NEARER, ACTION_CAMERA_FARTHER}, false},
    {TAB_SESSION, 2, {ACTION_PAUSE, ACTION_RESTART}, false},
    {TAB_SESSION, 2, {ACTION_BOOKMARK, ACTION_SAVE}, false},
    {TAB_SESSION, 2, {ACTION_TRAINEE, ACTION_SCREENSHOT}, false},
    {TAB_SESSION, 2, {ACTION_FULL_SCREEN, ACTION_PANELS}, false},
    {TAB_SESSION, 2, {ACTION_HELP, ACTION_BRIEFING}, false},
    {TAB_SESSION, 2, {ACTION_HINTS, ACTION_QUIT}, false},
};
static const int panel_button_row_count = sizeof panel_button_row / sizeof panel_button_row[0];

static bool is_on(const Panel *panel, const PanelState *state, ActionId id)
{
    switch (id) {
    case ACTION_PEDAL: return state->xray.pedal > 0;
    case ACTION_PEDAL_LATCH: return state->is_pedal_latched;
    case ACTION_CONTRAST: return state->xray.contrast_ml_s > 0;
    case ACTION_DSA: return (int)state->xray.mode == XRAY_DSA;
    case ACTION_ROADMAP: return (int)state->xray.mode == XRAY_ROADMAP;
    case ACTION_REFERENCE: return state->second == SECOND_REFERENCE;
    case ACTION_BIPLANE: return state->second == SECOND_PLANE;
    case ACTION_CINE_RECORD: return state->is_recording_cine;
    case ACTION_CINE_REPLAY: return state->mode == PANEL_CINE;
    case ACTION_VIEW_FLUOROSCOPY: return state->view == VIEW_FLUOROSCOPY;
    case ACTION_VIEW_3D: return state->view == VIEW_3D;
    case ACTION_VIEW_ANGIOSCOPY: return state->view == VIEW_ANGIOSCOPY;
    case ACTION_VIEW_ALL: return state->view == VIEW_ALL;
    case ACTION_CAMERA_FOLLOW: return state->is_following;
    case ACTION_CAMERA_C_ARM: return state->is_following_arm;
    case ACTION_SECTION: return state->has_section;
    case ACTION_MODEL: return state->has_model;
    case ACTION_ARROWS: return state->has_arrows;
    case ACTION_TOOL_1:
    case ACTION_TOOL_2:
    case ACTION_TOOL_3:
    case ACTION_TOOL_4: return state->chosen_tool == (int)(id - ACTION_TOOL_1);
    case ACTION_LOCK: return state->is_pair_locked;
    case ACTION_RELEASE: return state->is_released;
    case ACTION_EXCHANGE: return panel->dialogue == DIALOGUE_TRAY;
    case ACTION_PAUSE: return state->is_paused;
    case ACTION_HINTS: return panel->has_hints;
    case ACTION_PANELS: return panel->has_panels;
    case ACTION_HELP: return panel->has_help;
    case ACTION_BRIEFING: return panel->briefing_at.width > 0;
    default: return panel->held[id];
    }
}

void panel_action_button(Panel *panel, const PanelState *state, ActionId id, const char *where, float width)
{
    const KeyAction *action = &key_table[id];
    char key[32], name[32], last[64];
    key_table_text(id, key, sizeof key);
    snprintf(name, sizeof name, "%s%d", where, (int)id);
    GuiPress press = gui_button(panel->gui, name, action->name, key, width, is_on(panel, state, id));
    bool is_speed = id == ACTION_FAST || id == ACTION_SLOW;
    if (is_speed && press.pressed) {
        panel->latched[id] = !panel->latched[id];
        panel->latched[id == ACTION_FAST ? ACTION_SLOW : ACTION_FAST] = false;
    } else if (action->kind == ACTION_PRESS && press.pressed) {
        panel->mouse_pressed[id]++;
    } else if (action->kind == ACTION_HOLD && !is_speed && press.held) {
        panel->mouse_held[id] = true;
    }
    snprintf(last, sizeof last, tr("Key: %s%s"), key, is_speed ? tr("; a click keeps it on") : action->kind == ACTION_HOLD ? tr(" (hold)") : "");
    gui_tooltip(panel->gui, action->name, action->help, last);
}

// Of labels in small letters.
static float widest_label(Panel *panel, int count, const ActionId *action)
{
    float widest = 0, width, height;
    for (int i = 0; i < count; i++) {
        gui_text_extent(panel->gui, GUI_SMALL, key_table[action[i]].name, &width, &height);
        widest = fmaxf(widest, width);
    }
    return widest;
}

static float button_width(float all, float gap, int in_line) { return floorf((all - gap * (float)(in_line - 1)) / (float)in_line); }

static void button_row(Panel *panel, const PanelState *state, const ButtonRow *buttons)
{
    int count = 0;
    ActionId action[BUTTONS_IN_ROW];
    if (buttons->is_of_several && state->tool_count < 2)
        return;
    for (int i = 0; i < buttons->count; i++) {
        int tool = (int)buttons->action[i] - ACTION_TOOL_1;
        if (state->is_examination && key_table_is_of_3d(buttons->action[i]))
            continue;
        if (tool < state->tool_count || tool >= PANEL_TOOLS)
            action[count++] = buttons->action[i];
    }
    if (count == 0)
        return;
    const float gap = floorf(3 * gui_scale(panel->gui)), all = gui_width(panel->gui);
    // fewer in a line where a label in another language is too long
    int in_line = count;
    while (in_line > 1 && widest_label(panel, count, action) > button_width(all, gap, in_line))
        in_line = (in_line + 1) / 2;
    for (int i = 0; i < count; i++) {
        if (i % in_line > 0)
            gui_beside(panel->gui, gap);
        panel_action_button(panel, state, action[i], "tab", button_width(all, gap, in_line));
    }
}

// A slider for a value of the X-ray controls; `label` is part of its text.
static void xray_slider(Panel *panel, const PanelState *state, float *value, float least, float most, const char *format, const char *tip, float width)
{
    char id[24];
    ptrdiff_t place = value - (float *)&panel->xray;
    snprintf(id, sizeof id, "xray%d", (int)place);
    XrayControl before = panel->xray_set ? panel->xray : state->xray;
    panel->xray = before;
    if (gui_slider(panel->gui, id, value, least, most, format, width))
        panel->xray_set = true;
    gui_tooltip(panel->gui, NULL, tip, NULL);
}

static void angle_sliders(Panel *panel, const PanelState *state)
{
    char format[32];
    int lao = (int)lround(state->xray.lao_deg), cra = (int)lround(state->xray.cra_deg);
    snprintf(format, sizeof format, "%s %d\u00b0", lao < 0 ? "RAO" : "LAO", lao < 0 ? -lao : lao);
    xray_slider(panel, state, &panel->xray.lao_deg, -90, 90, format, "C-arm to the patient's right (RAO) or left (LAO), up to 90\u00b0", 0);
    snprintf(format, sizeof format, "%s %d\u00b0", cra < 0 ? "CAU" : "CRA", cra < 0 ? -cra : cra);
    xray_slider(panel, state, &panel->xray.cra_deg, -45, 45, format, "C-arm towards the feet (CAU) or the head (CRA), up to 45\u00b0", 0);
}

static void collimator_sliders(Panel *panel, const PanelState *state)
{
    static const char *const name[4] = {N_("left %.2f"), N_("right %.2f"), N_("lower %.2f"), N_("upper %.2f")};
    float gap = floorf(3 * gui_scale(panel->gui)), width = floorf((gui_width(panel->gui) - gap) / 2);
    for (int i = 0; i < 4; i++) {
        if (i % 2)
            gui_beside(panel->gui, gap);
        xray_slider(panel, state, &panel->xray.collimator[i], 0, 0.95f, name[i], "collimator blade: fraction of half the field that it covers", width);
    }
}

static void pulse_buttons(Panel *panel, const PanelState *state)
{
    float gap = floorf(3 * gui_scale(panel->gui)), width = floorf((gui_width(panel->gui) - 3 * gap) / 4);
    for (int i = 0; i < 4; i++) {
        char label[16], id[24];
        snprintf(label, sizeof label, "%g/s", (double)pulse_rate[i]);
        snprintf(id, sizeof id, "pulse%d", i);
        if (i > 0)
            gui_beside(panel->gui, gap);
        if (gui_button(panel->gui, id, label, NULL, width, fabsf(state->xray.pulses_s - pulse_rate[i]) < 0.01f).pressed) {
            panel->xray = panel->xray_set ? panel->xray : state->xray;
            panel->xray.pulses_s = pulse_rate[i];
            panel->xray_set = true;
        }
        gui_tooltip(panel->gui, NULL, "fluoroscopy pulses per second: fewer give less dose, more a smoother picture", NULL);
    }
}

static void draw_tab(Panel *panel, const PanelState *state, int tab)
{
    gui_space(panel->gui, 2 * gui_scale(panel->gui));
    if (tab == TAB_C_ARM)
        angle_sliders(panel, state);
    for (int i = 0; i < panel_button_row_count; i++)
        if (panel_button_row[i].tab == tab)
            button_row(panel, state, &panel_button_row[i]);
    if (tab == TAB_VIEWS && state->is_examination)
        gui_text_wrapped(panel->gui, GUI_NORMAL, gui_colors.dim, "This is an examination: the 3D view and angioscopy are hidden.");
    if (tab == TAB_XRAY) {
        pulse_buttons(panel, state);
        xray_slider(panel, state, &panel->xray.field_mm, 40, 400, tr("field %.0f mm"), "side of the square field at the isocentre", 0);
    }
    if (tab == TAB_C_ARM)
        collimator_sliders(panel, state);
}

void panel_draw_controls(Panel *panel, const PanelState *state)
{
    gui_window_begin(panel->gui, "right", panel->layout.right, GUI_KEPT);
    if (gui_tabs_begin(panel->gui, "controls")) {
        for (int i = 0; i < PANEL_TABS; i++)
            if (gui_tab_begin(panel->gui, tab_name[i])) {
                draw_tab(panel, state, i);
                gui_tab_end(panel->gui);
            }
        gui_tabs_end(panel->gui);
    }
    gui_window_end(panel->gui);
}
