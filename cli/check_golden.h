// `seldinger check` for golden runs: scenes are run in parallel and compared with their golden runs, or these are written.
#ifndef SELDINGER_CLI_CHECK_GOLDEN_H
#define SELDINGER_CLI_CHECK_GOLDEN_H

#include "cli/golden_case.h"

// Checks the scenes and prints their rows in order, each as soon as those before it are ready. A scene that cannot be checked is a case too; what is wrong with
// it goes to standard error. Returns the worst exit code.
int check_golden(const SceneList *list, const GoldenOptions *options, CheckLog *log);

#endif
