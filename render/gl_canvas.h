// A framebuffer with colour and depth, multisampled or not, that can be read as a texture or as pixels; and shader programs. Everything here needs a current GL
// context.
#ifndef SELDINGER_RENDER_GL_CANVAS_H
#define SELDINGER_RENDER_GL_CANVAS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct GlCanvas {
    int width, height;         // [pixel]
    unsigned framebuffer;      // drawn into
    unsigned color, depth;     // its renderbuffers (0 if not multisampled: the texture itself)
    unsigned resolved;         // framebuffer around `texture`
    unsigned texture;          // RGBA8, valid after gl_canvas_resolve
} GlCanvas;

// `samples`: 1 or more (reduced to the driver's limit).
bool gl_canvas_create(GlCanvas *canvas, int width, int height, int samples, char *message, size_t capacity);
void gl_canvas_destroy(GlCanvas *canvas);   // a zeroed canvas is allowed
void gl_canvas_begin(const GlCanvas *canvas, const float background[3]);
void gl_canvas_resolve(const GlCanvas *canvas);
// Reads the pixels into `rgb` (height, width, 3), rows from the top; resolves first.
void gl_canvas_read(const GlCanvas *canvas, uint8_t *rgb);
// As gl_canvas_read(), for any framebuffer that is not multisampled; 0 is that of the window.
void gl_framebuffer_read(unsigned framebuffer, int width, int height, uint8_t *rgb);

void gl_canvas_finish(void);   // waits until everything is drawn, for timing
bool gl_is_software(void);     // the driver draws on the processor: Mesa's llvmpipe or softpipe

// Returns 0 with the first lines of the compiler's output in `message`.
unsigned gl_program_create(const char *vertex_shader, const char *fragment_shader, char *message, size_t capacity);

#endif
