// What windows show of their keys: the list that is drawn over a window, and buttons with their keys.
#ifndef SELDINGER_RENDER_KEY_LIST_H
#define SELDINGER_RENDER_KEY_LIST_H

#include "render/gui.h"
#include "render/key_sheet.h"
#include "render/window.h"

// Rows of what the mouse does (mouse_count, 2), then the keys of the sheets (sheet_count).
void key_list_draw(Gui *gui, const WindowInput *input, int mouse_count, const char *const mouse[][2], int sheet_count, const KeySheet *sheet);

// A button with its key of the sheet; `width` as of gui_button(). Returns true if it was pressed.
bool key_list_button(Gui *gui, KeySheet sheet, const char *id, const char *label, int key, float width, bool is_on);

#endif
