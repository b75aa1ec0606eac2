// What the panel looks like. Columns left and right, a bar above and one below; letters over the views. Signs go with colours everywhere: a tick,
// a triangle or a cross for a mark, a tick and a bar for a button that is on.
#include "render/panel_internal.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const sign[] = {"", "\u2713 ", "\u25b2 ", "\u2717 "};   // by PanelMark
static const char *const mode_name[] = {"LIVE", "LAST IMAGE", "DSA", "ROADMAP", "CINE"};
static const float pulse_rate[] = {7.5f, 10, 15, 30};

static Color mark_color(PanelMark mark)
{
    return (const Color[]){gui_colors.text, gui_colors.good, gui_colors.warning, gui_colors.bad}[mark];
}

static const char *text_or_empty(const char *text) { return text ? text : ""; }

// "12.3 mm", a dash for what is not known; never "-0.0".
static const char *figure(char *text, size_t capacity, double value, int decimals, const char *unit)
{
    const char *blank = unit[0] && strncmp(unit, "\u00b0", 2) != 0 ? " " : "";   // 35 mm, but 35\u00b0
    if (isfinite(value))
        snprintf(text, capacity, "%.*f%s%s", decimals, fabs(value) < 0.5 * pow(10, -decimals) ? 0.0 : value, blank, unit);
    else
        snprintf(text, capacity, "\u2013%s%s", blank, unit);
    return text;
}

static const char *minutes(char *text, size_t capacity, double s)
{
    if (isfinite(s) && s >= 0 && s < 1e6)
        snprintf(text, capacity, "%d:%02d", (int)s / 60, (int)s % 60);
    else
        snprintf(text, capacity, "\u2013");
    return text;
}

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

__attribute__((format(printf, 4, 5))) static void row(Panel *panel, const char *label, PanelMark mark, const char *format, ...)
{
    char text[128] = "";
    snprintf(text, sizeof text, "%s", sign[mark]);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + strlen(text), sizeof text - strlen(text), format, arguments);
    va_end(arguments);
    gui_row(panel->gui, panel->is_dense ? GUI_SMALL : GUI_NORMAL, label, mark_color(mark), text);
}

static void heading(Panel *panel, const char *text)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), line = gui_line_height(gui, GUI_SMALL), width, height;
    GuiRect at = gui_place(gui, 0, line + floorf(3 * s));
    gui_text_extent(gui, GUI_SMALL, text, &width, &height);
    gui_draw_text(gui, at.x, at.y + floorf(2 * s), GUI_SMALL, gui_colors.accent, text);
    gui_draw_fill(gui, (GuiRect){at.x + width + 6 * s, at.y + floorf(2 * s + height / 2), at.width - width - 6 * s, 1}, gui_colors.line);
}

// ---- buttons, all from the table of keys

