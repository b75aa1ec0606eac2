// See case_window.h.
#include "render/case_window.h"

#include "render/case_panel.h"
#include "render/case_state.h"
#include "render/case_views.h"
#include "render/edit_desk.h"
#include "render/gl_canvas.h"
#include "render/gui.h"
#include "render/key_sheet.h"
#include "render/png_file.h"
#include "render/window.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OVER_PANEL = CASE_VIEWS, OVER_NOTHING, SETTLES = 6 };     // SETTLES: frames until lists and fine pictures are up to date
static const double TRAVEL = 4;          // [pixel] a press that goes further is a drag

typedef struct CaseWindow {
    const CaseWindowOptions *options;
    Window *window;
    Gui *gui;
    CaseViews *views;
    EditDesk *desk;              // while sections are edited; else NULL
    CaseState state;
    GuiRect at[CASE_VIEWS], panel_at;
    int held;                    // the view where the mouse was pressed
    int width, height;           // of the window in the last frame
    unsigned buttons;            // pressed in the last frame
    double x, y, travel;         // of the mouse; [pixel] since it was pressed
    WindowModifiers modifiers;
    bool shows_help, ends;
    int still;                   // frames since something moved …
    int unchanged;               // … and since anything may look different
    char *steer;
    size_t steer_capacity;
    char message[512];
} CaseWindow;

static bool is_in(GuiRect at, double x, double y)
{
    return x >= (double)at.x && y >= (double)at.y && x < (double)(at.x + at.width) && y < (double)(at.y + at.height);
}

static int view_at(const CaseWindow *w, double x, double y)
{
    for (int i = 0; i < CASE_VIEWS; i++)
        if (is_in(w->at[i], x, y))
            return i;
    return is_in(w->panel_at, x, y) ? OVER_PANEL : OVER_NOTHING;
}

static void lay_out(CaseWindow *w, const WindowInput *input)
{
    float k = (float)input->scale, panel = floorf(300 * k), gap = floorf(2 * k), rest = (float)input->width - panel, half = floorf(rest / 2),
          high = floorf((float)input->height / 2);
    for (int i = 0; i < CASE_VIEWS; i++)
        w->at[i] = (GuiRect){i % 2 ? half : 0, i / 2 ? high : 0, half - gap, high - gap};
    w->panel_at = (GuiRect){rest, 0, panel, (float)input->height};
}

static void steer(CaseWindow *w)
{
    static Faults faults;
    faults_clear(&faults);
    if (case_state_save(&w->state, w->options->folder, w->steer, w->steer_capacity, &faults))
        w->ends = true;
    else
        w->steer[0] = 0;
}

static void leave(CaseWindow *w)
{
    BuildStage stage = w->state.progress.stage;
    if (w->shows_help)
        w->shows_help = false;
    else if (stage == BUILD_TRACKING || stage == BUILD_FITTING)
        case_state_cancel(&w->state);
    else
        w->ends = true;
}

// --- the desk on which sections are edited ---

static void close_desk(CaseWindow *w)
{
    edit_desk_destroy(w->desk);
    w->desk = NULL;
    w->unchanged = 0;
    case_state_edit_end(&w->state);
}

static void open_desk(CaseWindow *w)
{
    if (!w->desk && case_state_edit_begin(&w->state) && !(w->desk = edit_desk_create(&w->state.edit, w->state.volume, true, w->message, sizeof w->message)))
        close_desk(w);
}

static void do_what_the_desk_wants(CaseWindow *w)
{
    EditDeskWants wants = edit_desk_wants(w->desk);
    case_state_edit_take(&w->state);
    if (wants.undo)
        case_state_undo(&w->state);
    if (wants.redo)
        case_state_redo(&w->state);
    if (wants.leave || wants.save || !w->state.editor)
        close_desk(w);
}

// --- keys ---

static void arrow(CaseWindow *w, double right, double up)
{
    const double fast = 10;
    double way = w->modifiers.shift ? fast : 1;
    case_state_move(&w->state, w->state.view, way * right, way * up);
    w->still = 0;
}

