// The page of settings in the start window: rows of values and of keys. No window, no GL.
#ifndef SELDINGER_RENDER_START_SETTINGS_H
#define SELDINGER_RENDER_START_SETTINGS_H

#include "render/settings.h"

typedef struct SettingsPage {
    Settings settings;
    int waits_for;               // row whose new key is awaited, -1: none
    KeyBinding refused;          // the key that another action has; pressed again, the two exchange keys. key 0: none
    bool has_changed;            // to be saved
    char message[600];
} SettingsPage;

// Loads the user's settings; faults are shown as the message.
void settings_page_open(SettingsPage *page);
int settings_page_rows(void);
// The row of a key: set and key as in settings_key.
int settings_page_row_of(int set, int key);
// The texts of a row, translated. `heading`: above the row, or NULL.
void settings_page_describe(const SettingsPage *page, int row, const char **heading, char left[300], char right[200]);
// What the row does, or what just happened.
const char *settings_page_about(const SettingsPage *page, int row);
// Whether Left and Right change the row.
bool settings_page_has_steps(int row);
// Enter on a row: switches it, waits for a key, or restores the defaults.
void settings_page_enter(SettingsPage *page, int row);
// Left (-1) or Right (1) on a row.
void settings_page_step(SettingsPage *page, int row, int by);
// Takes a key while one is awaited; false if none is.
bool settings_page_take(SettingsPage *page, const WindowEvent *event);
// Saves what has changed. Returns whether settings must be put in force again.
bool settings_page_save(SettingsPage *page);

#endif
