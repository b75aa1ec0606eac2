// The user's settings: keys, speeds, inverted axes, size of letters, language. A small YAML file in the user's configuration folder:
//
//   seldinger_settings: 1
//   speed: {insertion: 1, rotation: 1, c_arm: 1}      # 0.1 to 5: times the usual speed, of keys and of devices with a built-in map
//   inverted: {insertion: false, rotation: false, c_arm_sideways: false, c_arm_tilt: false}
//   interface_scale: 1                                # 0.5 to 3
//   keys: {push: Up, table_up: Alt+I, help: F1 or ?}  # of the trainer, those that differ from the defaults; two actions cannot share a key
//   case_keys: {wall: V, undo: Ctrl+U}                # of the other windows: also edit_keys, pen_keys (edit, while drawing), start_keys
//
// A missing file or key means the default. No window, no GL.
#ifndef SELDINGER_RENDER_SETTINGS_H
#define SELDINGER_RENDER_SETTINGS_H

#include "base/base.h"
#include "render/key_sheet.h"
#include "render/key_table.h"

typedef struct SpeedSettings {
    double insertion, rotation, c_arm;       // 0.1 to 5, default 1
    bool insertion_inverted, rotation_inverted, sideways_inverted, tilt_inverted;
} SpeedSettings;

typedef struct Settings {
    KeyBinding key[ACTION_COUNT];            // of the trainer
    KeyBinding sheet_key[KEY_SHEETS][SHEET_KEYS];
    SpeedSettings speed;
    double interface_scale;                  // 0.5 to 3, default 1
} Settings;

extern const double settings_speed_least, settings_speed_most, settings_scale_least, settings_scale_most;

Settings settings_default(void);
// The name of an action in the file, "table_up".
const char *settings_action_name(ActionId id);

// The sets of keys: no two keys of a set are the same. Set 0 is the trainer's, of ActionId; the others are the sheets, 1 + KeySheet.
enum { KEY_SETS = 1 + KEY_SHEETS };
int settings_key_count(int set);
KeyBinding *settings_key(Settings *settings, int set, int key);
KeyBinding settings_key_default(int set, int key);
// Another key of the set that is, or is part of, this one; -1: none.
int settings_clash(const Settings *settings, int set, int key);
// Why no action of the set can have this key; NULL: it can.
const char *settings_key_refused(int set, KeyBinding binding);

// Reads a text. With faults, *settings has the default for each key that is wrong; false is then returned.
bool settings_parse(const char *text, size_t length, const char *file, Settings *settings, Faults *faults);
// The text of a file. The caller frees it; NULL: out of memory.
char *settings_text(const Settings *settings);

// The user's file, $XDG_CONFIG_HOME/seldinger/settings.yaml, else ~/.config/seldinger/settings.yaml. The caller frees it; NULL: no home is known.
char *settings_file(void);
// Reads the user's file; no file is no fault. False with faults.
bool settings_load(Settings *settings, Faults *faults);
// Replaces the user's file at once, so that no partial file remains. A file with faults is kept as settings.yaml.old. False with faults.
bool settings_save(const Settings *settings, Faults *faults);

#endif
