// The positions of the trainer's views and panels.
#ifndef SELDINGER_RENDER_PANEL_LAYOUT_H
#define SELDINGER_RENDER_PANEL_LAYOUT_H

#include "render/gui.h"
#include "render/view_port.h"

#include <stdbool.h>

typedef enum { VIEW_FLUOROSCOPY, VIEW_3D, VIEW_ANGIOSCOPY, VIEW_COUNT, VIEW_ALL = VIEW_COUNT } PanelView;

typedef GuiRect PanelRect;   // x, y, width, height [pixel], y down from the upper left corner

// A view whose rectangle has zero width is not shown. Nothing overlaps for windows of at least 1024x600 (0.6 times that with smaller scale).
typedef struct PanelLayout {
    double scale;                  // of text and widgets, from the content scale and the height of the window
    ViewPort view[VIEW_COUNT];     // framebuffer 0, y from the lower left corner as in OpenGL
    PanelRect view_rect[VIEW_COUNT]; // the same, y down
    PanelView main;                // the largest
    ViewPort second;               // a second X-ray image, zero width: none
    PanelRect second_rect;
    PanelRect top, left, right, bottom;
} PanelLayout;

// `has_panels` false: the views fill the window.
PanelLayout panel_layout(int width, int height, double scale, PanelView view, bool has_panels);
// Makes room for a second X-ray image: in place of the other views, or, where there are none, beside the X-ray image.
void panel_layout_add_second(PanelLayout *layout, int window_height);
// Only the X-ray image, for examinations; the place of the other views goes to the controls.
PanelLayout panel_layout_xray_alone(int width, int height, double scale, bool has_panels);

#endif
