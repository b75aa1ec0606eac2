// A recording simulated again, and made into a regression scene on the way.
#ifndef SELDINGER_SIM_REPLAY_AGAIN_H
#define SELDINGER_SIM_REPLAY_AGAIN_H

#include "sim/open_vessel.h"
#include "sim/replay.h"

#include <stdio.h>

typedef struct ReplayAgain {
    ReplayVerdict verdict;
    bool diverged;
    bool is_written;         // the scene
} ReplayAgain;

// `folder` (NULL: no scene is made; else all is simulated, also past a difference) gets the scene of sim/replay_scene.h. `name` of the recording stands in faults.
// False with faults where it was not simulated.
bool replay_again(const RecordedRun *run, const Scene *scene, const OpenVessel *open, const char *folder, const char *name, ReplayAgain *again, Faults *faults);
// A line for each file that the run was made from and that is no longer what it was.
void replay_print_changed_files(FILE *out, const RecordedRun *run);
// A recording goes on in its own scene only: the same text. False with a fault, in which `recording` names it.
bool replay_is_of(const RecordedRun *run, const Scene *scene, const char *recording, Faults *faults);

#endif
