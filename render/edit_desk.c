// See edit_desk.h.
#include "render/edit_desk.h"

#include "render/edit_panel.h"
#include "render/edit_scene.h"
#include "render/key_sheet.h"
#include "render/section_view.h"
#include "sim/sim.h"
#include "render/translation.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

typedef enum { OVER_NOTHING, OVER_SCENE, OVER_SECTION, OVER_PANEL } Over;

struct EditDesk {
    EditState *state;
    bool is_of_case;
    EditScene *scene;
    SectionView *section;
    GuiRect scene_at, section_at, panel_at;
    Over held;               // where the mouse was pressed
    unsigned buttons;        // pressed in the last frame
    double x, y, travel;     // of the mouse; [pixel] since it was pressed
    WindowModifiers modifiers;
    bool drags_handle, draws_stroke, moves_blend, shows_help;
    bool has_left;           // the last key was to leave
    EditDeskWants wants;
    int drawn_branch;        // what the scene shows
    double drawn_t;
};

static bool is_in(GuiRect at, double x, double y)
{
    return x >= (double)at.x && y >= (double)at.y && x < (double)(at.x + at.width) && y < (double)(at.y + at.height);
}

static void lay_out(EditDesk *w, const WindowInput *input)
{
    float k = (float)input->scale, panel = floorf(310 * k), rest = (float)input->width - panel, gap = floorf(2 * k), left = floorf(0.56f * rest);
    w->scene_at = (GuiRect){0, 0, left - gap, (float)input->height};
    w->section_at = (GuiRect){left, 0, rest - left - gap, (float)input->height};
    w->panel_at = (GuiRect){rest, 0, panel, (float)input->height};
}

void edit_desk_leave(EditDesk *w)
{
    EditState *s = w->state;
    if (w->shows_help)
        w->shows_help = false;
    else if (edit_state_draws(s))
        edit_state_pen_end(s, false);
    else if (s->looks)
        edit_state_go(s, s->branch, s->t);
    else
        w->wants.leave = true, w->wants.leave_again = w->has_left;
    w->has_left = w->wants.leave;
}

// --- keys ---

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

// While a branch or a contour is drawn. A branch goes parallel to the screen, and towards and away from the viewer.
static void press_pen(EditDesk *w, PenKey key)
{
    EditState *s = w->state;
    Camera camera = edit_scene_projection(w->scene, w->scene_at);
    const Vec3 right = s->draws_branch ? camera.right : vec3(1, 0, 0), up = s->draws_branch ? camera.up : vec3(0, 1, 0);
    const Vec3 near = s->draws_branch ? camera.back : vec3(0, 0, 0);
    const double step = (s->draws_branch ? 0.1 : 0.05) * (w->modifiers.shift ? 10 : 1);    // [mm]
    const float wider = 0.05f;
    switch (key) {
    case PEN_KEY_LEFT: edit_state_pen_move(s, vec3_scale(right, -step)); break;
    case PEN_KEY_RIGHT: edit_state_pen_move(s, vec3_scale(right, step)); break;
    case PEN_KEY_UP: edit_state_pen_move(s, vec3_scale(up, step)); break;
    case PEN_KEY_DOWN: edit_state_pen_move(s, vec3_scale(up, -step)); break;
    case PEN_KEY_NEARER: edit_state_pen_move(s, vec3_scale(near, step)); break;
    case PEN_KEY_FARTHER: edit_state_pen_move(s, vec3_scale(near, -step)); break;
    case PEN_KEY_ADD: edit_state_pen_add(s); break;
    case PEN_KEY_BACK: edit_state_pen_back(s); break;
    case PEN_KEY_END: edit_state_pen_end(s, true); break;
    case PEN_KEY_WIDER: s->drawn_radius += wider; break;
    case PEN_KEY_NARROWER: s->drawn_radius = fmaxf(0.1f, s->drawn_radius - wider); break;
    case PEN_KEY_DROP: edit_desk_leave(w); break;
    case PEN_KEYS: break;
    }
    edit_scene_redraw(w->scene);
}