static void page(CaseWindow *w, double by)
{
    if (w->state.view == CASE_PROJECTION)
        case_state_zoom(&w->state, CASE_PROJECTION, by);
    else
        case_state_scroll(&w->state, w->state.view, w->modifiers.shift ? 10 * by : by);
}

static void show_otherwise(CaseWindow *w, bool *what)
{
    *what = !*what;
    w->state.pictures++;
}

static void press_view_key(CaseWindow *w, CaseKey key)
{
    CaseState *s = &w->state;
    switch (key) {
    case CASE_KEY_LEFT: arrow(w, -1, 0); break;
    case CASE_KEY_RIGHT: arrow(w, 1, 0); break;
    case CASE_KEY_UP: arrow(w, 0, 1); break;
    case CASE_KEY_DOWN: arrow(w, 0, -1); break;
    case CASE_KEY_SLICE_NEXT: page(w, 1); break;
    case CASE_KEY_SLICE_BEFORE: page(w, -1); break;
    case CASE_KEY_NEARER: case_state_zoom(s, s->view, 1); break;
    case CASE_KEY_FARTHER: case_state_zoom(s, s->view, -1); break;
    case CASE_KEY_DARKER: case_state_window(s, 1, 0.02); break;
    case CASE_KEY_BRIGHTER: case_state_window(s, 1, -0.02); break;
    case CASE_KEY_NARROWER: case_state_window(s, 1 / 1.05, 0); break;
    case CASE_KEY_WIDER: case_state_window(s, 1.05, 0); break;
    case CASE_KEY_RESET_BRIGHTNESS: s->low = s->full_low, s->high = s->full_high, s->pictures++; break;
    case CASE_KEY_NEXT_VIEW: s->view = (s->view + (w->modifiers.shift ? CASE_VIEWS - 1 : 1)) % CASE_VIEWS; break;
    case CASE_KEY_TURN: s->turns = !s->turns; break;
    case CASE_KEY_MARK_NEXT: case_state_choose_mark(s, s->chosen_mark + 1); break;
    case CASE_KEY_MARK_BEFORE: case_state_choose_mark(s, s->chosen_mark - 1); break;
    case CASE_KEY_WALL: show_otherwise(w, &s->shows_wall); break;
    case CASE_KEY_BONE: show_otherwise(w, &s->shows_bone); break;
    default: break;
    }
}

static void press(CaseWindow *w, int key)
{
    CaseState *s = &w->state;
    if (key >= CASE_KEY_START && key <= CASE_KEY_LOOK) {
        case_state_mode(s, key == CASE_KEY_LOOK ? CASE_LOOK : key - CASE_KEY_START);
        return;
    }
    if (key >= CASE_KEY_WIRE && key <= CASE_KEY_MODEL) {
        case_state_next(s, (CaseListId)(key - CASE_KEY_WIRE), w->modifiers.shift ? -1 : 1);
        return;
    }
    switch (key) {
    case CASE_KEY_LEAVE: leave(w); break;
    case CASE_KEY_CLICK:
        if (s->has_volume)
            case_state_click(s, s->cursor);
        else
            case_state_click_nowhere(s, s->view);
        break;
    case CASE_KEY_FORBID_BONE: case_state_turn_bone(s); break;
    case CASE_KEY_BACKGROUND: case_state_turn_background(s); break;
    case CASE_KEY_EDIT: open_desk(w); break;
    case CASE_KEY_UNDO: case_state_undo(s); break;
    case CASE_KEY_REDO: case_state_redo(s); break;
    case CASE_KEY_HELP: w->shows_help = !w->shows_help; break;
    case CASE_KEY_STEER: steer(w); break;
    case -1: break;
    default: press_view_key(w, (CaseKey)key); break;
    }
}

// --- mouse ---

