// A live session: a simulator with its score and contrast agent, stepped by the 1 kHz thread and recorded from the first step. `run --device` is a
// session without a window.
#ifndef SELDINGER_SIM_LIVE_SESSION_H
#define SELDINGER_SIM_LIVE_SESSION_H

#include "sim/open_vessel.h"
#include "sim/realtime.h"
#include "sim/session_tracker.h"

typedef struct LiveSession {
    const Scene *scene;
    Simulator *simulator;
    SessionTracker *tracker;
    Recording *recording;        // NULL: not recorded
    Realtime *realtime;
    char record_path[4096];      // "" if not recorded
    double resumed_s;            // simulated time taken over from an earlier recording …
    unsigned resumed_released;   // … the tools released at that time (ToolCommands) …
    int resumed_fitted[TOOLS_MOST];  // … and the devices requested last
} LiveSession;

typedef struct LiveSessionOptions {
    const char *record_path;     // NULL: not recorded
    const char *trainee, *date;  // trainee and start time (session_date()), stored in the recording; NULL: not a trainee's session
    int hand_count;
    HandPort *const *hand;       // (hand_count)
    HandGrip grip;               // grip at the start; in a resumed session the tools in `resumed_released` are released too, and `fitted` is `resumed_fitted`
    XrayControl xray;            // X-ray controls at the start; also used in a resumed session
    const RecordedRun *resume;   // NULL, or a recording to be simulated first, as fast as possible …
    double resume_s;             // … up to this time
    void (*progress)(void *context, double part);    // progress of that simulation; may be NULL
    void *progress_context;
    bool paused;
    double patience_s;               // see RealtimeOptions
} LiveSessionOptions;

// Returns false with faults and leaves nothing open. A resumed recording that does not reproduce its own states is refused.
bool live_session_open(LiveSession *session, const Scene *scene, const OpenVessel *open, const LiveSessionOptions *options, Faults *faults);
// Stops the thread and closes the recording; simulator and tracker stay available. Returns false with a fault if the recording is incomplete.
bool live_session_stop(LiveSession *session, RealtimeFigures *figures, Faults *faults);
void live_session_free(LiveSession *session);   // after stop, or if it never opened

#endif
