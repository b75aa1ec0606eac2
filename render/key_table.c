// One row per action, in the order of ActionId. A trainee's left hand is on A S D W, C, E and F (C-arm, contrast, X-ray) and the right hand on the
// arrows (tool), arranged like the controls on the table and the wire in the angio suite. To move a second tool the left hand goes to U H J K,
// which are arranged like the arrows on every Latin keyboard layout; rarely used settings (table, blades) are letters with Alt.
#include "render/key_table.h"

#include <stdio.h>
#include <string.h>

#define K(letter) letter, 0, 0
#define KEY(name) WINDOW_KEY_##name, 0, 0
#define ALT_K(letter) letter, WINDOW_ALT, 0
#define ALT(name) WINDOW_KEY_##name, WINDOW_ALT, 0
#define F(number) WINDOW_KEY_F1 + (number)-1, 0, 0

const KeyAction key_table[ACTION_COUNT] = {
    {ACTION_PUSH, GROUP_TOOL, ACTION_HOLD, KEY(UP), "Push", "push the tool into the patient while held"},
    {ACTION_PULL, GROUP_TOOL, ACTION_HOLD, KEY(DOWN), "Pull", "pull the tool back while held"},
    {ACTION_TWIST_LEFT, GROUP_TOOL, ACTION_HOLD, KEY(LEFT), "Twist left", "turn the tool left (counter-clockwise, seen from behind) while held"},
    {ACTION_TWIST_RIGHT, GROUP_TOOL, ACTION_HOLD, KEY(RIGHT), "Twist right", "turn the tool right (clockwise, seen from behind) while held"},
    {ACTION_FAST, GROUP_TOOL, ACTION_HOLD, KEY(SHIFT), "Fast", "with push, pull or twist: faster"},
    {ACTION_SLOW, GROUP_TOOL, ACTION_HOLD, KEY(CTRL), "Slow", "with push, pull or twist: slower, for the last millimetres"},
    {ACTION_STOP, GROUP_TOOL, ACTION_HOLD, KEY(SPACE), "Hold tool", "stop all tools while held, whatever other devices request"},
    {ACTION_OTHER_PUSH, GROUP_TOOL, ACTION_HOLD, K('U'), "Push other", "push the next tool inside (for the innermost: the one around it) while held"},
    {ACTION_OTHER_PULL, GROUP_TOOL, ACTION_HOLD, K('J'), "Pull other", "pull that tool, the other one of the pair, back while held"},
    {ACTION_OTHER_TWIST_LEFT, GROUP_TOOL, ACTION_HOLD, K('H'), "Other left", "turn the other tool of the pair left while held"},
    {ACTION_OTHER_TWIST_RIGHT, GROUP_TOOL, ACTION_HOLD, K('K'), "Other right", "turn the other tool of the pair right while held"},
    {ACTION_TOOL_1, GROUP_TOOL, ACTION_PRESS, K('1'), "Tool 1", "select the outermost tool: it is moved, the others are pinned"},
    {ACTION_TOOL_2, GROUP_TOOL, ACTION_PRESS, K('2'), "Tool 2", "select the second tool, counted from the outermost"},
    {ACTION_TOOL_3, GROUP_TOOL, ACTION_PRESS, K('3'), "Tool 3", "select the third tool"},
    {ACTION_TOOL_4, GROUP_TOOL, ACTION_PRESS, K('4'), "Tool 4", "select the fourth tool"},
    {ACTION_LOCK, GROUP_TOOL, ACTION_PRESS, K('L'), "Lock", "lock the pair (tool and next one inside or around it): they move as one"},
    {ACTION_RELEASE, GROUP_TOOL, ACTION_PRESS, K('G'), "Release", "release the tool: only its valve holds it; again: hold it"},
    {ACTION_EXCHANGE, GROUP_TOOL, ACTION_PRESS, K('X'), "Exchange", "open the tray: another device for the tool, a tip to shape; again: close"},

    {ACTION_PEDAL, GROUP_XRAY, ACTION_HOLD, K('F'), "X-ray pedal", "fluoroscopy while held; the last image stays on release"},
    {ACTION_PEDAL_LATCH, GROUP_XRAY, ACTION_PRESS, K('E'), "X-ray stays on", "fluoroscopy on until pressed again, without holding the pedal"},
    {ACTION_CONTRAST, GROUP_XRAY, ACTION_HOLD, K('C'), "Inject contrast", "inject contrast agent through the selected tool; only X-ray shows it"},
    {ACTION_DSA, GROUP_XRAY, ACTION_PRESS, K('T'), "DSA", "subtract the mask: shows only contrast and tool; again: live image"},
    {ACTION_ROADMAP, GROUP_XRAY, ACTION_PRESS, K('R'), "Roadmap", "show the vessels of the last injection over the live image; again: off"},
    {ACTION_MASK, GROUP_XRAY, ACTION_PRESS, K('M'), "Take mask", "take a new mask for DSA and roadmap, after C-arm or table have moved"},
    {ACTION_PULSES, GROUP_XRAY, ACTION_PRESS, K('I'), "Pulse rate", "next pulse rate: 7.5, 10, 15, 30 per second"},
    {ACTION_MAGNIFY, GROUP_XRAY, ACTION_PRESS, WINDOW_KEY_KEYPAD_ADD, 0, '+', "Magnify", "smaller field, larger picture"},
    {ACTION_DEMAGNIFY, GROUP_XRAY, ACTION_PRESS, WINDOW_KEY_KEYPAD_SUBTRACT, 0, '-', "Demagnify", "larger field, smaller picture"},
    {ACTION_REFERENCE, GROUP_XRAY, ACTION_PRESS, F(2), "Reference", "keep the X-ray image beside the live one; again: remove it"},
    {ACTION_BIPLANE, GROUP_XRAY, ACTION_PRESS, F(10), "Biplane", "image of a second detector, 90 degrees from the first; again: off"},
    {ACTION_CINE_RECORD, GROUP_XRAY, ACTION_PRESS, F(6), "Record cine", "record the X-ray images as a cine loop; again: stop"},
    {ACTION_CINE_REPLAY, GROUP_XRAY, ACTION_PRESS, F(7), "Replay cine", "show the recorded loop; again: live image"},
    {ACTION_CINE_SAVE, GROUP_XRAY, ACTION_PRESS, F(8), "Save cine", "save the recorded loop as a video"},

    {ACTION_RAO, GROUP_C_ARM, ACTION_HOLD, K('A'), "RAO", "C-arm to the patient's right (right anterior oblique) while held"},
    {ACTION_LAO, GROUP_C_ARM, ACTION_HOLD, K('D'), "LAO", "C-arm to the patient's left (left anterior oblique) while held"},
    {ACTION_CRA, GROUP_C_ARM, ACTION_HOLD, K('W'), "CRA", "tilt the C-arm towards the head (cranial) while held"},
    {ACTION_CAU, GROUP_C_ARM, ACTION_HOLD, K('S'), "CAU", "tilt the C-arm towards the feet (caudal) while held"},
    {ACTION_AP, GROUP_C_ARM, ACTION_PRESS, K('0'), "AP 0/0", "C-arm straight from the front: both angles 0"},
    {ACTION_LATERAL, GROUP_C_ARM, ACTION_PRESS, K('9'), "Lateral", "C-arm from the side: LAO 90"},
    {ACTION_STORE, GROUP_C_ARM, ACTION_PRESS, ALT_K('S'), "Store position", "store C-arm, table and field; four positions, the oldest is replaced"},
    {ACTION_RECALL, GROUP_C_ARM, ACTION_PRESS, ALT_K('R'), "Recall position", "return to a stored position; again: to the next"},
    {ACTION_TABLE_UP, GROUP_C_ARM, ACTION_HOLD, ALT_K('I'), "Table up", "move the table so that the picture goes up while held"},
    {ACTION_TABLE_DOWN, GROUP_C_ARM, ACTION_HOLD, ALT_K('K'), "Table down", "move the table so that the picture goes down while held"},
    {ACTION_TABLE_LEFT, GROUP_C_ARM, ACTION_HOLD, ALT_K('J'), "Table left", "move the table so that the picture goes left while held"},
    {ACTION_TABLE_RIGHT, GROUP_C_ARM, ACTION_HOLD, ALT_K('L'), "Table right", "move the table so that the picture goes right while held"},
    {ACTION_SIDES_CLOSE, GROUP_C_ARM, ACTION_HOLD, ALT_K('G'), "Sides in", "close the collimator's left and right blades while held"},
    {ACTION_SIDES_OPEN, GROUP_C_ARM, ACTION_HOLD, ALT_K('H'), "Sides out", "open the collimator's left and right blades while held"},
    {ACTION_ENDS_CLOSE, GROUP_C_ARM, ACTION_HOLD, ALT_K('T'), "Ends in", "close the collimator's upper and lower blades while held"},
    {ACTION_ENDS_OPEN, GROUP_C_ARM, ACTION_HOLD, ALT_K('Y'), "Ends out", "open the collimator's upper and lower blades while held"},

    {ACTION_VIEW_FLUOROSCOPY, GROUP_VIEW, ACTION_PRESS, K('5'), "X-ray view", "fluoroscopy as the main view"},
    {ACTION_VIEW_3D, GROUP_VIEW, ACTION_PRESS, K('6'), "3D view", "the vessel in 3D as the main view"},
    {ACTION_VIEW_ANGIOSCOPY, GROUP_VIEW, ACTION_PRESS, K('7'), "Angioscopy", "the view from the tip of the selected tool as the main view"},
    {ACTION_VIEW_ALL, GROUP_VIEW, ACTION_PRESS, K('8'), "All views", "all three views side by side"},
    {ACTION_CAMERA_RESET, GROUP_VIEW, ACTION_PRESS, KEY(HOME), "Reset camera", "3D: the whole vessel as the C-arm stood at the start"},
    {ACTION_CAMERA_FOLLOW, GROUP_VIEW, ACTION_PRESS, K('V'), "Follow tip", "3D: the camera follows the tip of the tool"},
    {ACTION_CAMERA_C_ARM, GROUP_VIEW, ACTION_PRESS, K('Y'), "3D follows C-arm", "3D: the camera turns with the C-arm; again: it is free"},
    {ACTION_SECTION, GROUP_VIEW, ACTION_PRESS, K('N'), "Section", "3D: cut the vessel open with a plane through the tool's tip"},
    {ACTION_SECTION_NEARER, GROUP_VIEW, ACTION_HOLD, KEY(INSERT), "Plane nearer", "3D: move the section plane towards you while held"},
    {ACTION_SECTION_FARTHER, GROUP_VIEW, ACTION_HOLD, KEY(DELETE), "Plane farther", "3D: move the section plane away while held"},
    {ACTION_MODEL, GROUP_VIEW, ACTION_PRESS, K('Q'), "Local model", "3D: show the local model of the wall at the tip as a wireframe"},
    {ACTION_ARROWS, GROUP_VIEW, ACTION_PRESS, K('Z'), "Force arrows", "3D: wall forces as arrows"},
    {ACTION_ORBIT_UP, GROUP_VIEW, ACTION_HOLD, ALT(UP), "Orbit up", "3D: turn the camera up while held; or drag in the view"},
    {ACTION_ORBIT_DOWN, GROUP_VIEW, ACTION_HOLD, ALT(DOWN), "Orbit down", "3D: turn the camera down while held; or drag in the view"},
    {ACTION_ORBIT_LEFT, GROUP_VIEW, ACTION_HOLD, ALT(LEFT), "Orbit left", "3D: turn the camera left while held; or drag in the view"},
    {ACTION_ORBIT_RIGHT, GROUP_VIEW, ACTION_HOLD, ALT(RIGHT), "Orbit right", "3D: turn the camera right while held; or drag in the view"},
    {ACTION_CAMERA_NEARER, GROUP_VIEW, ACTION_HOLD, KEY(PAGE_UP), "Nearer", "3D: camera nearer while held; or the mouse wheel in the view"},
    {ACTION_CAMERA_FARTHER, GROUP_VIEW, ACTION_HOLD, KEY(PAGE_DOWN), "Farther", "3D: camera farther while held; or the mouse wheel in the view"},

    {ACTION_PAUSE, GROUP_SESSION, ACTION_PRESS, K('P'), "Pause", "pause the simulation; again: continue"},
    {ACTION_RESTART, GROUP_SESSION, ACTION_PRESS, F(4), "Restart", "restart the exercise (asks first)"},
    {ACTION_BOOKMARK, GROUP_SESSION, ACTION_PRESS, K('B'), "Bookmark", "mark this moment in the recording, to return to it"},
    {ACTION_SAVE, GROUP_SESSION, ACTION_PRESS, F(5), "Save session", "save recording and score so far"},
    {ACTION_TRAINEE, GROUP_SESSION, ACTION_PRESS, F(3), "Trainee", "enter the trainee's name for the report"},
    {ACTION_SCREENSHOT, GROUP_SESSION, ACTION_PRESS, F(12), "Screenshot", "save the window as a picture"},
    {ACTION_FULL_SCREEN, GROUP_SESSION, ACTION_PRESS, F(11), "Full screen", "fill the screen; again: window"},
    {ACTION_PANELS, GROUP_SESSION, ACTION_PRESS, KEY(TAB), "Panels", "hide or show the panels around the views"},
    {ACTION_HINTS, GROUP_SESSION, ACTION_PRESS, F(9), "Hints", "hide or show the hints at the bottom"},
    {ACTION_BRIEFING, GROUP_SESSION, ACTION_PRESS, K('O'), "Instructions", "show or hide the whole text of the exercise"},
    {ACTION_HELP, GROUP_SESSION, ACTION_PRESS, WINDOW_KEY_F1, 0, '?', "Help", "this list of keys"},
    {ACTION_QUIT, GROUP_SESSION, ACTION_PRESS, KEY(ESCAPE), "Quit", "end the session (asks first); closes this list or a dialogue"},
};

