// See case_panel.h.
#include "render/case_panel.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const key_help[][2] = {{"click", "does what is chosen on the right; else looks there"},
                                          {"wheel, Page Up, Page Down", "next slice; zooms the projection"},
                                          {"Ctrl and wheel, + and -", "zooms"},
                                          {"right drag, [ ] and , .", "brightness: level and width; 0 as at first"},
                                          {"left drag", "moves the cross-hair; turns the projection"},
                                          {"Tab", "gives the keys to the next view"},
                                          {"arrows (Shift: ten times)", "moves the cross-hair; turns the projection"},
                                          {"Enter", "a click at the cross-hair"},
                                          {"Space", "the projection turns by itself, or stops"},
                                          {"1 to 8, L", "what a click does; L: it only looks"},
                                          {"N, P", "next and previous mark"},
                                          {"W", "the wall instead of the projection"},
                                          {"O", "bone in the projection of a CT, or not"},
                                          {"T, C (Shift: back)", "next wire; next catheter around it, or none"},
                                          {"A (Shift: back)", "which vessel of the body it is"},
                                          {"B", "what lies behind the vessels"},
                                          {"M (Shift: back)", "the kind of the wall's model; a new kind is fitted"},
                                          {"E", "edits sections and branches of a swept model (sweep); Esc leads back"},
                                          {"Ctrl+Z, Ctrl+Y", "undoes, does again"},
                                          {"S", "saves the case and steers in it"},
                                          {"Esc", "stops what is being made; leaves"}};

static void heading(Gui *gui, const char *text)
{
    gui_space(gui, floorf(3 * gui_scale(gui)));
    gui_text(gui, GUI_SMALL, gui_colors.dim, text);
}

static void show_progress(Gui *gui, const CaseState *s)
{
    const BuildProgress *p = &s->progress;
    char text[100];
    switch (p->stage) {
    case BUILD_LOADING: gui_progress(gui, p->part, "loading"); break;
    case BUILD_TRACKING:
        snprintf(text, sizeof text, tr("the tree grows: %d places"), s->seen_count);
        gui_progress(gui, 0, text);
        break;
    case BUILD_FITTING: gui_progress(gui, p->part, "fitting the wall"); break;
    case BUILD_LOOKING: gui_progress(gui, 1, "looking for marks"); break;
    case BUILD_DONE:
        snprintf(text, sizeof text, tr("read %.1f s, tracked %.1f s, fitted %.1f s"), p->load_s, p->track_s, p->fit_s);
        gui_progress(gui, 1, text);
        break;
    default: gui_progress(gui, 0, ""); break;
    }
}

static void show_volume(Gui *gui, const CaseState *s)
{
    const char *name = strrchr(s->made.input, '/');
    char text[160];
    gui_text(gui, GUI_LARGE, gui_colors.text, name && name[1] ? name + 1 : s->made.input);
    if (s->has_volume) {
        const Volume *v = s->volume;
        snprintf(text, sizeof text, tr("%d x %d x %d voxels of %.2f x %.2f x %.2f mm%s%s"), v->size[0], v->size[1], v->size[2], vec3_norm(v->axis[0]),
                 vec3_norm(v->axis[1]), vec3_norm(v->axis[2]), s->axes.is_known ? ", " : tr("; no orientation given"), s->axes.is_known ? v->frame : "");
        gui_text_wrapped(gui, GUI_SMALL, gui_colors.dim, text);
    }
    show_progress(gui, s);
}

static void show_modes(Gui *gui, CaseState *s)
{
    static const struct {
        const char *label, *key;
    } mode[CASE_TARGET + 1] = {{"New start", "1"}, {"Add branch", "2"}, {"Forbid", "3"}, {"Cut", "4"},
                               {"End here", "5"},  {"Mark sac", "6"},   {"Entry", "7"},  {"Target", "8"}};
    float gap = floorf(6 * gui_scale(gui)), half = floorf((gui_width(gui) - gap) / 2);
    heading(gui, "A CLICK");
    for (int i = 0; i <= CASE_TARGET; i++) {
        if (gui_button(gui, mode[i].label, mode[i].label, mode[i].key, half, s->mode == i).pressed)
            case_state_mode(s, s->mode == i ? CASE_LOOK : i);
        if (i % 2 == 0)
            gui_beside(gui, gap);
    }
    if (s->mode == CASE_FORBID) {
        float radius = (float)s->forbid_radius;
        if (gui_slider(gui, "radius", &radius, 0.5f, 20, "radius %.1f mm", 0))
            s->forbid_radius = (double)radius;
    }
}

