// All user actions in one table, from which keys, help overlay, tooltips and panel buttons are made, so that none is undocumented; and the state of
// the actions, computed from key events. No window, no GL, no clock.
#ifndef SELDINGER_RENDER_KEY_TABLE_H
#define SELDINGER_RENDER_KEY_TABLE_H

#include "render/key_binding.h"

#include <stdbool.h>
#include <stddef.h>

typedef enum ActionId {
    // tool: held
    ACTION_PUSH,
    ACTION_PULL,
    ACTION_TWIST_LEFT,
    ACTION_TWIST_RIGHT,
    ACTION_FAST,
    ACTION_SLOW,
    ACTION_STOP,
    ACTION_OTHER_PUSH,
    ACTION_OTHER_PULL,
    ACTION_OTHER_TWIST_LEFT,
    ACTION_OTHER_TWIST_RIGHT,
    // pressed
    ACTION_TOOL_1,
    ACTION_TOOL_2,
    ACTION_TOOL_3,
    ACTION_TOOL_4,
    ACTION_LOCK,
    ACTION_RELEASE,
    ACTION_EXCHANGE,
    // X-ray
    ACTION_PEDAL,
    ACTION_PEDAL_LATCH,
    ACTION_CONTRAST,
    ACTION_DSA,
    ACTION_ROADMAP,
    ACTION_MASK,
    ACTION_PULSES,
    ACTION_MAGNIFY,
    ACTION_DEMAGNIFY,
    ACTION_REFERENCE,
    ACTION_BIPLANE,
    ACTION_CINE_RECORD,
    ACTION_CINE_REPLAY,
    ACTION_CINE_SAVE,
    // C-arm, table, collimator: held
    ACTION_RAO,
    ACTION_LAO,
    ACTION_CRA,
    ACTION_CAU,
    ACTION_AP,
    ACTION_LATERAL,
    ACTION_STORE,
    ACTION_RECALL,
    ACTION_TABLE_UP,
    ACTION_TABLE_DOWN,
    ACTION_TABLE_LEFT,
    ACTION_TABLE_RIGHT,
    ACTION_SIDES_CLOSE,
    ACTION_SIDES_OPEN,
    ACTION_ENDS_CLOSE,
    ACTION_ENDS_OPEN,
    // views
    ACTION_VIEW_FLUOROSCOPY,
    ACTION_VIEW_3D,
    ACTION_VIEW_ANGIOSCOPY,
    ACTION_VIEW_ALL,
    ACTION_CAMERA_RESET,
    ACTION_CAMERA_FOLLOW,
    ACTION_CAMERA_C_ARM,
    ACTION_SECTION,
    ACTION_SECTION_NEARER,
    ACTION_SECTION_FARTHER,
    ACTION_MODEL,
    ACTION_ARROWS,
    ACTION_ORBIT_UP,
    ACTION_ORBIT_DOWN,
    ACTION_ORBIT_LEFT,
    ACTION_ORBIT_RIGHT,
    ACTION_CAMERA_NEARER,
    ACTION_CAMERA_FARTHER,
    // session
    ACTION_PAUSE,
    ACTION_RESTART,
    ACTION_BOOKMARK,
    ACTION_SAVE,
    ACTION_TRAINEE,
    ACTION_SCREENSHOT,
    ACTION_FULL_SCREEN,
    ACTION_PANELS,
    ACTION_HINTS,
    ACTION_BRIEFING,
    ACTION_HELP,
    ACTION_QUIT,
    ACTION_COUNT
} ActionId;

typedef enum { ACTION_HOLD, ACTION_PRESS } ActionKind;   // active while held, or triggered once per press
typedef enum { GROUP_TOOL, GROUP_XRAY, GROUP_C_ARM, GROUP_VIEW, GROUP_SESSION, ACTION_GROUPS } ActionGroup;

typedef struct KeyAction {
    ActionId id;             // its index in the table
    ActionGroup group;
    ActionKind kind;
    int key;                 // as in KeyBinding: the key by default
    unsigned modifiers;
    char character;
    const char *name;        // the text on the button, at most 18 bytes
    const char *help;        // one line
} KeyAction;

extern const KeyAction key_table[ACTION_COUNT];
extern const char *const action_group_name[ACTION_GROUPS];

KeyBinding key_table_default(ActionId id);
// The key in force: the user's choice, else the default.
KeyBinding key_table_binding(ActionId id);
// Puts keys (ACTION_COUNT) in force for all windows of the process; NULL: the defaults. Call before a window opens, or from the thread of the windows.
void key_table_bind(const KeyBinding *binding);
// Writes the keys in force as shown to the user, "Alt+Up", "F1 or ?"; returns text.
const char *key_table_text(ActionId id, char *text, size_t capacity);
// Copies a text in which {NAME}, with the name of an action, stands for its key: "Hold {X-ray pedal}." becomes "Hold F." Every text that a user sees names keys
// so, also those of exercises and translations (which keep the names in English). Braces around anything else stay. Returns text.
char *key_table_fill(const char *from, char *text, size_t capacity);
// Writes a line of the list of keys, starting at this action: "Alt+Up Down" and its description. Returns the number of actions covered, 1 or more.
int key_table_line(ActionId first, char *keys, size_t capacity, const char **help);

// The actions that are on. Initialise with zeros.
typedef struct KeyState {
    bool held[ACTION_COUNT];       // ACTION_HOLD: its key is down
    int pressed[ACTION_COUNT];     // ACTION_PRESS: number of presses since key_state_begin
} KeyState;

void key_state_begin(KeyState *state);   // at the start of a frame: clears presses, keeps held actions
// Takes the events of a window: keys, typed characters, loss of focus (releases everything). A key pressed with Alt keeps its meaning until it is released.
// `is_captured`: a text field has the keyboard; releases still count, presses do not, except for Escape and the function keys.
void key_state_feed(KeyState *state, const WindowInput *input, bool is_captured);
void key_state_release(KeyState *state); // releases all keys: the tool stops

// Whether an action is for the 3D view or angioscopy, which examinations hide.
bool key_table_is_of_3d(ActionId id);

#endif
