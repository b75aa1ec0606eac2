// The page of a picture: context, canvas, overlay, 3D panels, and common parts (title, colour bar, scale bar). Internal to render. One page at a
// time in a process.
#ifndef SELDINGER_RENDER_PICTURE_PAGE_H
#define SELDINGER_RENDER_PICTURE_PAGE_H

#include "render/camera.h"
#include "render/gl_canvas.h"
#include "render/gl_context.h"
#include "render/overlay.h"
#include "render/picture.h"
#include "render/surface_view.h"

enum { PAGE_PANELS = 32 };

typedef struct PicturePage {
    int width, height;         // [pixel]
    double scale;              // of text, lines and gaps: 1 at 1000 pixels height
    GlContext *context;
    GlCanvas canvas;
    Overlay *overlay;
    SurfaceView *view;
    int panel_count;
    GlCanvas panel[PAGE_PANELS];
    int texture_count;
    unsigned texture[PAGE_PANELS];
    char *message;             // the caller's
    size_t capacity;
} PicturePage;

extern const Color PAGE_INK, PAGE_MUTED, PAGE_FAINT, PAGE_PAPER, PAGE_PANEL;

// 1 for 1600 x 1000 pixels.
double picture_page_scale_of(const PictureOptions *options);
// A page `height` pixels high (options->height, or less where less is needed; the scale stays that of the options). False with a reason; then there
// is nothing to close.
bool picture_page_open(PicturePage *page, const PictureOptions *options, int height, char *message, size_t capacity);
bool picture_page_save(PicturePage *page, const char *path);
void picture_page_close(PicturePage *page);

// A multisampled panel: draw between begin and end; end puts it on the page with its upper left corner at (x, y). NULL with the message set.
GlCanvas *picture_page_begin_panel(PicturePage *page, int width, int height);
void picture_page_end_panel(PicturePage *page, const GlCanvas *panel, double x, double y);
// A grey image as a texture that lives as long as the page; rows from the bottom. 0 if there is no room.
unsigned picture_page_grey_texture(PicturePage *page, int width, int height, const uint8_t *grey);

void picture_page_text(PicturePage *page, double x, double y, TextSize size, Color color, const char *format, ...) __attribute__((format(printf, 6, 7)));
// `anchor` 0: x is the text's left end, 0.5 its middle, 1 its right end. Returns the width.
double picture_page_text_anchored(PicturePage *page, double x, double y, double anchor, TextSize size, Color color, const char *text);
// Large; where it is too long its beginning is left out (the end of a path says more). Returns the width; 0 for NULL.
double picture_page_title(PicturePage *page, double x, double y, double room, const char *text);
// Text on a light halo, for labels over a drawing.
void picture_page_label(PicturePage *page, double x, double y, double anchor, TextSize size, Color color, const char *text);
// A bar of round length at most `longest` pixels with its length in mm, its left end at x, its lower edge at y.
void picture_page_scale_bar(PicturePage *page, double x, double y, double longest, double mm_per_pixel, Color color);
// `map` over [low, high] with ticks at round values; `title` above it.
void picture_page_color_bar(PicturePage *page, double x, double y, double width, double height, Color (*map)(double), double map_low, double low, double high,
                            const char *title);

// A panel of the surface, each vertex in the colour of its `error` (mesh->vertex_count) [mm], +-scale at the ends, NaN grey: discs that overlap, opaque.
bool picture_page_error_surface(PicturePage *page, const PictureOptions *options, const TriangleMesh *mesh, const double *error, double scale, double x,
                                double y, int width, int height);

// A round number at or above x for the end of a scale: 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8.
double picture_page_scale_end(double x);

#endif
