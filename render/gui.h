// A thin C interface to Dear ImGui and its OpenGL 3 back end: windows at fixed places, text, buttons, sliders, tabs, a text field, and drawing. Its input is
// WindowInput, so that it works the same in a window, off screen and in tests; independent of GLFW. Texts are translated where they are shown
// (render/translation.h). Units are pixels, y down. Needs a current GL
// context. Other ImGui contexts (render/overlay.h) are not affected: the context of a Gui is current only from gui_begin to gui_end.
#ifndef SELDINGER_RENDER_GUI_H
#define SELDINGER_RENDER_GUI_H

#ifdef __cplusplus
extern "C" {
#endif

#include "render/color_map.h"
#include "render/window.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Gui Gui;
typedef struct GuiRect {
    float x, y, width, height;
} GuiRect;
typedef enum { GUI_SMALL, GUI_NORMAL, GUI_LARGE, GUI_HUGE, GUI_FONTS } GuiFont;   // 13, 15, 19 and 28 pixels times the scale

typedef struct GuiColors {     // colours of all elements; the marks are distinguishable with colour-vision deficiency, and never shown by colour alone
    Color window, panel, frame, frame_hot, frame_on, line, text, dim, accent, good, warning, bad, grab, grab_on;
} GuiColors;
extern const GuiColors gui_colors;

// Every pair of colours that lie on each other, with the least ratio of WCAG 2.1 AA: 4.5 for text, 3 for large text and for marks.
typedef struct GuiContrast {
    const char *what;
    Color front, back;
    double least;
} GuiContrast;
int gui_contrasts(const GuiContrast **out);              // their number

Gui *gui_create(char *message, size_t capacity);
void gui_destroy(Gui *gui);

// Begins a frame. `scale`: of text and widgets; fonts are rebuilt if it changes by more than a twentieth. `is_silent`: lays out without input or
// drawing (the contents of a window are known from the previous frame).
void gui_begin(Gui *gui, const WindowInput *input, double scale, bool is_silent);
// The last gui_end() of a frame draws into `framebuffer`, which has the size `input->width` x `input->height` and is not multisampled. Leaves blending and
// scissor test off.
void gui_end(Gui *gui, unsigned framebuffer);
float gui_scale(const Gui *gui);        // scale of the current fonts
// The number of texts in the last frame that their place cut off; `first` (may be NULL): the first of them, valid until the next frame.
int gui_cut_texts(const Gui *gui, const char **first);

// Windows at a fixed place. Overflowing contents scroll. NO_INPUT lets the mouse through; ON_TOP lies over the previous windows and takes their clicks.
// KEPT: opaque, overlapping only windows on top; its pixels are cached and redrawn only when its contents change. SELDOM: a cached window
// updated in every third frame, for figures that change faster than anyone can read. FRAMED: with a border line. VEIL: translucent.
enum { GUI_NO_BACKGROUND = 1, GUI_NO_INPUT = 2, GUI_ON_TOP = 4, GUI_SCROLL_TO_END = 8, GUI_KEPT = 16, GUI_SELDOM = 32, GUI_FRAMED = 64, GUI_VEIL = 128 };
void gui_window_begin(Gui *gui, const char *id, GuiRect at, unsigned flags);
// Missing height of the contents [pixel]; negative: free height.
float gui_window_end(Gui *gui);

// A picture to show: `rgb` (height, width, 3), rows from the top.
typedef unsigned GuiTexture;             // 0: none
GuiTexture gui_texture_create(int width, int height, const uint8_t *rgb);
void gui_texture_destroy(GuiTexture texture);

// Flow layout: each item goes below the last one, or next to it.
GuiRect gui_place(Gui *gui, float width, float height);   // reserves space (width 0: all available) and returns its rectangle, for drawing
void gui_beside(Gui *gui, float gap);
void gui_space(Gui *gui, float height);
void gui_scroll_here(Gui *gui);                           // scrolls to the last item
float gui_width(Gui *gui);                                // remaining width of this line
float gui_line_height(const Gui *gui, GuiFont font);

void gui_text(Gui *gui, GuiFont font, Color color, const char *text);
void gui_heading(Gui *gui, const char *text);             // of a group of items, in small letters
void gui_text_wrapped(Gui *gui, GuiFont font, Color color, const char *text);
void gui_row(Gui *gui, GuiFont font, const char *label, Color color, const char *value);   // label left, value right, in one line

typedef struct GuiPress {
    bool pressed, held;
} GuiPress; // clicked in this frame; the mouse is down on it
// `width` 0: all available. `key` is shown at the right end in small letters if both fit. `is_on`: filled, with a tick.
GuiPress gui_button(Gui *gui, const char *id, const char *label, const char *key, float width, bool is_on);
// Returns true while it is being moved. `format`: printf format for one double.
bool gui_slider(Gui *gui, const char *id, float *value, float least, float most, const char *format, float width);
// A large button with a picture at its left (texture 0: a dark place for it), a title, and a line below; `right` in small letters at the right end.
bool gui_card(Gui *gui, const char *id, GuiTexture texture, const char *title, const char *line, const char *right, bool is_on);
void gui_progress(Gui *gui, double part, const char *text);
// A tooltip for the last item. NULL texts are left out.
void gui_tooltip(Gui *gui, const char *title, const char *text, const char *last);

bool gui_tabs_begin(Gui *gui, const char *id);
bool gui_tab_begin(Gui *gui, const char *name);           // true: fill it, then gui_tab_end
void gui_tab_end(Gui *gui);
void gui_tabs_end(Gui *gui);

// One line of UTF-8. Returns true when Enter was pressed. Takes the keyboard focus if `take_focus`.
bool gui_text_field(Gui *gui, const char *id, char *text, size_t capacity, bool take_focus);
// Whether a text field of the last frame had the keys.
bool gui_takes_text(const Gui *gui);

// Drawing in the current window.
void gui_draw_fill(Gui *gui, GuiRect at, Color color);
void gui_draw_line(Gui *gui, float x0, float y0, float x1, float y1, Color color, float thickness);
void gui_draw_text(Gui *gui, float x, float y, GuiFont font, Color color, const char *text);
void gui_draw_wrapped(Gui *gui, float x, float y, GuiFont font, Color color, const char *text, float width);
void gui_text_extent(Gui *gui, GuiFont font, const char *text, float *width, float *height);
float gui_wrapped_height(Gui *gui, GuiFont font, const char *text, float width);

#ifdef __cplusplus
}
#endif
#endif
