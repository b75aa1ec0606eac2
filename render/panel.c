#include "render/panel.h"

#include "render/message.h"
#include "render/panel_internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FRAME_S (1.0 / 30)

// ---- create and destroy

Panel *panel_create(char *message, size_t capacity)
{
    Panel *panel = calloc(1, sizeof *panel);
    Gui *gui = panel ? gui_create(message, capacity) : NULL;
    if (!gui) {
        if (!panel)
            message_fail(message, capacity, "out of memory");
        free(panel);
        return NULL;
    }
    panel->gui = gui;
    panel->has_panels = panel->has_hints = true;
    panel->drag_view = -1;
    panel->plots = 2;
    panel->plot_height = 60;
    memcpy(panel->tray_value, (const float[3]){10, 45, 1}, sizeof panel->tray_value);
    panel_forget_samples(panel);
    return panel;
}

void panel_destroy(Panel *panel)
{
    if (!panel)
        return;
    gui_destroy(panel->gui);
    free(panel);
}

// ---- input

static void open_dialogue(Panel *panel, Dialogue dialogue)
{
    panel->dialogue = dialogue;
    panel->dialogue_is_new = true;
    panel->answer = 0;
    panel->has_help = false;
    panel->drag_buttons = 0;
    key_state_release(&panel->keys);
    memset(panel->mouse_held, 0, sizeof panel->mouse_held);
}

// Printable text without leading and trailing blanks; control characters of a pasted or typed name are removed.
static void trim_name(const char *from, char *to, size_t capacity)
{
    size_t length = 0;
    for (; *from && length + 1 < capacity; from++)
        if ((unsigned char)*from >= ' ' && *from != 127 && !(length == 0 && *from == ' '))
            to[length++] = *from;
    while (length > 0 && to[length - 1] == ' ')
        length--;
    to[length] = 0;
}

static void confirm(Panel *panel, PanelActions *actions)
{
    if (panel->dialogue == DIALOGUE_QUIT)
        actions->pressed[ACTION_QUIT] = 1;
    if (panel->dialogue == DIALOGUE_RESTART)
        actions->pressed[ACTION_RESTART] = 1;
    if (panel->dialogue == DIALOGUE_TRAINEE) {
        trim_name(panel->name, actions->trainee, sizeof actions->trainee);
        actions->trainee_set = actions->trainee[0] != 0;
    }
    if (panel->dialogue == DIALOGUE_QUESTION)
        actions->answer = 1;
    panel->dialogue = DIALOGUE_NONE;
}

// Number of presses of a key in this frame.
static int presses(const WindowInput *input, int key)
{
    int count = 0;
    for (int i = 0; i < input->event_count; i++)
        count += input->event[i].kind == WINDOW_KEY_DOWN_EVENT && input->event[i].key == key && !input->event[i].is_repeat;
    return count;
}

static bool has_key(const WindowInput *input, int key) { return presses(input, key) > 0; }

// X closes the box that X opened. The keys of a tip's length, angle and mandrel: less, more.
static void take_tray(Panel *panel, const WindowInput *input, PanelActions *actions)
{
    static const int tip_keys[3][2] = {{WINDOW_KEY_PAGE_DOWN, WINDOW_KEY_PAGE_UP}, {WINDOW_KEY_LEFT, WINDOW_KEY_RIGHT}, {WINDOW_KEY_HOME, WINDOW_KEY_END}};
    bool is_closed = actions->pressed[ACTION_QUIT] > 0 || panel->answer < 0 || has_key(input, key_table_binding(ACTION_EXCHANGE).key);
    bool is_taken = panel->answer > 0 || has_key(input, WINDOW_KEY_ENTER);
    panel_move_in_tray(panel, presses(input, WINDOW_KEY_DOWN) - presses(input, WINDOW_KEY_UP));
    panel->tray.is_shaped ^= presses(input, 'S') % 2;
    for (int i = 0; i < 3; i++)
        panel_shape_in_tray(panel, i, presses(input, tip_keys[i][1]) - presses(input, tip_keys[i][0]));
    panel->answer = 0;
    if (is_closed && !is_taken)
        panel_close_tray(panel);
    actions->tray = panel->tray;
    actions->tray.is_open = panel->dialogue == DIALOGUE_TRAY;
    actions->tray.is_taken = is_taken;
    actions->tray.length_mm = (double)panel->tray_value[0];
    actions->tray.angle_deg = (double)panel->tray_value[1];
    actions->tray.mandrel_mm = (double)panel->tray_value[2];
}

