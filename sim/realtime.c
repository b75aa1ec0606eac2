#include "sim/realtime.h"

#include "sim/clock.h"
#include "sim/triple_buffer.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// How often the figures are recomputed [published poses]: quantiles of a histogram take a few us each.
enum { FIGURES_EVERY = 20 };

struct Realtime {
    RealtimeOptions options;
    HandSet hands;
    // from the operator to the thread
    TripleBuffer xray_buffer, grip_buffer;
    XrayControl xray[3];
    HandGrip grip[3];
    _Atomic int paused, ending;
    // from the thread to the window
    TripleBuffer moment_buffer;
    Moment moment[3];
    bool has_moment;         // read by the window only
    // used by the thread only
    pthread_t thread;
    XrayControl now;         // controls of this step
    double heard_s;          // real time of the window's last controls or grip
    int64_t pose_every, since_pose, moments;
    DriveReport live;
    TimeHistogram late_ns;
    RealtimeFigures figures;
    double factor_from_s;    // real and simulated time of the last figures
    double factor_from_simulated_s;
};

RealtimeOptions realtime_default_options(void) { return (RealtimeOptions){.pose_ms = 10, .xray = xray_default_control()}; }

// Lets everything go while the window is silent.
static void listen(Realtime *realtime, bool is_heard)
{
    double now_s = clock_s(CLOCK_MONOTONIC);
    if (is_heard)
        realtime->heard_s = now_s;
    bool is_silent = now_s - realtime->heard_s > realtime->options.patience_s;
    hand_set_let_go(&realtime->hands, is_silent);
    if (is_silent)
        realtime->now.pedal = realtime->now.contrast_ml_s = 0;
}

static ToolCommands read_hands(void *context)
{
    Realtime *realtime = context;
    bool has_xray = triple_buffer_fetch(&realtime->xray_buffer), has_grip = triple_buffer_fetch(&realtime->grip_buffer);
    if (has_xray)
        realtime->now = realtime->xray[realtime->xray_buffer.reading];
    if (has_grip)
        hand_set_grip(&realtime->hands, &realtime->grip[realtime->grip_buffer.reading]);
    if (realtime->options.patience_s > 0)
        listen(realtime, has_xray || has_grip);
    return hand_set_command(&realtime->hands, simulator_scene(realtime->options.simulator)->dt);
}

static bool may_rest(const void *context) { return !hand_set_has_device(&((const Realtime *)context)->hands); }

static void renew_figures(Realtime *realtime)
{
    RealtimeFigures *figures = &realtime->figures;
    const TimeHistogram *step = &simulator_profile(realtime->options.simulator)->step, *late = &realtime->late_ns;
    figures->deadline_misses = realtime->live.deadline_misses;
    figures->slowed_s = realtime->live.slowed_s;
    figures->latest_s = realtime->live.latest_s;
    figures->real_time_priority = realtime->live.real_time_priority;
    figures->step_us[0] = histogram_quantile(step, 0.5) / 1000;
    figures->step_us[1] = histogram_quantile(step, 0.999) / 1000;
    figures->step_us[2] = (double)step->largest / 1000;
    figures->late_us[0] = histogram_quantile(late, 0.5) / 1000;
    figures->late_us[1] = histogram_quantile(late, 0.99) / 1000;
    figures->late_us[2] = (double)late->largest / 1000;
    double real = clock_s(CLOCK_MONOTONIC), simulated = simulator_time_s(realtime->options.simulator);
    if (real - realtime->factor_from_s >= 1) {
        figures->real_time_factor = (simulated - realtime->factor_from_simulated_s) / (real - realtime->factor_from_s);
        realtime->factor_from_s = real;
        realtime->factor_from_simulated_s = simulated;
    }
}

static void publish(Realtime *realtime, const ToolCommands *commands)
{
    const RealtimeOptions *options = &realtime->options;
    Moment *moment = &realtime->moment[realtime->moment_buffer.writing];
    if (realtime->moments++ % FIGURES_EVERY == 0)
        renew_figures(realtime);
    pose_take(moment->pose, options->simulator, commands, &realtime->now);
    moment->figures = realtime->figures;
    if (options->publish)
        options->publish(options->context, moment->extra);
    triple_buffer_publish(&realtime->moment_buffer);
    realtime->since_pose = 0;
}

static bool after_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    Realtime *realtime = context;
    const RealtimeOptions *options = &realtime->options;
    const StepReport *report = simulator_last(simulator);
    hand_set_answer(&realtime->hands, report, simulator_totals(simulator)->steps);
    if (options->after_step)
        options->after_step(options->context, simulator, commands, &realtime->now);
    if (options->recording && !recording_step(options->recording, simulator, commands, &realtime->now))
        realtime->figures.state = REALTIME_UNRECORDED;
    if (report->flags & STEP_DIVERGED)
        realtime->figures.state = REALTIME_DIVERGED;
    if (++realtime->since_pose >= realtime->pose_every || realtime->figures.state != REALTIME_RUNNING)
        publish(realtime, commands);
    return realtime->figures.state == REALTIME_RUNNING && !atomic_load_explicit(&realtime->paused, memory_order_relaxed) &&
           !atomic_load_explicit(&realtime->ending, memory_order_relaxed);
}