// Row by row; the X-ray and C-arm tabs put their sliders between (draw_tab).
enum { TAB_TOOL, TAB_XRAY, TAB_C_ARM, TAB_VIEWS, TAB_SESSION };
static const char *const tab_name[PANEL_TABS] = {"Tool", "X-ray", "C-arm", "Views", "Session"};
const ButtonRow panel_button_row[] = {
    {TAB_TOOL, 1, {ACTION_PUSH}},
    {TAB_TOOL, 2, {ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT}},
    {TAB_TOOL, 1, {ACTION_PULL}},
    {TAB_TOOL, 2, {ACTION_FAST, ACTION_SLOW}},
    {TAB_TOOL, 1, {ACTION_STOP}},
    {TAB_TOOL, 2, {ACTION_PEDAL_LATCH, ACTION_CONTRAST}},
    {TAB_XRAY, 2, {ACTION_PEDAL, ACTION_PEDAL_LATCH}},
    {TAB_XRAY, 1, {ACTION_CONTRAST}},
    {TAB_XRAY, 3, {ACTION_DSA, ACTION_ROADMAP, ACTION_MASK}},
    {TAB_XRAY, 3, {ACTION_CINE_RECORD, ACTION_CINE_REPLAY, ACTION_CINE_SAVE}},
    {TAB_XRAY, 3, {ACTION_MAGNIFY, ACTION_DEMAGNIFY, ACTION_PULSES}},
    {TAB_C_ARM, 5, {ACTION_RAO, ACTION_LAO, ACTION_CRA, ACTION_CAU, ACTION_AP}},
    {TAB_C_ARM, 2, {ACTION_TABLE_LEFT, ACTION_TABLE_RIGHT}},
    {TAB_C_ARM, 2, {ACTION_TABLE_UP, ACTION_TABLE_DOWN}},
    {TAB_C_ARM, 4, {ACTION_SIDES_CLOSE, ACTION_SIDES_OPEN, ACTION_ENDS_CLOSE, ACTION_ENDS_OPEN}},
    {TAB_VIEWS, 2, {ACTION_VIEW_FLUOROSCOPY, ACTION_VIEW_3D}},
    {TAB_VIEWS, 2, {ACTION_VIEW_ANGIOSCOPY, ACTION_VIEW_ALL}},
    {TAB_VIEWS, 2, {ACTION_CAMERA_RESET, ACTION_CAMERA_FOLLOW}},
    {TAB_VIEWS, 2, {ACTION_MODEL, ACTION_ARROWS}},
    {TAB_VIEWS, 3, {ACTION_SECTION, ACTION_SECTION_NEARER, ACTION_SECTION_FARTHER}},
    {TAB_VIEWS, 2, {ACTION_ORBIT_LEFT, ACTION_ORBIT_RIGHT}},
    {TAB_VIEWS, 2, {ACTION_ORBIT_UP, ACTION_ORBIT_DOWN}},
    {TAB_VIEWS, 2, {ACTION_CAMERA_NEARER, ACTION_CAMERA_FARTHER}},
    {TAB_SESSION, 2, {ACTION_PAUSE, ACTION_RESTART}},
    {TAB_SESSION, 2, {ACTION_BOOKMARK, ACTION_SAVE}},
    {TAB_SESSION, 2, {ACTION_TRAINEE, ACTION_SCREENSHOT}},
    {TAB_SESSION, 2, {ACTION_FULL_SCREEN, ACTION_PANELS}},
    {TAB_SESSION, 2, {ACTION_HELP, ACTION_BRIEFING}},
    {TAB_SESSION, 2, {ACTION_HINTS, ACTION_QUIT}},
};
const int panel_button_row_count = sizeof panel_button_row / sizeof panel_button_row[0];

static bool is_on(const Panel *panel, const PanelState *state, ActionId id)
{
    switch (id) {
    case ACTION_PEDAL: return state->xray.pedal > 0;
    case ACTION_PEDAL_LATCH: return state->is_pedal_latched;
    case ACTION_CONTRAST: return state->xray.contrast_ml_s > 0;
    case ACTION_DSA: return (int)state->xray.mode == XRAY_DSA;
    case ACTION_ROADMAP: return (int)state->xray.mode == XRAY_ROADMAP;
    case ACTION_CINE_RECORD: return state->is_recording_cine;
    case ACTION_CINE_REPLAY: return state->mode == PANEL_CINE;
    case ACTION_VIEW_FLUOROSCOPY: return state->view == VIEW_FLUOROSCOPY;
    case ACTION_VIEW_3D: return state->view == VIEW_3D;
    case ACTION_VIEW_ANGIOSCOPY: return state->view == VIEW_ANGIOSCOPY;
    case ACTION_VIEW_ALL: return state->view == VIEW_ALL;
    case ACTION_CAMERA_FOLLOW: return state->is_following;
    case ACTION_SECTION: return state->has_section;
    case ACTION_MODEL: return state->has_model;
    case ACTION_ARROWS: return state->has_arrows;
    case ACTION_PAUSE: return state->is_paused;
    case ACTION_HINTS: return panel->has_hints;
    case ACTION_PANELS: return panel->has_panels;
    case ACTION_HELP: return panel->has_help;
    case ACTION_BRIEFING: return panel->briefing_at.width > 0;
    default: return panel->held[id];
    }
}

static void action_button(Panel *panel, const PanelState *state, ActionId id, const char *where, float width)
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
    snprintf(last, sizeof last, "Key: %s%s", key, is_speed ? "; a click keeps it on" : action->kind == ACTION_HOLD ? " (hold)" : "");
    gui_tooltip(panel->gui, action->name, action->help, last);
}

