#include "render/timeline.h"

#include "render/message.h"
#include "render/replay_keys.h"
#include "render/score_parts_box.h"
#include "render/session_figures.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

// --- actions ---

static void ask_for_time(TimelineActions *actions, double time_s)
{
    actions->seek = true;
    actions->seek_s = time_s;
}

static void ask_for_mark(TimelineActions *actions, const TimelineState *state, bool is_after)
{
    int mark = !state->marks ? -1 : is_after ? run_marks_after(state->marks, state->time_s) : run_marks_before(state->marks, state->time_s);
    if (mark < 0)
        return;
    ask_for_time(actions, state->marks->mark[mark].time_s);
    actions->stop = true;
}

TimelineActions timeline_take_keys(const WindowInput *input, const TimelineState *state)
{
    TimelineActions actions = {.speed = state->speed};
    for (int i = 0; i < input->event_count; i++) {
        const WindowEvent *event = &input->event[i];
        const bool is_before = replay_key_is_pressed(REPLAY_MARK_BEFORE, event), is_slower = replay_key_is_pressed(REPLAY_SLOWER, event);
        if (is_before || replay_key_is_pressed(REPLAY_MARK_AFTER, event))
            ask_for_mark(&actions, state, !is_before);
        if (is_slower || replay_key_is_pressed(REPLAY_FASTER, event))
            actions.speed = fminf(8, fmaxf(0.1F, actions.speed * (is_slower ? 0.8F : 1.25F)));
        actions.toggle_parts ^= !event->is_repeat && replay_key_is_pressed(REPLAY_PARTS, event);
        actions.toggle_step ^= !event->is_repeat && replay_key_is_pressed(REPLAY_STEP, event) && state->side;
    }
    return actions;
}

// --- marks ---

static float place(const TimelineState *state, GuiRect bar, double time_s)
{
    return bar.x + bar.width * (float)fmin(1, fmax(0, state->end_s > 0 ? time_s / state->end_s : 0));
}

static Color color_of(const RunMark *mark)
{
    switch (mark->kind) {
    case RUN_MARK_ERROR: return color_qualitative((int)mark->error);      // and its letter, as in the report
    case RUN_MARK_BOOKMARK: return gui_colors.warning;
    case RUN_MARK_TARGET: return gui_colors.good;
    case RUN_MARK_INJECTION: break;
    }
    return gui_colors.accent;
}

static void sign_of(const RunMark *mark, char text[8])
{
    const char *sign = mark->kind == RUN_MARK_BOOKMARK ? "\u25cf" : mark->kind == RUN_MARK_TARGET ? "\u2713" : "+";
    if (mark->kind == RUN_MARK_ERROR)
        snprintf(text, 8, "%c", session_error_letter(mark->error));
    else
        snprintf(text, 8, "%s", sign);
}

// The mark under the mouse, which may be up to 5 points beside it; -1: none.
static int mark_under(const TimelineState *state, const WindowInput *input, GuiRect bar, float scale)
{
    int nearest = -1;
    double best = 5 * (double)scale;
    bool is_over = input->mouse_y >= (double)bar.y && input->mouse_y < (double)(bar.y + bar.height);
    for (int i = 0; is_over && state->marks && i < state->marks->count; i++) {
        double away = fabs(input->mouse_x - (double)place(state, bar, state->marks->mark[i].time_s));
        if (away < best)
            best = away, nearest = i;
    }
    return nearest;
}

