// A recording at the trainer's window: played, stopped, searched; and gone on from.
#ifndef SELDINGER_RENDER_REPLAY_WINDOW_H
#define SELDINGER_RENDER_REPLAY_WINDOW_H

#include "render/panel.h"
#include "sim/open_vessel.h"
#include "sim/recording.h"

typedef struct ReplayWindowOptions {
    const char *name;                // of the recording, for the strip below
    int width, height;
    PanelView view;
    double at_s;                     // first moment
    double duration_s;               // ends by itself after this much real time; 0: never
    double lao_deg, cra_deg;         // of a recording that nobody looked at; NaN: as the scene says
} ReplayWindowOptions;

// Until the user quits, or wants to go on from a moment: then true in *resumes and its time in *resume_s. False with faults where no window can be had.
bool replay_window_run(const ReplayWindowOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, bool *resumes, double *resume_s,
                       Faults *faults);

#endif