static void button_row(Panel *panel, const PanelState *state, const ButtonRow *buttons)
{
    float gap = floorf(3 * gui_scale(panel->gui)), all = gui_width(panel->gui);
    float width = floorf((all - gap * (float)(buttons->count - 1)) / (float)buttons->count);
    for (int i = 0; i < buttons->count; i++) {
        if (i > 0)
            gui_beside(panel->gui, gap);
        action_button(panel, state, buttons->action[i], "tab", width);
    }
}

// A slider over a value of the X-ray control; `label` is part of what it shows.
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
    static const char *const name[4] = {"left %.2f", "right %.2f", "lower %.2f", "upper %.2f"};
    float gap = floorf(3 * gui_scale(panel->gui)), width = floorf((gui_width(panel->gui) - gap) / 2);
    for (int i = 0; i < 4; i++) {
        if (i % 2)
            gui_beside(panel->gui, gap);
        xray_slider(panel, state, &panel->xray.collimator[i], 0, 0.95f, name[i], "collimator blade: part of half the field that it covers", width);
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
        gui_tooltip(panel->gui, NULL, "fluoroscopy pulses a second: fewer is less dose, more is smoother", NULL);
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
    if (tab == TAB_XRAY) {
        pulse_buttons(panel, state);
        xray_slider(panel, state, &panel->xray.field_mm, 40, 400, "field %.0f mm", "side of the square field at the isocentre", 0);
    }
    if (tab == TAB_C_ARM)
        collimator_sliders(panel, state);
}

static void draw_right(Panel *panel, const PanelState *state)
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

// ---- left column

static bool has_more_lines(const char *text)
{
    const char *end = strchr(text_or_empty(text), '\n');
    return end && end[strspn(end, " \n\r\t")];
}

// Of the instructions; false where there is none.
static bool first_line(const char *text, char *line, size_t capacity)
{
    snprintf(line, capacity, "%.*s", (int)strcspn(text_or_empty(text), "\n"), text_or_empty(text));
    return line[0] != 0;
}

static void draw_exercise(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    char text[300], value[48];
    heading(panel, "EXERCISE");
    if (first_line(state->instructions, text, sizeof text)) {
        gui_text_wrapped(gui, panel->is_dense ? GUI_SMALL : GUI_NORMAL, gui_colors.text, text);
        if (has_more_lines(state->instructions)) {
            snprintf(text, sizeof text, "All of it: %s", key_table_text(ACTION_BRIEFING, value, sizeof value));
            gui_text(gui, GUI_SMALL, gui_colors.dim, text);
        }
    }
    if (state->hold_needed_s > 0) {
        const char *target = text_or_empty(state->target)[0] ? state->target : "target";
        if (state->hold_s > 0)
            snprintf(text, sizeof text, "%s: held %.1f of %.1f s", target, fmin(state->hold_s, state->hold_needed_s), state->hold_needed_s);
        else
            snprintf(text, sizeof text, "to reach: %s", target);
        gui_progress(gui, state->hold_s / state->hold_needed_s, text);
    }
    for (int i = 0; i < state->figure_count; i++) {
        const PanelFigure *f = &state->figure[i];
        row(panel, text_or_empty(f->label), f->mark, "%s", figure(value, sizeof value, f->value, f->decimals, text_or_empty(f->unit)));
    }
    row(panel, "Handling errors", state->error_count > 0 ? MARK_BAD : MARK_NONE, "%d", state->error_count);
    for (int i = state->error_count > 2 ? state->error_count - 2 : 0; i < state->error_count; i++) {
        snprintf(text, sizeof text, "%s%s", sign[MARK_BAD], text_or_empty(state->error[i]));
        gui_text_wrapped(gui, GUI_SMALL, gui_colors.bad, text);
    }
}

