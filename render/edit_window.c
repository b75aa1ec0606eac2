// See edit_window.h.
#include "render/edit_window.h"

#include "render/edit_panel.h"
#include "render/edit_scene.h"
#include "render/edit_state.h"
#include "render/gl_canvas.h"
#include "render/gui.h"
#include "render/png_file.h"
#include "render/section_view.h"
#include "render/window.h"
#include "sim/sim.h"
#include "render/translation.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

typedef enum { OVER_NOTHING, OVER_SCENE, OVER_SECTION, OVER_PANEL } Over;

typedef struct EditWindow {
    const EditWindowOptions *options;
    const EditFile *file;
    Window *window;
    Gui *gui;
    EditScene *scene;
    SectionView *section;
    EditState state;
    GuiRect scene_at, section_at, panel_at;
    Over held;               // where the mouse was pressed
    unsigned buttons;        // pressed in the last frame
    double x, y, travel;     // of the mouse; [pixel] since it was pressed
    bool shift, control;     // held down
    bool drags_handle, draws_stroke, moves_blend, shows_help, wants_out, ends;
    int drawn_branch;        // what the scene shows
    double drawn_t;
    char message[512];
} EditWindow;

static bool is_in(GuiRect at, double x, double y)
{
    return x >= (double)at.x && y >= (double)at.y && x < (double)(at.x + at.width) && y < (double)(at.y + at.height);
}

static void lay_out(EditWindow *w, const WindowInput *input)
{
    float k = (float)input->scale, panel = floorf(310 * k), rest = (float)input->width - panel, gap = floorf(2 * k), left = floorf(0.56f * rest);
    w->scene_at = (GuiRect){0, 0, left - gap, (float)input->height};
    w->section_at = (GuiRect){left, 0, rest - left - gap, (float)input->height};
    w->panel_at = (GuiRect){rest, 0, panel, (float)input->height};
}

static void save(EditWindow *w)
{
    static Faults faults;
    faults_clear(&faults);
    EditState *s = &w->state;
    sweep_editor_try(s->editor, NULL, NULL, NULL);
    if (edit_file_save(w->file, s->editor, w->options->output, &faults)) {
        s->saved_count = sweep_editor_list(s->editor)->count;
        edit_state_say(s, false, tr("saved as %s"), w->options->output);
    } else {
        edit_state_say(s, true, "%s", faults.text[0]);
    }
}

static void leave(EditWindow *w)
{
    EditState *s = &w->state;
    if (w->shows_help) {
        w->shows_help = false;
    } else if (s->draws_branch) {
        edit_state_draw_end(s, false);
    } else if (s->looks) {
        edit_state_go(s, s->branch, s->t);
    } else if (sweep_editor_list(s->editor)->count != s->saved_count && !w->wants_out) {
        w->wants_out = true;
        edit_state_say(s, true, "there are edits that are not saved: Ctrl+S saves them, Esc once more leaves without");
        return;
    } else {
        w->ends = true;
    }
    w->wants_out = false;
}

// --- keys ---

static void press_control(EditWindow *w, int key)
{
    if (key == 'Z')
        edit_state_undo(&w->state);
    else if (key == 'Y')
        edit_state_redo(&w->state);
    else if (key == 'S')
        save(w);
}

static void nudge(EditState *s, double by)
{
    Vec3 p = s->contour[s->handle * (EDIT_CONTOUR / EDIT_HANDLES)];
    edit_state_drag(s, vec3_scale(p, 1 + by / fmax(vec3_norm(p), 1e-3)));
}

static void change_strength(EditState *s, float by)
{
    s->strength = fminf(1, fmaxf(0, s->strength + by));
    edit_state_smooth(s, false);
}

static void change_blend(EditState *s, float by)
{
    if (s->looks)
        edit_state_go(s, s->branch, s->t);
    s->blend = fminf(2, fmaxf(0, s->blend + by));
    edit_state_blend(s, true);
}