static void take_dialogue(Panel *panel, const WindowInput *input, PanelActions *actions)
{
    bool is_refused = actions->pressed[ACTION_QUIT] > 0 || panel->answer < 0;   // Escape, or the button
    // a second click on the close button of the window confirms
    bool is_confirmed = panel->answer > 0 || (panel->dialogue != DIALOGUE_TRAINEE && has_key(input, WINDOW_KEY_ENTER)) ||
                        (panel->dialogue == DIALOGUE_QUIT && input->close == WINDOW_CLOSE_REQUESTED);
    if (panel->dialogue == DIALOGUE_TRAY)
        take_tray(panel, input, actions);
    int full_screen = actions->pressed[ACTION_FULL_SCREEN], picture = actions->pressed[ACTION_SCREENSHOT];
    memset(actions->pressed, 0, sizeof actions->pressed);
    memset(actions->held, 0, sizeof actions->held);
    actions->pressed[ACTION_FULL_SCREEN] = full_screen;
    actions->pressed[ACTION_SCREENSHOT] = picture;
    if (panel->dialogue == DIALOGUE_TRAY)
        return;
    if (is_confirmed)
        confirm(panel, actions);
    else if (is_refused) {
        actions->answer = panel->dialogue == DIALOGUE_QUESTION ? -1 : 0;
        panel->dialogue = DIALOGUE_NONE;
    }
    panel->answer = 0;
}

static bool is_inside(GuiRect r, double x, double y) { return x >= r.x && x < r.x + r.width && y >= r.y && y < r.y + r.height; }

// The text of the exercise is hidden after the first actions.
static void take_briefing(Panel *panel, PanelActions *actions)
{
    static const ActionId follows[] = {ACTION_PUSH, ACTION_PULL, ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT, ACTION_PEDAL, ACTION_PEDAL_LATCH};
    bool is_shown = panel->briefing_at.width > 0;
    double used = 0;
    for (size_t i = 0; i < sizeof follows / sizeof follows[0]; i++)
        used += panel->used_s[follows[i]];
    if (panel->briefing == BRIEFING_AT_BEGIN && used > 0.5)
        panel->briefing = BRIEFING_CLOSED;
    if (is_shown && !panel->has_help && actions->pressed[ACTION_QUIT] > 0) {
        panel->briefing = BRIEFING_CLOSED;
        actions->pressed[ACTION_QUIT] = 0;
    }
    if (actions->pressed[ACTION_BRIEFING] % 2)
        panel->briefing = is_shown ? BRIEFING_CLOSED : BRIEFING_OPEN;
}

// Handles the actions of the panel itself. Restart and quit ask for confirmation first.
static void take_own_actions(Panel *panel, const WindowInput *input, PanelActions *actions)
{
    int *pressed = actions->pressed;
    take_briefing(panel, actions);
    if (panel->has_help && pressed[ACTION_QUIT] > 0) {
        panel->has_help = false;
        pressed[ACTION_QUIT] = 0;
    }
    if (pressed[ACTION_HELP] % 2)
        panel->has_help = !panel->has_help;
    if (pressed[ACTION_PANELS] % 2)
        panel->has_panels = !panel->has_panels;
    if (pressed[ACTION_HINTS] % 2)
        panel->has_hints = !panel->has_hints;
    if (pressed[ACTION_QUIT] > 0 || input->close == WINDOW_CLOSE_REQUESTED)
        open_dialogue(panel, DIALOGUE_QUIT);
    else if (pressed[ACTION_RESTART] > 0 && !panel->is_replay)
        open_dialogue(panel, DIALOGUE_RESTART);
    else if (pressed[ACTION_TRAINEE] > 0 && !panel->is_replay)
        open_dialogue(panel, DIALOGUE_TRAINEE);
    pressed[ACTION_QUIT] = pressed[ACTION_RESTART] = 0;
    if (panel->dialogue != DIALOGUE_NONE)
        memset(actions->held, 0, sizeof actions->held);
}

