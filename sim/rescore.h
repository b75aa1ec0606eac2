// The score of a recording, by simulating it again beside what is shown: the figures at any second of it that was reached.
#ifndef SELDINGER_SIM_RESCORE_H
#define SELDINGER_SIM_RESCORE_H

#include "sim/open_vessel.h"
#include "sim/recording.h"
#include "sim/score.h"

typedef struct Rescore Rescore;

// All borrowed. NULL with faults.
Rescore *rescore_create(const RecordedRun *run, const Scene *scene, const OpenVessel *open, Faults *faults);
void rescore_free(Rescore *rescore);
// Goes on to step `to`, for at most `budget_s` of real time (HUGE_VAL: all the way).
void rescore_advance(Rescore *rescore, int64_t to, double budget_s);
// The figures at the last whole tenth of a second at or before `time_s` that was reached. Valid as long as the rescore.
const ScoreFigures *rescore_at(Rescore *rescore, double time_s);
// Index of the first step that gave another state than the recording holds, where it stopped; -1: none so far.
int64_t rescore_first_different(const Rescore *rescore);
int64_t rescore_steps(const Rescore *rescore);           // that were simulated
const Score *rescore_score(const Rescore *rescore);      // after them

#endif
