// Output of a run: the summary as JSON, the final state as CSV, and a few lines of text.
#ifndef SELDINGER_SIM_RUN_SUMMARY_H
#define SELDINGER_SIM_RUN_SUMMARY_H

#include "sim/drive.h"

#include <stdio.h>

// Returns whether a node left the vessel: beyond an open end, or so far outside the wall that the wall no longer holds it.
bool run_left_vessel(const RunTotals *totals);

// Text of the summary (docs/scene-format.md, "Output files"); the caller frees it. NULL if out of memory.
char *run_summary_json(Simulator *simulator, const DriveReport *drive, const NodeReport *node);
// run_write_summary writes the JSON summary and run_write_final the CSV of the final state to a file ("-": standard output). Both return false with a fault.
bool run_write_summary(const char *path, Simulator *simulator, const DriveReport *drive, const NodeReport *node, Faults *faults);
bool run_write_final(const char *path, Simulator *simulator, const NodeReport *node, Faults *faults);
void run_print(FILE *out, Simulator *simulator, const DriveReport *drive, const NodeReport *node);
// Prints what makes the run doubtful, one line each; prints nothing if there is nothing.
void run_print_warnings(FILE *out, const Simulator *simulator, const DriveReport *drive);

#endif
