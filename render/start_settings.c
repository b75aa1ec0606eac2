#include "render/start_settings.h"

#include "render/translation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum { ROW_FACTOR, ROW_SWITCH, ROW_RESTORE } RowKind;

static const struct {
    RowKind kind;
    size_t place;                // in Settings
    const double *least, *most;
    const char *name;
} value_row[] = {
    {ROW_FACTOR, offsetof(Settings, speed.insertion), &settings_speed_least, &settings_speed_most, N_("Speed of pushing and pulling")},
    {ROW_FACTOR, offsetof(Settings, speed.rotation), &settings_speed_least, &settings_speed_most, N_("Speed of turning")},
    {ROW_FACTOR, offsetof(Settings, speed.c_arm), &settings_speed_least, &settings_speed_most, N_("Speed of the C-arm")},
    {ROW_SWITCH, offsetof(Settings, speed.insertion_inverted), NULL, NULL, N_("Push and pull exchanged")},
    {ROW_SWITCH, offsetof(Settings, speed.rotation_inverted), NULL, NULL, N_("Left and right turns exchanged")},
    {ROW_SWITCH, offsetof(Settings, speed.sideways_inverted), NULL, NULL, N_("C-arm: RAO and LAO exchanged")},
    {ROW_SWITCH, offsetof(Settings, speed.tilt_inverted), NULL, NULL, N_("C-arm: CRA and CAU exchanged")},
    {ROW_FACTOR, offsetof(Settings, interface_scale), &settings_scale_least, &settings_scale_most, N_("Size of letters and buttons")},
    {ROW_RESTORE, 0, NULL, NULL, N_("Restore all defaults")},
};
enum { VALUE_ROWS = sizeof value_row / sizeof *value_row };

static double *factor_of(SettingsPage *page, int row) { return (double *)((char *)&page->settings + value_row[row].place); }

static bool *switch_of(SettingsPage *page, int row) { return (bool *)((char *)&page->settings + value_row[row].place); }

static void say(SettingsPage *page, const char *text) { snprintf(page->message, sizeof page->message, "%s", text); }

void settings_page_open(SettingsPage *page)
{
    Faults *faults = calloc(1, sizeof *faults);
    *page = (SettingsPage){.settings = settings_default(), .waits_for = -1};
    if (faults && !settings_load(&page->settings, faults))
        say(page, faults->text[0]);
    free(faults);
}

// The set of keys and the key that a row is about. False: a row of a value, or no row.
static bool key_at(int row, int *set, int *key)
{
    *key = row - VALUE_ROWS;
    for (*set = 0; *key >= 0 && *set < KEY_SETS; ++*set) {
        if (*key < settings_key_count(*set))
            return true;
        *key -= settings_key_count(*set);
    }
    return false;
}

int settings_page_rows(void)
{
    int rows = VALUE_ROWS;
    for (int set = 0; set < KEY_SETS; set++)
        rows += settings_key_count(set);
    return rows;
}

int settings_page_row_of(int set, int key)
{
    int row = VALUE_ROWS + key;
    for (int i = 0; i < set; i++)
        row += settings_key_count(i);
    return row;
}

static const char *name_of(int set, int key) { return set == 0 ? key_table[key].name : key_sheet_row((KeySheet)(set - 1), key)->what; }

// Leaves the window.
static bool is_fixed(int set, int key) { return settings_key_default(set, key).key == WINDOW_KEY_ESCAPE; }

static KeyBinding *awaited(SettingsPage *page, int *set, int *key)
{
    return key_at(page->waits_for, set, key) ? settings_key(&page->settings, *set, *key) : NULL;
}

static void describe_key(const SettingsPage *page, int row, const char **heading, char left[300], char right[200])
{
    char text[KEY_BINDING_TEXT];
    int set, key;
    key_at(row, &set, &key);
    if (set > 0 && key == 0)
        *heading = tr(key_sheet_title((KeySheet)(set - 1)));
    else if (set == 0 && (key == 0 || key_table[key].group != key_table[key - 1].group))
        *heading = tr(action_group_name[key_table[key].group]);
    const KeyBinding now = set == 0 ? page->settings.key[key] : page->settings.sheet_key[set - 1][key];
    snprintf(left, 300, "%s", tr(name_of(set, key)));
    snprintf(right, 200, "%s", page->waits_for == row ? tr("press a key") : key_binding_text(now, text, sizeof text));
}