static void press_section_key(EditState *s, int key)
{
    switch (key) {
    case WINDOW_KEY_TAB: s->handle = (s->handle + 1) % EDIT_HANDLES; break;
    case WINDOW_KEY_UP: nudge(s, 0.02); break;
    case WINDOW_KEY_DOWN: nudge(s, -0.02); break;
    case '=':
    case WINDOW_KEY_KEYPAD_ADD: edit_state_scale(s, 1.02); break;
    case '-':
    case WINDOW_KEY_KEYPAD_SUBTRACT: edit_state_scale(s, 1 / 1.02); break;
    case WINDOW_KEY_DELETE: edit_state_delete(s); break;
    case 'O': s->shape = s->shape == SMOOTH_CIRCLE ? SMOOTH_ELLIPSE : SMOOTH_CIRCLE; break;
    case 'E': s->extent = s->extent == SMOOTH_SECTION ? SMOOTH_BRANCH : s->extent == SMOOTH_BRANCH ? SMOOTH_TREE : SMOOTH_SECTION; break;
    case ',': change_strength(s, -0.1f); break;
    case '.': change_strength(s, 0.1f); break;
    case 'A': edit_state_smooth(s, true); break;
    default: break;
    }
}

static void press(EditWindow *w, int key)
{
    EditState *s = &w->state;
    switch (key) {
    case WINDOW_KEY_ESCAPE: leave(w); return;
    case WINDOW_KEY_PAGE_UP: edit_state_step(s, 1); break;
    case WINDOW_KEY_PAGE_DOWN: edit_state_step(s, -1); break;
    case WINDOW_KEY_RIGHT: edit_state_move(s, 0.1); break;
    case WINDOW_KEY_LEFT: edit_state_move(s, -0.1); break;
    case ']': edit_state_branch(s, 1); break;
    case '[': edit_state_branch(s, -1); break;
    case WINDOW_KEY_ENTER:
        if (s->draws_branch)
            edit_state_draw_end(s, true);
        else
            edit_state_keep(s);
        break;
    case 'J': change_blend(s, -0.05f); break;
    case 'K': change_blend(s, 0.05f); break;
    case 'B': edit_state_draw_begin(s); break;
    case 'X': edit_state_cut(s); break;
    case 'T': edit_state_flip(s); break;
    case 'H': w->shows_help = !w->shows_help; break;
    case 'F': edit_scene_focus(w->scene, edit_state_in_space(s, vec3(0, 0, 0))); break;
    case WINDOW_KEY_HOME:
        free_camera_reset(edit_scene_camera(w->scene));
        edit_scene_redraw(w->scene);
        break;
    default: press_section_key(s, key); break;
    }
    w->wants_out = false;
}

// --- mouse ---

static void scroll(EditWindow *w, const WindowEvent *event, double x, double y, bool control)
{
    double notches = (double)event->scroll_y;
    if (is_in(w->scene_at, x, y)) {
        free_camera_zoom(edit_scene_camera(w->scene), notches, x - (double)w->scene_at.x, y - (double)w->scene_at.y, (int)w->scene_at.width,
                         (int)w->scene_at.height);
        edit_scene_redraw(w->scene);
    } else if (is_in(w->section_at, x, y) && control) {
        section_view_zoom(w->section, notches);
    } else if (is_in(w->section_at, x, y) && notches != 0) {
        edit_state_step(&w->state, notches > 0 ? 1 : -1);
    }
}

static void mouse_down(EditWindow *w, const WindowInput *input, double x, double y, bool shift)
{
    EditState *s = &w->state;
    w->held = is_in(w->scene_at, x, y) ? OVER_SCENE : is_in(w->section_at, x, y) ? OVER_SECTION : OVER_PANEL;
    w->travel = 0;
    w->x = x, w->y = y;      // a way before the press is no drag
    if (w->held != OVER_SECTION || !(input->mouse_buttons & WINDOW_MOUSE_LEFT))
        return;
    w->draws_stroke = shift;
    if (shift) {
        s->stroke_count = 0;
        return;
    }
    int handle = section_view_handle(w->section, s, w->section_at, x, y, 14 * input->scale);
    w->drags_handle = handle >= 0;
    s->handle = handle >= 0 ? handle : s->handle;
}

