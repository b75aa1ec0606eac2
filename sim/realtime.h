// The 1 kHz thread: owns a simulator, takes commands from input devices and controls from the operator, steps in real time, and publishes poses for
// drawing. No locks: devices write ports (input/hand_port.h); the operator's controls and grip and the poses go through triple buffers. Simulator and
// recording belong to it from start to stop.
//
// A diverging step ends the session: the state is the last good one, and the pose reports it. Nothing resets automatically.
#ifndef SELDINGER_SIM_REALTIME_H
#define SELDINGER_SIM_REALTIME_H

#include "sim/drive.h"
#include "sim/hand_set.h"
#include "sim/pose.h"
#include "sim/recording.h"

typedef struct Realtime Realtime;

typedef struct RealtimeOptions {
    Simulator *simulator;
    Recording *recording;            // NULL: none
    int hand_count;                  // at most HANDS_SAMPLED
    HandPort *const *hand;           // (hand_count) borrowed, each with one writer
    HandGrip grip;                   // initial grip: default the first tool selected, none locked or released
    XrayControl xray;                // initial X-ray controls
    double pose_ms;                  // simulated time between published poses, default 10
    bool paused;                     // at the start
    // [s] If the window has set neither controls nor grip for so long, all is let go until it does: the tools stand still, X-rays and contrast agent are off.
    // A key that is held while no picture comes would otherwise push blindly. 0: never.
    double patience_s;
    // On the thread, after each step; must not wait. May be NULL.
    void (*after_step)(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray);
    // On the thread, with each published pose: fills the additional data (`extra_bytes`). May be NULL.
    void (*publish)(void *context, void *extra);
    void *context;
    size_t extra_bytes;
} RealtimeOptions;
RealtimeOptions realtime_default_options(void);

typedef enum {
    REALTIME_RUNNING,
    REALTIME_PAUSED,
    REALTIME_DIVERGED,
    REALTIME_UNRECORDED      // the recording failed, and the session stopped with it
} RealtimeState;

typedef struct RealtimeFigures {
    RealtimeState state;
    int64_t deadline_misses;
    double slowed_s, latest_s;       // see DriveReport
    bool real_time_priority;
    double step_us[3];               // CPU time of a step: median, p99.9, worst
    double late_us[3];               // wake-up latency of the thread: median, p99, worst
    double real_time_factor;         // simulated time over real time, over the last second of running
} RealtimeFigures;

typedef struct Moment {
    Pose *pose;
    RealtimeFigures figures;
    void *extra;                     // (extra_bytes)
} Moment;

// Starts the thread. Returns NULL with a fault if that fails.
Realtime *realtime_start(const RealtimeOptions *options, Faults *faults);
// The following calls are for one thread, the window's.
void realtime_set_xray(Realtime *realtime, const XrayControl *xray);
void realtime_set_grip(Realtime *realtime, const HandGrip *grip);
void realtime_pause(Realtime *realtime, bool paused);
// The newest published pose; unchanged until the next call. NULL before the first.
const Moment *realtime_moment(Realtime *realtime);
double realtime_cpu_s(const Realtime *realtime);   // CPU time of the thread so far [s]
// Ends and joins the thread, frees, and returns the figures of the whole session. Simulator and recording belong to the caller again.
RealtimeFigures realtime_stop(Realtime *realtime);

#endif