static void draw_tool(Panel *panel, const PanelState *state)
{
    char value[48], other[48];
    heading(panel, "TOOL");
    gui_text_wrapped(panel->gui, GUI_NORMAL, gui_colors.text, text_or_empty(state->tool));
    row(panel, "Inserted", MARK_NONE, "%s at %s", figure(value, sizeof value, state->inserted_mm, 1, "mm"),
        figure(other, sizeof other, state->push_mm_s, 1, "mm/s"));
    row(panel, "Turned", MARK_NONE, "%s at %s", figure(value, sizeof value, state->turned_deg, 0, "\u00b0"),
        figure(other, sizeof other, state->twist_deg_s, 0, "\u00b0/s"));
    row(panel, "Wall, most / sum", MARK_NONE, "%s / %s", figure(value, sizeof value, 1000 * state->wall_max_n, 0, ""),
        figure(other, sizeof other, 1000 * state->wall_sum_n, 0, "mN"));
    plot_draw(&panel->force, panel->gui, "Push force", "mN", 0, 100, panel->plot_height);
    plot_draw(&panel->torque, panel->gui, "Torque", "N mm", 3, 0.02, panel->plot_height);
    if (panel->plots == 3)
        plot_draw(&panel->wall, panel->gui, "Wall force, largest", "mN", 0, 100, panel->plot_height);
}

static void draw_hands(Panel *panel, const PanelState *state)
{
    static const char *const device_state[] = {"not there", "ready", "lost"};
    static const PanelMark device_mark[] = {MARK_NONE, MARK_GOOD, MARK_BAD};
    heading(panel, "HANDS");
    for (int i = 0; i < state->device_count; i++) {
        const PanelDevice *device = &state->device[i];
        row(panel, text_or_empty(device->name), device_mark[device->state], "%s", device_state[device->state]);
        if (text_or_empty(device->note)[0])
            gui_text_wrapped(panel->gui, GUI_SMALL, gui_colors.dim, device->note);
    }
    if (state->device_count == 0)
        gui_text(panel->gui, GUI_NORMAL, gui_colors.dim, "keyboard and mouse");
}

static void draw_left(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), least = 44 * s;
    gui_window_begin(gui, "left", panel->layout.left, GUI_KEPT | GUI_SELDOM);
    draw_exercise(panel, state);
    draw_tool(panel, state);
    draw_hands(panel, state);
    // the plots take what the rest leaves; where that is too little the rows become smaller, and last the column scrolls
    float room = panel->plot_height * (float)panel->plots - gui_window_end(gui) - 2;
    panel->is_dense = panel->is_dense || room < 2 * least;   // until the window is resized: no flicker between the two
    panel->plots = room >= 3 * 70 * s ? 3 : 2;
    panel->plot_height = floorf(fminf(fmaxf(room / (float)panel->plots, least), 120 * s));
}

// ---- above, below

static void badge(Panel *panel, const char *text, Color ground, Color letters)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), width, height;
    gui_text_extent(gui, GUI_NORMAL, text, &width, &height);
    GuiRect at = gui_place(gui, floorf(width + 14 * s), floorf(height + 8 * s));
    gui_draw_fill(gui, at, ground);
    gui_draw_text(gui, at.x + floorf(7 * s), at.y + floorf(4 * s), GUI_NORMAL, letters, text);
}

static void draw_top(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), gap = floorf(8 * s), button = floorf(88 * s);
    GuiRect title = panel->layout.top, badges = title, session = title;
    session.width = floorf(3 * button + 2 * gap + 20 * s);
    session.x = title.width - session.width;
    badges.width = floorf(330 * s);
    badges.x = session.x - badges.width;
    title.width = badges.x;
    char text[200], time[32];
    gui_window_begin(gui, "title", title, GUI_NO_INPUT | GUI_KEPT);
    gui_text(gui, GUI_LARGE, gui_colors.text, text_or_empty(state->title)[0] ? state->title : "Seldinger");
    if (text_or_empty(state->trainee)[0]) {
        gui_beside(gui, 2 * gap);
        gui_text(gui, GUI_LARGE, gui_colors.dim, state->trainee);
    }
    gui_window_end(gui);
    gui_window_begin(gui, "badges", badges, GUI_NO_INPUT | GUI_KEPT);
    if (state->xray.pedal > 0)
        badge(panel, "\u25cf X-RAY ON", gui_colors.warning, gui_colors.window);
    else
        badge(panel, "\u25cb X-ray off", gui_colors.frame, gui_colors.dim);
    gui_beside(gui, gap);
    badge(panel, mode_name[state->mode], gui_colors.frame_on, gui_colors.text);
    gui_beside(gui, gap);
    snprintf(text, sizeof text, "%s%s", state->is_paused ? "PAUSED " : "", minutes(time, sizeof time, state->time_s));
    badge(panel, text, state->is_paused ? gui_colors.warning : gui_colors.frame, state->is_paused ? gui_colors.window : gui_colors.text);
    gui_window_end(gui);
    gui_window_begin(gui, "session", session, GUI_KEPT);
    static const ActionId action[] = {ACTION_PAUSE, ACTION_HELP, ACTION_QUIT};
    for (int i = 0; i < 3; i++) {
        if (i > 0)
            gui_beside(gui, gap);
        action_button(panel, state, action[i], "top", button);
    }
    gui_window_end(gui);
}

