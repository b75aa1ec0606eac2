// The options of `sweep`.
#ifndef SELDINGER_CLI_SWEEP_OPTIONS_H
#define SELDINGER_CLI_SWEEP_OPTIONS_H

#include "base/base.h"

typedef struct SweepOptions {
    const char *spec, *output;
    const char *report;      // the folder of results to report of; NULL: none
    double run;              // -1: all
    int threads, simulate_ranks;
    bool dry_run, quiet;
} SweepOptions;

extern const OptionTable sweep_options;

#endif