static void press_section_key(EditState *s, EditKey key)
{
    switch (key) {
    case EDIT_KEY_HANDLE: edit_state_handle(s, (s->handle + 1) % EDIT_HANDLES); break;
    case EDIT_KEY_OUTWARDS: nudge(s, 0.02); break;
    case EDIT_KEY_INWARDS: nudge(s, -0.02); break;
    case EDIT_KEY_LARGER: edit_state_scale(s, 1.02); break;
    case EDIT_KEY_SMALLER: edit_state_scale(s, 1 / 1.02); break;
    case EDIT_KEY_DELETE: edit_state_delete(s); break;
    case EDIT_KEY_SHAPE: s->shape = s->shape == SMOOTH_CIRCLE ? SMOOTH_ELLIPSE : SMOOTH_CIRCLE; break;
    case EDIT_KEY_EXTENT: s->extent = s->extent == SMOOTH_SECTION ? SMOOTH_BRANCH : s->extent == SMOOTH_BRANCH ? SMOOTH_TREE : SMOOTH_SECTION; break;
    case EDIT_KEY_WEAKER: change_strength(s, -0.1f); break;
    case EDIT_KEY_STRONGER: change_strength(s, 0.1f); break;
    case EDIT_KEY_SMOOTH: edit_state_smooth(s, true); break;
    default: break;
    }
}

static void press_view_key(EditDesk *w, EditKey key)
{
    const double turn = 12;  // [pixel] of the mouse's way for a key
    FreeCamera *camera = edit_scene_camera(w->scene);
    switch (key) {
    case EDIT_KEY_TURN_LEFT: free_camera_orbit(camera, -turn, 0); break;
    case EDIT_KEY_TURN_RIGHT: free_camera_orbit(camera, turn, 0); break;
    case EDIT_KEY_TURN_UP: free_camera_orbit(camera, 0, -turn); break;
    case EDIT_KEY_TURN_DOWN: free_camera_orbit(camera, 0, turn); break;
    case EDIT_KEY_ZOOM_IN: free_camera_zoom(camera, 1, 50, 50, 100, 100); break;
    case EDIT_KEY_ZOOM_OUT: free_camera_zoom(camera, -1, 50, 50, 100, 100); break;
    case EDIT_KEY_FOCUS: edit_scene_focus(w->scene, edit_state_in_space(w->state, vec3(0, 0, 0))); break;
    case EDIT_KEY_WHOLE: free_camera_reset(camera); break;
    default: break;
    }
    edit_scene_redraw(w->scene);
}

static void press(EditDesk *w, EditKey key)
{
    EditState *s = w->state;
    w->has_left &= key == EDIT_KEY_LEAVE;
    if (key >= EDIT_KEY_TURN_LEFT && key <= EDIT_KEY_WHOLE) {
        press_view_key(w, key);
        return;
    }
    switch (key) {
    case EDIT_KEY_LEAVE: edit_desk_leave(w); break;
    case EDIT_KEY_STATION_NEXT: edit_state_step(s, 1); break;
    case EDIT_KEY_STATION_BEFORE: edit_state_step(s, -1); break;
    case EDIT_KEY_ON: edit_state_move(s, 0.1); break;
    case EDIT_KEY_BACK: edit_state_move(s, -0.1); break;
    case EDIT_KEY_BRANCH_NEXT: edit_state_branch(s, 1); break;
    case EDIT_KEY_BRANCH_BEFORE: edit_state_branch(s, -1); break;
    case EDIT_KEY_KEEP: edit_state_keep(s); break;
    case EDIT_KEY_BLEND_NARROWER: change_blend(s, -0.05f); break;
    case EDIT_KEY_BLEND_WIDER: change_blend(s, 0.05f); break;
    case EDIT_KEY_DRAW: edit_state_draw_begin(s); break;
    case EDIT_KEY_CONTOUR: edit_state_contour_begin(s); break;
    case EDIT_KEY_CUT: edit_state_cut(s); break;
    case EDIT_KEY_FLIP: edit_state_flip(s); break;
    case EDIT_KEY_HELP: w->shows_help = !w->shows_help; break;
    case EDIT_KEY_UNDO: w->wants.undo = true; break;
    case EDIT_KEY_REDO: w->wants.redo = true; break;
    case EDIT_KEY_SAVE: w->wants.save = true; break;
    default: press_section_key(s, key); break;
    }
}

static void take_key(EditDesk *w, const WindowEvent *event, const WindowEvent *before)
{
    const int pen = edit_state_draws(w->state) ? key_sheet_pressed(SHEET_PEN, event, before) : -1;
    const int key = pen < 0 ? key_sheet_pressed(SHEET_EDIT, event, before) : -1;
    if (pen >= 0)
        press_pen(w, (PenKey)pen);
    else if (key >= 0)
        press(w, (EditKey)key);
}

// --- mouse ---

static void scroll(EditDesk *w, const WindowEvent *event, double x, double y, bool control)
{
    double notches = (double)event->scroll_y;
    if (is_in(w->scene_at, x, y)) {
        free_camera_zoom(edit_scene_camera(w->scene), notches, x - (double)w->scene_at.x, y - (double)w->scene_at.y, (int)w->scene_at.width,
                         (int)w->scene_at.height);
        edit_scene_redraw(w->scene);
    } else if (is_in(w->section_at, x, y) && control) {
        section_view_zoom(w->section, notches);
    } else if (is_in(w->section_at, x, y) && notches != 0) {
        edit_state_step(w->state, notches > 0 ? 1 : -1);
    }
}

