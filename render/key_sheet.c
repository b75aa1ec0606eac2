// A row per key, in the order of its window's enum. See key_sheet.h.
#include "render/key_sheet.h"

#include "render/translation.h"

#include <stdio.h>
#include <string.h>

#define K(letter)                                                                                                                                              \
    {                                                                                                                                                          \
        letter, 0, 0                                                                                                                                           \
    }
#define KEY(name)                                                                                                                                              \
    {                                                                                                                                                          \
        WINDOW_KEY_##name, 0, 0                                                                                                                                \
    }
#define CTRL(letter)                                                                                                                                           \
    {                                                                                                                                                          \
        letter, WINDOW_CTRL, 0                                                                                                                                 \
    }
#define CTRL_KEY(name)                                                                                                                                         \
    {                                                                                                                                                          \
        WINDOW_KEY_##name, WINDOW_CTRL, 0                                                                                                                      \
    }
#define PLUS                                                                                                                                                   \
    {                                                                                                                                                          \
        WINDOW_KEY_KEYPAD_ADD, 0, '+'                                                                                                                          \
    }
#define MINUS                                                                                                                                                  \
    {                                                                                                                                                          \
        WINDOW_KEY_KEYPAD_SUBTRACT, 0, '-'                                                                                                                     \
    }
#define CTRL_PLUS                                                                                                                                              \
    {                                                                                                                                                          \
        WINDOW_KEY_KEYPAD_ADD, WINDOW_CTRL, '+'                                                                                                                \
    }
#define CTRL_MINUS                                                                                                                                             \
    {                                                                                                                                                          \
        WINDOW_KEY_KEYPAD_SUBTRACT, WINDOW_CTRL, '-'                                                                                                           \
    }

static const SheetKey case_key[] = {
    [CASE_KEY_LEFT] = {"left", KEY(LEFT), "Cross-hair left", "move the cross-hair (Shift: ten times); turn the projection"},
    [CASE_KEY_RIGHT] = {"right", KEY(RIGHT), "Cross-hair right", NULL},
    [CASE_KEY_UP] = {"up", KEY(UP), "Cross-hair up", NULL},
    [CASE_KEY_DOWN] = {"down", KEY(DOWN), "Cross-hair down", NULL},
    [CASE_KEY_CLICK] = {"click", KEY(ENTER), "Click at the cross-hair", "a click at the cross-hair"},
    [CASE_KEY_SLICE_NEXT] = {"slice_next", KEY(PAGE_UP), "Next slice", "next slice, slice before; zoom the projection"},
    [CASE_KEY_SLICE_BEFORE] = {"slice_before", KEY(PAGE_DOWN), "Slice before", NULL},
    [CASE_KEY_NEARER] = {"nearer", PLUS, "Nearer", "zoom in, out"},
    [CASE_KEY_FARTHER] = {"farther", MINUS, "Farther", NULL},
    [CASE_KEY_BRIGHTER] = {"brighter", K('['), "Brighter", "brighter, darker"},
    [CASE_KEY_DARKER] = {"darker", K(']'), "Darker", NULL},
    [CASE_KEY_NARROWER] = {"narrower", K(','), "More contrast", "more contrast, less; brightness as at first"},
    [CASE_KEY_WIDER] = {"wider", K('.'), "Less contrast", NULL},
    [CASE_KEY_RESET_BRIGHTNESS] = {"reset_brightness", K('0'), "Brightness as at first", NULL},
    [CASE_KEY_NEXT_VIEW] = {"next_view", KEY(TAB), "Next view", "give the keys to the next view (Shift: back)"},
    [CASE_KEY_TURN] = {"turn", KEY(SPACE), "Turning projection", "the projection turns by itself, or stops"},
    [CASE_KEY_START] = {"start", K('1'), "A click: new start", "a click: start, branch, forbid, cut"},
    [CASE_KEY_BRANCH] = {"branch", K('2'), "A click: add branch", NULL},
    [CASE_KEY_FORBID] = {"forbid", K('3'), "A click: forbid", NULL},
    [CASE_KEY_CUT] = {"cut", K('4'), "A click: cut", NULL},
    [CASE_KEY_END] = {"end", K('5'), "A click: end here", "a click: end here, sac, entry, target"},
    [CASE_KEY_SAC] = {"sac", K('6'), "A click: mark sac", NULL},
    [CASE_KEY_ENTRY] = {"entry", K('7'), "A click: entry", NULL},
    [CASE_KEY_TARGET] = {"target", K('8'), "A click: target", NULL},
    [CASE_KEY_LOOK] = {"look", K('L'), "A click: look there", "a click only looks there"},
    [CASE_KEY_MARK_NEXT] = {"mark_next", K('N'), "Next mark", "next mark, mark before"},
    [CASE_KEY_MARK_BEFORE] = {"mark_before", K('P'), "Mark before", NULL},
    [CASE_KEY_WALL] = {"wall", K('W'), "Wall or projection", "the wall instead of the projection"},
    [CASE_KEY_BONE] = {"bone", K('O'), "Bone in the projection", "bone in the projection of a CT, or not"},
    [CASE_KEY_FORBID_BONE] = {"forbid_bone", K('F'), "Forbid bone", "bone of a CT is left out, or tracked as anything else"},
    [CASE_KEY_WIRE] = {"wire", K('T'), "Next wire", "next wire; next catheter around it (Shift: back)"},
    [CASE_KEY_CATHETER] = {"catheter", K('C'), "Next catheter", NULL},
    [CASE_KEY_ANATOMY] = {"anatomy", K('A'), "Which vessel of the body", "which vessel of the body it is (Shift: back)"},
    [CASE_KEY_MODEL] = {"model", K('M'), "Kind of the wall's model", "kind of the wall's model (Shift: back); fits it again"},
    [CASE_KEY_BACKGROUND] = {"background", K('B'), "What lies behind", "what lies behind the vessels"},
    [CASE_KEY_EDIT] = {"edit", K('E'), "Edit sections", "edit sections and branches of a swept model"},
    [CASE_KEY_UNDO] = {"undo", CTRL('Z'), "Undo", "undo, do again"},
    [CASE_KEY_REDO] = {"redo", CTRL('Y'), "Do again", NULL},
    [CASE_KEY_STEER] = {"steer", K('S'), "Save and steer", "save the case and steer in it"},
    [CASE_KEY_HELP] = {"help", KEY(F1), "List of keys", "this list"},
    [CASE_KEY_LEAVE] = {"leave", KEY(ESCAPE), "Leave", "stop what is being made; leave"},
};

