// The strip below the views for playing, pausing, seeking and resuming a recording, with marks for what happened in it, which can be jumped to; and, over the views,
// the parts of the score at the moment shown. Draws with its own Gui over the lower edge of the panels. Every button has a key, see timeline_take_keys().
#ifndef SELDINGER_RENDER_TIMELINE_H
#define SELDINGER_RENDER_TIMELINE_H

#include "render/panel.h"
#include "sim/sim.h"

typedef struct TimelineSide {        // a recording beside the one that is played
    const char *name;                // one line
    double time_s, end_s;
    double behind_s;                 // how much less simulated time has passed in it since its first action; 0 in step
    bool is_in_step;                 // it follows the first one; else it has its own time
    const ScoreFigures *figures;     // at its time
} TimelineSide;

typedef struct TimelineState {
    double time_s, end_s;            // time shown, total length; simulated time
    bool is_playing;
    float speed;                     // simulated over real time, 0.1 to 8
    const char *note;                // one line: the name of the recording
    const RunMarks *marks;           // NULL: none
    double known_s;                  // errors are known up to here; later ones are still being computed
    double scored_s;                 // so are the points
    bool has_parts;                  // the parts of the score are shown …
    const ScoreFigures *figures;     // … of these figures at the time shown
    const TimelineSide *side;        // NULL: none
    PanelRect main;                  // the main view, for boxes over it
} TimelineState;

typedef struct TimelineActions {
    bool seek, toggle_play, resume;  // resume the session from here
    bool stop;                       // a jump to a mark, which is to be looked at: playing stops
    double seek_s;
    float speed;                     // as set now
    bool toggle_parts, toggle_step;  // of the side: in step or by its own time
    bool seek_side;                  // moves the side alone
    double seek_side_s;
} TimelineActions;

typedef struct Timeline Timeline;

Timeline *timeline_create(char *message, size_t capacity);   // needs a current GL context; NULL with a reason
void timeline_destroy(Timeline *timeline);
// The timeline's own actions by keys (render/replay_keys.h); play, back, on and resume come as actions of the key table.
TimelineActions timeline_take_keys(const WindowInput *input, const TimelineState *state);
// Draws a frame; `at` is the bottom strip of the layout.
TimelineActions timeline_draw(Timeline *timeline, const WindowInput *input, const TimelineState *state, double scale, PanelRect at, unsigned framebuffer);

#endif
