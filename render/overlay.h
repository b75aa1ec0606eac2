// Lines, shapes, text and images on a page, drawn with the draw list of Dear ImGui behind a C interface. Units are pixels, x right, y down from the upper left
// corner.
// Needs a current GL context. One overlay at a time per process (ImGui's context is global); destroy restores an outer ImGui context.
#ifndef SELDINGER_RENDER_OVERLAY_H
#define SELDINGER_RENDER_OVERLAY_H

#include "render/color_map.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct Overlay Overlay;
typedef enum { TEXT_SMALL, TEXT_NORMAL, TEXT_LARGE, TEXT_SIZES } TextSize;   // 14, 17 and 23 pixels times `scale`

// `scale` of text: 1 for a page about 1000 pixels high. Returns NULL if the driver fails or if out of memory. The font is DejaVu Sans if it is installed
// (package
// fonts-dejavu-core), else ImGui's built-in font.
Overlay *overlay_create(int width, int height, float scale);
void overlay_destroy(Overlay *overlay);
void overlay_finish(Overlay *overlay);   // draws everything into the bound framebuffer; afterwards only destroy may be called

void overlay_line(Overlay *overlay, double x0, double y0, double x1, double y1, Color color, double thickness);
void overlay_polyline(Overlay *overlay, int count, const float (*point)[2], Color color, double thickness);
void overlay_rectangle(Overlay *overlay, double x, double y, double width, double height, Color color, double thickness);
void overlay_fill(Overlay *overlay, double x, double y, double width, double height, Color color);
void overlay_circle(Overlay *overlay, double x, double y, double radius, Color color, double thickness);
void overlay_disc(Overlay *overlay, double x, double y, double radius, Color color);
void overlay_text(Overlay *overlay, double x, double y, TextSize size, Color color, const char *text);   // x, y: upper left corner
void overlay_text_size(Overlay *overlay, TextSize size, const char *text, double *width, double *height);
// Draws a GL texture; `is_bottom_up`: its first row is the lowest.
void overlay_image(Overlay *overlay, unsigned texture, double x, double y, double width, double height, bool is_bottom_up);
void overlay_push_clip(Overlay *overlay, double x, double y, double width, double height);
void overlay_pop_clip(Overlay *overlay);

#ifdef __cplusplus
}
#endif
#endif
