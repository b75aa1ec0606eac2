// See edit_window.h.
#include "render/edit_window.h"

#include "render/edit_desk.h"
#include "render/gl_canvas.h"
#include "render/png_file.h"
#include "render/translation.h"
#include "sim/sim.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct EditWindow {
    const EditWindowOptions *options;
    const EditFile *file;
    Window *window;
    Gui *gui;
    EditDesk *desk;
    EditState state;
    bool ends;
    char message[512];
} EditWindow;

static void save(EditWindow *w)
{
    static Faults faults;
    faults_clear(&faults);
    EditState *s = &w->state;
    sweep_editor_try(s->editor, NULL, NULL, NULL);
    if (edit_file_save(w->file, s->editor, w->options->output, &faults)) {
        s->saved_count = sweep_editor_list(s->editor)->count;
        edit_state_say(s, false, "saved as %s", w->options->output);
    } else {
        edit_state_say(s, true, "%s", faults.text[0]);
    }
}

static void do_what_is_wanted(EditWindow *w)
{
    EditDeskWants wants = edit_desk_wants(w->desk);
    EditState *s = &w->state;
    if (wants.undo)
        edit_state_undo(s);
    if (wants.redo)
        edit_state_redo(s);
    if (wants.save)
        save(w);
    bool is_saved = sweep_editor_list(s->editor)->count == s->saved_count;
    if (wants.leave && (is_saved || wants.leave_again))
        w->ends = true;
    else if (wants.leave)
        edit_state_say(s, true, "there are edits that are not saved: {save} saves them, {leave} once more leaves without");
}

static bool take_picture(const EditWindow *w, const WindowInput *input, Faults *faults)
{
    char message[200] = "out of memory";
    uint8_t *rgb = calloc((size_t)input->width * (size_t)input->height, 3);
    if (rgb)
        gl_framebuffer_read(0, input->width, input->height, rgb);
    bool good = rgb && png_file_write(w->options->picture, input->width, input->height, rgb, message, sizeof message);
    free(rgb);
    if (!good)
        faults_add(faults, w->options->picture, 0, 0, "%s", message);
    return good;
}

static bool run_frames(EditWindow *w, Faults *faults)
{
    const WindowInput *input;
    bool has_picture = false;
    for (double begun = clock_s(CLOCK_MONOTONIC); !w->ends;) {
        bool visible = window_next_frame(w->window, &input);
        edit_desk_take_input(w->desk, input);
        if (input->close == WINDOW_CLOSE_REQUESTED)
            edit_desk_leave(w->desk);
        do_what_is_wanted(w);
        if (input->close == WINDOW_ENDED || (w->options->duration_s > 0 && clock_s(CLOCK_MONOTONIC) - begun > w->options->duration_s))
            w->ends = true;
        if (!visible)
            continue;
        if (!edit_desk_draw(w->desk, w->gui, input, w->message, sizeof w->message)) {
            faults_add(faults, w->options->name, 0, 0, "the window cannot be drawn: %s", w->message);
            return false;
        }
        if (w->ends && w->options->picture && !has_picture)
            has_picture = take_picture(w, input, faults);
        window_swap(w->window);
    }
    return faults->count == 0;
}

bool edit_window_run(const EditWindowOptions *options, const EditFile *file, SweepEditor *editor, const Volume *volume, Faults *faults)
{
    EditWindow *w = calloc(1, sizeof *w);
    char title[300];
    if (!w) {
        faults_add(faults, options->name, 0, 0, "needs more memory than is available");
        return false;
    }
    w->options = options, w->file = file;
    snprintf(title, sizeof title, "Seldinger edit: %.200s", options->name);
    snprintf(w->message, sizeof w->message, "out of memory");
    bool good = edit_state_begin(&w->state, editor) && (w->window = window_create(title, options->width, options->height, 0, w->message, sizeof w->message)) &&
                (w->gui = gui_create(w->message, sizeof w->message)) && (w->desk = edit_desk_create(&w->state, volume, false, w->message, sizeof w->message));
    if (!good)
        faults_add(faults, options->name, 0, 0, "no window: %s", w->message);
    good = good && run_frames(w, faults);
    edit_desk_destroy(w->desk);
    if (w->gui)
        gui_destroy(w->gui);
    if (w->window)
        window_destroy(w->window);
    edit_state_end(&w->state);
    free(w);
    return good;
}