static void draw_log(Panel *panel, GuiRect at)
{
    Gui *gui = panel->gui;
    char text[256], time[32];
    gui_window_begin(gui, "log", at, GUI_SCROLL_TO_END | GUI_KEPT);
    int first = panel->message_count > PANEL_MESSAGES ? panel->message_count - PANEL_MESSAGES : 0;
    if (panel->message_count == 0)
        gui_text(gui, GUI_SMALL, gui_colors.dim, "Messages appear here.");
    for (int i = first; i < panel->message_count; i++) {
        const PanelMessage *message = &panel->message[i % PANEL_MESSAGES];
        snprintf(text, sizeof text, "%s  %s%s", minutes(time, sizeof time, message->now_s), sign[message->mark], message->text);
        gui_text_wrapped(gui, GUI_SMALL, mark_color(message->mark), text);
    }
    gui_window_end(gui);
}

static void small_row(Panel *panel, const char *label, PanelMark mark, const char *text)
{
    char marked[96];
    snprintf(marked, sizeof marked, "%s%s", sign[mark], text);
    gui_row(panel->gui, GUI_SMALL, label, mark_color(mark), marked);
}

static void draw_machine(Panel *panel, const PanelState *state, GuiRect at)
{
    char text[96], one[32], other[32];
    gui_window_begin(panel->gui, "machine", at, GUI_KEPT | GUI_SELDOM | GUI_NO_INPUT);
    snprintf(text, sizeof text, "%s / %s", figure(one, sizeof one, state->step_median_us, 0, ""),
             figure(other, sizeof other, state->step_p999_us, 0, "\u00b5s"));
    small_row(panel, "Step, median / p99.9", MARK_NONE, text);
    snprintf(text, sizeof text, "\u00d7%s, %lld missed", figure(one, sizeof one, state->real_time_factor, 2, ""), (long long)state->missed_deadlines);
    small_row(panel, "Real time, deadlines", state->warnings & (WARN_SLOW | WARN_STALLED) ? MARK_WARNING : MARK_NONE, text);
    small_row(panel, "Drawing", MARK_NONE, figure(one, sizeof one, state->frame_ms, 1, "ms a frame"));
    gui_window_end(panel->gui);
}

// Hint, messages, machine.
static void draw_bottom(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    GuiRect at = panel->layout.bottom, hints = at, log = at, machine = at;
    float s = gui_scale(gui);
    char text[256];
    int hint = panel->has_hints ? panel_current_hint(panel) : -1;
    machine.width = floorf(268 * s);
    machine.x = at.width - machine.width;
    hints.width = hint >= 0 ? floorf(machine.x * 0.58f) : 0;
    log.x = hints.width;
    log.width = machine.x - hints.width;
    if (hint >= 0) {
        gui_window_begin(gui, "hint", hints, GUI_NO_INPUT | GUI_KEPT);
        gui_draw_fill(gui, (GuiRect){hints.x + floorf(5 * s), hints.y + floorf(8 * s), floorf(3 * s), hints.height - floorf(16 * s)}, gui_colors.accent);
        gui_place(gui, floorf(4 * s), 1);
        gui_beside(gui, 0);
        panel_hint_text(hint, text, sizeof text);
        gui_text_wrapped(gui, GUI_LARGE, gui_colors.text, text);
        gui_window_end(gui);
    }
    draw_log(panel, log);
    draw_machine(panel, state, machine);
}

