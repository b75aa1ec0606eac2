#include "render/start_window.h"

#include "render/redraw.h"
#include "render/settings_in_force.h"
#include "render/start_pages.h"

#include <stdio.h>

static void run_frames(StartWindow *w)
{
    const WindowInput *input;
    Redraw redraw = {0};
    for (double begun = clock_s(CLOCK_MONOTONIC); !w->ends;) {
        bool visible = window_next_frame(w->window, &input);
        for (int i = 0; i < input->event_count && !w->ends; i++) {
            const WindowEvent *event = &input->event[i];
            if ((event->kind == WINDOW_KEY_DOWN_EVENT || event->kind == WINDOW_TEXT_EVENT) && !gui_takes_text(w->gui) && w->takes_name == 0)
                start_press(w, event);
            else if (event->kind == WINDOW_DROP_EVENT)
                start_choose(w, START_STEER, window_dropped(w->window));
        }
        w->ends |= input->close != WINDOW_OPEN || (w->options->duration_s > 0 && clock_s(CLOCK_MONOTONIC) - begun > w->options->duration_s);
        // values of devices change without input, and a field gets the keys in the picture after the next
        const double refresh_s = w->state->page == PAGE_DEVICES || w->takes_name > 0 ? 0 : 0.5;
        if (!visible || w->ends || !redraw_is_due(&redraw, input, NULL, 0, clock_s(CLOCK_MONOTONIC), refresh_s))
            continue;
        start_draw(w, input, 0);
        if (settings_page_save(&w->settings))
            settings_put_in_force(&w->settings.settings);
        window_swap(w->window);
    }
}

StartChoice start_window_run(const StartOptions *options, StartState *state, Faults *faults)
{
    StartWindow w = {.options = options, .state = state};
    char message[512] = "";
    snprintf(w.message, sizeof w.message, "%s", options->message);
    if ((w.window = window_create("Seldinger", options->width, options->height, 0, message, sizeof message)) && (w.gui = gui_create(message, sizeof message))) {
        start_open(&w);
        run_frames(&w);
        start_close(&w);
    } else {
        faults_add(faults, "seldinger", 0, 0, "no window: %s", message);
    }
    if (w.gui)
        gui_destroy(w.gui);
    if (w.window)
        window_destroy(w.window);
    return w.choice;
}
