// Shared by panel.c (input, dialogues, state) and by panel_draw.c, panel_controls.c, panel_views.c, panel_boxes.c and panel_tray.c (appearance).
#ifndef SELDINGER_RENDER_PANEL_INTERNAL_H
#define SELDINGER_RENDER_PANEL_INTERNAL_H

#include "render/panel_state.h"
#include "render/plot.h"
#include "render/window.h"

typedef enum { BRIEFING_AT_BEGIN, BRIEFING_OPEN, BRIEFING_CLOSED } Briefing;   // AT_BEGIN: until the tool or the X-ray system is used
typedef enum { DIALOGUE_NONE, DIALOGUE_QUIT, DIALOGUE_RESTART, DIALOGUE_TRAINEE, DIALOGUE_QUESTION, DIALOGUE_TRAY } Dialogue;
enum { PANEL_MESSAGES = 100, PANEL_TABS = 5, BUTTONS_IN_ROW = 5 };

typedef struct PanelMessage {
    double now_s;
    PanelMark mark;
    char text[200];
} PanelMessage;

typedef struct Panel Panel;
struct Panel {
    Gui *gui;
    KeyState keys;
    PanelLayout layout;            // as last drawn
    bool is_drawn;                 // layout and sizes of the contents are known
    int width, height;
    // mouse on buttons and sliders, until the next panel_take_input
    bool mouse_held[ACTION_COUNT];
    bool latched[ACTION_COUNT];    // Fast and Slow are toggled by the mouse, which cannot hold two buttons
    int mouse_pressed[ACTION_COUNT];
    bool xray_set;
    XrayControl xray;
    bool held[ACTION_COUNT];       // as last returned: buttons light up together with their keys
    // mouse in a view
    int drag_view;
    unsigned drag_buttons;
    double mouse_x, mouse_y, dragged;   // dragged: distance since the press [pixel]
    // open boxes
    Dialogue dialogue;
    bool dialogue_is_new;
    PanelQuestion question;
    int answer;                    // a click on its yes (1) or no (-1)
    char name[64];                 // the text field
    PanelTrayChoice tray;
    int tray_count, tray_shown;    // tray_shown: the device last scrolled into view
    float tray_over;               // [pixel] height of its contents that does not fit; < 0: free height
    float tray_value[3];           // of its sliders: length, angle, mandrel
    bool has_help, has_panels, has_hints;
    Briefing briefing;
    bool was_finished;             // the exercise, in the last frame
    bool is_replay;
    bool is_interactive;           // there is a user: panel_take_input was called
    GuiRect briefing_at;           // as last drawn; zero width: not shown
    double used_s[ACTION_COUNT];   // how long an action was held, or 1 s for each press: hints disappear with use
    // plots and log
    RunningPlot force[PANEL_TOOLS], torque[PANEL_TOOLS], wall;
    int plots;
    float plot_height;
    bool is_dense;                 // the rows of the left column are in small letters because they would not fit otherwise
    int message_count;             // number of all messages; the last PANEL_MESSAGES are kept
    PanelMessage message[PANEL_MESSAGES];
};

// The buttons of each tab, row by row. Every action is in one of them (checked by a test).
typedef struct ButtonRow {
    int tab, count;
    ActionId action[BUTTONS_IN_ROW];
    bool is_of_several;            // hidden if there is only one tool
} ButtonRow;

// panel_text.c
extern const char *const panel_sign[MARK_BAD + 1];         // a tick, a triangle or a cross before a marked text
extern const char *const panel_mode_name[PANEL_CINE + 1];
Color panel_mark_color(PanelMark mark);
const char *panel_text(const char *text);                  // "" for NULL
const char *panel_figure(char *text, size_t capacity, double value, int decimals, const char *unit);
const char *panel_minutes(char *text, size_t capacity, double s);
bool panel_has_more_lines(const char *text);
bool panel_first_line(const char *text, char *line, size_t capacity);
void panel_heading(Panel *panel, const char *text);

// A position for a label without overlap: `wanted`, or the nearest free one above or below it.
GuiRect panel_free_place(GuiRect wanted, const GuiRect *taken, int count);

void panel_reflow(const char *from, char *to, size_t capacity);

// Draws the button of an action; `where` distinguishes several buttons of one action.
void panel_action_button(Panel *panel, const PanelState *state, ActionId id, const char *where, float width);
void panel_draw_controls(Panel *panel, const PanelState *state);
void panel_draw_over_views(Panel *panel, const PanelState *state);
void panel_draw_briefing(Panel *panel, const PanelState *state);
void panel_draw_help(Panel *panel, const WindowInput *input, const PanelState *state);
void panel_draw_dialogue(Panel *panel, const WindowInput *input);
void panel_draw_tray(Panel *panel, const WindowInput *input, const PanelState *state);
void panel_draw_all(Panel *panel, const WindowInput *input, const PanelState *state);
int panel_current_hint(const Panel *panel, int tool_count);        // -1: none left
void panel_hint_text(int hint, char *text, size_t capacity);
// What is happening and what to do (a HintKind; not in an examination), or the present step of a guided exercise. Returns false if there is neither.
bool panel_happening_text(const PanelState *state, char *text, size_t capacity);
void panel_draw_steps(Panel *panel, const PanelState *state);      // the checklist

#endif