// ---- over the views

// Letters on a picture that may be white or black.
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

static void draw_fluoroscopy_labels(Panel *panel, const PanelState *state, GuiRect at, bool is_main)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), pad = floorf(10 * s), normal = gui_line_height(gui, GUI_NORMAL) + floorf(5 * s);
    GuiFont large = is_main ? GUI_HUGE : GUI_NORMAL;
    char text[64], time[32];
    label(panel, at.x + pad, at.y + at.height - pad - gui_line_height(gui, large), large, gui_colors.text, angles(text, sizeof text, &state->xray));
    if (!is_main)
        return;
    float right = at.x + at.width - pad, y = at.y + at.height - pad - normal;
    snprintf(text, sizeof text, "contrast %.1f ml", isfinite(state->contrast_ml) ? state->contrast_ml : 0);
    label_right(panel, right, y, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, "fluoroscopy %s", minutes(time, sizeof time, state->fluoro_s));
    label_right(panel, right, y - normal, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, "%g pulses/s", (double)state->xray.pulses_s);
    label_right(panel, right, y - 2 * normal, GUI_NORMAL, gui_colors.text, text);
    snprintf(text, sizeof text, "field %.0f mm", (double)state->xray.field_mm);
    label_right(panel, right, y - 3 * normal, GUI_NORMAL, gui_colors.text, text);
    label(panel, at.x + pad, at.y + pad / 2, GUI_LARGE, gui_colors.text, mode_name[state->mode]);
    y = at.y + pad / 2 + gui_line_height(gui, GUI_LARGE) + floorf(6 * s);
    if (state->mode == PANEL_CINE) {
        snprintf(text, sizeof text, "frame %d of %d", state->cine_frame + 1, state->cine_frames);
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
    if ((state->mode == PANEL_DSA || state->mode == PANEL_ROADMAP) && !state->is_roadmap_ready)
        label(panel, at.x + pad, y, GUI_NORMAL, gui_colors.warning, "\u25b2 no mask yet: take one with the X-ray on");
}

static void draw_warnings(Panel *panel, const PanelState *state, GuiRect at)
{
    static const struct { unsigned bit; const char *text; } warning[] = {
        {WARN_OUTSIDE, "The tool is outside the vessel: forces are not to be trusted"},
        {WARN_STALLED, "The simulation stands still"},
        {WARN_DEVICE_LOST, "A device is lost: the tool stands still until it is back"},
        {WARN_NOT_CONVERGED, "Contact forces did not converge in the last step"},
        {WARN_SLOW, "Simulation slower than real time"},
        {WARN_NO_FIFO, "No real-time priority (SCHED_FIFO): steps may come late"}};
    Gui *gui = panel->gui;
    float s = gui_scale(gui), y = at.y + floorf(52 * s), width, height, pad = floorf(8 * s);
    char text[200];
    for (size_t i = 0; i <= sizeof warning / sizeof warning[0]; i++) {
        bool is_own = i == sizeof warning / sizeof warning[0];
        const char *what = is_own ? text_or_empty(state->warning) : state->warnings & warning[i].bit ? warning[i].text : "";
        if (!what[0])
            continue;
        if (!is_own && warning[i].bit == WARN_SLOW && isfinite(state->real_time_factor))
            snprintf(text, sizeof text, "\u25b2 %s: \u00d7%.2f", what, state->real_time_factor);
        else
            snprintf(text, sizeof text, "\u25b2 %s", what);
        gui_text_extent(gui, GUI_NORMAL, text, &width, &height);
        GuiRect box = {floorf(at.x + fmaxf(0, (at.width - width) / 2 - pad)), y, width + 2 * pad, height + pad};
        gui_draw_fill(gui, box, gui_colors.warning);
        gui_draw_text(gui, box.x + pad, y + pad / 2, GUI_NORMAL, gui_colors.window, text);
        y += box.height + floorf(3 * s);
    }
}

