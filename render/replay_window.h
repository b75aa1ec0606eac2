// Replays a recording in the trainer's window: play, pause, seek and resume.
#ifndef SELDINGER_RENDER_REPLAY_WINDOW_H
#define SELDINGER_RENDER_REPLAY_WINDOW_H

#include "render/panel.h"
#include "sim/sim.h"

typedef struct ReplayWindowOptions {
    const char *name;                // of the recording, for the strip below the views
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
