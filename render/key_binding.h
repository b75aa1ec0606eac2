// Keys as users read and write them: "Up", "Alt+I", "Keypad +", "F1 or ?". No window, no GL.
#ifndef SELDINGER_RENDER_KEY_BINDING_H
#define SELDINGER_RENDER_KEY_BINDING_H

#include "render/window.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct KeyBinding {
    int key;                 // WindowKey
    unsigned modifiers;      // WINDOW_ALT, WINDOW_CTRL, both or 0. Shift only changes how far an action goes and is not part of a key
    char character;          // alternative typed character, independent of the layout; 0: none
} KeyBinding;

enum { KEY_BINDING_TEXT = 32 };

// Writes a key as shown to the user; returns text.
const char *key_binding_text(KeyBinding binding, char *text, size_t capacity);
// Reads what key_binding_text writes, in capitals or small letters. Returns false if there is no such key; *binding is then unchanged.
bool key_binding_parse(const char *text, KeyBinding *binding);
// Whether one press could mean both.
bool key_binding_clash(KeyBinding a, KeyBinding b);
// Whether an event presses the key. A sign counts as it is typed; with Ctrl nothing is typed, and its place on a US keyboard counts.
bool key_binding_is_pressed(KeyBinding binding, const WindowEvent *event);
// Copies a text in which {NAME} stands for what `key_of_name` returns for it, given `table` and the length of the name; NULL: the braces stay. Returns text.
char *key_binding_fill(const char *(*key_of_name)(int table, const char *name, size_t length, char *text, size_t capacity), int table, const char *from,
                       char *text, size_t capacity);

#endif
