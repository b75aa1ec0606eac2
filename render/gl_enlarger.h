// Copies a framebuffer, enlarged, into a rectangle of another (render/enlarge.h). Needs a current OpenGL context, the same in every call.
#ifndef SELDINGER_RENDER_GL_ENLARGER_H
#define SELDINGER_RENDER_GL_ENLARGER_H

#include "render/enlarge.h"
#include "render/gl_strip.h"

typedef struct GlEnlarger {    // initialise with zeros
    Enlarger pixels;
    GlStrip strip;
} GlEnlarger;

// `framebuffer`: of width x height pixels, not multisampled. Returns false if memory runs out or the driver fails.
bool gl_enlarge(GlEnlarger *enlarger, unsigned framebuffer, int width, int height, ViewPort port);
void gl_enlarger_destroy(GlEnlarger *enlarger);

#endif
