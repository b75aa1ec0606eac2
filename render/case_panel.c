// See case_panel.h.
#include "render/case_panel.h"
#include "render/key_list.h"
#include "render/translation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const mouse_help[][2] = {{"click", "do what is chosen on the right; else look there"},
                                            {"left drag", "move the cross-hair; turn the projection"},
                                            {"right drag", "brightness: level and width"},
                                            {"wheel (with Ctrl: zoom)", "next slice; zoom the projection"}};

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
    static const char *const mode[CASE_TARGET + 1] = {"New start", "Add branch", "Forbid", "Cut", "End here", "Mark sac", "Entry", "Target"};
    float gap = floorf(6 * gui_scale(gui)), half = floorf((gui_width(gui) - gap) / 2);
    gui_heading(gui, "A CLICK");
    for (int i = 0; i <= CASE_TARGET; i++) {
        if (key_list_button(gui, SHEET_CASE, mode[i], mode[i], CASE_KEY_START + i, half, s->mode == i))
            case_state_mode(s, s->mode == i ? CASE_LOOK : i);
        if (i % 2 == 0)
            gui_beside(gui, gap);
    }
    if (s->soft) {
        const bool forbids = case_state_forbids_bone(s);
        if (key_list_button(gui, SHEET_CASE, "bone", forbids ? "bone is left out" : "bone may be tracked", CASE_KEY_FORBID_BONE, 0, forbids))
            case_state_turn_bone(s);
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
    gui_heading(gui, "TOOLS, PATIENT AND WALL");
    static const char *const none[CASE_LISTS] = {N_("wire that suits the vessels"), N_("no catheter"), N_("which vessel it is: not said"),
                                                 N_("wall of local models")};
    for (int i = 0; i < CASE_LISTS; i++) {
        const int chosen = s->list[i].chosen;
        const char *name = chosen > 0 ? s->list[i].name[chosen] : tr(none[i]);
        snprintf(label, sizeof label, i == CASE_MODELS && chosen > 0 ? tr("wall: %.*s") : "%.*s", (int)strcspn(name, "."), name);
        const bool has_neighbour = i == CASE_MODELS && is_swept;
        if (key_list_button(gui, SHEET_CASE, none[i], label, CASE_KEY_WIRE + i, has_neighbour ? half : 0, chosen > 0))
            case_state_next(s, (CaseListId)i, 1);
        if (has_neighbour)
            gui_beside(gui, gap);
    }
    bool edits = is_swept && key_list_button(gui, SHEET_CASE, "edit", "Edit sections", CASE_KEY_EDIT, half, false);
    if (key_list_button(gui, SHEET_CASE, "behind", behind && behind->is_on ? "the volume lies behind" : "a plain patient lies behind", CASE_KEY_BACKGROUND, 0,
                        behind && behind->is_on))
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
    char title[80];
    key_sheet_fill(SHEET_CASE, tr("MARKS ({mark_next}, {mark_before})"), title, sizeof title);
    gui_text(gui, GUI_SMALL, gui_colors.dim, count > 0 ? title : s->progress.stage == BUILD_DONE ? "NO MARKS" : "MARKS COME AFTER THE WALL");
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
    gui_heading(gui, "ACTS");
    for (int i = s->acts.count > SHOWN ? s->acts.count - SHOWN : 0; i < s->acts.count; i++) {
        case_act_describe(&s->acts.act[i], tr, text, sizeof text);
        gui_text(gui, GUI_SMALL, gui_colors.text, text);
    }
    if (key_list_button(gui, SHEET_CASE, "undo", "Undo", CASE_KEY_UNDO, half, false))
        case_state_undo(s);
    gui_beside(gui, gap);
    if (key_list_button(gui, SHEET_CASE, "redo", "Redo", CASE_KEY_REDO, half, false))
        case_state_redo(s);
}

CasePanelActions case_panel_draw(Gui *gui, CaseState *s, GuiRect at, bool shows_help)
{
    CasePanelActions actions = {0};
    float k = gui_scale(gui), gap = floorf(6 * k), low = floorf(fmaxf(0.2f * at.height, at.height - 590 * k));
    bool can_steer = case_builder_work(s->builder) != NULL;
    char text[800];
    gui_window_begin(gui, "panel", (GuiRect){at.x, at.y, at.width, at.height - low}, 0);
    show_volume(gui, s);
    gui_text_wrapped(gui, GUI_NORMAL, gui_colors.accent, key_sheet_fill(SHEET_CASE, tr(case_state_hint(s)), text, sizeof text));
    show_modes(gui, s);
    actions.edit = show_choices(gui, s);
    show_acts(gui, s);
    gui_space(gui, floorf(4 * k));
    float half = floorf((gui_width(gui) - gap) / 2);
    actions.steer = key_list_button(gui, SHEET_CASE, "steer", can_steer ? "Steer" : "Steer: not yet", CASE_KEY_STEER, 0, can_steer);
    actions.help = key_list_button(gui, SHEET_CASE, "help", "All keys", CASE_KEY_HELP, half, shows_help);
    gui_beside(gui, gap);
    actions.leave = key_list_button(gui, SHEET_CASE, "leave", "Leave", CASE_KEY_LEAVE, half, false);
    gui_text_wrapped(gui, GUI_NORMAL, s->message_is_fault ? gui_colors.warning : gui_colors.good, key_sheet_fill(SHEET_CASE, s->message, text, sizeof text));
    gui_window_end(gui);
    show_marks(gui, s, (GuiRect){at.x, at.y + at.height - low, at.width, low});
    return actions;
}

void case_panel_help(Gui *gui, const WindowInput *input)
{
    static const KeySheet sheet[] = {SHEET_CASE};
    key_list_draw(gui, input, sizeof mouse_help / sizeof *mouse_help, mouse_help, 1, sheet);
}