// Over the slider `bar`: a tag with its letter for each mark, a band for each injection along the upper edge, the X-ray pulses along the lower one.
static void draw_marks(Gui *gui, const TimelineState *state, GuiRect bar, float scale)
{
    const RunMarks *marks = state->marks;
    float last_x = -100;
    if (!marks)
        return;
    for (int i = 0; i < marks->xray_count; i++) {
        float from = place(state, bar, marks->xray[i].from_s), to = place(state, bar, marks->xray[i].to_s);
        gui_draw_fill(gui, (GuiRect){from, bar.y + bar.height, fmaxf(to - from, 1), 4 * scale}, gui_colors.warning);
    }
    if (state->known_s < state->end_s) {
        float from = place(state, bar, state->known_s);
        gui_draw_fill(gui, (GuiRect){from, bar.y, bar.x + bar.width - from, 2 * scale}, gui_colors.dim);
    }
    for (int i = 0; i < marks->count; i++) {
        const RunMark *mark = &marks->mark[i];
        char sign[8];
        float x = place(state, bar, mark->time_s), width, height;
        sign_of(mark, sign);
        gui_text_extent(gui, GUI_SMALL, sign, &width, &height);
        gui_draw_fill(gui, (GuiRect){x - scale, bar.y, 2 * scale, bar.height}, color_of(mark));
        if (mark->kind == RUN_MARK_INJECTION)
            gui_draw_fill(gui, (GuiRect){x, bar.y, fmaxf(place(state, bar, mark->time_s + mark->seconds) - x, 1), 3 * scale}, color_of(mark));
        GuiRect tag = {x - width / 2 - 2 * scale, bar.y + (bar.height - height) / 2, width + 4 * scale, height};
        if (tag.x < last_x)              // its neighbour's tag is there; the line and the text remain
            continue;
        gui_draw_fill(gui, tag, color_of(mark));
        gui_draw_text(gui, x - width / 2, tag.y, GUI_SMALL, gui_colors.window, sign);
        last_x = tag.x + tag.width;
    }
}

// The text of a mark above the strip, at its place.
static void draw_note(Gui *gui, const TimelineState *state, const WindowInput *input, int mark, GuiRect bar, PanelRect at, float scale)
{
    char text[200];
    float width, height, pad = 8 * scale;
    run_mark_text(state->marks, mark, tr, text, sizeof text);
    gui_text_extent(gui, GUI_NORMAL, text, &width, &height);
    GuiRect box = {place(state, bar, state->marks->mark[mark].time_s) - width / 2 - pad, 0, width + 2 * pad + 2, height + 2 * pad};
    box.x = fmaxf(0, fminf(box.x, (float)input->width - box.width));
    box.y = at.y - box.height - 2 * scale;
    gui_window_begin(gui, "mark", box, GUI_ON_TOP | GUI_NO_INPUT | GUI_FRAMED);
    gui_draw_text(gui, box.x + pad, box.y + pad, GUI_NORMAL, color_of(&state->marks->mark[mark]), text);
    gui_window_end(gui);
}

// --- two recordings side by side ---

static void draw_caption(Gui *gui, const char *id, GuiRect over, const char *text, float s)
{
    float width, height;
    gui_text_extent(gui, GUI_NORMAL, text, &width, &height);
    GuiRect at = {over.x + fmaxf(0, (over.width - width) / 2 - 8 * s), over.y + 6 * s, fminf(width + 16 * s, over.width), height + 10 * s};
    gui_window_begin(gui, id, at, GUI_NO_INPUT | GUI_VEIL);
    gui_draw_text(gui, at.x + 8 * s, at.y + 5 * s, GUI_NORMAL, gui_colors.text, text);
    gui_window_end(gui);
}

static const char *file_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static void draw_captions(Gui *gui, const TimelineState *state, float s)
{
    char text[300];
    const TimelineSide *side = state->side;
    GuiRect half = state->main;
    half.width /= 2;
    draw_caption(gui, "caption", half, file_name(state->note ? state->note : ""), s);
    half.x += half.width;
    if (side->is_in_step)
        snprintf(text, sizeof text, tr("%.200s, in step at %.1f s"), file_name(side->name), side->time_s);
    else
        snprintf(text, sizeof text, "%.200s, %.1f s %s", file_name(side->name), fabs(side->behind_s), side->behind_s >= 0 ? "behind" : "ahead");
    draw_caption(gui, "caption beside", half, text, s);
}

// --- the strip ---

static bool key_button(Gui *gui, const char *id, const char *label, ReplayKey key, float width, bool is_on)
{
    char text[KEY_BINDING_TEXT];
    return gui_button(gui, id, label, replay_key_text(key, text, sizeof text), width, is_on).pressed;
}