// True if the user wants to edit sections.
static bool show_choices(Gui *gui, CaseState *s)
{
    float gap = floorf(6 * gui_scale(gui)), half = floorf((gui_width(gui) - gap) / 2);
    const CaseWork *work = case_builder_work(s->builder);
    const bool is_swept = work && work->how.model == FIT_MODEL_SWEEP;
    const CaseAct *behind = case_acts_last(&s->acts, CASE_BEHIND);
    char label[120];
    heading(gui, "TOOLS, PATIENT AND WALL");
    static const struct {
        const char *none, *key;
    } list[CASE_LISTS] = {
        {N_("wire that suits the vessels"), "T"}, {N_("no catheter"), "C"}, {N_("which vessel it is: not said"), "A"}, {N_("wall of local models"), "M"}};
    for (int i = 0; i < CASE_LISTS; i++) {
        const int chosen = s->list[i].chosen;
        const char *name = chosen > 0 ? s->list[i].name[chosen] : tr(list[i].none);
        snprintf(label, sizeof label, i == CASE_MODELS && chosen > 0 ? tr("wall: %.*s") : "%.*s", (int)strcspn(name, "."), name);
        const bool has_neighbour = i == CASE_MODELS && is_swept;
        if (gui_button(gui, list[i].key, label, list[i].key, has_neighbour ? half : 0, chosen > 0).pressed)
            case_state_next(s, (CaseListId)i, 1);
        if (has_neighbour)
            gui_beside(gui, gap);
    }
    bool edits = is_swept && gui_button(gui, "edit", "Edit sections", "E", half, false).pressed;
    if (gui_button(gui, "behind", behind && behind->is_on ? "the volume lies behind" : "a plain patient lies behind", "B", 0, behind && behind->is_on).pressed)
        case_state_turn_background(s);
    return edits;
}

static void show_marks(Gui *gui, CaseState *s, GuiRect at)
{
    static const char *const sign[MARK_KINDS] = {
        [MARK_SAC] = "sac", [MARK_NARROW_PLACE] = "narrow", [MARK_NO_ENTRY] = "closed", [MARK_MISSED] = "missing", [MARK_DOUBT] = "doubt"};
    const CaseMark *mark;
    int count = case_builder_marks(s->builder, &mark);
    gui_window_begin(gui, "marks", at, 0);
    gui_text(gui, GUI_SMALL, gui_colors.dim, count > 0 ? "MARKS (N, P)" : s->progress.stage == BUILD_DONE ? "NO MARKS" : "MARKS COME AFTER THE WALL");
    for (int i = 0; i < count; i++) {
        char id[20], text[240];
        snprintf(id, sizeof id, "mark %d", i);
        if (gui_button(gui, id, sign[mark[i].kind], NULL, 0, i == s->chosen_mark).pressed)
            case_state_choose_mark(s, i);
        if (i == s->chosen_mark)
            gui_scroll_here(gui);
        snprintf(text, sizeof text, "%s", mark[i].text);
        gui_text_wrapped(gui, GUI_SMALL, gui_colors.text, text);
    }
    gui_window_end(gui);
}

static void show_acts(Gui *gui, CaseState *s)
{
    enum { SHOWN = 4 };
    float gap = floorf(6 * gui_scale(gui)), half = floorf((gui_width(gui) - gap) / 2);
    char text[160];
    heading(gui, "ACTS");
    for (int i = s->acts.count > SHOWN ? s->acts.count - SHOWN : 0; i < s->acts.count; i++) {
        case_act_describe(&s->acts.act[i], tr, text, sizeof text);
        gui_text(gui, GUI_SMALL, gui_colors.text, text);
    }
    if (gui_button(gui, "undo", "Undo", "^Z", half, false).pressed)
        case_state_undo(s);
    gui_beside(gui, gap);
    if (gui_button(gui, "redo", "Redo", "^Y", half, false).pressed)
        case_state_redo(s);
}

CasePanelActions case_panel_draw(Gui *gui, CaseState *s, GuiRect at, bool shows_help)
{
    CasePanelActions actions = {0};
    float k = gui_scale(gui), gap = floorf(6 * k), low = floorf(fmaxf(0.2f * at.height, at.height - 590 * k));
    bool can_steer = case_builder_work(s->builder) != NULL;
    gui_window_begin(gui, "panel", (GuiRect){at.x, at.y, at.width, at.height - low}, 0);
    show_volume(gui, s);
    gui_text_wrapped(gui, GUI_NORMAL, gui_colors.accent, case_state_hint(s));
    show_modes(gui, s);
    actions.edit = show_choices(gui, s);
    show_acts(gui, s);
    gui_space(gui, floorf(4 * k));
    float half = floorf((gui_width(gui) - gap) / 2);
    actions.steer = gui_button(gui, "steer", can_steer ? "Steer" : "Steer: not yet", "S", 0, can_steer).pressed;
    actions.help = gui_button(gui, "help", "All keys", "H", half, shows_help).pressed;
    gui_beside(gui, gap);
    actions.leave = gui_button(gui, "leave", "Leave", "Esc", half, false).pressed;
    gui_text_wrapped(gui, GUI_NORMAL, s->message_is_fault ? gui_colors.warning : gui_colors.good, s->message);
    gui_window_end(gui);
    show_marks(gui, s, (GuiRect){at.x, at.y + at.height - low, at.width, low});
    return actions;
}

void case_panel_help(Gui *gui, const WindowInput *input)
{
    enum { ROWS = sizeof key_help / sizeof key_help[0] };
    float k = gui_scale(gui), width = floorf(560 * k), height = floorf((gui_line_height(gui, GUI_NORMAL) + 3 * k) * ROWS + 50 * k);
    GuiRect at = {floorf(((float)input->width - width) / 2), floorf(((float)input->height - height) / 2), width, height};
    gui_window_begin(gui, "keys", at, GUI_ON_TOP | GUI_FRAMED);
    gui_text(gui, GUI_LARGE, gui_colors.text, "Keys and mouse");
    for (int i = 0; i < ROWS; i++)
        gui_row(gui, GUI_NORMAL, key_help[i][0], gui_colors.text, key_help[i][1]);
    gui_window_end(gui);
}
