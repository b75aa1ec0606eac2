#include "render/gl_enlarger.h"

#include <epoxy/gl.h>

bool gl_enlarge(GlEnlarger *enlarger, unsigned framebuffer, int width, int height, ViewPort port)
{
    if (!enlarger_fit(&enlarger->pixels, width, height, port.width, port.height) || !gl_strip_fit(&enlarger->strip, port))
        return false;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, enlarger->pixels.picture);
    gl_strip_begin(&enlarger->strip, port);
    enlarger_begin(&enlarger->pixels);
    for (int y = 0; y < port.height; y += STRIP_ROWS) {
        const int rows = port.height - y < STRIP_ROWS ? port.height - y : STRIP_ROWS;
        enlarger_rows(&enlarger->pixels, y, rows, enlarger->strip.is_turned, enlarger->strip.pixel);
        gl_strip_send(&enlarger->strip, port, y, rows);
    }
    return true;
}

void gl_enlarger_destroy(GlEnlarger *enlarger)
{
    gl_strip_destroy(&enlarger->strip);
    enlarger_free(&enlarger->pixels);
}
