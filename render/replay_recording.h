// A recording with what is needed to show it.
#ifndef SELDINGER_RENDER_REPLAY_RECORDING_H
#define SELDINGER_RENDER_REPLAY_RECORDING_H

#include "sim/sim.h"

typedef struct ReplayRecording {     // all borrowed
    const char *name;                // for the window
    const RecordedRun *run;
    Scene *scene;
    OpenVessel *open;
} ReplayRecording;

#endif