const char *const action_group_name[ACTION_GROUPS] = {"Tool", "X-ray", "C-arm and table", "Views", "Session"};

// Set before the first window opens and by the page of settings, which runs in the same thread as the windows.
static KeyBinding in_force[ACTION_COUNT];
static bool is_bound;

KeyBinding key_table_default(ActionId id) { return (KeyBinding){key_table[id].key, key_table[id].modifiers, key_table[id].character}; }

KeyBinding key_table_binding(ActionId id) { return is_bound ? in_force[id] : key_table_default(id); }

void key_table_bind(const KeyBinding *binding)
{
    is_bound = binding != NULL;
    if (binding)
        memcpy(in_force, binding, sizeof in_force);
}

const char *key_table_text(ActionId id, char *text, size_t capacity) { return key_binding_text(key_table_binding(id), text, capacity); }

static const char *key_of_name(int table, const char *name, size_t length, char *text, size_t capacity)
{
    (void)table;
    for (int i = 0; i < ACTION_COUNT; i++)
        if (strlen(key_table[i].name) == length && !strncmp(key_table[i].name, name, length))
            return key_table_text((ActionId)i, text, capacity);
    return NULL;
}

char *key_table_fill(const char *from, char *text, size_t capacity) { return key_binding_fill(key_of_name, 0, from, text, capacity); }

