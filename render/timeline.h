// The strip below the views for playing, pausing, seeking and resuming a recording. Draws with its own Gui over the lower edge of the panels.
#ifndef SELDINGER_RENDER_TIMELINE_H
#define SELDINGER_RENDER_TIMELINE_H

#include "render/panel.h"

enum { TIMELINE_MARKS = 64 };

typedef struct TimelineState {
    double time_s, end_s;            // time shown, total length; simulated time
    bool is_playing;
    float speed;                     // simulated over real time, 0.1 to 8
    int mark_count;
    double mark_s[TIMELINE_MARKS];   // bookmarks
    const char *note;                // one line: the name of the recording
} TimelineState;

typedef struct TimelineActions {
    bool seek, toggle_play, resume;  // resume the session from here
    double seek_s;
    float speed;                     // as set now
} TimelineActions;

typedef struct Timeline Timeline;

Timeline *timeline_create(char *message, size_t capacity);   // needs a current GL context; NULL with a reason
void timeline_destroy(Timeline *timeline);
// Draws a frame; `at` is the bottom strip of the layout.
TimelineActions timeline_draw(Timeline *timeline, const WindowInput *input, const TimelineState *state, double scale, PanelRect at, unsigned framebuffer);

#endif
