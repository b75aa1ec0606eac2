// The texture has the order of channels and rows of the buffer to which it is copied: then the driver copies memory, else it runs a shader (see gui.cpp).
#include "render/gl_enlarger.h"

#include <epoxy/gl.h>
#include <stddef.h>

static bool make_texture(GlEnlarger *enlarger, int width, int height, bool is_turned)
{
    if (enlarger->texture && enlarger->width == width && enlarger->height == height && enlarger->is_turned == is_turned)
        return true;
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
    bool is_turned = port.framebuffer == 0;
    if (!enlarger_fit(&enlarger->pixels, width, height, port.width, port.height) || !make_texture(enlarger, port.width, port.height, is_turned))
        return false;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, enlarger->pixels.picture);
    enlarger_run(&enlarger->pixels, is_turned);
    glBindTexture(GL_TEXTURE_2D, enlarger->texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, port.width, port.height, is_turned ? GL_BGRA : GL_RGBA, GL_UNSIGNED_BYTE, enlarger->pixels.enlarged);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, enlarger->framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, port.framebuffer);
    int bottom = is_turned ? port.y + port.height : port.y, top = is_turned ? port.y : port.y + port.height;
    glBlitFramebuffer(0, 0, port.width, port.height, port.x, bottom, port.x + port.width, top, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    return true;
}

void gl_enlarger_destroy(GlEnlarger *enlarger)
{
    if (enlarger->texture) {
        glDeleteTextures(1, &enlarger->texture);
        glDeleteFramebuffers(1, &enlarger->framebuffer);
    }
    enlarger_free(&enlarger->pixels);
    *enlarger = (GlEnlarger){0};
}
