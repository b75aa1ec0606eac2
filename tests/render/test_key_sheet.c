// The keys of the case, edit and start windows: no key twice in a sheet, every key in the window's list, the key of an event, and texts that name the keys in force.
#include "render/key_sheet.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>

static void every_key_has_a_name_and_no_other_has_its_key(void **unused)
{
    (void)unused;
    for (int sheet = 0; sheet < KEY_SHEETS; sheet++) {
        assert_non_null(key_sheet_row((KeySheet)sheet, 0)->line);
        for (int i = 0; i < key_sheet_count((KeySheet)sheet); i++) {
            const SheetKey *row = key_sheet_row((KeySheet)sheet, i);
            assert_true(row->name && row->name[0] && row->what && row->what[0]);     // no row of the enum is missing
            assert_true(row->key.key > 0 && row->key.key < WINDOW_KEYS);
            assert_true(!row->line || strlen(row->line) <= 60);
            for (int j = 0; j < i; j++) {
                const SheetKey *other = key_sheet_row((KeySheet)sheet, j);
                if (key_binding_clash(row->key, other->key) || !strcmp(row->name, other->name))
                    fail_msg("%s: \"%s\" and \"%s\" share a key or a name", key_sheet_section((KeySheet)sheet), row->name, other->name);
            }
        }
    }
}

static void the_list_shows_every_key(void **unused)
{
    (void)unused;
    for (int sheet = 0; sheet < KEY_SHEETS; sheet++)
        for (int i = 0, covered; i < key_sheet_count((KeySheet)sheet); i += covered) {
            char keys[120], text[KEY_BINDING_TEXT];
            covered = key_sheet_line((KeySheet)sheet, i, keys, sizeof keys);
            assert_in_range(strlen(keys), 1, 40);        // beside the text of the line
            for (int k = i; k < i + covered; k++) {
                const char *key = key_sheet_text((KeySheet)sheet, k, text, sizeof text);
                assert_non_null(strstr(keys, k > i && key_sheet_binding((KeySheet)sheet, k).modifiers ? strchr(key, '+') + 1 : key));
            }
        }
}

static WindowEvent down(int key, unsigned modifiers) { return (WindowEvent){.kind = WINDOW_KEY_DOWN_EVENT, .key = key, .modifiers = modifiers}; }

static WindowEvent typed(unsigned character) { return (WindowEvent){.kind = WINDOW_TEXT_EVENT, .character = character}; }

static void an_event_presses_one_key(void **unused)
{
    (void)unused;
    for (int sheet = 0; sheet < KEY_SHEETS; sheet++)
        for (int i = 0; i < key_sheet_count((KeySheet)sheet); i++) {
            const KeyBinding key = key_sheet_row((KeySheet)sheet, i)->key;
            WindowEvent event = down(key.key, key.modifiers), shifted = down(key.key, key.modifiers | WINDOW_SHIFT);
            assert_int_equal(key_sheet_pressed((KeySheet)sheet, &event, NULL), i);
            assert_int_equal(key_sheet_pressed((KeySheet)sheet, &shifted, NULL), i);
        }
    WindowEvent z = down('Z', 0), undo = down('Z', WINDOW_CTRL), up = {.kind = WINDOW_KEY_UP_EVENT, .key = 'W'}, plus = typed('+'),
                keypad = down(WINDOW_KEY_KEYPAD_ADD, 0), equals = down('=', WINDOW_CTRL);
    assert_int_equal(key_sheet_pressed(SHEET_CASE, &z, NULL), -1);
    assert_int_equal(key_sheet_pressed(SHEET_CASE, &undo, NULL), CASE_KEY_UNDO);
    assert_int_equal(key_sheet_pressed(SHEET_CASE, &up, NULL), -1);
    assert_int_equal(key_sheet_pressed(SHEET_CASE, &plus, NULL), CASE_KEY_NEARER);
    assert_int_equal(key_sheet_pressed(SHEET_CASE, &plus, &keypad), -1);     // one press, one action
    assert_int_equal(key_sheet_pressed(SHEET_EDIT, &equals, NULL), EDIT_KEY_ZOOM_IN);
}

static void texts_and_events_follow_the_keys_in_force(void **unused)
{
    (void)unused;
    static KeyBinding bound[KEY_SHEETS][SHEET_KEYS];
    char text[80];
    for (int sheet = 0; sheet < KEY_SHEETS; sheet++)
        for (int i = 0; i < key_sheet_count((KeySheet)sheet); i++)
            bound[sheet][i] = key_sheet_row((KeySheet)sheet, i)->key;
    assert_string_equal(key_sheet_fill(SHEET_CASE, "{undo} undoes, {steer} steers", text, sizeof text), "Ctrl+Z undoes, S steers");
    bound[SHEET_CASE][CASE_KEY_UNDO] = (KeyBinding){'U', WINDOW_ALT, 0};
    key_sheet_bind((const KeyBinding(*)[SHEET_KEYS])bound);
    key_sheet_fill(SHEET_CASE, "{undo} undoes, {steer} steers {none}", text, sizeof text);
    WindowEvent before = down('Z', WINDOW_CTRL), now = down('U', WINDOW_ALT);
    int was = key_sheet_pressed(SHEET_CASE, &before, NULL), is = key_sheet_pressed(SHEET_CASE, &now, NULL);
    key_sheet_bind(NULL);
    assert_string_equal(text, "Alt+U undoes, S steers {none}");
    assert_int_equal(was, -1);
    assert_int_equal(is, CASE_KEY_UNDO);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_key_has_a_name_and_no_other_has_its_key),
        cmocka_unit_test(the_list_shows_every_key),
        cmocka_unit_test(an_event_presses_one_key),
        cmocka_unit_test(texts_and_events_follow_the_keys_in_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
