// The verification table of `seldinger check`: scenes with the key `verify:`, each run with each of its numbers of elements.
#ifndef SELDINGER_CLI_CHECK_VERIFY_H
#define SELDINGER_CLI_CHECK_VERIFY_H

#include "cli/cli.h"

// Runs those of the scenes that have the key on `threads` threads (0: one per processor) and prints the table; with `quiet` only rows that fail.
// Each row becomes a case of the log, and so does a scene that cannot be opened. Returns an exit code.
int check_verify(int count, char *const *path, int threads, bool quiet, CheckLog *log, Faults *faults);

#endif
