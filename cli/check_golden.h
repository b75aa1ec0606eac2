// The rows of `seldinger check` for golden tool paths: a scene is run and compared with what lies beside it, or that is rewritten.
#ifndef SELDINGER_CLI_CHECK_GOLDEN_H
#define SELDINGER_CLI_CHECK_GOLDEN_H

#include "cli/cli.h"

typedef struct GoldenOptions {
    double tolerance_mm, duration_s;   // duration < 0: not given
    bool update, quiet;
    int threads;
} GoldenOptions;

// One scene; prints its row. An exit code.
int check_golden(const char *path, const GoldenOptions *options, Faults *faults);

#endif