static bool place_under(const CaseWindow *w, int view, double x, double y, Vec3 *place)
{
    const CaseState *s = &w->state;
    GuiRect at = w->at[view];
    Camera camera = case_state_camera(s, view, (int)at.width, (int)at.height);
    x -= (double)at.x, y -= (double)at.y;
    if (view == CASE_PROJECTION)
        return volume_pick(case_state_projected(s), &camera, s->low, s->high, x, y, place);
    *place = camera_point(&camera, x, y, s->cursor);
    Vec3 v = volume_voxel_of(s->volume, *place);
    const int *size = s->volume->size;
    return v.x > -0.5 && v.y > -0.5 && v.z > -0.5 && v.x < size[0] - 0.5 && v.y < size[1] - 0.5 && v.z < size[2] - 0.5;
}

static void click(CaseWindow *w, int view, double x, double y)
{
    Vec3 place;
    w->state.view = view;
    if (w->state.has_volume && place_under(w, view, x, y, &place))
        case_state_click(&w->state, place);
    else
        case_state_click_nowhere(&w->state, view);
}

static void drag(CaseWindow *w, unsigned buttons, double x, double y)
{
    CaseState *s = &w->state;
    const double whole = 250;        // [pixel] of a drag that doubles the width, or moves the level by the whole range
    double dx = x - w->x, dy = y - w->y;
    Vec3 place;
    w->still = 0;
    if (buttons & WINDOW_MOUSE_RIGHT) {
        case_state_window(s, exp2(dx / whole), dy / whole);
    } else if (w->held == CASE_PROJECTION) {
        s->turns = false;
        free_camera_orbit(&s->camera, dx, dy);
        s->turned++;
    } else if (place_under(w, w->held, x, y, &place)) {
        s->cursor = place;
        s->pictures++;
    }
}

static void take_mouse(CaseWindow *w, const WindowInput *input)
{
    double x = input->mouse_x, y = input->mouse_y;
    if (input->mouse_buttons && !w->buttons) {
        w->held = view_at(w, x, y);
        w->travel = 0;
        w->x = x, w->y = y;      // a way before the press is no drag
    }
    if (input->mouse_buttons) {
        w->travel += fabs(x - w->x) + fabs(y - w->y);
        if (w->state.has_volume && w->held < CASE_VIEWS && w->travel > TRAVEL && (x != w->x || y != w->y))
            drag(w, input->mouse_buttons, x, y);
    } else if (w->buttons && w->held < CASE_VIEWS && w->travel <= TRAVEL && (w->buttons & WINDOW_MOUSE_LEFT)) {
        click(w, w->held, x, y);
    }
    w->buttons = input->mouse_buttons;
    w->x = x, w->y = y;
}

static void scroll(CaseWindow *w, double notches, double x, double y)
{
    int view = view_at(w, x, y);
    if (view >= CASE_VIEWS || notches == 0)
        return;
    w->state.view = view;
    if (w->modifiers.control || view == CASE_PROJECTION)
        case_state_zoom(&w->state, view, notches);
    else
        case_state_scroll(&w->state, view, notches > 0 ? 1 : -1);
    w->still = 0;
}

static void take_input(CaseWindow *w, const WindowInput *input)
{
    for (int i = 0; i < input->event_count; i++) {
        const WindowEvent *event = &input->event[i];
        window_modifiers_take(&w->modifiers, event);
        if (event->kind == WINDOW_SCROLL_EVENT)
            scroll(w, (double)event->scroll_y, input->mouse_x, input->mouse_y);
        else
            press(w, key_sheet_pressed(SHEET_CASE, event, i > 0 ? event - 1 : NULL));
    }
    take_mouse(w, input);
}

// --- frames ---