static int view_at(const Panel *panel, double x, double y)
{
    if (is_inside(panel->briefing_at, x, y))
        return -1;
    for (int i = 0; i < VIEW_COUNT; i++)
        if (is_inside(panel->layout.view_rect[i], x, y))
            return i;
    return -1;
}

static void take_mouse(Panel *panel, const WindowInput *input, PanelActions *actions)
{
    PanelMouse *mouse = &actions->mouse;
    bool is_covered = !panel->is_drawn || panel->dialogue != DIALOGUE_NONE || panel->has_help;
    int over = is_covered || input->mouse_x < 0 || input->mouse_y < 0 ? -1 : view_at(panel, input->mouse_x, input->mouse_y);
    unsigned buttons = input->has_focus ? input->mouse_buttons : 0;
    double dx = input->mouse_x - panel->mouse_x, dy = input->mouse_y - panel->mouse_y;
    if (panel->drag_view >= 0) {
        panel->dragged += fabs(dx) + fabs(dy);
        // a click on a small view makes it the main one
        if (!buttons && panel->drag_buttons && panel->dragged < 5 * panel->layout.scale && panel->drag_view != (int)panel->layout.main &&
            over == panel->drag_view)
            actions->pressed[ACTION_VIEW_FLUOROSCOPY + panel->drag_view]++;
    }
    if (!buttons || is_covered) {
        panel->drag_view = -1;
        panel->drag_buttons = 0;
    } else if (panel->drag_view < 0 && !panel->drag_buttons) {
        panel->drag_view = over;
        panel->drag_buttons = buttons;
        panel->dragged = 0;
        dx = dy = 0;
    }
    mouse->view = panel->drag_view >= 0 ? panel->drag_view : over;
    if (mouse->view >= 0) {
        PanelRect r = panel->layout.view_rect[mouse->view];
        mouse->x = (input->mouse_x - r.x) / r.width;
        mouse->y = 1 - (input->mouse_y - r.y) / r.height;
        if (panel->drag_view >= 0) {
            mouse->buttons = buttons;
            mouse->drag_x = dx / r.height;
            mouse->drag_y = -dy / r.height;
        }
        for (int i = 0; i < input->event_count; i++)
            if (input->event[i].kind == WINDOW_SCROLL_EVENT)
                mouse->scroll += input->event[i].scroll_y;
    }
    panel->mouse_x = input->mouse_x;
    panel->mouse_y = input->mouse_y;
}

void panel_take_input(Panel *panel, const WindowInput *input, PanelActions *actions)
{
    *actions = (PanelActions){.mouse.view = -1};
    panel->is_interactive = true;
    key_state_begin(&panel->keys);
    key_state_feed(&panel->keys, input, panel->dialogue != DIALOGUE_NONE);
    bool is_mouse_down = (input->mouse_buttons & WINDOW_MOUSE_LEFT) && input->has_focus;
    for (int i = 0; i < ACTION_COUNT; i++) {
        actions->held[i] = panel->keys.held[i] || (panel->mouse_held[i] && is_mouse_down) || panel->latched[i];
        actions->pressed[i] = panel->keys.pressed[i] + panel->mouse_pressed[i];
        panel->mouse_pressed[i] = 0;
    }
    if (!is_mouse_down)
        memset(panel->mouse_held, 0, sizeof panel->mouse_held);
    take_mouse(panel, input, actions);
    if (panel->dialogue != DIALOGUE_NONE)
        take_dialogue(panel, input, actions);
    else
        take_own_actions(panel, input, actions);
    if (input->close == WINDOW_ENDED)
        actions->pressed[ACTION_QUIT] = 1;
    if (panel->xray_set && panel->dialogue == DIALOGUE_NONE) {
        actions->xray_set = true;
        actions->xray = panel->xray;
    }
    panel->xray_set = false;
    for (int i = 0; i < ACTION_COUNT; i++)
        panel->used_s[i] += actions->held[i] ? FRAME_S : actions->pressed[i];
    memcpy(panel->held, actions->held, sizeof panel->held);
}

