#include "render/key_binding.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

static const struct {
    int key;
    const char *name;
} named[] = {{WINDOW_KEY_SPACE, "Space"},
             {WINDOW_KEY_UP, "Up"},
             {WINDOW_KEY_DOWN, "Down"},
             {WINDOW_KEY_LEFT, "Left"},
             {WINDOW_KEY_RIGHT, "Right"},
             {WINDOW_KEY_PAGE_UP, "Page up"},
             {WINDOW_KEY_PAGE_DOWN, "Page down"},
             {WINDOW_KEY_HOME, "Home"},
             {WINDOW_KEY_END, "End"},
             {WINDOW_KEY_INSERT, "Insert"},
             {WINDOW_KEY_DELETE, "Delete"},
             {WINDOW_KEY_BACKSPACE, "Backspace"},
             {WINDOW_KEY_ENTER, "Enter"},
             {WINDOW_KEY_TAB, "Tab"},
             {WINDOW_KEY_ESCAPE, "Esc"},
             {WINDOW_KEY_SHIFT, "Shift"},
             {WINDOW_KEY_CTRL, "Ctrl"},
             {WINDOW_KEY_ALT, "Alt"},
             {WINDOW_KEY_KEYPAD_ADD, "Keypad +"},
             {WINDOW_KEY_KEYPAD_SUBTRACT, "Keypad -"},
             {'-', "Minus"},
             {'+', "Plus"}};
enum { NAMED = sizeof named / sizeof named[0] };

static bool is_sign(int key) { return key > ' ' && key < 127; }

// A keypad key whose sign is also the typed character is shown once.
static bool is_keypad_sign(KeyBinding b)
{
    return (b.key == WINDOW_KEY_KEYPAD_ADD && b.character == '+') || (b.key == WINDOW_KEY_KEYPAD_SUBTRACT && b.character == '-');
}

static const char *key_name(int key, char *text, size_t capacity)
{
    for (int i = 0; i < NAMED; i++)
        if (named[i].key == key)
            return named[i].name;
    if (key >= WINDOW_KEY_F1 && key <= WINDOW_KEY_F12)
        snprintf(text, capacity, "F%d", key - WINDOW_KEY_F1 + 1);
    else
        snprintf(text, capacity, "%c", is_sign(key) ? key : '?');
    return text;
}

const char *key_binding_text(KeyBinding binding, char *text, size_t capacity)
{
    char one[16];
    const char *key = key_name(binding.key, one, sizeof one), *alt = binding.modifiers & WINDOW_ALT ? "Alt+" : "";
    if (is_keypad_sign(binding))
        snprintf(text, capacity, "%s%c", alt, binding.character);
    else if (binding.character)
        snprintf(text, capacity, "%s%s or %c", alt, key, binding.character);
    else
        snprintf(text, capacity, "%s%s", alt, key);
    return text;
}

// The key of a name; 0: none.
static int key_of(const char *name)
{
    for (int i = 0; i < NAMED; i++)
        if (!strcasecmp(named[i].name, name))
            return named[i].key;
    for (int i = 0; i < 12; i++) {
        char text[16];
        snprintf(text, sizeof text, "F%d", i + 1);
        if (!strcasecmp(text, name))
            return WINDOW_KEY_F1 + i;
    }
    if (strlen(name) != 1 || !is_sign(name[0]))
        return 0;
    return name[0] >= 'a' && name[0] <= 'z' ? name[0] - 'a' + 'A' : name[0];
}

bool key_binding_parse(const char *text, KeyBinding *binding)
{
    KeyBinding read = {0};
    char name[KEY_BINDING_TEXT];
    if (!strncasecmp(text, "Alt+", 4) && text[4]) {
        read.modifiers = WINDOW_ALT;
        text += 4;
    }
    size_t length = strlen(text);
    if (length >= sizeof name)
        return false;
    strcpy(name, text);
    if (!strcmp(name, "+") || !strcmp(name, "-")) {
        read.character = name[0];
        read.key = name[0] == '+' ? WINDOW_KEY_KEYPAD_ADD : WINDOW_KEY_KEYPAD_SUBTRACT;
    } else {
        if (length > 5 && !strncmp(name + length - 5, " or ", 4) && is_sign(name[length - 1])) {
            read.character = name[length - 1];
            name[length - 5] = 0;
        }
        read.key = key_of(name);
    }
    if (read.key)
        *binding = read;
    return read.key != 0;
}

bool key_binding_clash(KeyBinding a, KeyBinding b)
{
    return (a.key == b.key && a.modifiers == b.modifiers) || (a.character && a.character == b.character) ||
           (a.character && a.character == b.key && !b.modifiers) || (b.character && b.character == a.key && !a.modifiers);
}
