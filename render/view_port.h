// Where a view draws: a rectangle of a framebuffer, the window's (0) or one off screen. A view sets all GL state that it depends on, leaves the
// scissor test off and framebuffer and viewport changed; the caller sets its own again.
#ifndef SELDINGER_RENDER_VIEW_PORT_H
#define SELDINGER_RENDER_VIEW_PORT_H

typedef struct ViewPort {
    unsigned framebuffer;
    int x, y, width, height; // [pixel], from the lower left corner
} ViewPort;

#endif
