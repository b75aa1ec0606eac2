// A run without a viewer: a script or hands drive a simulator, and the requested results are kept: recording, score, moments for pictures.
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
    int moment_count;                // 0: only the end of the run
    double moment_s[MOMENTS_MOST];
    double duration_s, settle_s;     // < 0: the script's duration; no settling
    bool paced;
    const volatile sig_atomic_t *stop;
} HeadlessOptions;

typedef struct HeadlessRun {         // zeroed by the caller of headless_open()
    const HeadlessOptions *options;
    Simulator *simulator;
    NodeReport *node;                // of the last state
    SessionTracker *tracker;
    Moments moments;
    Recording *recording;            // while it is recorded
    DriveReport report;
    bool is_whole;                   // it did not diverge, its recording did not fail, and it was not cut short
    bool is_broken_off;              // the recording failed: the run ended before the requested time
    // called after each step; may be NULL
    void (*watch)(void *context, const struct HeadlessRun *run);
    void *context;
} HeadlessRun;

// The largest number of steps that the run can take.
int64_t headless_steps(const HeadlessOptions *options, const Scene *scene);
// `options` and the vessel must outlive the run. Returns false with faults; headless_close() must be called in either case.
bool headless_open(HeadlessRun *run, const HeadlessOptions *options, const Scene *scene, const OpenVessel *open, Faults *faults);
// `hand` (NULL: the scene's script) returns each step's commands. Returns false with a fault if the run did not begin because no recording can be written.
bool headless_drive(HeadlessRun *run, ToolCommands (*hand)(void *context), void *hand_context, Faults *faults);
// Removes a recording that was begun but not driven.
void headless_close(HeadlessRun *run);

#endif
