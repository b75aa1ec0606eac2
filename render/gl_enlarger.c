// In strips that stay in the processor's cache, from the enlarger's buffer into a texture of this height and from there into the port.
// The texture has the order of channels and rows of the buffer to which it is copied: then the driver copies memory, else it runs a shader (see gui.cpp).
#include "render/gl_enlarger.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdlib.h>

enum { STRIP_ROWS = 48 };

static bool make_texture(GlEnlarger *enlarger, int width, int height, bool is_turned)
{
    if (enlarger->texture && enlarger->width == width && enlarger->height == height && enlarger->is_turned == is_turned)
        return true;
    free(enlarger->strip);
    enlarger->strip = malloc((size_t)width * (size_t)height * sizeof *enlarger->strip);
    if (!enlarger->strip) {
        enlarger->width = 0;
        return false;
    }
    if (!enlarger->texture) {
        glGenTextures(1, &enlarger->texture);
        glGenFramebuffers(1, &enlarger->framebuffer);
    }
    glBindTexture(GL_TEXTURE_2D, enlarger->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, is_turned ? GL_RGBA : GL_RGBA8, width, height, 0, is_turned ? GL_BGRA : GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, enlarger->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, enlarger->texture, 0);
    enlarger->width = width;
    enlarger->height = height;
    enlarger->is_turned = is_turned;
    return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

bool gl_enlarge(GlEnlarger *enlarger, unsigned framebuffer, int width, int height, ViewPort port)
{
    const bool is_turned = port.framebuffer == 0;
    if (!enlarger_fit(&enlarger->pixels, width, height, port.width, port.height) || !make_texture(enlarger, port.width, STRIP_ROWS, is_turned))
        return false;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, enlarger->pixels.picture);
    glBindTexture(GL_TEXTURE_2D, enlarger->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, enlarger->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, port.framebuffer);
    enlarger_begin(&enlarger->pixels);
    for (int y = 0; y < port.height; y += STRIP_ROWS) {
        const int rows = port.height - y < STRIP_ROWS ? port.height - y : STRIP_ROWS, low = port.y + y, high = low + rows;
        enlarger_rows(&enlarger->pixels, y, rows, is_turned, enlarger->strip);
        glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, port.width, rows, is_turned ? GL_BGRA : GL_RGBA, GL_UNSIGNED_BYTE, enlarger->strip);
        glBlitFramebuffer(0, 0, port.width, rows, port.x, is_turned ? high : low, port.x + port.width, is_turned ? low : high, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    }
    return true;
}

void gl_enlarger_destroy(GlEnlarger *enlarger)
{
    if (enlarger->texture) {
        glDeleteTextures(1, &enlarger->texture);
        glDeleteFramebuffers(1, &enlarger->framebuffer);
    }
    enlarger_free(&enlarger->pixels);
    free(enlarger->strip);
    *enlarger = (GlEnlarger){0};
}
