// The user's settings: reading with faults by line, writing, keys that clash, and what they change.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/operator_controls.h"
#include "render/settings.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/seldinger-settings-XXXXXX";
#include "tests/folder.h"

static Faults faults;

static Settings parsed(const char *text, int fault_count)
{
    Settings settings;
    faults_clear(&faults);
    bool good = settings_parse(text, strlen(text), "s.yaml", &settings, &faults);
    if (faults.count != fault_count)
        fail_msg("%d faults, the first: %s", faults.count, faults.text[0]);
    assert_int_equal(good, fault_count == 0);
    return settings;
}

static void every_key_can_be_written_and_read(void **state)
{
    (void)state;
    char text[KEY_BINDING_TEXT], again[KEY_BINDING_TEXT];
    int count = 0;
    for (int key = 1; key < WINDOW_KEYS; key++)
        for (unsigned modifiers = 0; modifiers <= WINDOW_ALT; modifiers += WINDOW_ALT) {
            KeyBinding binding = {key, modifiers, 0}, read;
            bool is_real = (key >= ' ' && key < 127 && !(key >= 'a' && key <= 'z')) || (key >= WINDOW_KEY_UP && key <= WINDOW_KEY_KEYPAD_SUBTRACT) ||
                           (key >= WINDOW_KEY_F1 && key <= WINDOW_KEY_F12);
            if (!is_real)
                continue;
            key_binding_text(binding, text, sizeof text);
            if (!key_binding_parse(text, &read))
                fail_msg("key %d is written '%s' and not read", key, text);
            assert_int_equal(read.key, key);
            assert_int_equal(read.modifiers, modifiers);
            assert_string_equal(key_binding_text(read, again, sizeof again), text);
            count++;
        }
    assert_true(count > 150);
    for (int i = 0; i < ACTION_COUNT; i++) {
        KeyBinding usual = key_table_default((ActionId)i), read;
        assert_true(key_binding_parse(key_table_text((ActionId)i, text, sizeof text), &read));
        assert_true(read.key == usual.key && read.modifiers == usual.modifiers && read.character == usual.character);
        assert_true(settings_action_name((ActionId)i)[0] != 0);
        for (int j = 0; j < i; j++)
            assert_string_not_equal(settings_action_name((ActionId)i), settings_action_name((ActionId)j));
    }
    KeyBinding untouched = {'Q', 0, 0};
    static const char *const none[] = {"", "Alt+", "UpDown", "F13", "F0", "AA", "Up or", "Up or ??", "\xc3\xa4", " "};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        if (key_binding_parse(none[i], &untouched))
            fail_msg("'%s' is no key", none[i]);
    assert_int_equal(untouched.key, 'Q');
}

static void the_defaults_have_no_clash(void **state)
{
    (void)state;
    Settings settings = settings_default();
    for (int i = 0; i < ACTION_COUNT; i++)
        assert_int_equal(settings_clash(&settings, 0, i), -1);
    char *text = settings_text(&settings);
    assert_null(strstr(text, "keys:"));
    Settings again = parsed(text, 0);
    for (int i = 0; i < ACTION_COUNT; i++)
        assert_true(again.key[i].key == settings.key[i].key && again.key[i].modifiers == settings.key[i].modifiers &&
                    again.key[i].character == settings.key[i].character);
    assert_true(again.interface_scale == 1 && again.speed.insertion == 1);
    free(text);
}

static void what_is_written_is_read(void **state)
{
    (void)state;
    Settings settings = settings_default();
    settings.speed = (SpeedSettings){.insertion = 0.25, .rotation = 5, .c_arm = 1.35, .rotation_inverted = true, .tilt_inverted = true};
    settings.interface_scale = 1.5;
    settings.key[ACTION_PUSH] = (KeyBinding){'"', 0, 0};
    settings.key[ACTION_PULL] = (KeyBinding){'\\', WINDOW_ALT, 0};
    settings.key[ACTION_HELP] = (KeyBinding){WINDOW_KEY_END, 0, '%'};
    settings.key[ACTION_DSA] = key_table_default(ACTION_ROADMAP);          // they exchange their keys
    settings.key[ACTION_ROADMAP] = key_table_default(ACTION_DSA);
    char *text = settings_text(&settings);
    Settings again = parsed(text, 0);
    char *same = settings_text(&again);
    assert_string_equal(same, text);
    assert_true(again.speed.insertion == 0.25 && again.speed.rotation == 5 && again.speed.c_arm == 1.35 && again.interface_scale == 1.5);
    assert_true(again.speed.rotation_inverted && again.speed.tilt_inverted && !again.speed.insertion_inverted && !again.speed.sideways_inverted);
    assert_int_equal(again.key[ACTION_PUSH].key, '"');
    assert_int_equal(again.key[ACTION_PULL].modifiers, WINDOW_ALT);
    assert_int_equal(again.key[ACTION_HELP].character, '%');
    assert_int_equal(again.key[ACTION_DSA].key, 'R');
    assert_int_equal(again.key[ACTION_ROADMAP].key, 'T');
    free(text);
    free(same);
}

