// A part of `bench track`: one click in volumes with the contrast, noise and bright band of VascuSynth's, many seeds of each.
#ifndef SELDINGER_BENCH_STARTS_H
#define SELDINGER_BENCH_STARTS_H

#include "bench/bench.h"

// Runs `seeds` trials of each kind of volume, prints a row a kind, adds `starts` to the JSON and verdicts to *kept (left true where all that must be reached is).
bool bench_starts(FILE *out, int seeds, int threads, cJSON *root, bool *kept, Faults *faults);

#endif
