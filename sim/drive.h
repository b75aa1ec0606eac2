// Many steps: a script drives a simulator, as fast as possible or paced in real time. Input is sampled on simulated time, so pacing does not change any result.
#ifndef SELDINGER_SIM_DRIVE_H
#define SELDINGER_SIM_DRIVE_H

#include "sim/simulator.h"

#include <signal.h>

typedef enum { DRIVE_DONE, DRIVE_STOPPED, DRIVE_DIVERGED } DriveEnd;

// Paced: step i begins at base + i dt of real time and is due at base + (i + 1) dt, both absolute. A step that ends later is a missed deadline; the base then
// moves by its lateness. So simulated time falls behind real time permanently, by slowed_s in total: no step is skipped or shortened, which the operator would
// feel as a jump. At rest (`may_rest`) several steps are made at one wake-up, when the last of them begins: the others begin late, which nobody feels, but with
// caches that are still warm, in half the time. Inputs and results of a step are the same.
typedef struct DriveReport {
    DriveEnd end;
    double wall_s;
    int64_t deadline_misses;
    double slowed_s;                 // how far simulated time fell behind real time
    double latest_s;                 // largest lateness of a single step
    bool real_time_priority;         // paced with SCHED_FIFO; false if not permitted, so that other programs may delay steps
    bool settled;                    // nothing was faster than 0.01 mm/s during the last 0.1 s
} DriveReport;

typedef struct DriveOptions {
    const Script *script;            // NULL: no input …
    ToolCommands (*hand)(void *hand_context);   // … or this instead, called once before each step
    void *hand_context;
    // Paced, with `hand`: whether nobody notices that steps wait for up to 8 ms while nothing moves and no command is given. NULL: never.
    bool (*may_rest)(const void *hand_context);
    double duration_s;               // < 0: the script's
    double settle_s;                 // settling time after the script, at most: without input until nothing is faster than 0.01 mm/s for 0.1 s
    bool paced;                      // real time: a step begins when the last one's millisecond is over, see above
    const volatile sig_atomic_t *stop;   // NULL, or a flag: the run stops before the next step once it is not 0
    // After each step, on the simulation thread; false stops. May be NULL.
    bool (*after_step)(void *context, Simulator *simulator, const ToolCommands *commands);
    DriveReport *live;               // NULL, or counters of missed deadlines, updated (added to) during a paced run
    TimeHistogram *late_ns;          // NULL, or a histogram of how late each wake-up of a paced run was
    void *context;
} DriveOptions;

DriveOptions drive_default_options(void);
// Stops at the first diverged step: the state is the last good one.
DriveReport simulator_drive(Simulator *simulator, const DriveOptions *options);

#endif
