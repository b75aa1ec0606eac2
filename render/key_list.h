// The list of a window's keys, drawn over it.
#ifndef SELDINGER_RENDER_KEY_LIST_H
#define SELDINGER_RENDER_KEY_LIST_H

#include "render/gui.h"
#include "render/key_sheet.h"
#include "render/window.h"

// Rows of what the mouse does (mouse_count, 2), then the keys of the sheets (sheet_count).
void key_list_draw(Gui *gui, const WindowInput *input, int mouse_count, const char *const mouse[][2], int sheet_count, const KeySheet *sheet);

#endif