// Related keys share a line in the list.
static const struct {
    ActionId first, last;
    const char *help;
} shared_line[] = {
    {ACTION_PUSH, ACTION_PULL, "push the tool into the patient, pull it back, while held"},
    {ACTION_TWIST_LEFT, ACTION_TWIST_RIGHT, "turn the tool left, right (clockwise, seen from behind) while held"},
    {ACTION_FAST, ACTION_SLOW, "with push, pull or twist: faster; slower, for the last millimetres"},
    {ACTION_OTHER_PUSH, ACTION_OTHER_TWIST_RIGHT, "push, pull, turn left, turn right the other tool of the pair while held"},
    {ACTION_TOOL_1, ACTION_TOOL_4, "select the tool to move, outermost first; the others are pinned"},
    {ACTION_MAGNIFY, ACTION_DEMAGNIFY, "larger picture of a smaller field; smaller picture of a larger field"},
    {ACTION_RAO, ACTION_LAO, "C-arm to the patient's right (RAO), left (LAO) while held"},
    {ACTION_CRA, ACTION_CAU, "tilt the C-arm towards the head (CRA), the feet (CAU) while held"},
    {ACTION_TABLE_UP, ACTION_TABLE_RIGHT, "move the picture up, down, left, right (the table) while held"},
    {ACTION_SIDES_CLOSE, ACTION_SIDES_OPEN, "close, open the collimator's left and right blades while held"},
    {ACTION_ENDS_CLOSE, ACTION_ENDS_OPEN, "close, open the collimator's upper and lower blades while held"},
    {ACTION_SECTION_NEARER, ACTION_SECTION_FARTHER, "3D: move the section plane towards you, away, while held"},
    {ACTION_ORBIT_UP, ACTION_ORBIT_DOWN, "3D: turn the camera up, down while held; or drag in the view"},
    {ACTION_ORBIT_LEFT, ACTION_ORBIT_RIGHT, "3D: turn the camera left, right while held; or drag in the view"},
};

