// Passes rows of pixels that the processor has made to a rectangle of a framebuffer, in strips that stay in its cache. Needs a current OpenGL context, the same in
// every call.
#ifndef SELDINGER_RENDER_GL_STRIP_H
#define SELDINGER_RENDER_GL_STRIP_H

#include "render/view_port.h"

#include <stdbool.h>
#include <stdint.h>

enum { STRIP_ROWS = 48 };

typedef struct GlStrip {       // initialise with zeros
    uint32_t *pixel;           // (STRIP_ROWS, width) the rows under way, red in the lowest byte, rows upwards; turned: blue in the lowest byte, rows downwards
    unsigned texture, framebuffer;
    int width;
    bool is_turned;            // as the buffer of a window has them
} GlStrip;

// Prepares for a port's width. Returns false if memory runs out or the driver fails.
bool gl_strip_fit(GlStrip *strip, ViewPort port);
void gl_strip_begin(const GlStrip *strip, ViewPort port);
// Rows `first` to first + rows - 1 of the port, counted from below; at most STRIP_ROWS.
void gl_strip_send(const GlStrip *strip, ViewPort port, int first, int rows);
void gl_strip_destroy(GlStrip *strip);

#endif
