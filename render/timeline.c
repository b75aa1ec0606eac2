#include "render/timeline.h"

#include "render/message.h"

#include <stdio.h>
#include <stdlib.h>

struct Timeline {
    Gui *gui;
};

Timeline *timeline_create(char *message, size_t capacity)
{
    Timeline *timeline = calloc(1, sizeof *timeline);
    if (!timeline) {
        message_fail(message, capacity, "out of memory for the timeline");
        return NULL;
    }
    timeline->gui = gui_create(message, capacity);
    if (timeline->gui)
        return timeline;
    free(timeline);
    return NULL;
}

void timeline_destroy(Timeline *timeline)
{
    if (!timeline)
        return;
    gui_destroy(timeline->gui);
    free(timeline);
}

// Draws bookmarks as ticks over the slider, which fills `bar`.
static void draw_marks(Gui *gui, const TimelineState *state, GuiRect bar, float scale)
{
    for (int i = 0; i < state->mark_count && state->end_s > 0; i++) {
        float x = bar.x + bar.width * (float)(state->mark_s[i] / state->end_s);
        gui_draw_line(gui, x, bar.y - 3 * scale, x, bar.y + bar.height + 3 * scale, gui_colors.warning, 2 * scale);
    }
}

TimelineActions timeline_draw(Timeline *timeline, const WindowInput *input, const TimelineState *state, double scale, PanelRect at, unsigned framebuffer)
{
    Gui *gui = timeline->gui;
    TimelineActions actions = {.speed = state->speed};
    float s = (float)scale, time = (float)state->time_s;
    gui_begin(gui, input, scale, false);
    gui_window_begin(gui, "timeline", at, 0);
    actions.toggle_play = gui_button(gui, "play", state->is_playing ? "Stop" : "Play", "P", 90 * s, state->is_playing).pressed;
    gui_beside(gui, 6 * s);
    if (gui_button(gui, "back", "-5 s", "Left", 90 * s, false).pressed) {
        actions.seek = true;
        actions.seek_s = state->time_s - 5;
    }
    gui_beside(gui, 6 * s);
    if (gui_button(gui, "on", "+5 s", "Right", 90 * s, false).pressed) {
        actions.seek = true;
        actions.seek_s = state->time_s + 5;
    }
    gui_beside(gui, 6 * s);
    gui_slider(gui, "speed", &actions.speed, 0.1F, 8, "speed %.1f", 130 * s);
    gui_beside(gui, 6 * s);
    actions.resume = gui_button(gui, "resume", "Continue from here", "F5", 190 * s, false).pressed;
    gui_beside(gui, 10 * s);
    gui_text(gui, GUI_NORMAL, gui_colors.dim, state->note ? state->note : "");
    char label[64];
    snprintf(label, sizeof label, "%%.2f s of %.2f s", state->end_s);
    GuiRect bar = {at.x + 8 * s, at.y + at.height - gui_line_height(gui, GUI_NORMAL) - 14 * s, at.width - 16 * s, gui_line_height(gui, GUI_NORMAL)};
    if (gui_slider(gui, "time", &time, 0, (float)state->end_s, label, 0)) {
        actions.seek = true;
        actions.seek_s = (double)time;
    }
    draw_marks(gui, state, bar, s);
    gui_window_end(gui);
    gui_end(gui, framebuffer);
    return actions;
}