static const SheetKey edit_key[] = {
    [EDIT_KEY_STATION_NEXT] = {"station_next", KEY(PAGE_UP), "Next station", "next station, station before"},
    [EDIT_KEY_STATION_BEFORE] = {"station_before", KEY(PAGE_DOWN), "Station before", NULL},
    [EDIT_KEY_BACK] = {"back", KEY(LEFT), "Back along the branch", "0.1 mm back, on along the branch"},
    [EDIT_KEY_ON] = {"on", KEY(RIGHT), "On along the branch", NULL},
    [EDIT_KEY_BRANCH_NEXT] = {"branch_next", K(']'), "Next branch", "next branch, branch before"},
    [EDIT_KEY_BRANCH_BEFORE] = {"branch_before", K('['), "Branch before", NULL},
    [EDIT_KEY_HANDLE] = {"handle", KEY(TAB), "Next handle", "next handle; move it by 0.02 mm; keep it"},
    [EDIT_KEY_OUTWARDS] = {"outwards", KEY(UP), "Handle outwards", NULL},
    [EDIT_KEY_INWARDS] = {"inwards", KEY(DOWN), "Handle inwards", NULL},
    [EDIT_KEY_KEEP] = {"keep", KEY(ENTER), "Keep the contour", NULL},
    [EDIT_KEY_LARGER] = {"larger", PLUS, "Larger section", N_("make the section 2 % larger, smaller")},
    [EDIT_KEY_SMALLER] = {"smaller", MINUS, "Smaller section", NULL},
    [EDIT_KEY_DELETE] = {"delete", KEY(DELETE), "Delete the section", "delete the section"},
    [EDIT_KEY_CONTOUR] = {"contour", K('D'), "Draw a contour", "draw a new contour by keys, from the handle"},
    [EDIT_KEY_EXTENT] = {"extent", K('E'), "Extent of the smoothing", "extent and shape of the smoothing"},
    [EDIT_KEY_SHAPE] = {"shape", K('O'), "Shape of the smoothing", NULL},
    [EDIT_KEY_WEAKER] = {"weaker", K(','), "Weaker smoothing", "weaker, stronger smoothing; apply it"},
    [EDIT_KEY_STRONGER] = {"stronger", K('.'), "Stronger smoothing", NULL},
    [EDIT_KEY_SMOOTH] = {"smooth", K('A'), "Apply the smoothing", NULL},
    [EDIT_KEY_BLEND_NARROWER] = {"blend_narrower", K('J'), "Narrower blend", "narrower, wider blend at the fork"},
    [EDIT_KEY_BLEND_WIDER] = {"blend_wider", K('K'), "Wider blend", NULL},
    [EDIT_KEY_DRAW] = {"draw", K('B'), "Draw a branch", "draw a new branch from the point clicked, or the handle"},
    [EDIT_KEY_CUT] = {"cut", K('X'), "Cut the branch", "cut the branch here"},
    [EDIT_KEY_FLIP] = {"flip", K('T'), "Turn the flow", "turn the flow of the nearer end"},
    [EDIT_KEY_TURN_LEFT] = {"turn_left", CTRL_KEY(LEFT), "Turn left", "turn the surface"},
    [EDIT_KEY_TURN_RIGHT] = {"turn_right", CTRL_KEY(RIGHT), "Turn right", NULL},
    [EDIT_KEY_TURN_UP] = {"turn_up", CTRL_KEY(UP), "Turn up", NULL},
    [EDIT_KEY_TURN_DOWN] = {"turn_down", CTRL_KEY(DOWN), "Turn down", NULL},
    [EDIT_KEY_ZOOM_IN] = {"zoom_in", CTRL_PLUS, "Nearer", "zoom the surface"},
    [EDIT_KEY_ZOOM_OUT] = {"zoom_out", CTRL_MINUS, "Farther", NULL},
    [EDIT_KEY_FOCUS] = {"focus", K('F'), "Look at the place", "look at the place, at everything"},
    [EDIT_KEY_WHOLE] = {"whole", KEY(HOME), "Look at everything", NULL},
    [EDIT_KEY_UNDO] = {"undo", CTRL('Z'), "Undo", "undo, do again"},
    [EDIT_KEY_REDO] = {"redo", CTRL('Y'), "Do again", NULL},
    [EDIT_KEY_SAVE] = {"save", CTRL('S'), "Save", "save the model"},
    [EDIT_KEY_HELP] = {"help", KEY(F1), "List of keys", "this list"},
    [EDIT_KEY_LEAVE] = {"leave", KEY(ESCAPE), "Leave", "leave the window"},
};

