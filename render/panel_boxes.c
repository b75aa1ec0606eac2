// Boxes over everything: the instructions of the exercise, the list of keys, dialogues.
#include "render/panel_internal.h"
#include "render/replay_keys.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Joins lines that were broken by the editor of the scene file: a break counts only after the end of a sentence, before a list mark and at an empty line.
void panel_reflow(const char *from, char *to, size_t capacity)
{
    size_t length = 0;
    while (*from && length + 1 < capacity) {
        if (*from != '\n') {
            to[length++] = *from++;
            continue;
        }
        const char *next = from + 1 + strspn(from + 1, " \t\r");   // the indent also comes from the editor
        bool ends_sentence = length > 0 && strchr(".!?:\n", to[length - 1]);
        to[length++] = ends_sentence || !*next || strchr("\n-*0123456789", *next) ? '\n' : ' ';
        from = next;
    }
    while (length > 0 && strchr(" \n", to[length - 1]))
        length--;
    to[length] = 0;
}

void panel_draw_briefing(Panel *panel, const PanelState *state)
{
    Gui *gui = panel->gui;
    panel->briefing_at = (GuiRect){0};
    bool is_wanted = (panel->briefing == BRIEFING_OPEN && panel->is_interactive) ||
                     (panel->briefing == BRIEFING_AT_BEGIN && panel->is_interactive && panel->has_hints && panel_has_more_lines(state->instructions));
    if (!is_wanted || !panel_text(state->instructions)[0])
        return;
    char text[4200];
    panel_reflow(state->instructions, text, sizeof text);
    float s = gui_scale(gui), margin = floorf(12 * s), pad = floorf(20 * s);
    GuiRect view = panel->layout.view_rect[panel->layout.main];
    float width = floorf(fminf(view.width - 2 * margin, 640 * s));
    float height = gui_wrapped_height(gui, GUI_NORMAL, text, width - pad) + floorf(84 * s);
    height = floorf(fminf(height, view.height - 2 * margin));
    GuiRect at = {floorf(view.x + (view.width - width) / 2), floorf(view.y + (view.height - height) / 2), width, height};
    gui_window_begin(gui, "briefing", at, GUI_ON_TOP | GUI_FRAMED);   // also above the labels of the views
    gui_text_wrapped(gui, GUI_LARGE, gui_colors.text, panel_text(state->title));
    gui_space(gui, floorf(2 * s));
    gui_text_wrapped(gui, GUI_NORMAL, gui_colors.text, text);
    gui_space(gui, floorf(2 * s));
    char key[32];
    if (gui_button(gui, "begin", "Close", key_table_text(ACTION_BRIEFING, key, sizeof key), floorf(110 * s), false).pressed)
        panel->mouse_pressed[ACTION_BRIEFING]++;
    gui_window_end(gui);
    panel->briefing_at = at;
}

static void veil(Panel *panel, const WindowInput *input)
{
    GuiRect all = {0, 0, (float)input->width, (float)input->height};
    gui_window_begin(panel->gui, "veil", all, GUI_ON_TOP | GUI_VEIL);
    gui_window_end(panel->gui);
}

static void help_line(Gui *gui, const char *keys, const char *help, GuiFont font, float key_width)
{
    GuiRect at = gui_place(gui, 0, gui_line_height(gui, font));
    gui_draw_text(gui, at.x, at.y, font, gui_colors.accent, keys);
    gui_draw_text(gui, at.x + key_width, at.y, font, gui_colors.text, help);
}

static void help_group(Panel *panel, ActionGroup group, GuiFont font, float key_width)
{
    panel_heading(panel, action_group_name[group]);
    for (int i = 0, covered = 1; i < ACTION_COUNT; i += covered) {
        char keys[64];
        const char *help;
        covered = key_table_line((ActionId)i, keys, sizeof keys, &help);
        if (key_table[i].group == group && (!panel->is_replay || replay_has_action((ActionId)i)))
            help_line(panel->gui, keys, help, font, key_width);
    }
}

// In a replay the tool and the X-ray system obey the recording: instead of their keys, those of the timeline.
static void help_timeline(Panel *panel, GuiFont font, float key_width)
{
    panel_heading(panel, "Timeline");
    for (int i = 0; i < REPLAY_KEYS; i++) {
        char key[KEY_BINDING_TEXT];
        help_line(panel->gui, replay_key_text((ReplayKey)i, key, sizeof key), replay_key_help((ReplayKey)i), font, key_width);
    }
}

