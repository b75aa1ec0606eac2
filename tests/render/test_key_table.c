// The table of keys: no key twice, nothing undocumented; and the effect of key events: hold, press, release, repeats, Alt, loss of focus.
#include "render/key_table.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>

static void every_action_has_one_row_a_key_and_help(void **unused)
{
    (void)unused;
    for (int i = 0; i < ACTION_COUNT; i++) {
        const KeyAction *action = &key_table[i];
        char text[32] = "";
        assert_int_equal(action->id, i);
        assert_in_range(action->group, 0, ACTION_GROUPS - 1);
        assert_true(action->key > 0 && action->key < WINDOW_KEYS);
        assert_true(action->modifiers == 0 || action->modifiers == WINDOW_ALT);
        assert_non_null(action->name);
        assert_in_range(strlen(action->name), 2, 18);
        assert_non_null(action->help);
        assert_in_range(strlen(action->help), 8, 75);   // fits the help overlay at 1024x600
        assert_ptr_equal(key_table_text((ActionId)i, text, sizeof text), text);
        assert_true(text[0] != 0);
        for (int j = 0; j < i; j++) {
            char other[32];
            bool is_same_key = key_table[j].key == action->key && key_table[j].modifiers == action->modifiers;
            if (is_same_key || (action->character && key_table[j].character == action->character) ||
                strcmp(key_table_text((ActionId)j, other, sizeof other), text) == 0)
                fail_msg("\"%s\" and \"%s\" share a key (%s)", action->name, key_table[j].name, text);
            assert_string_not_equal(key_table[j].name, action->name);
        }
    }
}

// The list of keys: every action in one line, with its key, and few enough lines for 1024x600.
static void the_list_of_keys_has_every_action(void **unused)
{
    (void)unused;
    int lines[2] = {0};
    for (int i = 0, covered = 1; i < ACTION_COUNT; i += covered) {
        char keys[64], key[32];
        const char *help;
        covered = key_table_line((ActionId)i, keys, sizeof keys, &help);
        assert_true(covered >= 1 && i + covered <= ACTION_COUNT);
        assert_in_range(strlen(help), 8, 75);
        assert_in_range(strlen(keys), 1, 16);
        for (int j = i; j < i + covered; j++) {
            assert_int_equal(key_table[j].group, key_table[i].group);
            assert_int_equal(key_table[j].modifiers, key_table[i].modifiers);
            const char *text = key_table_text((ActionId)j, key, sizeof key);
            assert_non_null(strstr(keys, j > i && key_table[j].modifiers ? text + strlen("Alt+") : text));
        }
        lines[key_table[i].group >= GROUP_VIEW]++;
    }
    assert_true(lines[0] + 3 <= 34 && lines[1] + 2 <= 34);
}

// A text follows the user's keys; braces that name no action stay, and a text is cut at the capacity.
static void texts_name_the_keys_in_force(void **unused)
{
    (void)unused;
    KeyBinding bound[ACTION_COUNT];
    char text[64], brief[12];
    for (int i = 0; i < ACTION_COUNT; i++)
        bound[i] = key_table_default((ActionId)i);
    assert_string_equal(key_table_fill("Hold {X-ray pedal}, then {Push}.", text, sizeof text), "Hold F, then Up.");
    bound[ACTION_PEDAL] = (KeyBinding){'Q', WINDOW_ALT, 0};
    key_table_bind(bound);
    key_table_fill("Hold {X-ray pedal}, then {Push}.", text, sizeof text);
    key_table_fill("Hold {X-ray pedal}, then {Push}.", brief, sizeof brief);
    key_table_bind(NULL);
    assert_string_equal(text, "Hold Alt+Q, then Up.");
    assert_string_equal(brief, "Hold Alt+Q,");
    assert_string_equal(key_table_fill("{no action} {Push", text, sizeof text), "{no action} {Push");
    for (int i = 0; i < ACTION_COUNT; i++) {
        char name[32], key[32];
        snprintf(name, sizeof name, "{%s}", key_table[i].name);
        assert_string_equal(key_table_fill(name, text, sizeof text), key_table_text((ActionId)i, key, sizeof key));
    }
}

// Typed signs must not also be printable keys of the table: one press would do two things.
static void a_typed_sign_is_no_key_of_another_action(void **unused)
{
    (void)unused;
    for (int i = 0; i < ACTION_COUNT; i++)
        for (int j = 0; j < ACTION_COUNT; j++)
            assert_true(!key_table[i].character || key_table[i].character != key_table[j].key);
}

