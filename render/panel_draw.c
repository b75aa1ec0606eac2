// Appearance of the panel: columns left and right, a bar above and one below; text over the views (panel_views.c), boxes (panel_boxes.c). Colours are always
// accompanied by
// signs: a tick, a triangle or a cross for a mark, a tick and a bar for a button that is on.
#include "render/panel_internal.h"
#include "render/translation.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

__attribute__((format(printf, 4, 5))) static void row(Panel *panel, const char *label, PanelMark mark, const char *format, ...)
{
    char text[128] = "";
    snprintf(text, sizeof text, "%s", panel_sign[mark]);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + strlen(text), sizeof text - strlen(text), format, arguments);
    va_end(arguments);
    gui_row(panel->gui, panel->is_dense ? GUI_SMALL : GUI_NORMAL, label, panel_mark_color(mark), text);
}

// ---- left column

static void draw_exercise(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    char text[300], value[48];
    panel_heading(panel, "EXERCISE");
    panel_draw_steps(panel, state);
    const bool is_guided = state->guide && state->guide->count > 0 && !state->is_finished;
    if (!is_guided && panel_first_line(state->instructions, text, sizeof text)) {
        gui_text_wrapped(gui, panel->is_dense ? GUI_SMALL : GUI_NORMAL, gui_colors.text, text);
        if (panel_has_more_lines(state->instructions)) {
            snprintf(text, sizeof text, tr("Full text: %s"), key_table_text(ACTION_BRIEFING, value, sizeof value));
            gui_text(gui, GUI_SMALL, gui_colors.dim, text);
        }
    }
    if (state->hold_needed_s > 0) {
        const char *target = panel_text(state->target)[0] ? state->target : "target";
        if (state->hold_s > 0)
            snprintf(text, sizeof text, tr("%s: held %.1f of %.1f s"), target, fmin(state->hold_s, state->hold_needed_s), state->hold_needed_s);
        else
            snprintf(text, sizeof text, tr("target: %s"), target);
        gui_progress(gui, state->hold_s / state->hold_needed_s, text);
    }
    for (int i = 0; i < state->figure_count; i++) {
        const PanelFigure *f = &state->figure[i];
        row(panel, panel_text(f->label), f->mark, "%s", panel_figure(value, sizeof value, f->value, f->decimals, panel_text(f->unit)));
    }
    row(panel, "Handling errors", state->error_count > 0 ? MARK_BAD : MARK_NONE, "%d", state->error_count);
    for (int i = state->error_count > 2 ? state->error_count - 2 : 0; i < state->error_count; i++) {
        snprintf(text, sizeof text, "%s%s", panel_sign[MARK_BAD], panel_text(state->error[i]));
        gui_text_wrapped(gui, GUI_SMALL, gui_colors.bad, text);
    }
}

// All tools in short: a dot for the one whose figures follow, its insertion, its reaction force, its note.
static void draw_tools(Panel *panel, const PanelState *state)
{
    char name[64], text[96], value[48], other[48];
    for (int k = 0; k < state->tool_count; k++) {
        const PanelTool *tool = &state->tool[k];
        snprintf(name, sizeof name, "%s %d %s", k == state->chosen_tool ? "\u25cf" : "\u25cb", k + 1, panel_text(tool->name));
        gui_row(panel->gui, GUI_SMALL, name, tool->color, panel_figure(value, sizeof value, tool->inserted_mm, 1, "mm"));
        snprintf(text, sizeof text, "%s, %s", panel_figure(value, sizeof value, 1000 * tool->force_n, 0, "mN"),
                 panel_figure(other, sizeof other, tool->torque_n_mm, 2, "N mm"));
        snprintf(name, sizeof name, "      %s%.40s", panel_sign[tool->mark], panel_text(tool->note));
        gui_row(panel->gui, GUI_SMALL, name, gui_colors.dim, text);
    }
}

