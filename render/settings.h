// The user's settings: keys, speeds, inverted axes, size of letters, language. A small YAML file in the user's configuration folder:
//
//   seldinger_settings: 1
//   speed: {insertion: 1, rotation: 1, c_arm: 1}      # 0.1 to 5: times the usual speed, of keys and of devices with a built-in map
//   inverted: {insertion: false, rotation: false, c_arm_sideways: false, c_arm_tilt: false}
//   interface_scale: 1                                # 0.5 to 3
//   keys: {push: Up, table_up: Alt+I, help: F1 or ?}  # those that differ from the defaults; two actions cannot share a key
//
// A missing file or key means the default. No window, no GL.
#ifndef SELDINGER_RENDER_SETTINGS_H
#define SELDINGER_RENDER_SETTINGS_H

#include "base/base.h"
#include "render/key_table.h"

typedef struct SpeedSettings {
    double insertion, rotation, c_arm;       // 0.1 to 5, default 1
    bool insertion_inverted, rotation_inverted, sideways_inverted, tilt_inverted;
} SpeedSettings;

typedef struct Settings {
    KeyBinding key[ACTION_COUNT];
    SpeedSettings speed;
    double interface_scale;                  // 0.5 to 3, default 1
} Settings;

extern const double settings_speed_least, settings_speed_most, settings_scale_least, settings_scale_most;

Settings settings_default(void);
// The name of an action in the file, "table_up".
const char *settings_action_name(ActionId id);
// Another action whose key is, or is part of, the key of `id`; -1: none.
int settings_clash(const Settings *settings, ActionId id);

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
