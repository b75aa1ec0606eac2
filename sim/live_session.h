// One session at the trainer: a simulator with its score and contrast agent, stepped by the 1 kHz thread, recorded from the first step on.
// Headless too: `run --device` is a session without a window.
#ifndef SELDINGER_SIM_LIVE_SESSION_H
#define SELDINGER_SIM_LIVE_SESSION_H

#include "sim/lesson.h"
#include "sim/open_vessel.h"
#include "sim/realtime.h"

typedef struct LiveSession {
    const Scene *scene;
    Simulator *simulator;
    Lesson *lesson;
    Recording *recording;        // NULL: not recorded
    Realtime *realtime;
    char record_path[4096];      // "" where not recorded
    double resumed_s;            // simulated time that was taken over from an earlier recording …
    unsigned resumed_released;   // … the tools that no hand held then (ToolCommands) …
    int resumed_fitted[TOOLS_MOST];  // … and which devices were asked for last
} LiveSession;

typedef struct LiveSessionOptions {
    const char *record_path;     // NULL: not recorded
    const char *trainee, *date;  // who practises and since when (session_date()), kept in the recording; NULL: no trainee's session
    int hand_count;
    HandPort *const *hand;       // (hand_count)
    HandGrip grip;               // at the start; of a resumed session `resumed_released` are let go too, and `fitted` is `resumed_fitted`
    XrayControl xray;            // the same
    const RecordedRun *resume;   // NULL, or what is gone through first, as fast as it goes …
    double resume_s;             // … up to this time
    void (*progress)(void *context, double part);    // how much of that is done, now and then; NULL: nobody asks
    void *progress_context;
    bool paused;
} LiveSessionOptions;

// False with faults; then nothing is left open. A resumed recording that does not give its own states again is refused.
bool live_session_open(LiveSession *session, const Scene *scene, const OpenVessel *open, const LiveSessionOptions *options, Faults *faults);
// Stops the thread and closes the recording; simulator and lesson stay to be asked. False with a fault where the recording is not whole.
bool live_session_stop(LiveSession *session, RealtimeFigures *figures, Faults *faults);
void live_session_free(LiveSession *session);   // after stop, or of one that never opened

#endif
