// See edit_panel.h.
#include "render/edit_panel.h"
#include "render/key_list.h"
#include "render/translation.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const mouse_help[][2] = {{"click on the wall", "go there"},
                                            {"left, right drag, wheel", "turn, move, zoom the surface"},
                                            {"wheel on the section", "next station (with Ctrl: zoom)"},
                                            {"drag a handle", "move the contour"},
                                            {"Shift and drag", "draw a new contour around the vessel"}};

static void row(Gui *gui, const char *label, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void row(Gui *gui, const char *label, const char *format, ...)
{
    char text[80];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    gui_row(gui, GUI_NORMAL, label, gui_colors.text, text);
}

static void show_place(Gui *gui, const EditState *s)
{
    const SweepModel *m = sweep_editor_model(s->editor);
    char title[80];
    snprintf(title, sizeof title, "Branch %d at %.2f mm", s->branch, s->t);
    gui_text(gui, GUI_LARGE, gui_colors.text, title);
    row(gui, edit_state_at_station(s) ? "a section of the model" : "between two sections", tr("%d branches"), m->branch_count);
    SweepSection section;
    if (sweep_section_of(&s->outline, &section))
        row(gui, "mean radius, area", "%.3f mm, %.2f mm²", section.mean, section.area);
    if (s->outline.kind != SECTION_POLAR)
        row(gui, "stored as", "%s", section_kind_name[s->outline.kind]);
    row(gui, "surface follows in", tr("%.1f ms, at most %.1f"), s->update_ms, s->worst_ms);
}

static void show_smoothing(Gui *gui, EditState *s)
{
    static const char *const extents[] = {"section", "", "branch", "tree"};
    float gap = floorf(6 * gui_scale(gui)), half = floorf((gui_width(gui) - gap) / 2), third = floorf((gui_width(gui) - 2 * gap) / 3);
    gui_heading(gui, "SMOOTH TOWARDS");
    if (key_list_button(gui, SHEET_EDIT, "circle", "Circle", EDIT_KEY_SHAPE, half, s->shape == SMOOTH_CIRCLE))
        s->shape = SMOOTH_CIRCLE;
    gui_beside(gui, gap);
    if (key_list_button(gui, SHEET_EDIT, "ellipse", "Ellipse", EDIT_KEY_SHAPE, half, s->shape == SMOOTH_ELLIPSE))
        s->shape = SMOOTH_ELLIPSE;
    for (int i = 0; i < 4; i++) {
        if (i == SMOOTH_RANGE)
            continue;
        if (gui_button(gui, extents[i], extents[i], NULL, third, (int)s->extent == i).pressed)
            s->extent = (SmoothExtent)i;
        if (i != SMOOTH_TREE)
            gui_beside(gui, gap);
    }
    if (gui_slider(gui, "strength", &s->strength, 0, 1, "strength %.2f", 0))
        edit_state_smooth(s, false);
    if (key_list_button(gui, SHEET_EDIT, "smooth", "Smooth", EDIT_KEY_SMOOTH, 0, false))
        edit_state_smooth(s, true);
}

static void show_fork(Gui *gui, EditState *s)
{
    char text[80];
    gui_heading(gui, key_sheet_fill(SHEET_EDIT, tr("BLEND AT THE FORK ({blend_narrower}, {blend_wider})"), text, sizeof text));
    if (sweep_editor_model(s->editor)->branch[s->branch].parent < 0)
        gui_text(gui, GUI_NORMAL, gui_colors.dim, "this branch is the root");
    else if (gui_slider(gui, "blend", &s->blend, 0, 2, "%.2f radii", 0))
        edit_state_blend(s, false);
}

static void show_branches(Gui *gui, EditState *s)
{
    float gap = floorf(6 * gui_scale(gui)), half = floorf((gui_width(gui) - gap) / 2);
    gui_heading(gui, "BRANCHES");
    char end[KEY_BINDING_TEXT];
    key_sheet_text(SHEET_PEN, PEN_KEY_END, end, sizeof end);
    if (s->draws_branch ? gui_button(gui, "draw", "End the branch", end, half, true).pressed
                        : key_list_button(gui, SHEET_EDIT, "draw", "Draw one", EDIT_KEY_DRAW, half, false)) {
        if (s->draws_branch)
            edit_state_draw_end(s, true);
        else
            edit_state_draw_begin(s);
    }
    gui_beside(gui, gap);
    if (key_list_button(gui, SHEET_EDIT, "cut", "Cut here", EDIT_KEY_CUT, half, false))
        edit_state_cut(s);
    if (s->draws_branch)
        gui_slider(gui, "radius", &s->drawn_radius, 0.1f, 5, "radius %.2f mm", 0);
    if (key_list_button(gui, SHEET_EDIT, "delete", "Delete section", EDIT_KEY_DELETE, half, false))
        edit_state_delete(s);
    gui_beside(gui, gap);
    if (key_list_button(gui, SHEET_EDIT, "flip", "Flip the flow", EDIT_KEY_FLIP, half, false))
        edit_state_flip(s);
}

static void show_edits(Gui *gui, const EditState *s, GuiRect at)
{
    const EditList *list = sweep_editor_list(s->editor);
    gui_window_begin(gui, "edits", at, GUI_SCROLL_TO_END);
    if (list->count == 0)
        gui_text(gui, GUI_SMALL, gui_colors.dim, "no edits yet");
    for (int i = list->count > 200 ? list->count - 200 : 0; i < list->count; i++) {
        char *line = edit_line(&list->edit[i]), text[200];
        bool is_long = line && strlen(line) > 130;
        snprintf(text, sizeof text, "- %.130s%s", line ? line : "", is_long ? " …" : "");
        gui_text_wrapped(gui, GUI_SMALL, i + 1 > s->saved_count ? gui_colors.text : gui_colors.dim, text);
        free(line);
    }
    gui_window_end(gui);
}

EditPanelActions edit_panel_draw(Gui *gui, EditState *s, GuiRect at, bool shows_help, bool is_of_case)
{
    EditPanelActions actions = {0};
    float k = gui_scale(gui), gap = floorf(6 * k), list_height = floorf(fmaxf(at.height * 0.2f, at.height - 480 * k));
    char title[80];
    const int edits = sweep_editor_list(s->editor)->count;
    gui_window_begin(gui, "panel", (GuiRect){at.x, at.y, at.width, at.height - list_height}, 0);
    show_place(gui, s);
    show_smoothing(gui, s);
    show_fork(gui, s);
    show_branches(gui, s);
    snprintf(title, sizeof title, is_of_case ? tr("EDITS: %d") : edits == s->saved_count ? tr("EDITS: %d, saved") : tr("EDITS: %d, not saved"), edits);
    gui_heading(gui, title);
    float third = floorf((gui_width(gui) - 2 * gap) / 3);
    actions.undo = key_list_button(gui, SHEET_EDIT, "undo", "Undo", EDIT_KEY_UNDO, third, false);
    gui_beside(gui, gap);
    actions.redo = key_list_button(gui, SHEET_EDIT, "redo", "Redo", EDIT_KEY_REDO, third, false);
    gui_beside(gui, gap);
    actions.save = key_list_button(gui, SHEET_EDIT, "save", is_of_case ? "Done" : "Save", EDIT_KEY_SAVE, third, false);
    actions.help = key_list_button(gui, SHEET_EDIT, "help", "All keys", EDIT_KEY_HELP, 0, shows_help);
    gui_space(gui, floorf(2 * k));
    char message[800], pen[800];
    key_sheet_fill(SHEET_PEN, s->message, pen, sizeof pen);
    gui_text_wrapped(gui, GUI_NORMAL, s->message_is_fault ? gui_colors.warning : gui_colors.good, key_sheet_fill(SHEET_EDIT, pen, message, sizeof message));
    gui_window_end(gui);
    show_edits(gui, s, (GuiRect){at.x, at.y + at.height - list_height, at.width, list_height});
    return actions;
}

void edit_panel_help(Gui *gui, const WindowInput *input)
{
    static const KeySheet sheet[] = {SHEET_EDIT, SHEET_PEN};
    key_list_draw(gui, input, sizeof mouse_help / sizeof *mouse_help, mouse_help, 2, sheet);
}
