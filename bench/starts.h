// A part of `bench track`: single clicks in volumes with contrast, noise and a bright band like VascuSynth's, with many seeds each.
#ifndef SELDINGER_BENCH_STARTS_H
#define SELDINGER_BENCH_STARTS_H

#include "bench/bench.h"

// Runs `seeds` trials of each kind of volume, prints one row per kind, adds `starts` to the JSON and verdicts to *kept (left true if all required
// figures are met).
bool bench_starts(FILE *out, int seeds, int threads, cJSON *root, bool *kept, Faults *faults);

#endif