void panel_draw_help(Panel *panel, const WindowInput *input, const PanelState *state)
{
    Gui *gui = panel->gui;
    float s = gui_scale(gui), margin = floorf(12 * s), key_width = floorf(112 * s), head = floorf(38 * s);
    GuiRect at = {margin, margin, (float)input->width - 2 * margin, (float)input->height - 2 * margin};
    veil(panel, input);
    gui_window_begin(gui, "help", (GuiRect){at.x, at.y, at.width, head}, GUI_ON_TOP);
    gui_text(gui, GUI_LARGE, gui_colors.text, "Keys");
    gui_beside(gui, margin);
    gui_text(gui, GUI_NORMAL, gui_colors.dim, "Everything is also a button in the panels.");
    gui_beside(gui, margin);
    panel_action_button(panel, state, ACTION_HELP, "help", floorf(120 * s));
    gui_window_end(gui);
    // larger letters if the longer column and the widest line have room for them
    float half = floorf(at.width / 2);
    int lines = 0;
    float widest = 0;
    for (int i = 0; i < ACTION_COUNT;) {
        char keys[64];
        const char *help;
        float width, height;
        lines += key_table[i].group < GROUP_VIEW;
        i += key_table_line((ActionId)i, keys, sizeof keys, &help);
        gui_text_extent(gui, GUI_NORMAL, help, &width, &height);
        widest = fmaxf(widest, width);
    }
    bool has_room = (float)(lines + GROUP_VIEW + 1) * (gui_line_height(gui, GUI_NORMAL) + 4 * s) < at.height - head && key_width + widest + 3 * margin < half;
    GuiFont font = has_room ? GUI_NORMAL : GUI_SMALL;
    for (int i = 0; i < 2; i++) {
        GuiRect part = {at.x + (i ? half : 0), at.y + head, i ? at.width - half : half, at.height - head};
        gui_window_begin(gui, i ? "help right" : "help left", part, GUI_ON_TOP);
        if (panel->is_replay && i == 0)
            help_timeline(panel, font, key_width);
        for (int group = panel->is_replay ? GROUP_VIEW : 0; group < ACTION_GROUPS; group++)
            if ((group >= GROUP_VIEW) == (i == 1))
                help_group(panel, (ActionGroup)group, font, key_width);
        gui_window_end(gui);
    }
}

void panel_draw_dialogue(Panel *panel, const WindowInput *input)
{
    static const PanelQuestion own[] = {
        [DIALOGUE_QUIT] = {"End the session?", "The session is saved as it is now.", "End", "Continue"},
        [DIALOGUE_RESTART] = {"Restart?", "The exercise starts again from the beginning; this attempt is kept in the recording.", "Restart", "Continue"},
        [DIALOGUE_TRAINEE] = {"Who is practising?", "The name is shown in the report, which compares earlier sessions of the same name.", "Accept", "Cancel"}};
    static const PanelQuestion end_replay = {"Close the replay?", "The recording stays as it is.", "Close", "Continue"};
    const PanelQuestion *question = panel->dialogue == DIALOGUE_QUESTION                   ? &panel->question
                                    : panel->dialogue == DIALOGUE_QUIT && panel->is_replay ? &end_replay
                                                                                           : &own[panel->dialogue];
    Gui *gui = panel->gui;
    float s = gui_scale(gui), width = floorf(fminf(420 * s, (float)input->width - 20 * s));
    float height = floorf((panel->dialogue == DIALOGUE_TRAINEE || panel->dialogue == DIALOGUE_QUESTION ? 142 : 112) * s);
    veil(panel, input);
    GuiRect at = {floorf(((float)input->width - width) / 2), floorf(((float)input->height - height) / 2), width, height};
    gui_window_begin(gui, "dialogue", at, GUI_ON_TOP | GUI_FRAMED);
    gui_text(gui, GUI_LARGE, gui_colors.text, question->title);
    gui_text_wrapped(gui, GUI_NORMAL, gui_colors.dim, question->text);
    gui_space(gui, floorf(4 * s));
    if (panel->dialogue == DIALOGUE_TRAINEE && gui_text_field(gui, "name", panel->name, sizeof panel->name, panel->dialogue_is_new))
        panel->answer = 1;
    gui_space(gui, floorf(2 * s));
    float gap = floorf(8 * s), button = floorf((gui_width(gui) - gap) / 2);
    if (gui_button(gui, "yes", question->yes, "Enter", button, false).pressed)
        panel->answer = 1;
    gui_beside(gui, gap);
    if (gui_button(gui, "no", question->no, "Esc", button, false).pressed)
        panel->answer = -1;
    gui_window_end(gui);
}
