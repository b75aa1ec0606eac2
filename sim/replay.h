// A recording simulated again: the same commands through the same scene must give the same state at each step, bit for bit.
#ifndef SELDINGER_SIM_REPLAY_H
#define SELDINGER_SIM_REPLAY_H

#include "sim/recording.h"

// The scene that a recording holds, read as if at its original path (for the files it refers to), without its script, which the recorded commands
// replace. NULL with faults.
Scene *replay_scene(const RecordedRun *run, const char *path, Faults *faults);

typedef struct ReplayVerdict {
    int64_t steps;           // simulated
    int64_t first_different; // index of the first step whose state differs; -1: none
    uint64_t recorded, simulated;   // the hashes at that step; if none differs, the last ones
} ReplayVerdict;

// Steps a fresh simulator through the first `steps` commands (< 0: all) and compares. Continues after a difference only with `go_on`. `each` is
// called after each step (`xray` NULL: no viewer); false stops. May be NULL.
ReplayVerdict replay_verify(Simulator *simulator, const RecordedRun *run, int64_t steps, bool go_on,
                            bool (*each)(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray), void *context);
// Returns whether the simulator's tools have as many nodes as the recording's; otherwise adds a fault.
bool replay_fits(const RecordedRun *run, Simulator *simulator, Faults *faults);
// The recorded commands as a script's text, runs of equal ones as one row; the caller frees it. NULL if out of memory.
char *replay_script(const RecordedRun *run, size_t *length);

#endif