static void draw_tool(Panel *panel, const PanelState *state)
{
    char value[48], other[48];
    bool has_several = state->tool_count > 1;
    int chosen = state->chosen_tool >= 0 && state->chosen_tool < state->tool_count ? state->chosen_tool : 0;
    const PanelTool *tool = &state->tool[chosen];
    panel_heading(panel, has_several ? "TOOLS" : "TOOL");
    if (has_several)
        draw_tools(panel, state);
    gui_text_wrapped(panel->gui, has_several ? GUI_SMALL : GUI_NORMAL, gui_colors.text, panel_text(tool->what));
    row(panel, "Inserted", MARK_NONE, "%s at %s", panel_figure(value, sizeof value, tool->inserted_mm, 1, "mm"),
        panel_figure(other, sizeof other, tool->push_mm_s, 1, "mm/s"));
    row(panel, "Turned", MARK_NONE, "%s at %s", panel_figure(value, sizeof value, tool->turned_deg, 0, "\u00b0"),
        panel_figure(other, sizeof other, tool->twist_deg_s, 0, "\u00b0/s"));
    row(panel, "Wall, most / sum", MARK_NONE, "%s / %s", panel_figure(value, sizeof value, 1000 * state->wall_max_n, 0, ""),
        panel_figure(other, sizeof other, 1000 * state->wall_sum_n, 0, "mN"));
    plot_draw(&panel->force[chosen], panel->gui, "Push force", "mN", 0, 100, panel->plot_height);
    plot_draw(&panel->torque[chosen], panel->gui, "Torque", "N mm", 3, 0.02, panel->plot_height);
    if (panel->plots == 3)
        plot_draw(&panel->wall, panel->gui, "Wall force, largest", "mN", 0, 100, panel->plot_height);
}

