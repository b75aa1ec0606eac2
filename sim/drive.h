// Many steps: a script drives a simulator, as fast as it goes or paced at the simulated clock's speed. Input is sampled on simulated time,
// so pacing changes no result.
#ifndef SELDINGER_SIM_DRIVE_H
#define SELDINGER_SIM_DRIVE_H

#include "sim/simulator.h"

#include <signal.h>

typedef struct DriveOptions {
    const Script *script;            // NULL: no input
    double duration_s;               // < 0: the script's
    double settle_s;                 // afterwards, without input, at most this long, until nothing is faster than 0.01 mm/s for 0.1 s
    bool paced;                      // a step begins at its absolute deadline; missed deadlines are counted, no step is skipped
    const volatile sig_atomic_t *stop;   // NULL, or stops before the next step once it is not 0
    // After each step, on the simulation thread; false stops. May be NULL.
    bool (*after_step)(void *context, Simulator *simulator, Command command);
    void *context;
} DriveOptions;

typedef enum { DRIVE_DONE, DRIVE_STOPPED, DRIVE_DIVERGED } DriveEnd;

typedef struct DriveReport {
    DriveEnd end;
    double wall_s;
    int64_t deadline_misses;
    bool settled;                    // nothing was faster than 0.01 mm/s during the last 0.1 s
} DriveReport;

DriveOptions drive_default_options(void);
// Stops at the first diverged step: the state is the last good one.
DriveReport simulator_drive(Simulator *simulator, const DriveOptions *options);

#endif
