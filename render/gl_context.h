// An OpenGL 3.3 core context without window or X server: EGL's surfaceless platform, on a GPU or on llvmpipe.
#ifndef SELDINGER_RENDER_GL_CONTEXT_H
#define SELDINGER_RENDER_GL_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct GlContext GlContext;

// Creates a context and makes it current in this thread; destroying it restores the context that was current before. Returns NULL with a reason.
GlContext *gl_context_create(char *message, size_t capacity);
void gl_context_destroy(GlContext *context);
const char *gl_context_renderer(const GlContext *context);   // "llvmpipe (LLVM 15, 256 bits)"; valid as long as the context

#endif
