// What is shown beside a replayed recording: another recording, or a script driven through the same scene.
#ifndef SELDINGER_CLI_REPLAY_BESIDE_H
#define SELDINGER_CLI_REPLAY_BESIDE_H

#include "sim/sim.h"

typedef struct ReplayBeside {        // zeroed by the caller
    RecordedRun *run;
    Scene *scene;
    OpenVessel open;
} ReplayBeside;

// `path`: of a recording, or of a script for the scene of `main`, which is then simulated. Returns false with faults; replay_beside_close in either case.
bool replay_beside_open(ReplayBeside *beside, const char *path, const RecordedRun *main, const char *main_path, int threads, bool quiet, Faults *faults);
void replay_beside_close(ReplayBeside *beside);

#endif
