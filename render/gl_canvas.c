// Framebuffers and programs. Multisampled renderbuffers are resolved by a blit into a texture; llvmpipe offers four samples.
#include "render/gl_canvas.h"

#include "render/message.h"

#include <epoxy/gl.h>
#include <string.h>

bool gl_canvas_create(GlCanvas *canvas, int width, int height, int samples, char *message, size_t capacity)
{
    *canvas = (GlCanvas){.width = width, .height = height};
    GLint most_samples = 1, most_pixels = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most_samples);
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &most_pixels);
    if (width < 1 || height < 1 || width > most_pixels || height > most_pixels)
        return message_fail(message, capacity, "cannot draw a picture of %d x %d pixels; expected 64 to %d per side", width, height, (int)most_pixels);
    if (samples > most_samples)
        samples = most_samples;

    glGenTextures(1, &canvas->texture);
    glBindTexture(GL_TEXTURE_2D, canvas->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glGenFramebuffers(1, &canvas->resolved);
    glBindFramebuffer(GL_FRAMEBUFFER, canvas->resolved);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, canvas->texture, 0);

    glGenRenderbuffers(1, &canvas->depth);
    glBindRenderbuffer(GL_RENDERBUFFER, canvas->depth);
    if (samples > 1) {
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT32F, width, height);
        glGenRenderbuffers(1, &canvas->color);
        glBindRenderbuffer(GL_RENDERBUFFER, canvas->color);
        glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA8, width, height);
        glGenFramebuffers(1, &canvas->framebuffer);
        glBindFramebuffer(GL_FRAMEBUFFER, canvas->framebuffer);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, canvas->color);
    } else {
        glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
        canvas->framebuffer = canvas->resolved;
    }
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, canvas->depth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE || glGetError() == GL_OUT_OF_MEMORY) {
        gl_canvas_destroy(canvas);
        return message_fail(message, capacity, "the driver cannot create a framebuffer of %d x %d pixels", width, height);
    }
    return true;
}

void gl_canvas_destroy(GlCanvas *canvas)
{
    if (canvas->framebuffer != canvas->resolved)
        glDeleteFramebuffers(1, &canvas->framebuffer);
    if (canvas->resolved)
        glDeleteFramebuffers(1, &canvas->resolved);
    if (canvas->color)
        glDeleteRenderbuffers(1, &canvas->color);
    if (canvas->depth)
        glDeleteRenderbuffers(1, &canvas->depth);
    if (canvas->texture)
        glDeleteTextures(1, &canvas->texture);
    *canvas = (GlCanvas){0};
}

void gl_canvas_begin(const GlCanvas *canvas, const float background[3])
{
    glBindFramebuffer(GL_FRAMEBUFFER, canvas->framebuffer);
    glViewport(0, 0, canvas->width, canvas->height);
    glDisable(GL_SCISSOR_TEST);
    glDepthMask(GL_TRUE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glClearColor(background[0], background[1], background[2], 1);
    glClearDepth(1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void gl_canvas_resolve(const GlCanvas *canvas)
{
    if (canvas->framebuffer == canvas->resolved)
        return;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, canvas->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, canvas->resolved);
    glBlitFramebuffer(0, 0, canvas->width, canvas->height, 0, 0, canvas->width, canvas->height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, canvas->framebuffer);
}

void gl_framebuffer_read(unsigned framebuffer, int width, int height, uint8_t *rgb)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    size_t row = (size_t)width * 3;
    // rows go upwards in OpenGL and downwards in a file
    for (int y = 0; y < height; y++)
        glReadPixels(0, height - 1 - y, width, 1, GL_RGB, GL_UNSIGNED_BYTE, rgb + (size_t)y * row);
}

void gl_canvas_read(const GlCanvas *canvas, uint8_t *rgb)
{
    gl_canvas_resolve(canvas);
    gl_framebuffer_read(canvas->resolved, canvas->width, canvas->height, rgb);
}

void gl_canvas_finish(void) { glFinish(); }

bool gl_is_software(void)
{
    const char *name = (const char *)glGetString(GL_RENDERER);
    return name && (strstr(name, "llvmpipe") || strstr(name, "softpipe"));
}

static bool add_shader(unsigned program, GLenum kind, const char *text, char *message, size_t capacity)
{
    unsigned shader = glCreateShader(kind);
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    GLint compiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled)
        glAttachShader(program, shader);
    else {
        char log[400] = "";
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        message_fail(message, capacity, "a shader does not compile: %s", log);
    }
    glDeleteShader(shader);
    return compiled;
}

unsigned gl_program_create(const char *vertex_shader, const char *fragment_shader, char *message, size_t capacity)
{
    unsigned program = glCreateProgram();
    GLint linked = 0;
    if (add_shader(program, GL_VERTEX_SHADER, vertex_shader, message, capacity) &&
        add_shader(program, GL_FRAGMENT_SHADER, fragment_shader, message, capacity)) {
        glLinkProgram(program);
        glGetProgramiv(program, GL_LINK_STATUS, &linked);
        if (!linked)
            message_fail(message, capacity, "the shaders cannot be linked");
    }
    if (!linked) {
        glDeleteProgram(program);
        return 0;
    }
    return program;
}
