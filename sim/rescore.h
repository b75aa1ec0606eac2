// The score of a recording at any time, computed by simulating it again during playback.
#ifndef SELDINGER_SIM_RESCORE_H
#define SELDINGER_SIM_RESCORE_H

#include "sim/open_vessel.h"
#include "sim/recording.h"
#include "sim/score.h"

typedef struct Rescore Rescore;

// All arguments are borrowed. Returns NULL with faults.
Rescore *rescore_create(const RecordedRun *run, const Scene *scene, const OpenVessel *open, Faults *faults);
void rescore_free(Rescore *rescore);
// Continues to step `to`, for at most `budget_s` of real time (HUGE_VAL: no limit).
void rescore_advance(Rescore *rescore, int64_t to, double budget_s);
// The figures at the last simulated tenth of a second at or before `time_s`. Valid as long as the rescore.
const ScoreFigures *rescore_at(Rescore *rescore, double time_s);
// Index of the first step whose state differs from the recording, where it stopped; -1: none so far.
int64_t rescore_first_different(const Rescore *rescore);
int64_t rescore_steps(const Rescore *rescore);           // number of steps simulated
const Score *rescore_score(const Rescore *rescore);      // score after these steps

#endif
