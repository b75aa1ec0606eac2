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

int settings_page_rows(void) { return VALUE_ROWS + ACTION_COUNT; }

static void describe_key(const SettingsPage *page, ActionId id, const char **heading, char left[300], char right[200])
{
    char key[KEY_BINDING_TEXT];
    if (id == 0 || key_table[id].group != key_table[id - 1].group)
        *heading = tr(action_group_name[key_table[id].group]);
    snprintf(left, 300, "%s", tr(key_table[id].name));
    snprintf(right, 200, "%s", page->waits_for == (int)id ? tr("press a key") : key_binding_text(page->settings.key[id], key, sizeof key));
}

void settings_page_describe(const SettingsPage *page, int row, const char **heading, char left[300], char right[200])
{
    *heading = NULL;
    right[0] = 0;
    if (row >= VALUE_ROWS) {
        describe_key(page, (ActionId)(row - VALUE_ROWS), heading, left, right);
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
    return page->message[0] ? page->message : row >= VALUE_ROWS && row < settings_page_rows() ? tr(key_table[row - VALUE_ROWS].help) : "";
}

bool settings_page_has_steps(int row) { return row < VALUE_ROWS && value_row[row].kind != ROW_RESTORE; }

void settings_page_enter(SettingsPage *page, int row)
{
    page->message[0] = 0;
    if (row >= VALUE_ROWS) {
        page->waits_for = row - VALUE_ROWS;
        page->refused = (KeyBinding){0};
        say(page, tr("Press the new key, with Alt if you like, or Esc to leave it as it is."));
        if (page->waits_for == ACTION_QUIT) {
            page->waits_for = -1;
            say(page, tr("Esc remains the key that leaves every window."));
        }
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
    char key[KEY_BINDING_TEXT];
    ActionId id = (ActionId)page->waits_for;
    next.key[id] = binding;
    int other = settings_clash(&next, id);
    if (other == ACTION_QUIT) {
        say(page, tr("Esc remains the key that leaves every window."));
        return;
    }
    if (other >= 0 && page->refused.key == binding.key && page->refused.modifiers == binding.modifiers) {
        next.key[id] = page->settings.key[other];
        next.key[other] = page->settings.key[id];
    } else if (other >= 0) {
        page->refused = binding;
        snprintf(page->message, sizeof page->message, tr("%s is the key of \"%s\". Press it again to exchange the two, another key, or Esc."),
                 key_binding_text(binding, key, sizeof key), tr(key_table[other].name));
        return;
    }
    page->settings = next;
    page->waits_for = -1;
    page->has_changed = true;
    page->message[0] = 0;
}

bool settings_page_take(SettingsPage *page, const WindowEvent *event)
{
    if (page->waits_for < 0)
        return false;
    if (event->is_repeat || event->key == WINDOW_KEY_ALT || event->key == WINDOW_KEY_NONE)
        return true;             // Alt comes before the key that it is held for
    if (event->key == WINDOW_KEY_ESCAPE) {
        page->waits_for = -1;
        page->message[0] = 0;
    } else {
        bind(page, (KeyBinding){event->key, event->modifiers & WINDOW_ALT, 0});
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