static void faults_name_the_line_and_the_rest_applies(void **state)
{
    (void)state;
    Settings settings = parsed("seldinger_settings: 1\n"
                               "speed: {insertion: 9, rotation: 2}\n"
                               "interface_scal: 2\n"
                               "keys:\n"
                               "  push: Hyper\n"
                               "  pull: T\n"
                               "  twist_left: Alt+Q\n",
                               4);
    static const char *const expected[] = {"s.yaml:2:20: ", "s.yaml:3:1: ", "s.yaml:5:9: ", "s.yaml:6:9: "};
    for (int i = 0; i < 4; i++) {
        bool is_there = false;
        for (int k = 0; k < faults.count; k++)
            is_there |= !strncmp(faults.text[k], expected[i], strlen(expected[i]));
        if (!is_there)
            fail_msg("no fault at %s", expected[i]);
    }
    assert_true(settings.speed.insertion == 1 && settings.speed.rotation == 2);
    assert_int_equal(settings.key[ACTION_PULL].key, WINDOW_KEY_DOWN);
    assert_int_equal(settings.key[ACTION_TWIST_LEFT].key, 'Q');
    assert_int_equal(settings.key[ACTION_TWIST_LEFT].modifiers, WINDOW_ALT);
    parsed("", 1);
    parsed("keys: {}\n", 1);
    parsed("seldinger_settings: 2\n", 1);
}

// The keys of the other windows: read, written, and their faults with the line and what is valid.
static void keys_of_the_other_windows_are_read_and_kept(void **state)
{
    (void)state;
    Settings settings = parsed("seldinger_settings: 1\n"
                               "case_keys: {wall: V, undo: Ctrl+U, redo: ctrl+alt+r}\n"
                               "start_keys:\n"
                               "  up: Down\n"
                               "  down: Up\n",
                               0);
    const KeyBinding *key = settings.sheet_key[SHEET_CASE];
    assert_int_equal(key[CASE_KEY_WALL].key, 'V');
    assert_true(key[CASE_KEY_UNDO].key == 'U' && key[CASE_KEY_UNDO].modifiers == WINDOW_CTRL);
    assert_true(key[CASE_KEY_REDO].key == 'R' && key[CASE_KEY_REDO].modifiers == (WINDOW_CTRL | WINDOW_ALT));
    assert_int_equal(settings.sheet_key[SHEET_START][START_KEY_UP].key, WINDOW_KEY_DOWN);
    char *text = settings_text(&settings);
    Settings again = parsed(text, 0);
    assert_memory_equal(again.sheet_key, settings.sheet_key, sizeof again.sheet_key);
    free(text);
    settings = parsed("seldinger_settings: 1\n"
                      "keys: {push: Ctrl+Q}\n"
                      "case_keys:\n"
                      "  wall: Shift\n"
                      "  bone: N\n"
                      "  walls: V\n"
                      "edit_keys: {undo: Ctrl+Hyper}\n"
                      "pen_keys: {add: A}\n",
                      5);
    static const char *const expected[] = {"s.yaml:2:14: 'Ctrl+Q' cannot be the key of push: Ctrl makes", "s.yaml:4:9: 'Shift' cannot be the key of wall",
                                           "s.yaml:5:9: N is also the key of mark_next", "s.yaml:6:3: unknown key 'walls'; did you mean 'wall'?",
                                           "s.yaml:7:19: there is no key 'Ctrl+Hyper'; valid are letters"};
    for (int i = 0; i < 5; i++) {
        bool is_there = false;
        for (int k = 0; k < faults.count; k++)
            is_there |= !strncmp(faults.text[k], expected[i], strlen(expected[i]));
        if (!is_there)
            fail_msg("no fault \"%s\"", expected[i]);
    }
    assert_int_equal(settings.sheet_key[SHEET_CASE][CASE_KEY_BONE].key, 'O');
    assert_int_equal(settings.sheet_key[SHEET_PEN][PEN_KEY_ADD].key, 'A');       // a key of the edit window may be another one while drawing
}

