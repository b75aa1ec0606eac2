#include "sim/live_session.h"

#include "sim/replay.h"

#include <stdio.h>
#include <string.h>

typedef struct TakeOver {
    LiveSession *session;
    const LiveSessionOptions *options;
    int64_t done, steps;
} TakeOver;

static bool take_over_step(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    enum { REPORT_INTERVAL = 64 };
    TakeOver *take_over = context;
    LiveSession *session = take_over->session;
    if (take_over->options->progress && ++take_over->done % REPORT_INTERVAL == 0)
        take_over->options->progress(take_over->options->progress_context, (double)take_over->done / (double)take_over->steps);
    session_tracker_step(session->tracker, simulator, commands, xray);
    session->resumed_released = commands->released;
    memcpy(session->resumed_fitted, commands->fitted, sizeof session->resumed_fitted);
    return !session->recording || recording_step(session->recording, simulator, commands, xray);
}

static bool take_over(LiveSession *session, const LiveSessionOptions *options, Faults *faults)
{
    const RecordedRun *run = options->resume;
    int64_t steps = 0;
    if (!replay_fits(run, session->simulator, faults))
        return false;
    while (steps < run->step_count && run->time_s[steps] <= options->resume_s + 1e-9)
        steps++;
    TakeOver through = {session, options, 0, steps};
    ReplayVerdict verdict = replay_verify(session->simulator, run, steps, false, take_over_step, &through);
    session->resumed_s = simulator_time_s(session->simulator);
    if (verdict.first_different < 0)
        return true;
    faults_add(faults, session->scene->path, 0, 0,
               "the recording cannot be resumed: step %lld gives another state than the recorded one; see `seldinger replay --verify`",
               (long long)verdict.first_different);
    return false;
}

bool live_session_open(LiveSession *session, const Scene *scene, const OpenVessel *open, const LiveSessionOptions *options, Faults *faults)
{
    *session = (LiveSession){.scene = scene};
    session->simulator = simulator_create(scene, open->vessel, faults);
    session->tracker = session->simulator ? session_tracker_create(session->simulator, open->tree) : NULL;
    if (session->simulator && !session->tracker)
        faults_add(faults, scene->path, 0, 0, "not enough memory for a session");
    if (session->tracker && options->record_path) {
        RecordingOptions record = recording_session_options();
        record.trainee = options->trainee;
        record.date = options->date;
        const XrayPatient patient = xray_patient_around(open->tree, scene->patient_anterior, scene->patient_superior);
        record.patient = &patient;
        snprintf(session->record_path, sizeof session->record_path, "%s", options->record_path);
        session->recording = recording_create(options->record_path, session->simulator, &record, faults);
    }
    bool good = session->tracker && (session->recording || !options->record_path) && (!options->resume || take_over(session, options, faults));
    if (good) {
        RealtimeOptions realtime = realtime_default_options();
        realtime.simulator = session->simulator;
        realtime.recording = session->recording;
        realtime.hand_count = options->hand_count;
        realtime.hand = options->hand;
        realtime.grip = options->grip;
        realtime.grip.released |= session->resumed_released;
        if (options->resume)
            memcpy(realtime.grip.fitted, session->resumed_fitted, sizeof session->resumed_fitted);
        realtime.xray = options->xray;
        realtime.paused = options->paused;
        realtime.patience_s = options->patience_s;
        realtime.after_step = session_tracker_step;
        realtime.publish = session_tracker_publish;
        realtime.context = session->tracker;
        realtime.extra_bytes = session_tracker_view_bytes(session->tracker);
        session->realtime = realtime_start(&realtime, faults);
        good = session->realtime != NULL;
    }
    if (good)
        return true;
    recording_abandon(session->recording);
    live_session_free(session);
    return false;
}

bool live_session_stop(LiveSession *session, RealtimeFigures *figures, Faults *faults)
{
    *figures = realtime_stop(session->realtime);
    session->realtime = NULL;
    bool whole = !session->recording || recording_close(session->recording, session->simulator, faults);
    session->recording = NULL;
    return whole;
}

void live_session_free(LiveSession *session)
{
    session_tracker_free(session->tracker);
    simulator_destroy(session->simulator);
    *session = (LiveSession){0};
}
