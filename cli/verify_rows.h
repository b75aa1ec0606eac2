// The rows of the verification table of `seldinger check`.
#ifndef SELDINGER_CLI_VERIFY_ROWS_H
#define SELDINGER_CLI_VERIFY_ROWS_H

#include "cli/cli.h"

void verify_print_heading(void);
// Prints the runs of one scene, one for each of its numbers of elements, and adds their cases to the log; with `quiet` only rows that fail. What is wrong with
// the scene goes to standard error. Returns the worst exit code.
int verify_print_scene(const VerifyRun *run, int runs, bool quiet, CheckLog *log);

#endif
