#include "render/settings.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const double settings_speed_least = 0.1, settings_speed_most = 5, settings_scale_least = 0.5, settings_scale_most = 3;

// Names that stay the same when texts change.
static const char *const action_name[ACTION_COUNT + 1] = {
    [ACTION_PUSH] = "push",
    [ACTION_PULL] = "pull",
    [ACTION_TWIST_LEFT] = "twist_left",
    [ACTION_TWIST_RIGHT] = "twist_right",
    [ACTION_FAST] = "fast",
    [ACTION_SLOW] = "slow",
    [ACTION_STOP] = "stop",
    [ACTION_OTHER_PUSH] = "other_push",
    [ACTION_OTHER_PULL] = "other_pull",
    [ACTION_OTHER_TWIST_LEFT] = "other_twist_left",
    [ACTION_OTHER_TWIST_RIGHT] = "other_twist_right",
    [ACTION_TOOL_1] = "tool_1",
    [ACTION_TOOL_2] = "tool_2",
    [ACTION_TOOL_3] = "tool_3",
    [ACTION_TOOL_4] = "tool_4",
    [ACTION_LOCK] = "lock",
    [ACTION_RELEASE] = "release",
    [ACTION_EXCHANGE] = "exchange",
    [ACTION_PEDAL] = "pedal",
    [ACTION_PEDAL_LATCH] = "pedal_latch",
    [ACTION_CONTRAST] = "contrast",
    [ACTION_DSA] = "dsa",
    [ACTION_ROADMAP] = "roadmap",
    [ACTION_MASK] = "mask",
    [ACTION_PULSES] = "pulses",
    [ACTION_MAGNIFY] = "magnify",
    [ACTION_DEMAGNIFY] = "demagnify",
    [ACTION_CINE_RECORD] = "cine_record",
    [ACTION_CINE_REPLAY] = "cine_replay",
    [ACTION_CINE_SAVE] = "cine_save",
    [ACTION_RAO] = "rao",
    [ACTION_LAO] = "lao",
    [ACTION_CRA] = "cra",
    [ACTION_CAU] = "cau",
    [ACTION_AP] = "ap",
    [ACTION_TABLE_UP] = "table_up",
    [ACTION_TABLE_DOWN] = "table_down",
    [ACTION_TABLE_LEFT] = "table_left",
    [ACTION_TABLE_RIGHT] = "table_right",
    [ACTION_SIDES_CLOSE] = "sides_close",
    [ACTION_SIDES_OPEN] = "sides_open",
    [ACTION_ENDS_CLOSE] = "ends_close",
    [ACTION_ENDS_OPEN] = "ends_open",
    [ACTION_VIEW_FLUOROSCOPY] = "view_fluoroscopy",
    [ACTION_VIEW_3D] = "view_3d",
    [ACTION_VIEW_ANGIOSCOPY] = "view_angioscopy",
    [ACTION_VIEW_ALL] = "view_all",
    [ACTION_CAMERA_RESET] = "camera_reset",
    [ACTION_CAMERA_FOLLOW] = "camera_follow",
    [ACTION_SECTION] = "section",
    [ACTION_SECTION_NEARER] = "section_nearer",
    [ACTION_SECTION_FARTHER] = "section_farther",
    [ACTION_MODEL] = "model",
    [ACTION_ARROWS] = "arrows",
    [ACTION_ORBIT_UP] = "orbit_up",
    [ACTION_ORBIT_DOWN] = "orbit_down",
    [ACTION_ORBIT_LEFT] = "orbit_left",
    [ACTION_ORBIT_RIGHT] = "orbit_right",
    [ACTION_CAMERA_NEARER] = "camera_nearer",
    [ACTION_CAMERA_FARTHER] = "camera_farther",
    [ACTION_PAUSE] = "pause",
    [ACTION_RESTART] = "restart",
    [ACTION_BOOKMARK] = "bookmark",
    [ACTION_SAVE] = "save",
    [ACTION_TRAINEE] = "trainee",
    [ACTION_SCREENSHOT] = "screenshot",
    [ACTION_FULL_SCREEN] = "full_screen",
    [ACTION_PANELS] = "panels",
    [ACTION_HINTS] = "hints",
    [ACTION_BRIEFING] = "briefing",
    [ACTION_HELP] = "help",
    [ACTION_BIPLANE] = "biplane",
    [ACTION_CAMERA_C_ARM] = "camera_c_arm",
    [ACTION_LATERAL] = "lateral",
    [ACTION_RECALL] = "recall",
    [ACTION_REFERENCE] = "reference",
    [ACTION_STORE] = "store",
    [ACTION_QUIT] = "quit",
};

const char *settings_action_name(ActionId id) { return action_name[id] ? action_name[id] : ""; }

// --- sets of keys ---

int settings_key_count(int set) { return set == 0 ? ACTION_COUNT : key_sheet_count((KeySheet)(set - 1)); }