static void draw_buttons(Gui *gui, const TimelineState *state, TimelineActions *actions, float s)
{
    const float gap = 5 * s;
    actions->toggle_play = key_button(gui, "play", state->is_playing ? "Stop" : "Play", REPLAY_PLAY, 74 * s, state->is_playing);
    gui_beside(gui, gap);
    if (key_button(gui, "back", "-5 s", REPLAY_BACK, 74 * s, false))
        ask_for_time(actions, state->time_s - 5);
    gui_beside(gui, gap);
    if (key_button(gui, "on", "+5 s", REPLAY_ON, 80 * s, false))
        ask_for_time(actions, state->time_s + 5);
    gui_beside(gui, gap);
    if (key_button(gui, "before", "Mark before", REPLAY_MARK_BEFORE, 116 * s, false))
        ask_for_mark(actions, state, false);
    gui_beside(gui, gap);
    if (key_button(gui, "after", "Mark after", REPLAY_MARK_AFTER, 124 * s, false))
        ask_for_mark(actions, state, true);
    gui_beside(gui, gap);
    gui_slider(gui, "speed", &actions->speed, 0.1F, 8, "speed %.1f", 100 * s);
    gui_beside(gui, gap);
    actions->toggle_parts = key_button(gui, "parts", "Score", REPLAY_PARTS, 84 * s, state->has_parts);
    gui_beside(gui, gap);
    actions->resume = key_button(gui, "resume", "Continue from here", REPLAY_RESUME, 176 * s, false);
    if (state->side) {
        gui_beside(gui, gap);
        actions->toggle_step = key_button(gui, "step", "In step", REPLAY_STEP, 90 * s, state->side->is_in_step);
    }
    gui_beside(gui, 2 * gap);
    gui_text(gui, GUI_NORMAL, gui_colors.dim, state->note ? state->note : "");
}

// A slider that fills the width of the strip; returns where it is.
static GuiRect draw_bar(Gui *gui, PanelRect at, TimelineActions *actions, const TimelineState *state, float s)
{
    char label[128];
    const TimelineSide *side = state->side;
    float time = (float)state->time_s, other = side ? (float)side->time_s : 0;
    const float height = gui_line_height(gui, GUI_NORMAL), width = side ? 0.62F * (at.width - 16 * s) : at.width - 16 * s;
    if (state->scored_s < state->time_s)
        snprintf(label, sizeof label, tr("%%.2f s of %.2f s; score computed up to %.0f s"), state->end_s, state->scored_s);
    else
        snprintf(label, sizeof label, "%%.2f s of %.2f s", state->end_s);
    if (gui_slider(gui, "time", &time, 0, (float)state->end_s, label, width))
        ask_for_time(actions, (double)time);
    if (side) {
        gui_beside(gui, 8 * s);
        snprintf(label, sizeof label, tr("beside: %%.2f s of %.2f s"), side->end_s);
        actions->seek_side = gui_slider(gui, "side", &other, 0, (float)side->end_s, label, 0);
        actions->seek_side_s = (double)other;
    }
    return (GuiRect){at.x + 8 * s, at.y + at.height - height - 17 * s, width, height + 6 * s};
}

TimelineActions timeline_draw(Timeline *timeline, const WindowInput *input, const TimelineState *state, double scale, PanelRect at, unsigned framebuffer)
{
    Gui *gui = timeline->gui;
    TimelineActions actions = {.speed = state->speed};
    float s = (float)scale;
    gui_begin(gui, input, scale, false);
    gui_window_begin(gui, "timeline", at, 0);
    draw_buttons(gui, state, &actions, s);
    GuiRect bar = draw_bar(gui, at, &actions, state, s);
    draw_marks(gui, state, bar, s);
    gui_window_end(gui);
    int shown = mark_under(state, input, bar, s);
    if (shown < 0 && state->marks)
        shown = run_marks_at(state->marks, state->time_s);
    if (shown >= 0)
        draw_note(gui, state, input, shown, bar, at, s);
    if (state->side)
        draw_captions(gui, state, s);
    if (state->has_parts)
        score_parts_box(gui, state->figures, state->side ? state->side->figures : NULL, state->main, (float)input->width);
    gui_end(gui, framebuffer);
    return actions;
}
