// The trainer's panels around the views: figures, running plots, exercise, devices, controls, messages, help. Plain data in, actions out; draws with
// Dear ImGui, identically in a window and off screen (--picture, --movie). A frame:
//     input = window_next_frame            keys and mouse
//     panel_take_input(panel, input, &a)   user actions; apply them before drawing
//     layout = panel_layout(...)           draw the views into layout.view[]
//     panel_draw(panel, input, &state, 0)  over and around the views
//     window_swap
#ifndef SELDINGER_RENDER_PANEL_H
#define SELDINGER_RENDER_PANEL_H

#include "render/panel_layout.h"
#include "render/panel_state.h"
#include "render/panel_tray.h"
#include "render/window.h"

typedef struct Panel Panel;

// Needs a current GL context, of a window or off screen. Returns NULL with a reason.
Panel *panel_create(char *message, size_t capacity);
void panel_destroy(Panel *panel);

void panel_take_input(Panel *panel, const WindowInput *input, PanelActions *actions);
void panel_draw(Panel *panel, const WindowInput *input, const PanelState *state, unsigned framebuffer);

// Adds a sample to the running plots of a tool. panel_draw adds one itself, but more frequent samples preserve peaks. Simulated time [s].
void panel_sample(Panel *panel, int tool, double time_s, double force_n, double torque_n_mm, double wall_max_n);
void panel_forget_samples(Panel *panel);         // after a restart or a jump in time

void panel_message(Panel *panel, double now_s, PanelMark mark, const char *text);   // adds a line to the log; the last 100 are kept
void panel_show_help(Panel *panel, bool is_shown);
bool panel_has_panels(const Panel *panel);       // Tab hides them; pass the result to panel_layout
void panel_show_hints(Panel *panel, bool is_shown);
void panel_show_replay(Panel *panel);            // nothing is saved: Esc asks for less, and there is no restart and no trainee
bool panel_is_asking(const Panel *panel);        // true if a dialogue has the keyboard
void panel_ask(Panel *panel, PanelQuestion question);    // Enter, Esc or a button gives PanelActions.answer
// The tray: the caller opens it (ACTION_EXCHANGE, a button of a device), the user or the caller closes it. While open it has the keyboard.
void panel_open_tray(Panel *panel, int device_count, int device);      // with this device selected
void panel_close_tray(Panel *panel);

#endif
