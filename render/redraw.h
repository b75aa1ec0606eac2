// Whether a window needs a new picture: nothing is drawn while nothing changes that a user could see. Plain data: no clock, no OpenGL.
#ifndef SELDINGER_RENDER_REDRAW_H
#define SELDINGER_RENDER_REDRAW_H

#include "render/window.h"
#include "sim/sim.h"

typedef struct Redraw {
    bool has_picture;
    double drawn_s;
    int trail;                   // pictures to be drawn after the last change: views refine once they are at rest
    bool is_repeat;              // the picture due only refreshes figures: its views show what they showed in the last one
    double mouse_x, mouse_y;     // of the last picture …
    unsigned mouse_buttons;
    int width, height;
    bool has_focus;
    uint64_t settings;
    int node_count, capacity;
    Vec3 *node;                  // (node_count) … and the tools as its views show them
} Redraw;

void redraw_free(Redraw *redraw);
// True if a picture is due at `now_s`, which is then taken for drawn: input came, `settings` (a hash of what else is shown) differ, a tool moved by more than
// 0.02 mm, a picture of the trail is due, or the last one is `refresh_s` old. `pose` NULL: none.
bool redraw_is_due(Redraw *redraw, const WindowInput *input, const Pose *pose, uint64_t settings, double now_s, double refresh_s);
// Adds bytes to a hash, which starts at 0.
uint64_t redraw_hash(uint64_t hash, const void *bytes, size_t count);

#endif
