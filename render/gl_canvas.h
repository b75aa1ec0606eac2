// A framebuffer with colour and depth, multisampled or not, that is read as a texture or as pixels. And shader programs. All of it needs a current GL
// context.
#ifndef SELDINGER_RENDER_GL_CANVAS_H
#define SELDINGER_RENDER_GL_CANVAS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct GlCanvas {
    int width, height;         // [pixel]
    unsigned framebuffer;      // drawn into
    unsigned color, depth;     // its renderbuffers (0 where not multisampled: the texture itself)
    unsigned resolved;         // framebuffer around `texture`
    unsigned texture;          // RGBA8, valid after gl_canvas_resolve
} GlCanvas;

// `samples` 1 or more (cut to what the driver has).
bool gl_canvas_create(GlCanvas *canvas, int width, int height, int samples, char *message, size_t capacity);
void gl_canvas_destroy(GlCanvas *canvas);   // a zeroed canvas is allowed
void gl_canvas_begin(const GlCanvas *canvas, const float background[3]);
void gl_canvas_resolve(const GlCanvas *canvas);
// Rows from the top, 3 bytes a pixel, into `rgb` (height, width, 3); resolves first.
void gl_canvas_read(const GlCanvas *canvas, uint8_t *rgb);
// The same of any framebuffer that is not multisampled; 0 is the window's.
void gl_framebuffer_read(unsigned framebuffer, int width, int height, uint8_t *rgb);

void gl_canvas_finish(void);   // waits until everything is drawn, to measure it

// 0 with the compiler's first lines in `message`.
unsigned gl_program_create(const char *vertex_shader, const char *fragment_shader, char *message, size_t capacity);

#endif