KeyBinding *settings_key(Settings *settings, int set, int key) { return set == 0 ? &settings->key[key] : &settings->sheet_key[set - 1][key]; }

KeyBinding settings_key_default(int set, int key) { return set == 0 ? key_table_default((ActionId)key) : key_sheet_row((KeySheet)(set - 1), key)->key; }

static const char *section_of(int set) { return set == 0 ? "keys" : key_sheet_section((KeySheet)(set - 1)); }

static const char *name_of(int set, int key) { return set == 0 ? action_name[key] : key_sheet_row((KeySheet)(set - 1), key)->name; }

Settings settings_default(void)
{
    Settings settings = {.speed = {.insertion = 1, .rotation = 1, .c_arm = 1}, .interface_scale = 1};
    for (int set = 0; set < KEY_SETS; set++)
        for (int i = 0; i < settings_key_count(set); i++)
            *settings_key(&settings, set, i) = settings_key_default(set, i);
    return settings;
}

int settings_clash(const Settings *settings, int set, int key)
{
    const KeyBinding *row = set == 0 ? settings->key : settings->sheet_key[set - 1];
    for (int i = 0; i < settings_key_count(set); i++)
        if (i != key && key_binding_clash(row[i], row[key]))
            return i;
    return -1;
}

const char *settings_key_refused(int set, KeyBinding binding)
{
    if (set == 0)
        return binding.modifiers & WINDOW_CTRL ? "Ctrl makes the tool slower in the trainer, so a key there cannot contain it; Alt is allowed" : NULL;
    const bool is_held = binding.key == WINDOW_KEY_SHIFT || binding.key == WINDOW_KEY_CTRL || binding.key == WINDOW_KEY_ALT;
    return is_held ? "Shift, Ctrl and Alt are held together with other keys in this window and cannot be used alone" : NULL;
}

// --- reading ---

static void read_flag(const YamlMap *map, const char *key, bool *out)
{
    if (yaml_has(map, key))
        yaml_boolean(yaml_get(map, key, false), out);
}

static void read_speeds(const YamlMap *map, SpeedSettings *speed)
{
    static const char *const speeds[] = {"insertion", "rotation", "c_arm", NULL}, *const axes[] = {"insertion", "rotation", "c_arm_sideways", "c_arm_tilt",
                                                                                                   NULL};
    const NumberRange range = {settings_speed_least, settings_speed_most, false};
    YamlMap factor = yaml_map(yaml_get(map, "speed", false), speeds), inverted = yaml_map(yaml_get(map, "inverted", false), axes);
    yaml_map_number(&factor, "insertion", false, range, &speed->insertion);
    yaml_map_number(&factor, "rotation", false, range, &speed->rotation);
    yaml_map_number(&factor, "c_arm", false, range, &speed->c_arm);
    read_flag(&inverted, "insertion", &speed->insertion_inverted);
    read_flag(&inverted, "rotation", &speed->rotation_inverted);
    read_flag(&inverted, "c_arm_sideways", &speed->sideways_inverted);
    read_flag(&inverted, "c_arm_tilt", &speed->tilt_inverted);
}

// Keys of a set are read together, so that two actions can exchange theirs. Where two share one afterwards, those from the file get their defaults back, and so on
// until none do: the defaults differ from each other.
static void read_keys(YamlValue value, int set, Settings *settings)
{
    enum { MOST = (int)ACTION_COUNT > (int)SHEET_KEYS ? (int)ACTION_COUNT : (int)SHEET_KEYS };
    const char *name[MOST + 1] = {NULL};
    bool is_own[MOST] = {false};
    const int count = settings_key_count(set);
    for (int i = 0; i < count; i++)
        name[i] = name_of(set, i);
    YamlMap map = yaml_map(value, name);
    for (int i = 0; map.value.node && i < count; i++) {
        const char *text;
        KeyBinding read;
        YamlValue key = yaml_get(&map, name[i], false);
        if (!key.node || !yaml_text(key, &text))
            continue;
        const bool is_key = key_binding_parse(text, &read);
        const char *refused = is_key ? settings_key_refused(set, read) : NULL;
        is_own[i] = is_key && !refused;
        if (is_own[i])
            *settings_key(settings, set, i) = read;
        else if (refused)
            yaml_fault(key, "'%.40s' cannot be the key of %s: %s", text, name[i], refused);
        else
            yaml_fault(key, "there is no key '%.40s'; valid are letters, digits and signs, Up, Page down, Keypad +, F1 and the like, with Alt+%s before them",
                       text, set == 0 ? "" : " or Ctrl+");
    }
    for (bool changes = true; changes;) {
        changes = false;
        for (int i = 0; i < count; i++) {
            int other = is_own[i] ? settings_clash(settings, set, i) : -1;
            if (other < 0)
                continue;
            char text[KEY_BINDING_TEXT];
            yaml_fault(yaml_get(&map, name[i], false), "%s is also the key of %s", key_binding_text(*settings_key(settings, set, i), text, sizeof text),
                       name[other]);
            *settings_key(settings, set, i) = settings_key_default(set, i);
            is_own[i] = false;
            changes = true;
        }
    }
}

