#include "render/panel.h"

#include "render/message.h"

#include <stdlib.h>
#include <string.h>

struct Panel {
    KeyState keys;
    bool has_panels, has_hints;
};

Panel *panel_create(char *message, size_t capacity)
{
    Panel *panel = calloc(1, sizeof *panel);
    if (!panel)
        message_fail(message, capacity, "out of memory");
    else
        panel->has_panels = panel->has_hints = true;
    return panel;
}

void panel_destroy(Panel *panel) { free(panel); }

PanelLayout panel_layout(int width, int height, double scale, PanelView view, bool has_panels)
{
    (void)has_panels;
    PanelLayout layout = {.scale = scale, .main = view == VIEW_ALL ? VIEW_FLUOROSCOPY : view};
    layout.view[layout.main] = (ViewPort){0, 0, 0, width, height};
    layout.view_rect[layout.main] = (PanelRect){0, 0, (float)width, (float)height};
    return layout;
}

void panel_take_input(Panel *panel, const WindowInput *input, PanelActions *actions)
{
    *actions = (PanelActions){.mouse.view = -1};
    key_state_begin(&panel->keys);
    key_state_feed(&panel->keys, input, false);
    memcpy(actions->held, panel->keys.held, sizeof actions->held);
    memcpy(actions->pressed, panel->keys.pressed, sizeof actions->pressed);
    if (input->close != WINDOW_OPEN)
        actions->pressed[ACTION_QUIT]++;
}

void panel_draw(Panel *panel, const WindowInput *input, const PanelState *state, unsigned framebuffer)
{
    (void)panel, (void)input, (void)state, (void)framebuffer;
}

void panel_sample(Panel *panel, double time_s, double force_n, double torque_n_mm, double wall_max_n)
{
    (void)panel, (void)time_s, (void)force_n, (void)torque_n_mm, (void)wall_max_n;
}
void panel_forget_samples(Panel *panel) { (void)panel; }
void panel_message(Panel *panel, double now_s, PanelMark mark, const char *text) { (void)panel, (void)now_s, (void)mark, (void)text; }
void panel_show_help(Panel *panel, bool is_shown) { (void)panel, (void)is_shown; }
bool panel_has_panels(const Panel *panel) { return panel->has_panels; }
void panel_show_hints(Panel *panel, bool is_shown) { panel->has_hints = is_shown; }
bool panel_is_asking(const Panel *panel) { return !panel; }
