// The report of a finished sweep.
#ifndef SELDINGER_CLI_SWEEP_REPORT_H
#define SELDINGER_CLI_SWEEP_REPORT_H

#include "cli/sweep_options.h"

// Writes FOLDER/report.html of the folder in options->report. Returns an exit code; faults if there is no finished sweep or the page cannot be written.
int sweep_report(const SweepOptions *options, Faults *faults);

#endif