static bool draw(CaseWindow *w, const WindowInput *input)
{
    CaseState *s = &w->state;
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, input->width, input->height);
    glClearColor(12 / 255.0f, 14 / 255.0f, 18 / 255.0f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    if (!case_views_draw(w->views, s, w->at, input->height, w->still < 3, w->message, sizeof w->message))
        return false;
    glViewport(0, 0, input->width, input->height);
    gui_begin(w->gui, input, input->scale, false);
    for (int i = 0; i < CASE_VIEWS; i++) {
        char id[20];
        snprintf(id, sizeof id, "view %d", i);
        gui_window_begin(w->gui, id, w->at[i], GUI_NO_BACKGROUND | GUI_NO_INPUT);
        case_views_draw_over(w->views, w->gui, s, i, w->at[i]);
        gui_window_end(w->gui);
    }
    CasePanelActions actions = case_panel_draw(w->gui, s, w->panel_at, w->shows_help);
    if (w->shows_help)
        case_panel_help(w->gui, input);
    gui_end(w->gui, 0);
    w->shows_help ^= actions.help;
    if (actions.edit)
        open_desk(w);
    if (actions.leave)
        leave(w);
    if (actions.steer)
        steer(w);
    return true;
}

static bool take_picture(const CaseWindow *w, const WindowInput *input, Faults *faults)
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

static bool run_frames(CaseWindow *w, Faults *faults)
{
    const double turn = 1.2;         // [pixel] of the mouse's way for each frame in which the projection turns
    const WindowInput *input;
    for (double begun = clock_s(CLOCK_MONOTONIC); !w->ends;) {
        bool visible = window_next_frame(w->window, &input);
        lay_out(w, input);
        bool is_new = case_state_frame(&w->state), has_input = input->event_count > 0 || input->mouse_buttons || w->buttons || input->mouse_x != w->x ||
                                                               input->mouse_y != w->y || input->width != w->width || input->height != w->height;
        w->still++;
        w->width = input->width, w->height = input->height;
        if (w->desk)
            edit_desk_take_input(w->desk, input);
        else
            take_input(w, input);
        if (w->desk)
            do_what_the_desk_wants(w);
        // it stands still under the pointer: what moves cannot be clicked
        if (w->state.turns && w->state.has_volume && view_at(w, input->mouse_x, input->mouse_y) != CASE_PROJECTION) {
            free_camera_orbit(&w->state.camera, turn, 0);
            w->state.turned++;
            w->still = 0;
        }
        w->ends |= input->close != WINDOW_OPEN || (w->options->duration_s > 0 && clock_s(CLOCK_MONOTONIC) - begun > w->options->duration_s);
        w->unchanged = is_new || has_input || w->still < SETTLES ? 0 : w->unchanged + 1;
        if (!visible || (w->unchanged > SETTLES && !w->ends))
            continue;
        if (!(w->desk ? edit_desk_draw(w->desk, w->gui, input, w->message, sizeof w->message) : draw(w, input))) {
            faults_add(faults, w->options->made->input, 0, 0, "the window cannot be drawn: %s", w->message);
            return false;
        }
        if (w->ends && w->options->picture)
            take_picture(w, input, faults);
        window_swap(w->window);
    }
    return faults->count == 0;
}

bool case_window_run(const CaseWindowOptions *options, char *steer, size_t capacity, Faults *faults)
{
    CaseWindow *w = calloc(1, sizeof *w);
    char title[300];
    steer[0] = 0;
    if (!w) {
        faults_add(faults, options->made->input, 0, 0, "needs more memory than is available");
        return false;
    }
    w->options = options, w->held = OVER_NOTHING, w->steer = steer, w->steer_capacity = capacity;
    snprintf(title, sizeof title, "Seldinger case: %.200s", options->made->input);
    snprintf(w->message, sizeof w->message, "out of memory");
    bool good = (w->window = window_create(title, options->width, options->height, 0, w->message, sizeof w->message)) &&
                (w->gui = gui_create(w->message, sizeof w->message)) && (w->views = case_views_create(w->message, sizeof w->message)) &&
                case_state_begin(&w->state, options->made);
    if (!good)
        faults_add(faults, options->made->input, 0, 0, "no window: %s", w->message);
    good = good && run_frames(w, faults);
    edit_desk_destroy(w->desk);
    case_views_destroy(w->views);
    if (w->gui)
        gui_destroy(w->gui);
    if (w->window)
        window_destroy(w->window);
    if (w->state.builder)
        case_state_end(&w->state);
    free(w);
    return good;
}