static void mouse_down(EditDesk *w, const WindowInput *input, double x, double y, bool shift)
{
    EditState *s = w->state;
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

static void click(EditDesk *w, double x, double y)
{
    EditState *s = w->state;
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
    edit_state_say(s, false, "branch %d at %.2f mm", branch, s->t);
}

static void mouse_move(EditDesk *w, const WindowInput *input, double x, double y)
{
    double dx = x - w->x, dy = y - w->y;
    EditState *s = w->state;
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

static void mouse_up(EditDesk *w, double x, double y)
{
    if (w->held == OVER_SCENE && w->travel <= 4 && (w->buttons & WINDOW_MOUSE_LEFT))
        click(w, x, y);
    if (w->held == OVER_SECTION && w->drags_handle)
        edit_state_keep(w->state);
    if (w->held == OVER_SECTION && w->draws_stroke)
        edit_state_stroke_end(w->state);
    if (w->moves_blend)
        edit_state_blend(w->state, true);
    w->held = OVER_NOTHING;
    w->drags_handle = w->draws_stroke = w->moves_blend = false;
}

void edit_desk_take_input(EditDesk *w, const WindowInput *input)
{
    lay_out(w, input);
    double x = input->mouse_x, y = input->mouse_y;
    for (int i = 0; i < input->event_count; i++) {
        const WindowEvent *event = &input->event[i];
        window_modifiers_take(&w->modifiers, event);
        if (event->kind == WINDOW_SCROLL_EVENT)
            scroll(w, event, x, y, w->modifiers.control);
        else
            take_key(w, event, i > 0 ? event - 1 : NULL);
    }
    if (input->mouse_buttons && !w->buttons)
        mouse_down(w, input, x, y, w->modifiers.shift);
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

bool edit_desk_draw(EditDesk *w, Gui *gui, const WindowInput *input, char *message, size_t capacity)
{
    EditState *s = w->state;
    lay_out(w, input);
    if (s->branch != w->drawn_branch || s->t != w->drawn_t)
        edit_scene_redraw(w->scene);
    w->drawn_branch = s->branch, w->drawn_t = s->t;
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, input->width, input->height);
    glClearColor(12 / 255.0f, 14 / 255.0f, 18 / 255.0f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (!edit_scene_draw(w->scene, s, w->scene_at, input->height, message, capacity))
        return false;
    section_view_draw_image(w->section, s, w->section_at, input->height);
    glViewport(0, 0, input->width, input->height);
    gui_begin(gui, input, input->scale, false);
    gui_window_begin(gui, "scene", w->scene_at, GUI_NO_BACKGROUND | GUI_NO_INPUT);
    label(gui, w->scene_at, "click: go there   drag: turn   right drag: move   wheel: zoom");
    gui_window_end(gui);
    gui_window_begin(gui, "section", w->section_at, GUI_NO_BACKGROUND | GUI_NO_INPUT);
    section_view_draw_contour(w->section, gui, s, w->section_at);
    label(gui, w->section_at, "wheel: along the branch   drag a handle   Shift+drag: draw a contour");
    gui_window_end(gui);
    float blend = s->blend;
    EditPanelActions actions = edit_panel_draw(gui, s, w->panel_at, w->shows_help, w->is_of_case);
    w->moves_blend |= s->blend != blend && w->held == OVER_PANEL;
    if (w->shows_help)
        edit_panel_help(gui, input);
    gui_end(gui, 0);
    w->shows_help ^= actions.help;
    w->wants.save |= actions.save;
    w->wants.undo |= actions.undo;
    w->wants.redo |= actions.redo;
    return true;
}

EditDeskWants edit_desk_wants(EditDesk *w)
{
    EditDeskWants wants = w->wants;
    w->wants = (EditDeskWants){0};
    return wants;
}

EditDesk *edit_desk_create(EditState *state, const Volume *volume, bool is_of_case, char *message, size_t capacity)
{
    EditDesk *w = calloc(1, sizeof *w);
    snprintf(message, capacity, "out of memory");
    if (!w)
        return NULL;
    w->state = state, w->is_of_case = is_of_case, w->drawn_branch = -1;
    if (!(w->scene = edit_scene_create(state, message, capacity)) || !(w->section = section_view_create(volume))) {
        edit_desk_destroy(w);
        return NULL;
    }
    return w;
}

void edit_desk_destroy(EditDesk *w)
{
    if (!w)
        return;
    section_view_destroy(w->section);
    edit_scene_destroy(w->scene);
    free(w);
}