static void click(EditWindow *w, double x, double y)
{
    EditState *s = &w->state;
    Vec3 wall;
    int branch;
    double t;
    if (s->draws_branch) {
        edit_state_draw_add(s, edit_scene_point(w->scene, w->scene_at, x, y, s->drawn[s->drawn_count - 1]));
        edit_scene_redraw(w->scene);
        return;
    }
    if (!edit_scene_pick(w->scene, s, w->scene_at, x, y, &wall, &branch, &t))
        return;
    if (branch < 0) {
        edit_state_say(s, true, "this is a sac: it consists of blobs and has no sections to edit");
        return;
    }
    double within, station = sweep_edit_station(sweep_editor_model(s->editor), branch, t, &within);
    edit_state_go(s, branch, s->snaps && fabs(t - station) <= 2 * within ? station : t);
    s->wall = wall;
    edit_state_say(s, false, tr("branch %d at %.2f mm"), branch, s->t);
}

static void mouse_move(EditWindow *w, const WindowInput *input, double x, double y)
{
    double dx = x - w->x, dy = y - w->y;
    EditState *s = &w->state;
    w->travel += fabs(dx) + fabs(dy);
    if (w->held == OVER_SCENE && w->travel > 4 && (dx != 0 || dy != 0)) {
        FreeCamera *camera = edit_scene_camera(w->scene);
        if (input->mouse_buttons & WINDOW_MOUSE_LEFT)
            free_camera_orbit(camera, dx, dy);
        else
            free_camera_pan(camera, dx, dy, (int)w->scene_at.width, (int)w->scene_at.height);
        edit_scene_redraw(w->scene);
    }
    if (w->held == OVER_SECTION && w->drags_handle && w->travel > 2 && (dx != 0 || dy != 0))
        edit_state_drag(s, section_view_place(w->section, w->section_at, x, y));
    if (w->held == OVER_SECTION && w->draws_stroke && s->stroke_count < EDIT_STROKE && (s->stroke_count == 0 || dx != 0 || dy != 0))
        s->stroke[s->stroke_count++] = section_view_place(w->section, w->section_at, x, y);
}

static void mouse_up(EditWindow *w, double x, double y)
{
    if (w->held == OVER_SCENE && w->travel <= 4 && (w->buttons & WINDOW_MOUSE_LEFT))
        click(w, x, y);
    if (w->held == OVER_SECTION && w->drags_handle)
        edit_state_keep(&w->state);
    if (w->held == OVER_SECTION && w->draws_stroke)
        edit_state_stroke_end(&w->state);
    if (w->moves_blend)
        edit_state_blend(&w->state, true);
    w->held = OVER_NOTHING;
    w->drags_handle = w->draws_stroke = w->moves_blend = false;
}

static void take_input(EditWindow *w, const WindowInput *input)
{
    double x = input->mouse_x, y = input->mouse_y;
    for (int i = 0; i < input->event_count; i++) {
        const WindowEvent *event = &input->event[i];
        if (event->kind == WINDOW_KEY_DOWN_EVENT || event->kind == WINDOW_KEY_UP_EVENT) {
            bool is_down = event->kind == WINDOW_KEY_DOWN_EVENT;
            w->shift = event->key == WINDOW_KEY_SHIFT ? is_down : w->shift;
            w->control = event->key == WINDOW_KEY_CTRL ? is_down : w->control;
        } else if (event->kind == WINDOW_FOCUS_LOST_EVENT) {
            w->shift = w->control = false;
        }
        if (event->kind == WINDOW_SCROLL_EVENT)
            scroll(w, event, x, y, w->control);
        else if (event->kind == WINDOW_KEY_DOWN_EVENT && (event->modifiers & WINDOW_CTRL))
            press_control(w, event->key);
        else if (event->kind == WINDOW_KEY_DOWN_EVENT)
            press(w, event->key);
    }
    if (input->mouse_buttons && !w->buttons)
        mouse_down(w, input, x, y, w->shift);
    if (input->mouse_buttons)
        mouse_move(w, input, x, y);
    if (!input->mouse_buttons && w->buttons)
        mouse_up(w, x, y);
    w->buttons = input->mouse_buttons;
    w->x = x, w->y = y;
}

