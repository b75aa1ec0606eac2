// Output of a run: the summary as JSON, the final state as CSV, and a few lines of text.
#ifndef SELDINGER_SIM_RUN_SUMMARY_H
#define SELDINGER_SIM_RUN_SUMMARY_H

#include "sim/drive.h"

#include <stdio.h>

// A node left the vessel: beyond an open end, or so far outside the wall that the wall no longer holds it.
bool run_left_vessel(const RunTotals *totals);

// The same into files ("-": standard output); false with a fault.
bool run_write_summary(const char *path, Simulator *simulator, const DriveReport *drive, const NodeReport *node, Faults *faults);
bool run_write_final(const char *path, Simulator *simulator, const NodeReport *node, Faults *faults);
void run_print(FILE *out, Simulator *simulator, const DriveReport *drive, const NodeReport *node);
// What makes the run doubtful, a line each; nothing where nothing does.
void run_print_warnings(FILE *out, const Simulator *simulator, const DriveReport *drive);

#endif
