// One case of `seldinger check`: a scene is run and compared with its golden run, or that is written.
#ifndef SELDINGER_CLI_GOLDEN_CASE_H
#define SELDINGER_CLI_GOLDEN_CASE_H

#include "cli/cli.h"

#include <pthread.h>

typedef struct GoldenOptions {
    double tolerance_mm, duration_s;   // < 0: not given
    Tolerances tolerances;             // of the command line; those of a scene come before them
    const char *baseline;              // where the golden runs are; NULL: beside the scenes
    bool writes, quiet;
    bool has_page;                     // keep what its figures show
    int threads;
} GoldenOptions;

enum { GOLDEN_MESSAGE = 1000 };

// Fills status, code and comparison of `result`, whose scene is set, and its message; prints its row. `opening` is held while files are read: the HDF5 library may be
// used by one thread at a time, and a fit uses all threads.
void golden_case(const GoldenOptions *options, pthread_mutex_t *opening, CheckCase *result, char message[GOLDEN_MESSAGE], FILE *row, Faults *faults);

#endif