// --- frames ---

static void label(Gui *gui, GuiRect at, const char *text)
{
    float k = gui_scale(gui);
    gui_draw_text(gui, at.x + 10 * k, at.y + 8 * k, GUI_SMALL, gui_colors.dim, text);
}

static bool draw(EditWindow *w, const WindowInput *input)
{
    EditState *s = &w->state;
    if (s->branch != w->drawn_branch || s->t != w->drawn_t)
        edit_scene_redraw(w->scene);
    w->drawn_branch = s->branch, w->drawn_t = s->t;
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, input->width, input->height);
    glClearColor(12 / 255.0f, 14 / 255.0f, 18 / 255.0f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (!edit_scene_draw(w->scene, s, w->scene_at, input->height, w->message, sizeof w->message))
        return false;
    section_view_draw_image(w->section, s, w->section_at, input->height);
    glViewport(0, 0, input->width, input->height);
    gui_begin(w->gui, input, input->scale, false);
    gui_window_begin(w->gui, "scene", w->scene_at, GUI_NO_BACKGROUND | GUI_NO_INPUT);
    label(w->gui, w->scene_at, "click: go there   drag: turn   right drag: move   wheel: zoom");
    gui_window_end(w->gui);
    gui_window_begin(w->gui, "section", w->section_at, GUI_NO_BACKGROUND | GUI_NO_INPUT);
    section_view_draw_contour(w->section, w->gui, s, w->section_at);
    label(w->gui, w->section_at, "wheel: along the branch   drag a handle   Shift+drag: draw a contour");
    gui_window_end(w->gui);
    float blend = s->blend;
    EditPanelActions actions = edit_panel_draw(w->gui, s, w->panel_at, w->shows_help);
    w->moves_blend |= s->blend != blend && w->held == OVER_PANEL;
    if (w->shows_help)
        edit_panel_help(w->gui, input);
    gui_end(w->gui, 0);
    w->shows_help ^= actions.help;
    if (actions.save)
        save(w);
    return true;
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
        lay_out(w, input);
        take_input(w, input);
        if (input->close == WINDOW_CLOSE_REQUESTED)
            leave(w);
        if (input->close == WINDOW_ENDED || (w->options->duration_s > 0 && clock_s(CLOCK_MONOTONIC) - begun > w->options->duration_s))
            w->ends = true;
        if (!visible)
            continue;
        if (!draw(w, input)) {
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
    w->options = options, w->file = file, w->drawn_branch = -1;
    snprintf(title, sizeof title, "Seldinger edit: %.200s", options->name);
    snprintf(w->message, sizeof w->message, "out of memory");
    bool good = edit_state_begin(&w->state, editor) && (w->window = window_create(title, options->width, options->height, 0, w->message, sizeof w->message)) &&
                (w->gui = gui_create(w->message, sizeof w->message)) && (w->scene = edit_scene_create(&w->state, w->message, sizeof w->message)) &&
                (w->section = section_view_create(volume));
    if (!good)
        faults_add(faults, options->name, 0, 0, "no window: %s", w->message);
    good = good && run_frames(w, faults);
    section_view_destroy(w->section);
    edit_scene_destroy(w->scene);
    if (w->gui)
        gui_destroy(w->gui);
    if (w->window)
        window_destroy(w->window);
    edit_state_end(&w->state);
    free(w);
    return good;
}
