// Where a view draws: a rectangle of a framebuffer, that of the window (0) or one off screen. A view sets all GL state that it depends on, leaves the
// scissor test off and the framebuffer and viewport changed; the caller restores its own.
#ifndef SELDINGER_RENDER_VIEW_PORT_H
#define SELDINGER_RENDER_VIEW_PORT_H

typedef struct ViewPort {
    unsigned framebuffer;
    int x, y, width, height; // [pixel], from the lower left corner
} ViewPort;

#endif
