#include "render/key_list.h"

#include <math.h>

static int line_count(KeySheet sheet)
{
    int lines = 0;
    for (int i = 0; i < key_sheet_count(sheet); i++)
        lines += key_sheet_row(sheet, i)->line != NULL;
    return lines;
}

void key_list_draw(Gui *gui, const WindowInput *input, int mouse_count, const char *const mouse[][2], int sheet_count, const KeySheet *sheet)
{
    int rows = mouse_count;
    for (int i = 0; i < sheet_count; i++)
        rows += line_count(sheet[i]);
    // smaller letters where the list would be higher than the window
    const float k = gui_scale(gui), height = (float)input->height;
    GuiFont font = (gui_line_height(gui, GUI_NORMAL) + 3 * k) * (float)rows + 50 * k < height ? GUI_NORMAL : GUI_SMALL;
    float high = floorf(fminf((gui_line_height(gui, font) + 3 * k) * (float)rows + 50 * k, height)), wide = floorf(fminf(560 * k, (float)input->width));
    gui_window_begin(gui, "keys", (GuiRect){floorf(((float)input->width - wide) / 2), floorf((height - high) / 2), wide, high}, GUI_ON_TOP | GUI_FRAMED);
    gui_text(gui, GUI_LARGE, gui_colors.text, "Keys and mouse");
    for (int i = 0; i < mouse_count; i++)
        gui_row(gui, font, mouse[i][0], gui_colors.text, mouse[i][1]);
    for (int i = 0; i < sheet_count; i++)
        for (int key = 0, next; key < key_sheet_count(sheet[i]); key = next) {
            char keys[120];
            next = key + key_sheet_line(sheet[i], key, keys, sizeof keys);
            gui_row(gui, font, keys, gui_colors.text, key_sheet_row(sheet[i], key)->line);
        }
    gui_window_end(gui);
}

bool key_list_button(Gui *gui, KeySheet sheet, const char *id, const char *label, int key, float width, bool is_on)
{
    char text[KEY_BINDING_TEXT];
    return gui_button(gui, id, label, key_sheet_text(sheet, key, text, sizeof text), width, is_on).pressed;
}
