// A second recording beside the one that is replayed: its playback, views and score. It follows the first in step, counted from the first action in each, or has its
// own time.
#ifndef SELDINGER_RENDER_REPLAY_SIDE_H
#define SELDINGER_RENDER_REPLAY_SIDE_H

#include "render/playback.h"
#include "render/replay_recording.h"
#include "render/scene_views.h"
#include "render/timeline.h"

typedef struct ReplaySide ReplaySide;

// All arguments are borrowed. `main`: the recording beside which it is shown. A recording without a viewer is shown with the pedal down. Needs a current GL context. NULL with faults.
ReplaySide *replay_side_create(const ReplayRecording *recording, const RecordedRun *main, Faults *faults);
void replay_side_free(ReplaySide *side);

// To be called with each new time of the first recording: moves along with it, in step or by the same time.
void replay_side_follow(ReplaySide *side, double main_s);
void replay_side_toggle_step(ReplaySide *side, double main_s);
// Gives it its own time.
void replay_side_seek(ReplaySide *side, double time_s, double main_s);
// Continues the repeated simulation of its score for at most `budget_s` of real time. Returns whether it has ended.
bool replay_side_compute(ReplaySide *side, double budget_s);
// Draws its view of the kind `view` into `port`, and nothing else. `look`: of the first recording's 3D view, used if both show the same scene.
void replay_side_draw(ReplaySide *side, PanelView view, ViewPort port, const VesselSceneLook *look, int width, int height, unsigned framebuffer);
const TimelineSide *replay_side_state(ReplaySide *side);     // valid until the next call
// The part of a view's rectangle that each of the two gets: the first the left half.
void replay_side_split(const PanelLayout *layout, PanelLayout *left, ViewPort *right);

#endif
