// The rows of `seldinger check` for golden tool paths: a scene is run and compared with the golden path in its folder, or that path is rewritten.
#ifndef SELDINGER_CLI_CHECK_GOLDEN_H
#define SELDINGER_CLI_CHECK_GOLDEN_H

#include "cli/cli.h"

typedef struct GoldenOptions {
    double tolerance_mm, duration_s;   // duration < 0: not given
    bool update, quiet;
    int threads;
} GoldenOptions;

// Checks one scene and prints its row. Returns an exit code.
int check_golden(const char *path, const GoldenOptions *options, Faults *faults);

#endif
