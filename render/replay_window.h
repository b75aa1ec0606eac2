// Replays a recording in the trainer's window: play, pause, seek, jump to what happened, and resume; the score's parts at each moment; another recording beside it.
#ifndef SELDINGER_RENDER_REPLAY_WINDOW_H
#define SELDINGER_RENDER_REPLAY_WINDOW_H

#include "render/panel.h"
#include "render/replay_recording.h"
#include "sim/sim.h"

typedef struct ReplayWindowOptions {
    const char *name;                // path of the recording, shown in the strip below the views; its session file beside it gives the errors at once
    const ReplayRecording *beside;   // shown beside it; NULL: none
    int width, height;
    PanelView view;
    double at_s;                     // first moment
    double duration_s;               // ends after this much real time; 0: never
    double lao_deg, cra_deg;         // for a recording without a viewer; NaN: as in the scene
} ReplayWindowOptions;

// Runs until the user quits or wants to resume from a moment: then *resumes is true and *resume_s is that time. Returns false with faults if no window can be
// opened.
bool replay_window_run(const ReplayWindowOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, bool *resumes, double *resume_s,
                       Faults *faults);

#endif