int key_table_line(ActionId first, char *keys, size_t capacity, const char **help)
{
    int last = (int)first;
    *help = key_table[first].help;
    for (size_t i = 0; i < sizeof shared_line / sizeof shared_line[0]; i++)
        if (shared_line[i].first == first)
            last = (int)shared_line[i].last, *help = shared_line[i].help;
    size_t used = 0;
    for (int id = (int)first; id <= last && used < capacity; id++) {
        char text[32];
        const char *key = key_table_text((ActionId)id, text, sizeof text);
        if (id > (int)first && key_table_binding(first).modifiers & key_table_binding((ActionId)id).modifiers & WINDOW_ALT)
            key += strlen("Alt+");       // shown once, with the first key
        used += (size_t)snprintf(keys + used, capacity - used, "%s%s", id > (int)first ? " " : "", key);
    }
    return last - (int)first + 1;
}

void key_state_begin(KeyState *state) { memset(state->pressed, 0, sizeof state->pressed); }

void key_state_release(KeyState *state) { memset(state->held, 0, sizeof state->held); }

static bool passes_capture(int key) { return key == WINDOW_KEY_ESCAPE || (key >= WINDOW_KEY_F1 && key <= WINDOW_KEY_F12); }

static void key_down(KeyState *state, const WindowEvent *event)
{
    for (int i = 0; i < ACTION_COUNT; i++) {
        const KeyBinding binding = key_table_binding((ActionId)i);
        if (binding.key != event->key || binding.modifiers != (event->modifiers & WINDOW_ALT))
            continue;
        if (key_table[i].kind == ACTION_HOLD)
            state->held[i] = true;
        else
            state->pressed[i]++;
    }
}

