// A scene with the key `verify:` run with one of its numbers of elements and measured (sim/verify.h).
#ifndef SELDINGER_SIM_VERIFY_RUN_H
#define SELDINGER_SIM_VERIFY_RUN_H

#include "sim/open_vessel.h"
#include "sim/verify.h"

typedef struct VerifyScene {
    Scene *scene;
    OpenVessel open;
} VerifyScene;

typedef struct VerifyRun {   // a scene with one number of elements
    const VerifyScene *of;
    int elements;
    double result[VERIFY_MOST_CASES];
    unsigned flags;
    bool diverged, rested;
    double wall_s;           // time that the run took
    Faults faults;
} VerifyRun;

// A job of parallel_for(): run `index` of the array `runs`, whose `of` and `elements` are set.
void verify_run_job(void *runs, long index);

#endif