static void draw_over_views(Panel *panel, const PanelState *state)
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
        gui_window_begin(gui, view_name[i], at, GUI_NO_BACKGROUND | GUI_NO_INPUT);
        if (i == VIEW_FLUOROSCOPY)
            draw_fluoroscopy_labels(panel, state, at, is_main);
        if (i != VIEW_FLUOROSCOPY || !is_main) {
            char text[48], key[16];
            snprintf(text, sizeof text, "%s  (%s)", view_name[i], key_table_text(view_action[i], key, sizeof key));
            label(panel, at.x + pad, at.y + pad / 2, GUI_SMALL, gui_colors.dim, text);
        }
        if (is_main)
            draw_warnings(panel, state, at);
        gui_window_end(gui);
    }
}

// ---- instructions, help and dialogues

// Lines that a file's editor broke are joined: a break counts after the end of a sentence, before a list's mark and at an empty line.
static void reflow(const char *from, char *to, size_t capacity)
{
    size_t length = 0;
    for (; *from && length + 1 < capacity; from++) {
        bool ends_sentence = length > 0 && strchr(".!?:\n", to[length - 1]);
        bool is_break = *from == '\n' && !ends_sentence && from[1] && !strchr("\n-*0123456789", from[1]);
        to[length++] = is_break ? ' ' : *from;
    }
    while (length > 0 && strchr(" \n", to[length - 1]))
        length--;
    to[length] = 0;
}

static void draw_briefing(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    panel->briefing_at = (GuiRect){0};
    bool is_wanted = panel->briefing == BRIEFING_OPEN || (panel->briefing == BRIEFING_AT_BEGIN && panel->is_interactive && panel->has_hints &&
                                                          has_more_lines(state->instructions));
    if (!is_wanted || !text_or_empty(state->instructions)[0])
        return;
    char text[4200];
    reflow(state->instructions, text, sizeof text);
    float s = gui_scale(gui), margin = floorf(12 * s), pad = floorf(20 * s);
    GuiRect view = panel->layout.view_rect[panel->layout.main];
    float width = floorf(fminf(view.width - 2 * margin, 640 * s));
    float height = gui_wrapped_height(gui, GUI_NORMAL, text, width - pad) + floorf(84 * s);
    height = floorf(fminf(height, view.height - 2 * margin));
    GuiRect at = {floorf(view.x + (view.width - width) / 2), floorf(view.y + (view.height - height) / 2), width, height};
    gui_window_begin(gui, "briefing", at, GUI_FRAMED);
    gui_text_wrapped(gui, GUI_LARGE, gui_colors.text, text_or_empty(state->title));
    gui_space(gui, floorf(2 * s));
    gui_text_wrapped(gui, GUI_NORMAL, gui_colors.text, text);
    gui_space(gui, floorf(2 * s));
    char key[32];
    if (gui_button(gui, "begin", "Close", key_table_text(ACTION_BRIEFING, key, sizeof key), floorf(110 * s), false).pressed)
        panel->mouse_pressed[ACTION_BRIEFING]++;
    gui_window_end(gui);
    panel->briefing_at = at;
}

static void veil(Panel *panel, const WindowInput *input)
{
    GuiRect all = {0, 0, (float)input->width, (float)input->height};
    gui_window_begin(panel->gui, "veil", all, GUI_ON_TOP | GUI_VEIL);
    gui_window_end(panel->gui);
}

static void help_group(Panel *panel, ActionGroup group, GuiFont font, float key_width)
{
    Gui *gui = panel->gui;
    heading(panel, action_group_name[group]);
    for (int i = 0; i < ACTION_COUNT; i++) {
        if (key_table[i].group != group)
            continue;
        char key[32];
        GuiRect at = gui_place(gui, 0, gui_line_height(gui, font));
        gui_draw_text(gui, at.x, at.y, font, gui_colors.accent, key_table_text((ActionId)i, key, sizeof key));
        gui_draw_text(gui, at.x + key_width, at.y, font, gui_colors.text, key_table[i].help);
    }
}