// However keys are typed, no two actions share one afterwards.
static void no_file_makes_two_actions_share_a_key(void **state)
{
    (void)state;
    unsigned random = 1;
    for (int run = 0; run < 300; run++) {
        char text[4000] = "seldinger_settings: 1\nkeys:\n";
        for (int i = 0; i < ACTION_COUNT; i++) {
            random = random * 1664525 + 1013904223;
            if (random >> 30 == 0)
                snprintf(text + strlen(text), sizeof text - strlen(text), "  %s: \"%c\"\n", settings_action_name((ActionId)i),
                         (char)('A' + (random >> 10) % 26));
        }
        Settings settings;
        faults_clear(&faults);
        settings_parse(text, strlen(text), "s.yaml", &settings, &faults);
        for (int i = 0; i < ACTION_COUNT; i++)
            assert_int_equal(settings_clash(&settings, 0, i), -1);
    }
}

static void bound_keys_act(void **state)
{
    (void)state;
    Settings settings = settings_default();
    settings.key[ACTION_PUSH] = (KeyBinding){'Y', 0, 0};
    key_table_bind(settings.key);
    KeyState keys = {0};
    WindowInput input = {
        .has_focus = true, .event_count = 2, .event = {{.kind = WINDOW_KEY_DOWN_EVENT, .key = WINDOW_KEY_UP}, {.kind = WINDOW_KEY_DOWN_EVENT, .key = 'Y'}}};
    key_state_feed(&keys, &input, false);
    char text[KEY_BINDING_TEXT];
    assert_true(keys.held[ACTION_PUSH]);
    assert_string_equal(key_table_text(ACTION_PUSH, text, sizeof text), "Y");
    input = (WindowInput){.has_focus = true, .event_count = 1, .event = {{.kind = WINDOW_KEY_UP_EVENT, .key = 'Y'}}};
    key_state_feed(&keys, &input, false);
    assert_false(keys.held[ACTION_PUSH]);
    key_table_bind(NULL);
    input = (WindowInput){.has_focus = true, .event_count = 1, .event = {{.kind = WINDOW_KEY_DOWN_EVENT, .key = 'Y'}}};
    key_state_feed(&keys, &input, false);
    assert_false(keys.held[ACTION_PUSH]);
    assert_string_equal(key_table_text(ACTION_PUSH, text, sizeof text), "Up");
}

static void a_file_with_faults_is_kept(void **state)
{
    (void)state;
    setenv("XDG_CONFIG_HOME", in_folder("config"), 1);
    Settings settings, again;
    faults_clear(&faults);
    assert_true(settings_load(&settings, &faults));          // there is none
    settings.interface_scale = 2;
    assert_true(settings_save(&settings, &faults));
    assert_true(settings_load(&again, &faults) && again.interface_scale == 2);
    assert_int_equal(access(in_folder("config/seldinger/settings.yaml.old"), F_OK), -1);
    put("config/seldinger/settings.yaml", "seldinger_settings: 1\nsound: loud\n");
    assert_false(settings_load(&again, &faults));
    faults_clear(&faults);
    assert_true(settings_save(&settings, &faults));
    assert_true(settings_load(&again, &faults) && again.interface_scale == 2);
    assert_int_equal(access(in_folder("config/seldinger/settings.yaml.old"), F_OK), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_key_can_be_written_and_read),
        cmocka_unit_test(the_defaults_have_no_clash),
        cmocka_unit_test(what_is_written_is_read),
        cmocka_unit_test(faults_name_the_line_and_the_rest_applies),
        cmocka_unit_test(keys_of_the_other_windows_are_read_and_kept),
        cmocka_unit_test(no_file_makes_two_actions_share_a_key),
        cmocka_unit_test(bound_keys_act),
        cmocka_unit_test(a_file_with_faults_is_kept),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
