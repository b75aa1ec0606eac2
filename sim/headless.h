// A run that nobody watches: a script or hands drive a simulator, and what was asked for is kept of it: recording, score, moments for pictures.
#ifndef SELDINGER_SIM_HEADLESS_H
#define SELDINGER_SIM_HEADLESS_H

#include "sim/drive.h"
#include "sim/moments.h"
#include "sim/open_vessel.h"
#include "sim/session_tracker.h"

typedef struct HeadlessOptions {
    const char *record;              // NULL: no recording
    bool scores;                     // also keep the score
    bool has_moments;
    int moment_count;                // 0: the end alone
    double moment_s[MOMENTS_MOST];
    double duration_s, settle_s;     // < 0: the script's, none
    bool paced;
    const volatile sig_atomic_t *stop;
} HeadlessOptions;

typedef struct HeadlessRun {         // zeroed by whoever opens it
    const HeadlessOptions *options;
    Simulator *simulator;
    NodeReport *node;                // of the last state
    SessionTracker *tracker;
    Moments moments;
    Recording *recording;            // while it runs
    DriveReport report;
    bool is_whole;                   // it did not diverge, and neither was the recording broken off nor is it cut short
    bool is_broken_off;              // the recording could not go on: it is another run than was asked for
    // after each step; NULL
    void (*watch)(void *context, const struct HeadlessRun *run);
    void *context;
} HeadlessRun;

// How many steps the run takes at most.
int64_t headless_steps(const HeadlessOptions *options, const Scene *scene);
// `options` and the vessel must outlive the run. False with faults; headless_close() is due all the same.
bool headless_open(HeadlessRun *run, const HeadlessOptions *options, const Scene *scene, const OpenVessel *open, Faults *faults);
// `hand` (NULL: the scene's script) is asked for each step's commands. False with a fault where it did not begin: no recording can be written.
bool headless_drive(HeadlessRun *run, ToolCommands (*hand)(void *context), void *hand_context, Faults *faults);
// Leaves no part of a recording that was begun and not driven.
void headless_close(HeadlessRun *run);

#endif