static void draw_hands(Panel *panel, const PanelState *state)
{
    static const char *const device_state[] = {"absent", "ready", "lost"};
    static const PanelMark device_mark[] = {MARK_NONE, MARK_GOOD, MARK_BAD};
    panel_heading(panel, "HANDS");
    for (int i = 0; i < state->device_count; i++) {
        const PanelDevice *device = &state->device[i];
        row(panel, panel_text(device->name), device_mark[device->state], "%s", device_state[device->state]);
        if (panel_text(device->note)[0])
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
    // the plots take the remaining height; if that is too little the rows shrink, and finally the column scrolls
    float room = panel->plot_height * (float)panel->plots - gui_window_end(gui) - 2;
    panel->is_dense = panel->is_dense || room < 2 * least;   // until the window is resized, to avoid flicker
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
    gui_text(gui, GUI_LARGE, gui_colors.text, panel_text(state->title)[0] ? state->title : "Seldinger");
    if (panel_text(state->trainee)[0]) {
        gui_beside(gui, 2 * gap);
        gui_text(gui, GUI_LARGE, gui_colors.dim, state->trainee);
    }
    if (state->is_examination) {
        gui_beside(gui, 2 * gap);
        gui_text(gui, GUI_LARGE, gui_colors.warning, "Examination");
    }
    gui_window_end(gui);
    gui_window_begin(gui, "badges", badges, GUI_NO_INPUT | GUI_KEPT);
    if (state->xray.pedal > 0)
        badge(panel, "\u25cf X-RAY ON", gui_colors.warning, gui_colors.window);
    else
        badge(panel, "\u25cb X-ray off", gui_colors.frame, gui_colors.dim);
    gui_beside(gui, gap);
    badge(panel, panel_mode_name[state->mode], gui_colors.frame_on, gui_colors.text);
    gui_beside(gui, gap);
    snprintf(text, sizeof text, "%s%s", state->is_paused ? tr("PAUSED ") : "", panel_minutes(time, sizeof time, state->time_s));
    badge(panel, text, state->is_paused ? gui_colors.warning : gui_colors.frame, state->is_paused ? gui_colors.window : gui_colors.text);
    gui_window_end(gui);
    gui_window_begin(gui, "session", session, GUI_KEPT);
    static const ActionId action[] = {ACTION_PAUSE, ACTION_HELP, ACTION_QUIT};
    for (int i = 0; i < 3; i++) {
        if (i > 0)
            gui_beside(gui, gap);
        panel_action_button(panel, state, action[i], "top", button);
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
        snprintf(text, sizeof text, "%s  %s%s", panel_minutes(time, sizeof time, message->now_s), panel_sign[message->mark], message->text);
        gui_text_wrapped(gui, GUI_SMALL, panel_mark_color(message->mark), text);
    }
    gui_window_end(gui);
}

static void small_row(Panel *panel, const char *label, PanelMark mark, const char *text)
{
    char marked[96];
    snprintf(marked, sizeof marked, "%s%s", panel_sign[mark], text);
    gui_row(panel->gui, GUI_SMALL, label, panel_mark_color(mark), marked);
}

static void draw_machine(Panel *panel, const PanelState *state, GuiRect at)
{
    char text[96], one[32], other[32];
    gui_window_begin(panel->gui, "machine", at, GUI_KEPT | GUI_SELDOM | GUI_NO_INPUT);
    snprintf(text, sizeof text, "%s / %s", panel_figure(one, sizeof one, state->step_median_us, 0, ""),
             panel_figure(other, sizeof other, state->step_p999_us, 0, "\u00b5s"));
    small_row(panel, "Step, median / p99.9", MARK_NONE, text);
    snprintf(text, sizeof text, tr("\u00d7%s, %lld missed"), panel_figure(one, sizeof one, state->real_time_factor, 2, ""), (long long)state->missed_deadlines);
    small_row(panel, "Real time, deadlines", state->warnings & (WARN_SLOW | WARN_STALLED) ? MARK_WARNING : MARK_NONE, text);
    panel_figure(one, sizeof one, state->frame_ms, 1, "ms");
    snprintf(text, sizeof text, state->shown_side > state->drawn_side ? tr("%s, image %d of %d px") : tr("%s per frame"), one, state->drawn_side,
             state->shown_side);
    small_row(panel, "Drawing", MARK_NONE, text);
    gui_window_end(panel->gui);
}

// Draws hint, messages and figures of the machine.
static void draw_bottom(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    GuiRect at = panel->layout.bottom, hints = at, log = at, machine = at;
    float s = gui_scale(gui);
    char text[256];
    int hint = panel->has_hints ? panel_current_hint(panel, state->tool_count) : -1;
    const bool is_happening = panel->has_hints && panel_happening_text(state, text, sizeof text), is_shown = is_happening || hint >= 0;
    machine.width = floorf(268 * s);
    machine.x = at.width - machine.width;
    hints.width = is_shown ? floorf(machine.x * 0.58f) : 0;
    log.x = hints.width;
    log.width = machine.x - hints.width;
    if (is_shown) {
        gui_window_begin(gui, "hint", hints, GUI_NO_INPUT | GUI_KEPT);
        gui_draw_fill(gui, (GuiRect){hints.x + floorf(5 * s), hints.y + floorf(8 * s), floorf(3 * s), hints.height - floorf(16 * s)}, gui_colors.accent);
        gui_place(gui, floorf(4 * s), 1);
        gui_beside(gui, 0);
        if (!is_happening)
            panel_hint_text(hint, text, sizeof text);
        if (state->is_finished && panel->is_replay) {
            snprintf(text, sizeof text, "%s", tr("The exercise is over; its report compares it with earlier ones."));
        } else if (state->is_finished) {
            char restart[16], quit[16];
            snprintf(text, sizeof text, tr("The exercise is over. %s restarts it, %s ends the session; its report compares it with earlier ones."),
                     key_table_text(ACTION_RESTART, restart, sizeof restart), key_table_text(ACTION_QUIT, quit, sizeof quit));
        }
        enum { TWO_LINES = 120 };    // letters of the large font
        gui_text_wrapped(gui, strlen(text) > TWO_LINES ? GUI_NORMAL : GUI_LARGE, gui_colors.text, text);
        gui_window_end(gui);
    }
    draw_log(panel, log);
    draw_machine(panel, state, machine);
}

void panel_draw_all(Panel *panel, const WindowInput *input, const PanelState *state)
{
    panel_draw_over_views(panel, state);
    if (panel->has_panels) {
        draw_top(panel, state);
        draw_left(panel, state);
        panel_draw_controls(panel, state);
        draw_bottom(panel, state);
    }
    panel_draw_briefing(panel, state);
    if (panel->has_help)
        panel_draw_help(panel, input, state);
    if (panel->dialogue == DIALOGUE_TRAY)
        panel_draw_tray(panel, input, state);
    else if (panel->dialogue != DIALOGUE_NONE)
        panel_draw_dialogue(panel, input);
}
