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
    static const char *const held[] = {"", "Ctrl+", "Alt+", "Ctrl+Alt+"};
    const char *key = key_name(binding.key, one, sizeof one), *alt = held[(binding.modifiers & WINDOW_CTRL ? 1 : 0) + (binding.modifiers & WINDOW_ALT ? 2 : 0)];
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
    if (!strncasecmp(text, "Ctrl+", 5) && text[5]) {
        read.modifiers = WINDOW_CTRL;
        text += 5;
    }
    if (!strncasecmp(text, "Alt+", 4) && text[4]) {
        read.modifiers |= WINDOW_ALT;
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

// The sign that is typed; with Ctrl none is.
static unsigned typed(KeyBinding b) { return b.modifiers & WINDOW_CTRL ? 0 : (unsigned)b.character; }

// On a US keyboard + is Shift and =; the key counts without Shift, too.
static bool types(KeyBinding b, unsigned sign) { return typed(b) && (sign == typed(b) || (sign == '=' && typed(b) == '+')); }

// With Ctrl: the sign's place on a US keyboard.
static int placed(KeyBinding b) { return !(b.modifiers & WINDOW_CTRL) ? 0 : b.character == '+' ? '=' : b.character; }

static bool means_too(KeyBinding a, KeyBinding b)
{
    return types(a, typed(b)) || (types(a, (unsigned)b.key) && !b.modifiers) || (placed(a) && placed(a) == b.key && a.modifiers == b.modifiers);
}

bool key_binding_clash(KeyBinding a, KeyBinding b) { return (a.key == b.key && a.modifiers == b.modifiers) || means_too(a, b) || means_too(b, a); }

bool key_binding_is_pressed(KeyBinding binding, const WindowEvent *event)
{
    if (event->kind == WINDOW_TEXT_EVENT)
        return types(binding, event->character);
    return event->kind == WINDOW_KEY_DOWN_EVENT && !(event->modifiers & WINDOW_SUPER) && (event->modifiers & (WINDOW_ALT | WINDOW_CTRL)) == binding.modifiers &&
           (event->key == binding.key || event->key == placed(binding));
}

char *key_binding_fill(const char *(*key_of_name)(int table, const char *name, size_t length, char *text, size_t capacity), int table, const char *from,
                       char *text, size_t capacity)
{
    size_t used = 0;
    while (*from && used + 1 < capacity) {
        char one[KEY_BINDING_TEXT];
        const size_t length = *from == '{' ? strcspn(from + 1, "}") : 0;
        const char *key = length > 0 && from[1 + length] ? key_of_name(table, from + 1, length, one, sizeof one) : NULL;
        if (!key) {
            text[used++] = *from++;
            continue;
        }
        int more = snprintf(text + used, capacity - used, "%s", key);
        used = used + (size_t)more < capacity ? used + (size_t)more : capacity - 1;
        from += length + 2;
    }
    text[used] = 0;
    return text;
}