bool settings_parse(const char *text, size_t length, const char *file, Settings *settings, Faults *faults)
{
    static const char *const keys[] = {"seldinger_settings", "speed",     "inverted", "interface_scale", "keys",
                                       "case_keys",          "edit_keys", "pen_keys", "start_keys",      NULL};
    int version, before = faults->count;
    *settings = settings_default();
    YamlReader *reader = yaml_reader_open(text, length, file, faults);
    if (!reader)
        return false;
    YamlMap map = yaml_map(yaml_root(reader), keys);
    if (map.value.node && yaml_integer(yaml_get(&map, "seldinger_settings", true), 1, 1, &version)) {
        read_speeds(&map, &settings->speed);
        yaml_map_number(&map, "interface_scale", false, (NumberRange){settings_scale_least, settings_scale_most, false}, &settings->interface_scale);
        for (int set = 0; set < KEY_SETS; set++)
            read_keys(yaml_get(&map, section_of(set), false), set, settings);
    }
    yaml_reader_close(reader);
    return faults->count == before;
}

// --- writing ---

// A scalar in double quotes.
static void print_quoted(FILE *out, const char *text)
{
    fputc('"', out);
    for (; *text; text++)
        fprintf(out, *text == '"' || *text == '\\' ? "\\%c" : "%c", *text);
    fputc('"', out);
}

static const char *boolean(bool is_on) { return is_on ? "true" : "false"; }

// Those that differ from the defaults.
static void print_keys(FILE *out, const Settings *settings, int set)
{
    const KeyBinding *row = set == 0 ? settings->key : settings->sheet_key[set - 1];
    bool has_keys = false;
    for (int i = 0; i < settings_key_count(set); i++) {
        char now[KEY_BINDING_TEXT], usual[KEY_BINDING_TEXT];
        key_binding_text(row[i], now, sizeof now);
        if (!strcmp(now, key_binding_text(settings_key_default(set, i), usual, sizeof usual)))
            continue;
        if (!has_keys)
            fprintf(out, "%s:\n", section_of(set));
        fprintf(out, "  %s: ", name_of(set, i));
        print_quoted(out, now);
        fputc('\n', out);
        has_keys = true;
    }
}

char *settings_text(const Settings *settings)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (!out)
        return NULL;
    const SpeedSettings *speed = &settings->speed;
    fprintf(out,
            "# Written by the start window of seldinger; docs/devices.md explains it.\nseldinger_settings: 1\n"
            "speed: {insertion: %.6g, rotation: %.6g, c_arm: %.6g}\n"
            "inverted: {insertion: %s, rotation: %s, c_arm_sideways: %s, c_arm_tilt: %s}\ninterface_scale: %.6g\n",
            speed->insertion, speed->rotation, speed->c_arm, boolean(speed->insertion_inverted), boolean(speed->rotation_inverted),
            boolean(speed->sideways_inverted), boolean(speed->tilt_inverted), settings->interface_scale);
    for (int set = 0; set < KEY_SETS; set++)
        print_keys(out, settings, set);
    bool good = !ferror(out);
    if (fclose(out) == 0 && good)
        return text;
    free(text);
    return NULL;
}

// --- the user's file ---

char *settings_file(void)
{
    char folder[4096];
    return folders_config(folder, sizeof folder) ? text_file_in(folder, "settings.yaml") : NULL;
}

bool settings_load(Settings *settings, Faults *faults)
{
    enum { MOST = 1 << 20 };
    size_t length;
    int before = faults->count;
    char *file = settings_file(), *text = NULL;
    *settings = settings_default();
    if (file && access(file, F_OK) == 0 && (text = whole_file_read_most(file, MOST, &length, faults)))
        settings_parse(text, length, file, settings, faults);
    free(text);
    free(file);
    return faults->count == before;
}

static void keep_faulty(const char *file)
{
    Settings ignored;
    Faults *faults = calloc(1, sizeof *faults);
    char old[4200];
    snprintf(old, sizeof old, "%s.old", file);
    if (faults && !settings_load(&ignored, faults))
        rename(file, old);
    free(faults);
}

bool settings_save(const Settings *settings, Faults *faults)
{
    char folder[4096], *file = settings_file(), *text = settings_text(settings);
    bool good = file && text;
    if (!file)
        faults_add(faults, "settings", 0, 0, "cannot be kept: neither XDG_CONFIG_HOME nor HOME is set");
    else if (!text)
        faults_add(faults, file, 0, 0, "out of memory");
    if (good && (!folders_config(folder, sizeof folder) || !folders_create(folder))) {
        faults_add(faults, file, 0, 0, "its folder cannot be created: %s", strerror(errno));
        good = false;
    }
    if (good)
        keep_faulty(file);
    good = good && whole_file_write(file, text, strlen(text), faults);
    free(text);
    free(file);
    return good;
}