static void key_up(KeyState *state, int key)
{
    for (int i = 0; i < ACTION_COUNT; i++)
        if (key_table_binding((ActionId)i).key == key)
            state->held[i] = false;
}

static void character_typed(KeyState *state, unsigned character)
{
    for (int i = 0; i < ACTION_COUNT; i++) {
        const KeyBinding binding = key_table_binding((ActionId)i);
        // the keypad key of this sign has already come as a key event
        if (binding.character && (unsigned)binding.character == character && key_table[i].kind == ACTION_PRESS)
            state->pressed[i]++;
    }
}

void key_state_feed(KeyState *state, const WindowInput *input, bool is_captured)
{
    bool is_keypad = false;
    for (int i = 0; i < input->event_count; i++) {
        const WindowEvent *event = &input->event[i];
        switch (event->kind) {
        case WINDOW_KEY_DOWN_EVENT:
            is_keypad = event->key == WINDOW_KEY_KEYPAD_ADD || event->key == WINDOW_KEY_KEYPAD_SUBTRACT;
            // a key repeat starts nothing: actions released by loss of focus or a dialogue need a new press
            if (!event->is_repeat && ((!is_captured && !(event->modifiers & WINDOW_SUPER)) || passes_capture(event->key)))
                key_down(state, event);
            break;
        case WINDOW_KEY_UP_EVENT: key_up(state, event->key); break;
        case WINDOW_TEXT_EVENT:
            if (!is_captured && !event->is_repeat && !is_keypad)
                character_typed(state, event->character);
            break;
        case WINDOW_FOCUS_LOST_EVENT: key_state_release(state); break;
        case WINDOW_SCROLL_EVENT:
        case WINDOW_DROP_EVENT:
        case WINDOW_DEVICE_EVENT: break;
        }
    }
    if (!input->has_focus)
        key_state_release(state);
}

bool key_table_is_of_3d(ActionId id) { return key_table[id].group == GROUP_VIEW && id != ACTION_VIEW_FLUOROSCOPY; }
