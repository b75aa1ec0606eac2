// Keys of the windows besides the trainer: one sheet of actions for each window. Their lists of keys, buttons, hints and the page of settings are made from it. No
// window, no GL.
#ifndef SELDINGER_RENDER_KEY_SHEET_H
#define SELDINGER_RENDER_KEY_SHEET_H

#include "render/key_binding.h"

typedef enum {
    SHEET_CASE,
    SHEET_EDIT,
    SHEET_PEN,
    SHEET_START,
    KEY_SHEETS
} KeySheet;               // SHEET_PEN: in the edit window while something is drawn, before SHEET_EDIT
enum { SHEET_KEYS = 48 };        // of a sheet at most

// With Shift the same keys go back, or ten times as far.
typedef enum CaseKey {
    CASE_KEY_LEFT,
    CASE_KEY_RIGHT,
    CASE_KEY_UP,
    CASE_KEY_DOWN,
    CASE_KEY_CLICK,
    CASE_KEY_SLICE_NEXT,
    CASE_KEY_SLICE_BEFORE,
    CASE_KEY_NEARER,
    CASE_KEY_FARTHER,
    CASE_KEY_BRIGHTER,
    CASE_KEY_DARKER,
    CASE_KEY_NARROWER,
    CASE_KEY_WIDER,
    CASE_KEY_RESET_BRIGHTNESS,
    CASE_KEY_NEXT_VIEW,
    CASE_KEY_TURN,
    CASE_KEY_START,              // what a click does, in the order of CaseActKind
    CASE_KEY_BRANCH,
    CASE_KEY_FORBID,
    CASE_KEY_CUT,
    CASE_KEY_END,
    CASE_KEY_SAC,
    CASE_KEY_ENTRY,
    CASE_KEY_TARGET,
    CASE_KEY_LOOK,
    CASE_KEY_MARK_NEXT,
    CASE_KEY_MARK_BEFORE,
    CASE_KEY_WALL,
    CASE_KEY_BONE,
    CASE_KEY_FORBID_BONE,
    CASE_KEY_WIRE,               // the lists, in the order of CaseListId
    CASE_KEY_CATHETER,
    CASE_KEY_ANATOMY,
    CASE_KEY_MODEL,
    CASE_KEY_BACKGROUND,
    CASE_KEY_EDIT,
    CASE_KEY_UNDO,
    CASE_KEY_REDO,
    CASE_KEY_STEER,
    CASE_KEY_HELP,
    CASE_KEY_LEAVE,
    CASE_KEYS
} CaseKey;

typedef enum EditKey {
    EDIT_KEY_STATION_NEXT,
    EDIT_KEY_STATION_BEFORE,
    EDIT_KEY_BACK,
    EDIT_KEY_ON,
    EDIT_KEY_BRANCH_NEXT,
    EDIT_KEY_BRANCH_BEFORE,
    EDIT_KEY_HANDLE,
    EDIT_KEY_OUTWARDS,
    EDIT_KEY_INWARDS,
    EDIT_KEY_KEEP,
    EDIT_KEY_LARGER,
    EDIT_KEY_SMALLER,
    EDIT_KEY_DELETE,
    EDIT_KEY_CONTOUR,
    EDIT_KEY_EXTENT,
    EDIT_KEY_SHAPE,
    EDIT_KEY_WEAKER,
    EDIT_KEY_STRONGER,
    EDIT_KEY_SMOOTH,
    EDIT_KEY_BLEND_NARROWER,
    EDIT_KEY_BLEND_WIDER,
    EDIT_KEY_DRAW,
    EDIT_KEY_CUT,
    EDIT_KEY_FLIP,
    EDIT_KEY_TURN_LEFT,
    EDIT_KEY_TURN_RIGHT,
    EDIT_KEY_TURN_UP,
    EDIT_KEY_TURN_DOWN,
    EDIT_KEY_ZOOM_IN,
    EDIT_KEY_ZOOM_OUT,
    EDIT_KEY_FOCUS,
    EDIT_KEY_WHOLE,
    EDIT_KEY_UNDO,
    EDIT_KEY_REDO,
    EDIT_KEY_SAVE,
    EDIT_KEY_HELP,
    EDIT_KEY_LEAVE,
    EDIT_KEYS
} EditKey;

typedef enum PenKey {
    PEN_KEY_LEFT,
    PEN_KEY_RIGHT,
    PEN_KEY_UP,
    PEN_KEY_DOWN,
    PEN_KEY_NEARER,
    PEN_KEY_FARTHER,
    PEN_KEY_ADD,
    PEN_KEY_BACK,
    PEN_KEY_WIDER,
    PEN_KEY_NARROWER,
    PEN_KEY_END,
    PEN_KEY_DROP,
    PEN_KEYS
} PenKey;

typedef enum StartKey {
    START_KEY_UP,
    START_KEY_DOWN,
    START_KEY_PAGE_UP,
    START_KEY_PAGE_DOWN,
    START_KEY_FIRST,
    START_KEY_LAST,
    START_KEY_OPEN,
    START_KEY_NEXT_PAGE,
    START_KEY_NAME,
    START_KEY_EXAMINATION,
    START_KEY_FOLDER_ABOVE,
    START_KEY_REPORT,
    START_KEY_LEARN_PUSH,
    START_KEY_LEARN_TURN,
    START_KEY_LOOK_AGAIN,
    START_KEY_LESS,
    START_KEY_MORE,
    START_KEY_LEAVE,
    START_KEYS
} StartKey;

typedef struct SheetKey {
    const char *name;            // in the settings file and in texts: "{undo}"
    KeyBinding key;              // by default
    const char *what;            // on the page of settings
    const char *line;            // in the window's list of keys, about this key and those below it that have none; NULL: about the one above
} SheetKey;

// What the sheet is called on the page of settings, and its part of the settings file, "case_keys".
const char *key_sheet_title(KeySheet sheet);
const char *key_sheet_section(KeySheet sheet);
int key_sheet_count(KeySheet sheet);
const SheetKey *key_sheet_row(KeySheet sheet, int key);

// The key in force: the user's choice, else the default.
KeyBinding key_sheet_binding(KeySheet sheet, int key);
// Puts keys (KEY_SHEETS, SHEET_KEYS) in force for all windows of the process; NULL: the defaults. Call before a window opens, or from the thread of the windows.
void key_sheet_bind(const KeyBinding (*binding)[SHEET_KEYS]);
// As key_table_text and key_table_fill do.
const char *key_sheet_text(KeySheet sheet, int key, char *text, size_t capacity);
char *key_sheet_fill(KeySheet sheet, const char *from, char *text, size_t capacity);
// Writes the keys of a line of the list that begins at `first`. Returns the number of keys covered, 1 or more; its text is that row's.
int key_sheet_line(KeySheet sheet, int first, char *keys, size_t capacity);
// The key of the sheet that an event presses; -1: none. `before`: the event before it in the same frame, or NULL.
int key_sheet_pressed(KeySheet sheet, const WindowEvent *event, const WindowEvent *before);

#endif