static void key(WindowInput *input, bool is_down, int which, unsigned modifiers, bool is_repeat)
{
    input->event[input->event_count++] =
        (WindowEvent){.kind = is_down ? WINDOW_KEY_DOWN_EVENT : WINDOW_KEY_UP_EVENT, .key = which, .modifiers = modifiers, .is_repeat = is_repeat};
}

static void feed(KeyState *state, WindowInput *input, bool is_captured)
{
    key_state_begin(state);
    key_state_feed(state, input, is_captured);
    input->event_count = 0;
}

static bool holds_nothing(const KeyState *state)
{
    for (int i = 0; i < ACTION_COUNT; i++)
        if (state->held[i])
            return false;
    return true;
}

// Every action by its own key alone: on at the press without any other action, off at the release.
static void each_key_does_its_own_action_only(void **unused)
{
    (void)unused;
    for (int i = 0; i < ACTION_COUNT; i++) {
        KeyState state = {0};
        WindowInput input = {.has_focus = true};
        key(&input, true, key_table[i].key, key_table[i].modifiers, false);
        feed(&state, &input, false);
        for (int j = 0; j < ACTION_COUNT; j++) {
            assert_int_equal(state.held[j], j == i && key_table[i].kind == ACTION_HOLD);
            assert_int_equal(state.pressed[j], j == i && key_table[i].kind == ACTION_PRESS);
        }
        for (int repeat = 0; repeat < 3; repeat++) {   // the keyboard repeats: held continues, a press stays one
            key(&input, true, key_table[i].key, key_table[i].modifiers, true);
            feed(&state, &input, false);
            assert_int_equal(state.held[i], key_table[i].kind == ACTION_HOLD);
            assert_int_equal(state.pressed[i], 0);
        }
        key(&input, false, key_table[i].key, 0, false);
        feed(&state, &input, false);
        assert_true(holds_nothing(&state));
    }
}

static void two_keys_are_held_together(void **unused)
{
    (void)unused;
    KeyState state = {0};
    WindowInput input = {.has_focus = true};
    key(&input, true, WINDOW_KEY_SHIFT, 0, false);
    key(&input, true, WINDOW_KEY_UP, WINDOW_SHIFT, false);
    key(&input, true, 'F', WINDOW_SHIFT, false);
    feed(&state, &input, false);
    assert_true(state.held[ACTION_FAST] && state.held[ACTION_PUSH] && state.held[ACTION_PEDAL]);
    key(&input, false, WINDOW_KEY_UP, WINDOW_SHIFT, false);
    feed(&state, &input, false);
    assert_true(state.held[ACTION_FAST] && !state.held[ACTION_PUSH] && state.held[ACTION_PEDAL]);
}

// Releasing Alt first must not turn an orbit into a push.
static void an_orbit_never_becomes_a_push(void **unused)
{
    (void)unused;
    KeyState state = {0};
    WindowInput input = {.has_focus = true};
    key(&input, true, WINDOW_KEY_ALT, 0, false);
    key(&input, true, WINDOW_KEY_UP, WINDOW_ALT, false);
    feed(&state, &input, false);
    assert_true(state.held[ACTION_ORBIT_UP] && !state.held[ACTION_PUSH]);
    key(&input, false, WINDOW_KEY_ALT, 0, false);
    key(&input, true, WINDOW_KEY_UP, 0, true);
    feed(&state, &input, false);
    assert_false(state.held[ACTION_PUSH]);
    key(&input, false, WINDOW_KEY_UP, 0, false);
    feed(&state, &input, false);
    assert_true(holds_nothing(&state));
}

static void loss_of_focus_lets_go_of_everything(void **unused)
{
    (void)unused;
    for (int by_event = 0; by_event < 2; by_event++) {
        KeyState state = {0};
        WindowInput input = {.has_focus = true};
        for (int i = 0; i < ACTION_COUNT; i++)
            if (key_table[i].kind == ACTION_HOLD)
                key(&input, true, key_table[i].key, key_table[i].modifiers, false);
        feed(&state, &input, false);
        assert_false(holds_nothing(&state));
        if (by_event)
            input.event[input.event_count++] = (WindowEvent){.kind = WINDOW_FOCUS_LOST_EVENT};
        else
            input.has_focus = false;
        feed(&state, &input, false);
        assert_true(holds_nothing(&state));
        // focus again with the key still down: its repeats start nothing
        input.has_focus = true;
        key(&input, true, WINDOW_KEY_UP, 0, true);
        feed(&state, &input, false);
        assert_true(holds_nothing(&state));
    }
}