static void draw_help(Panel *panel, const WindowInput *input, const PanelState *state)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), margin = floorf(12 * s), key_width = floorf(90 * s), head = floorf(38 * s);
    GuiRect at = {margin, margin, (float)input->width - 2 * margin, (float)input->height - 2 * margin};
    veil(panel, input);
    gui_window_begin(gui, "help", (GuiRect){at.x, at.y, at.width, head}, GUI_ON_TOP);
    gui_text(gui, GUI_LARGE, gui_colors.text, "Keys");
    gui_beside(gui, margin);
    gui_text(gui, GUI_NORMAL, gui_colors.dim, "Everything is also a button in the panels.");
    gui_beside(gui, margin);
    action_button(panel, state, ACTION_HELP, "help", floorf(120 * s));
    gui_window_end(gui);
    // larger letters where the longer column has room for them
    float half = floorf(at.width / 2);
    int lines = 0;
    for (int i = 0; i < ACTION_COUNT; i++)
        lines += key_table[i].group < GROUP_VIEW;
    bool has_room = (float)(lines + GROUP_VIEW + 1) * (gui_line_height(gui, GUI_NORMAL) + 4 * s) < at.height - head;
    GuiFont font = has_room ? GUI_NORMAL : GUI_SMALL;
    for (int i = 0; i < 2; i++) {
        GuiRect part = {at.x + (i ? half : 0), at.y + head, i ? at.width - half : half, at.height - head};
        gui_window_begin(gui, i ? "help right" : "help left", part, GUI_ON_TOP);
        for (int group = 0; group < ACTION_GROUPS; group++)
            if ((group >= GROUP_VIEW) == (i == 1))
                help_group(panel, (ActionGroup)group, font, key_width);
        gui_window_end(gui);
    }
}

static void draw_dialogue(Panel *panel, const WindowInput *input)
{
    static const struct { const char *title, *text, *yes, *no; } dialogue[] = {
        [DIALOGUE_QUIT] = {"End the session?", "The session is saved as it is now.", "End", "Go on"},
        [DIALOGUE_RESTART] = {"Begin anew?", "The exercise starts again from the beginning; this attempt is kept in the recording.", "Begin anew", "Go on"},
        [DIALOGUE_TRAINEE] = {"Who is practising?", "The name stands in the report, and earlier sessions of the same name are compared.", "Take", "Leave it"}};
    Gui *gui = panel->gui;
    float s = gui_scale(gui), width = floorf(fminf(420 * s, (float)input->width - 20 * s));
    float height = floorf((panel->dialogue == DIALOGUE_TRAINEE ? 142 : 112) * s);
    veil(panel, input);
    GuiRect at = {floorf(((float)input->width - width) / 2), floorf(((float)input->height - height) / 2), width, height};
    gui_window_begin(gui, "dialogue", at, GUI_ON_TOP | GUI_FRAMED);
    gui_text(gui, GUI_LARGE, gui_colors.text, dialogue[panel->dialogue].title);
    gui_text_wrapped(gui, GUI_NORMAL, gui_colors.dim, dialogue[panel->dialogue].text);
    gui_space(gui, floorf(4 * s));
    if (panel->dialogue == DIALOGUE_TRAINEE && gui_text_field(gui, "name", panel->name, sizeof panel->name, panel->dialogue_is_new))
        panel->answer = 1;
    gui_space(gui, floorf(2 * s));
    float gap = floorf(8 * s), button = floorf((gui_width(gui) - gap) / 2);
    if (gui_button(gui, "yes", dialogue[panel->dialogue].yes, "Enter", button, false).pressed)
        panel->answer = 1;
    gui_beside(gui, gap);
    if (gui_button(gui, "no", dialogue[panel->dialogue].no, "Esc", button, false).pressed)
        panel->answer = -1;
    gui_window_end(gui);
}

void panel_draw_all(Panel *panel, const WindowInput *input, const PanelState *state)
{
    draw_over_views(panel, state);
    if (panel->has_panels) {
        draw_top(panel, state);
        draw_left(panel, state);
        draw_right(panel, state);
        draw_bottom(panel, state);
    }
    draw_briefing(panel, state);
    if (panel->has_help)
        draw_help(panel, input, state);
    if (panel->dialogue != DIALOGUE_NONE)
        draw_dialogue(panel, input);
}