// ---- state

void panel_sample(Panel *panel, int tool, double time_s, double force_n, double torque_n_mm, double wall_max_n)
{
    plot_add(&panel->force[tool], time_s, 1000 * force_n);
    plot_add(&panel->torque[tool], time_s, torque_n_mm);
    plot_add(&panel->wall, time_s, 1000 * wall_max_n);
}

void panel_forget_samples(Panel *panel)
{
    for (int k = 0; k < PANEL_TOOLS; k++) {
        plot_clear(&panel->force[k]);
        plot_clear(&panel->torque[k]);
    }
    plot_clear(&panel->wall);
}

void panel_message(Panel *panel, double now_s, PanelMark mark, const char *text)
{
    PanelMessage *message = &panel->message[panel->message_count++ % PANEL_MESSAGES];
    message->now_s = now_s;
    message->mark = mark;
    snprintf(message->text, sizeof message->text, "%s", text);
}

void panel_show_help(Panel *panel, bool is_shown) { panel->has_help = is_shown; }
bool panel_has_panels(const Panel *panel) { return panel->has_panels; }
void panel_show_replay(Panel *panel) { panel->is_replay = true; }
void panel_show_hints(Panel *panel, bool is_shown) { panel->has_hints = is_shown; }
bool panel_is_asking(const Panel *panel) { return panel->dialogue != DIALOGUE_NONE; }

void panel_ask(Panel *panel, PanelQuestion question)
{
    open_dialogue(panel, DIALOGUE_QUESTION);
    panel->question = question;
}

void panel_open_tray(Panel *panel, int device_count, int device)
{
    open_dialogue(panel, DIALOGUE_TRAY);
    panel->tray_count = device_count;
    panel->tray_shown = -1;
    panel->tray = (PanelTrayChoice){.is_open = true, .device = device};
}

void panel_close_tray(Panel *panel)
{
    if (panel->dialogue == DIALOGUE_TRAY)
        panel->dialogue = DIALOGUE_NONE;
    panel->tray = (PanelTrayChoice){0};
}

// ---- drawing

void panel_draw(Panel *panel, const WindowInput *input, const PanelState *state, unsigned framebuffer)
{
    for (int k = 0; k < state->tool_count; k++)
        panel_sample(panel, k, state->time_s, state->tool[k].force_n, state->tool[k].torque_n_mm, state->wall_max_n);
    PanelLayout layout = state->is_examination ? panel_layout_xray_alone(input->width, input->height, input->scale, panel->has_panels)
                                               : panel_layout(input->width, input->height, input->scale, state->view, panel->has_panels);
    if (state->second != SECOND_NONE)
        panel_layout_add_second(&layout, input->height);
    // the result opens once; it can be closed and opened again like the text of the exercise, and goes with a new session
    if (state->is_finished != panel->was_finished)
        panel->briefing = state->is_finished ? BRIEFING_OPEN : BRIEFING_CLOSED;
    panel->was_finished = state->is_finished;
    bool is_new = !panel->is_drawn || panel->width != input->width || panel->height != input->height || layout.scale != panel->layout.scale;
    panel->layout = layout;
    panel->width = input->width;
    panel->height = input->height;
    if (is_new) {
        panel->is_dense = false;
        // the size of the contents is known only after the layout, and a scroll bar changes it
        for (int i = 0; i < 4; i++) {
            gui_begin(panel->gui, input, layout.scale, true);
            panel_draw_all(panel, input, state);
            gui_end(panel->gui, framebuffer);
        }
    }
    panel->is_drawn = true;
    gui_begin(panel->gui, input, layout.scale, false);
    panel_draw_all(panel, input, state);
    panel->dialogue_is_new = false;
    gui_end(panel->gui, framebuffer);
}