static void a_text_field_takes_letters_but_not_releases(void **unused)
{
    (void)unused;
    KeyState state = {0};
    WindowInput input = {.has_focus = true};
    key(&input, true, 'F', 0, false);
    feed(&state, &input, false);
    assert_true(state.held[ACTION_PEDAL]);
    key(&input, false, 'F', 0, false);
    key(&input, true, 'C', 0, false);
    key(&input, true, WINDOW_KEY_ESCAPE, 0, false);
    key(&input, true, WINDOW_KEY_F1 + 10, 0, false);
    input.event[input.event_count++] = (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = '?'};
    feed(&state, &input, true);
    assert_true(holds_nothing(&state));
    assert_int_equal(state.pressed[ACTION_QUIT], 1);
    assert_int_equal(state.pressed[ACTION_FULL_SCREEN], 1);
    assert_int_equal(state.pressed[ACTION_HELP], 0);
}

static void a_sign_is_typed_wherever_it_lies(void **unused)
{
    (void)unused;
    KeyState state = {0};
    WindowInput input = {.has_focus = true};
    // a German keyboard has ? on Shift and the key that has - on an American one
    key(&input, true, '-', WINDOW_SHIFT, false);
    input.event[input.event_count++] = (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = '?'};
    input.event[input.event_count++] = (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = '?', .is_repeat = true};
    feed(&state, &input, false);
    assert_int_equal(state.pressed[ACTION_HELP], 1);
    assert_int_equal(state.pressed[ACTION_DEMAGNIFY], 0);
    // the keypad's plus is key and sign in one press
    key(&input, true, WINDOW_KEY_KEYPAD_ADD, 0, false);
    input.event[input.event_count++] = (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = '+'};
    feed(&state, &input, false);
    assert_int_equal(state.pressed[ACTION_MAGNIFY], 1);
    // two presses in one frame are two
    for (int i = 0; i < 2; i++) {
        key(&input, true, WINDOW_KEY_F1, 0, false);
        key(&input, false, WINDOW_KEY_F1, 0, false);
    }
    feed(&state, &input, false);
    assert_int_equal(state.pressed[ACTION_HELP], 2);
}

// For any events nothing outside the table is changed, and loss of focus always ends all actions.
static void random_events_end_released(void **unused)
{
    (void)unused;
    srand(6);
    KeyState state = {0};
    for (int round = 0; round < 2000; round++) {
        WindowInput input = {.has_focus = rand() % 8 != 0};
        input.event_count = rand() % 20;
        for (int i = 0; i < input.event_count; i++)
            input.event[i] = (WindowEvent){.kind = (WindowEventKind)(rand() % 6),
                                           .key = rand() % WINDOW_KEYS,
                                           .modifiers = (unsigned)rand() % 16,
                                           .character = (unsigned)rand() % 300,
                                           .is_repeat = rand() % 2,
                                           .device = rand() % 16};
        feed(&state, &input, rand() % 2);
        for (int i = 0; i < ACTION_COUNT; i++) {
            assert_true(state.pressed[i] >= 0 && (state.pressed[i] == 0 || key_table[i].kind == ACTION_PRESS));
            assert_true(!state.held[i] || (key_table[i].kind == ACTION_HOLD && input.has_focus));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_action_has_one_row_a_key_and_help),
                                       cmocka_unit_test(the_list_of_keys_has_every_action),
                                       cmocka_unit_test(texts_name_the_keys_in_force),
                                       cmocka_unit_test(a_typed_sign_is_no_key_of_another_action),
                                       cmocka_unit_test(each_key_does_its_own_action_only),
                                       cmocka_unit_test(two_keys_are_held_together),
                                       cmocka_unit_test(an_orbit_never_becomes_a_push),
                                       cmocka_unit_test(loss_of_focus_lets_go_of_everything),
                                       cmocka_unit_test(a_text_field_takes_letters_but_not_releases),
                                       cmocka_unit_test(a_sign_is_typed_wherever_it_lies),
                                       cmocka_unit_test(random_events_end_released)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
