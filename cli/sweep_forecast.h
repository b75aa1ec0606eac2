// `sweep --dry-run` and `--simulate-ranks`: how long a sweep takes.
#ifndef SELDINGER_CLI_SWEEP_FORECAST_H
#define SELDINGER_CLI_SWEEP_FORECAST_H

#include "cli/sweep_options.h"
#include "study/study.h"

// Makes up to three runs. Returns an exit code.
int sweep_dry_run(OpenStudy *open, const SweepOptions *options, Faults *faults);
// Reads the times from the journal of a sweep and measures the manager's work for a result. Returns an exit code.
int sweep_simulate_ranks(const SweepOptions *options, const cJSON *heading, int64_t runs, Faults *faults);

#endif
