#include "sim/drive.h"

#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <string.h>
#include <time.h>

static const double rest_speed_mm_s = 0.01;
// A swinging wire is at rest at each turning point, so only a pause this long counts as rest. A swing of 1 Hz that passes this test has an amplitude of 1.3 um.
static const double rest_hold_s = 0.1;

static int64_t wall_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void sleep_until(int64_t deadline_ns)
{
    struct timespec at = {.tv_sec = deadline_ns / 1000000000, .tv_nsec = deadline_ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL) == EINTR)
        ;
}

// The calling thread's scheduling while it is paced. Existing threads keep theirs.
typedef struct Priority {
    int policy;
    struct sched_param parameter;
    bool raised;
} Priority;

static Priority priority_raise(void)
{
    Priority before = {0};
    const struct sched_param low = {.sched_priority = sched_get_priority_min(SCHED_FIFO)};   // above every ordinary thread, below the system's own
    if (pthread_getschedparam(pthread_self(), &before.policy, &before.parameter) == 0)
        before.raised = pthread_setschedparam(pthread_self(), SCHED_FIFO, &low) == 0;
    return before;
}

static void priority_restore(const Priority *before)
{
    if (before->raised)
        pthread_setschedparam(pthread_self(), before->policy, &before->parameter);
}

// The most steps that wait for one wake-up, and the part of a step's time that they may take together.
enum { REST_STEPS = 8 };
static const double rest_share = 0.5;

static bool is_still(const ToolCommands *commands)
{
    bool still = commands->contrast_ml_s == 0;
    for (int k = 0; k < TOOLS_MOST; k++)
        still &= commands->tool[k].push_mm_s == 0 && commands->tool[k].twist_deg_s == 0;
    return still;
}

// The number of steps to make at the next wake-up.
static int64_t steps_at_once(const Simulator *simulator, const DriveOptions *options, const ToolCommands *commands, double at_rest_s, int64_t step_ns)
{
    if (!options->hand || !options->may_rest || at_rest_s < rest_hold_s || !is_still(commands) || !options->may_rest(options->hand_context))
        return 1;
    int64_t cost_ns = simulator_step_ns(simulator);
    return (int64_t)fmax(1, fmin(REST_STEPS, rest_share * (double)step_ns / fmax(1, (double)cost_ns)));
}

// After a step of a paced run: counts a missed deadline.
static void count_late(DriveReport *report, int64_t late)
{
    report->deadline_misses++;
    report->slowed_s += (double)late * 1e-9;
    report->latest_s = fmax(report->latest_s, (double)late * 1e-9);
}

static void keep_pace(DriveReport *report, DriveReport *live, int64_t *base, int64_t due)
{
    int64_t late = wall_ns() - due;
    if (late <= 0)
        return;
    *base += late;
    count_late(report, late);
    if (live)
        count_late(live, late);
}

static double last_ramp_s(const Scene *scene)
{
    double end = 0;
    for (int i = 0; i < scene->wire.load_count; i++)
        end = fmax(end, scene->wire.load[i].ramp / 1000);
    return end;
}

// Commands without motion, with the exchanged devices kept inserted.
static ToolCommands settled(const ToolCommands *last)
{
    ToolCommands commands = {0};
    memcpy(commands.fitted, last->fitted, sizeof commands.fitted);
    return commands;
}

DriveOptions drive_default_options(void) { return (DriveOptions){.duration_s = -1}; }

DriveReport simulator_drive(Simulator *simulator, const DriveOptions *options)
{
    DriveReport report = {.end = DRIVE_DONE};
    const Scene *scene = simulator_scene(simulator);
    double step_s = scene->dt / 1000, ramp_s = last_ramp_s(scene), at_rest_s = 0;
    double duration = options->duration_s >= 0 ? options->duration_s : options->script ? script_duration_s(options->script) : 0;
    int64_t driven = (int64_t)ceil(duration / step_s - 1e-6), settling = (int64_t)ceil(options->settle_s / step_s - 1e-6);
    Priority priority = options->paced ? priority_raise() : (Priority){0};
    report.real_time_priority = priority.raised;
    if (options->live)
        options->live->real_time_priority = priority.raised;
    int64_t begin = wall_ns(), base = begin, step_ns = (int64_t)(scene->dt * 1e6 + 0.5), last_of_wake = -1;
    int cursor = 0;
    ToolCommands commands = {0};

    for (int64_t i = 0; i < driven + settling; i++) {
        if (options->stop && *options->stop) {
            report.end = DRIVE_STOPPED;
            break;
        }
        if (i >= driven && at_rest_s >= rest_hold_s && simulator_time_s(simulator) >= ramp_s)
            break;
        if (options->paced && i > last_of_wake) {
            last_of_wake = i + steps_at_once(simulator, options, &commands, at_rest_s, step_ns) - 1;
            sleep_until(base + last_of_wake * step_ns);
            if (options->late_ns)
                histogram_add(options->late_ns, wall_ns() - (base + last_of_wake * step_ns));
        }
        bool scripted = options->script && i < driven;
        if (scripted)
            commands = script_tools_at(options->script, (double)i * scene->dt / 1000, &cursor);
        else if (options->hand && i < driven)
            commands = options->hand(options->hand_context);
        else
            commands = settled(&commands);
        simulator_step(simulator, &commands);
        at_rest_s = simulator_fastest_mm_s(simulator) <= rest_speed_mm_s ? at_rest_s + step_s : 0;
        bool keeps_running = !options->after_step || options->after_step(options->context, simulator, &commands);
        if (options->paced && i == last_of_wake)
            keep_pace(&report, options->live, &base, base + (i + 1) * step_ns);
        if (!keeps_running) {
            report.end = DRIVE_STOPPED;
            break;
        }
        if (simulator_last(simulator)->flags & STEP_DIVERGED) {
            report.end = DRIVE_DIVERGED;
            break;
        }
    }
    report.wall_s = (double)(wall_ns() - begin) * 1e-9;
    priority_restore(&priority);
    report.settled = report.end != DRIVE_DIVERGED && at_rest_s >= rest_hold_s - step_s / 2 && simulator_time_s(simulator) >= ramp_s;
    return report;
}