void settings_page_describe(const SettingsPage *page, int row, const char **heading, char left[300], char right[200])
{
    *heading = NULL;
    right[0] = 0;
    if (row >= VALUE_ROWS) {
        describe_key(page, row, heading, left, right);
        return;
    }
    const char *place = (const char *)&page->settings + value_row[row].place;
    snprintf(left, 300, "%s", tr(value_row[row].name));
    if (value_row[row].kind == ROW_FACTOR)
        snprintf(right, 200, "%.0f %%", 100 * *(const double *)place);
    else if (value_row[row].kind == ROW_SWITCH)
        snprintf(right, 200, "%s", *(const bool *)place ? tr("yes") : tr("no"));
}

const char *settings_page_about(const SettingsPage *page, int row)
{
    int set, key;
    return page->message[0] ? page->message : key_at(row, &set, &key) && set == 0 ? tr(key_table[key].help) : "";
}

bool settings_page_has_steps(int row) { return row < VALUE_ROWS && value_row[row].kind != ROW_RESTORE; }

void settings_page_enter(SettingsPage *page, int row)
{
    page->message[0] = 0;
    int set, key;
    if (key_at(row, &set, &key)) {
        page->waits_for = is_fixed(set, key) ? -1 : row;
        page->refused = (KeyBinding){0};
        say(page, is_fixed(set, key) ? tr("Esc remains the key that leaves every window.")
                  : set == 0         ? tr("Press the new key, with Alt if you like, or Esc to leave it as it is.")
                                     : tr("Press the new key, with Ctrl or Alt if you like, or Esc to leave it as it is."));
    } else if (value_row[row].kind == ROW_RESTORE) {
        page->settings = settings_default();
        page->has_changed = true;
        say(page, tr("All settings and keys are as they were delivered."));
    } else {
        settings_page_step(page, row, 1);
    }
}

void settings_page_step(SettingsPage *page, int row, int by)
{
    if (!settings_page_has_steps(row))
        return;
    page->message[0] = 0;
    page->has_changed = true;
    if (value_row[row].kind == ROW_SWITCH)
        *switch_of(page, row) = !*switch_of(page, row);
    else
        *factor_of(page, row) = fmax(*value_row[row].least, fmin(*value_row[row].most, floor(*factor_of(page, row) * 10 + 0.5 + by) / 10));
}

// Gives the awaited key to its action; to two that exchange theirs if the same key is pressed again.
static void bind(SettingsPage *page, KeyBinding binding)
{
    Settings next = page->settings;
    char text[KEY_BINDING_TEXT];
    int set, key;
    const KeyBinding before = *awaited(page, &set, &key);
    *settings_key(&next, set, key) = binding;
    int other = settings_clash(&next, set, key);
    if (other >= 0 && is_fixed(set, other)) {
        say(page, tr("Esc remains the key that leaves every window."));
        return;
    }
    if (other >= 0 && page->refused.key == binding.key && page->refused.modifiers == binding.modifiers) {
        *settings_key(&next, set, key) = *settings_key(&page->settings, set, other);
        *settings_key(&next, set, other) = before;
    } else if (other >= 0) {
        page->refused = binding;
        snprintf(page->message, sizeof page->message, tr("%s is the key of \"%s\". Press it again to exchange the two, another key, or Esc."),
                 key_binding_text(binding, text, sizeof text), tr(name_of(set, other)));
        return;
    }
    page->settings = next;
    page->waits_for = -1;
    page->has_changed = true;
    page->message[0] = 0;
}

bool settings_page_take(SettingsPage *page, const WindowEvent *event)
{
    int set, key;
    if (!awaited(page, &set, &key))
        return false;
    // Alt comes before the key that it is held for; in the trainer Shift and Ctrl are keys of their own
    const KeyBinding binding = {event->key, event->modifiers & (set == 0 ? WINDOW_ALT : WINDOW_ALT | WINDOW_CTRL), 0};
    if (event->is_repeat || event->key == WINDOW_KEY_ALT || event->key == WINDOW_KEY_NONE || (set > 0 && settings_key_refused(set, binding)))
        return true;
    if (event->key == WINDOW_KEY_ESCAPE) {
        page->waits_for = -1;
        page->message[0] = 0;
    } else {
        bind(page, binding);
    }
    return true;
}

bool settings_page_save(SettingsPage *page)
{
    if (!page->has_changed)
        return false;
    Faults *faults = calloc(1, sizeof *faults);
    page->has_changed = false;
    if (faults && !settings_save(&page->settings, faults))
        say(page, faults->text[0]);
    free(faults);
    return true;
}
