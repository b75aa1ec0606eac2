// The texture has the order of channels and rows of the buffer to which it is copied: then the driver copies memory, else it runs a shader (see gui.cpp).
#include "render/gl_strip.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdlib.h>

bool gl_strip_fit(GlStrip *strip, ViewPort port)
{
    const bool is_turned = port.framebuffer == 0;
    if (strip->width == port.width && strip->is_turned == is_turned)
        return true;
    free(strip->pixel);
    strip->width = 0;
    strip->pixel = malloc((size_t)port.width * STRIP_ROWS * sizeof *strip->pixel);
    if (!strip->pixel)
        return false;
    if (!strip->texture) {
        glGenTextures(1, &strip->texture);
        glGenFramebuffers(1, &strip->framebuffer);
    }
    glBindTexture(GL_TEXTURE_2D, strip->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, is_turned ? GL_RGBA : GL_RGBA8, port.width, STRIP_ROWS, 0, is_turned ? GL_BGRA : GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, strip->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, strip->texture, 0);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return false;
    strip->width = port.width;
    strip->is_turned = is_turned;
    return true;
}

void gl_strip_begin(const GlStrip *strip, ViewPort port)
{
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, strip->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, strip->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, port.framebuffer);
}

void gl_strip_send(const GlStrip *strip, ViewPort port, int first, int rows)
{
    const bool is_turned = strip->is_turned;
    const int low = port.y + first, high = low + rows;
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, port.width, rows, is_turned ? GL_BGRA : GL_RGBA, GL_UNSIGNED_BYTE, strip->pixel);
    glBlitFramebuffer(0, 0, port.width, rows, port.x, is_turned ? high : low, port.x + port.width, is_turned ? low : high, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void gl_strip_destroy(GlStrip *strip)
{
    if (strip->texture) {
        glDeleteTextures(1, &strip->texture);
        glDeleteFramebuffers(1, &strip->framebuffer);
    }
    free(strip->pixel);
    *strip = (GlStrip){0};
}