static const SheetKey pen_key[] = {
    [PEN_KEY_LEFT] = {"left", KEY(LEFT), "Pen left", "while drawing: move the pen (Shift: ten times)"},
    [PEN_KEY_RIGHT] = {"right", KEY(RIGHT), "Pen right", NULL},
    [PEN_KEY_UP] = {"up", KEY(UP), "Pen up", NULL},
    [PEN_KEY_DOWN] = {"down", KEY(DOWN), "Pen down", NULL},
    [PEN_KEY_NEARER] = {"nearer", KEY(PAGE_UP), "Pen towards the viewer", "move the pen of a branch to and from the viewer"},
    [PEN_KEY_FARTHER] = {"farther", KEY(PAGE_DOWN), "Pen away from the viewer", NULL},
    [PEN_KEY_ADD] = {"add", KEY(SPACE), "Add a point", "add a point, take it back"},
    [PEN_KEY_BACK] = {"back", KEY(BACKSPACE), "Take a point back", NULL},
    [PEN_KEY_WIDER] = {"wider", PLUS, "Wider branch", "wider, narrower branch"},
    [PEN_KEY_NARROWER] = {"narrower", MINUS, "Narrower branch", NULL},
    [PEN_KEY_END] = {"end", KEY(ENTER), "End what is drawn", "end, drop what is drawn"},
    [PEN_KEY_DROP] = {"drop", KEY(ESCAPE), "Drop what is drawn", NULL},
};

static const SheetKey start_key[] = {
    [START_KEY_UP] = {"up", KEY(UP), "Row above", "choose a row"},
    [START_KEY_DOWN] = {"down", KEY(DOWN), "Row below", NULL},
    [START_KEY_PAGE_UP] = {"page_up", KEY(PAGE_UP), "Ten rows up", "ten rows at once"},
    [START_KEY_PAGE_DOWN] = {"page_down", KEY(PAGE_DOWN), "Ten rows down", NULL},
    [START_KEY_FIRST] = {"first", KEY(HOME), "First row", "first row, last row"},
    [START_KEY_LAST] = {"last", KEY(END), "Last row", NULL},
    [START_KEY_OPEN] = {"open", KEY(ENTER), "Open the row", "open the row"},
    [START_KEY_NEXT_PAGE] = {"next_page", KEY(TAB), "Next page", "next page (Shift: back)"},
    [START_KEY_NAME] = {"name", K('N'), "Enter the name", "enter the trainee's name"},
    [START_KEY_EXAMINATION] = {"examination", K('X'), "Examination", "examination, or practice"},
    [START_KEY_FOLDER_ABOVE] = {"folder_above", KEY(BACKSPACE), "Folder above", "folder above"},
    [START_KEY_REPORT] = {"report", K('R'), "Report", "report of a session"},
    [START_KEY_LEARN_PUSH] = {"learn_push", K('P'), "Learn the push", "learn the push, the turn of a device"},
    [START_KEY_LEARN_TURN] = {"learn_turn", K('T'), "Learn the turn", NULL},
    [START_KEY_LOOK_AGAIN] = {"look_again", K('U'), "Look for devices", "look for devices again"},
    [START_KEY_LESS] = {"less", KEY(LEFT), "Smaller value", "smaller, larger value"},
    [START_KEY_MORE] = {"more", KEY(RIGHT), "Larger value", NULL},
    [START_KEY_LEAVE] = {"leave", KEY(ESCAPE), "Leave", "leave the window"},
};