static void nap(long milliseconds) { nanosleep(&(struct timespec){.tv_nsec = milliseconds * 1000000}, NULL); }

static void *run_session(void *argument)
{
    Realtime *realtime = argument;
    DriveOptions drive = drive_default_options();
    drive.hand = read_hands;
    drive.hand_context = realtime;
    drive.may_rest = may_rest;
    drive.duration_s = SCRIPT_LONGEST_S;
    drive.paced = true;
    drive.after_step = after_step;
    drive.context = realtime;
    drive.live = &realtime->live;
    drive.late_ns = &realtime->late_ns;
    publish(realtime, &(ToolCommands){0});
    while (!atomic_load(&realtime->ending) && realtime->figures.state < REALTIME_DIVERGED) {
        if (atomic_load(&realtime->paused)) {
            if (realtime->figures.state == REALTIME_RUNNING) {
                realtime->figures.state = REALTIME_PAUSED;
                publish(realtime, &(ToolCommands){0});
            }
            nap(2);
            continue;
        }
        realtime->figures.state = REALTIME_RUNNING;
        realtime->factor_from_s = clock_s(CLOCK_MONOTONIC);
        realtime->factor_from_simulated_s = simulator_time_s(realtime->options.simulator);
        simulator_drive(realtime->options.simulator, &drive);
    }
    return NULL;
}

static void realtime_free(Realtime *realtime)
{
    for (int i = 0; i < 3; i++) {
        pose_free(realtime->moment[i].pose);
        free(realtime->moment[i].extra);
    }
    free(realtime);
}

Realtime *realtime_start(const RealtimeOptions *options, Faults *faults)
{
    Realtime *realtime = calloc(1, sizeof *realtime);
    const Scene *scene = simulator_scene(options->simulator);
    bool good = realtime != NULL;
    for (int i = 0; good && i < 3; i++) {
        realtime->moment[i].pose = pose_create_for(options->simulator);
        realtime->moment[i].extra = calloc(1, options->extra_bytes + 1);
        good = realtime->moment[i].pose && realtime->moment[i].extra;
    }
    if (good) {
        realtime->options = *options;
        realtime->now = options->xray;
        realtime->factor_from_s = clock_s(CLOCK_MONOTONIC);
        realtime->factor_from_simulated_s = simulator_time_s(options->simulator);
        realtime->pose_every = (int64_t)fmax(1, floor(options->pose_ms / scene->dt + 0.5));
        hand_set_init(&realtime->hands, scene->tool_count);
        realtime->hands.grip = options->grip;
        for (int i = 0; i < options->hand_count; i++)
            good &= hand_set_add(&realtime->hands, options->hand[i]);
        triple_buffer_init(&realtime->xray_buffer);
        triple_buffer_init(&realtime->grip_buffer);
        triple_buffer_init(&realtime->moment_buffer);
        atomic_store(&realtime->paused, options->paused);
        good = good && pthread_create(&realtime->thread, NULL, run_session, realtime) == 0;
    }
    if (good)
        return realtime;
    faults_add(faults, scene->path, 0, 0, "cannot start a session: out of memory, or no thread available");
    if (realtime)
        realtime_free(realtime);
    return NULL;
}

void realtime_set_xray(Realtime *realtime, const XrayControl *xray)
{
    realtime->xray[realtime->xray_buffer.writing] = *xray;
    triple_buffer_publish(&realtime->xray_buffer);
}

void realtime_set_grip(Realtime *realtime, const HandGrip *grip)
{
    realtime->grip[realtime->grip_buffer.writing] = *grip;
    triple_buffer_publish(&realtime->grip_buffer);
}

void realtime_pause(Realtime *realtime, bool paused) { atomic_store(&realtime->paused, paused); }

const Moment *realtime_moment(Realtime *realtime)
{
    if (triple_buffer_fetch(&realtime->moment_buffer))
        realtime->has_moment = true;
    return realtime->has_moment ? &realtime->moment[realtime->moment_buffer.reading] : NULL;
}

double realtime_cpu_s(const Realtime *realtime)
{
    clockid_t clock;
    return pthread_getcpuclockid(realtime->thread, &clock) == 0 ? clock_s(clock) : 0;
}

RealtimeFigures realtime_stop(Realtime *realtime)
{
    atomic_store(&realtime->ending, true);
    pthread_join(realtime->thread, NULL);
    renew_figures(realtime);
    RealtimeFigures figures = realtime->figures;
    realtime_free(realtime);
    return figures;
}
