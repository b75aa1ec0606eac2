// Simulates a recording again and, if requested, writes it as a regression scene.
#ifndef SELDINGER_SIM_REPLAY_AGAIN_H
#define SELDINGER_SIM_REPLAY_AGAIN_H

#include "sim/open_vessel.h"
#include "sim/replay.h"

#include <stdio.h>

typedef struct ReplayAgain {
    ReplayVerdict verdict;
    bool diverged;
    bool is_written;         // the scene was written
} ReplayAgain;

// With `folder`, simulates all steps even after a difference and writes the scene of sim/replay_scene.h there; NULL: no scene is written. `name` of the
// recording appears in faults. Returns false with faults if it was not simulated.
bool replay_again(const RecordedRun *run, const Scene *scene, const OpenVessel *open, const char *folder, const char *name, ReplayAgain *again, Faults *faults);
// Prints a line for each input file of the run that has changed since.
void replay_print_changed_files(FILE *out, const RecordedRun *run);
// A recording can only be continued in its own scene, that is, with the same text. Returns false with a fault that includes the name `recording`.
bool replay_is_of(const RecordedRun *run, const Scene *scene, const char *recording, Faults *faults);

#endif
