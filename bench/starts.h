// A part of `bench track`: single clicks in volumes with the contrast, noise and bright band of VascuSynth, with many seeds each.
#ifndef SELDINGER_BENCH_STARTS_H
#define SELDINGER_BENCH_STARTS_H

#include "bench/bench.h"

// Runs `seeds` trials of each kind of volume, prints one row per kind and adds `starts` to the JSON. Sets *kept to false if a required figure is missed.
bool bench_starts(FILE *out, int seeds, int threads, cJSON *root, bool *kept, Faults *faults);

#endif
