// Output of a run: the summary as JSON, the final state as CSV, and a few lines of text.
#ifndef SELDINGER_SIM_RUN_SUMMARY_H
#define SELDINGER_SIM_RUN_SUMMARY_H

#include "sim/drive.h"

#include <stdio.h>

// How far the last state's deepest node is outside the wall [mm], from a node report.
double run_final_penetration_mm(const NodeReport *node, int node_count);
// A node left the vessel: beyond an open end, or so far outside the wall that the wall no longer holds it.
bool run_left_vessel(const RunTotals *totals);

// Text of the summary (docs/scene-format.md, "Output files"); the caller frees it. NULL if out of memory.
char *run_summary_json(Simulator *simulator, const DriveReport *drive, const NodeReport *node);
// Text of the final state, one row per node.
char *run_final_csv(Simulator *simulator, const NodeReport *node, size_t *length);
// The same into files ("-": standard output); false with a fault.
bool run_write_summary(const char *path, Simulator *simulator, const DriveReport *drive, const NodeReport *node, Faults *faults);
bool run_write_final(const char *path, Simulator *simulator, const NodeReport *node, Faults *faults);
void run_print(FILE *out, Simulator *simulator, const DriveReport *drive, const NodeReport *node);
// What makes the run doubtful, a line each; nothing where nothing does.
void run_print_warnings(FILE *out, const Simulator *simulator, const DriveReport *drive);

#endif