_Static_assert((int)CASE_KEYS <= (int)SHEET_KEYS && (int)EDIT_KEYS <= (int)SHEET_KEYS && (int)PEN_KEYS <= (int)SHEET_KEYS && (int)START_KEYS <= (int)SHEET_KEYS,
               "a sheet has too many keys");

static const struct {
    const char *title, *section;
    const SheetKey *row;
    int count;
} sheets[KEY_SHEETS] = {
    [SHEET_CASE] = {"Case window", "case_keys", case_key, CASE_KEYS},
    [SHEET_EDIT] = {"Edit window", "edit_keys", edit_key, EDIT_KEYS},
    [SHEET_PEN] = {"Edit window, while drawing", "pen_keys", pen_key, PEN_KEYS},
    [SHEET_START] = {"Start window", "start_keys", start_key, START_KEYS},
};

static KeyBinding in_force[KEY_SHEETS][SHEET_KEYS];
static bool is_bound;

const char *key_sheet_title(KeySheet sheet) { return sheets[sheet].title; }
const char *key_sheet_section(KeySheet sheet) { return sheets[sheet].section; }
int key_sheet_count(KeySheet sheet) { return sheets[sheet].count; }
const SheetKey *key_sheet_row(KeySheet sheet, int key) { return &sheets[sheet].row[key]; }

KeyBinding key_sheet_binding(KeySheet sheet, int key) { return is_bound ? in_force[sheet][key] : sheets[sheet].row[key].key; }

void key_sheet_bind(const KeyBinding (*binding)[SHEET_KEYS])
{
    is_bound = binding != NULL;
    if (binding)
        memcpy(in_force, binding, sizeof in_force);
}

const char *key_sheet_text(KeySheet sheet, int key, char *text, size_t capacity) { return key_binding_text(key_sheet_binding(sheet, key), text, capacity); }

static const char *key_of_name(int sheet, const char *name, size_t length, char *text, size_t capacity)
{
    for (int i = 0; i < sheets[sheet].count; i++)
        if (strlen(sheets[sheet].row[i].name) == length && !strncmp(sheets[sheet].row[i].name, name, length))
            return key_sheet_text((KeySheet)sheet, i, text, capacity);
    return NULL;
}

char *key_sheet_fill(KeySheet sheet, const char *from, char *text, size_t capacity) { return key_binding_fill(key_of_name, (int)sheet, from, text, capacity); }

int key_sheet_line(KeySheet sheet, int first, char *keys, size_t capacity)
{
    int next = first;
    size_t used = 0;
    const unsigned modifiers = key_sheet_binding(sheet, first).modifiers;
    do {
        char text[KEY_BINDING_TEXT];
        const char *key = key_sheet_text(sheet, next, text, sizeof text);
        if (next > first && modifiers && modifiers == key_sheet_binding(sheet, next).modifiers)
            key = strchr(key, '+') + 1;      // "Ctrl+" is shown once, with the first key
        used += (size_t)snprintf(keys + used, capacity - used, "%s%s", next > first ? " " : "", key);
        used = used < capacity ? used : capacity - 1;
        next++;
    } while (next < sheets[sheet].count && !sheets[sheet].row[next].line);
    return next - first;
}

int key_sheet_pressed(KeySheet sheet, const WindowEvent *event, const WindowEvent *before)
{
    // the key of a keypad's sign has already come, as the event before
    if (event->kind == WINDOW_TEXT_EVENT && before && before->kind == WINDOW_KEY_DOWN_EVENT &&
        (before->key == WINDOW_KEY_KEYPAD_ADD || before->key == WINDOW_KEY_KEYPAD_SUBTRACT))
        return -1;
    for (int i = 0; i < sheets[sheet].count; i++)
        if (key_binding_is_pressed(key_sheet_binding(sheet, i), event))
            return i;
    return -1;
}
