#include "sim/drive.h"

#include <errno.h>
#include <time.h>

static const double rest_speed_mm_s = 0.01;
// A swinging wire stands still at each turning point: only a pause this long is rest. What swings at 1 Hz and passes it moves 1.3 um.
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

static double last_ramp_s(const Scene *scene)
{
    double end = 0;
    for (int i = 0; i < scene->wire.load_count; i++)
        end = fmax(end, scene->wire.load[i].ramp / 1000);
    return end;
}

DriveOptions drive_default_options(void) { return (DriveOptions){.duration_s = -1}; }

DriveReport simulator_drive(Simulator *simulator, const DriveOptions *options)
{
    DriveReport report = {.end = DRIVE_DONE};
    const Scene *scene = simulator_scene(simulator);
    double step_s = scene->dt / 1000, ramp_s = last_ramp_s(scene), at_rest_s = 0;
    double duration = options->duration_s >= 0 ? options->duration_s : options->script ? script_duration_s(options->script) : 0;
    int64_t driven = (int64_t)ceil(duration / step_s - 1e-6), settling = (int64_t)ceil(options->settle_s / step_s - 1e-6);
    int64_t begin = wall_ns(), step_ns = (int64_t)(scene->dt * 1e6 + 0.5);
    int cursor = 0;

    for (int64_t i = 0; i < driven + settling; i++) {
        if (options->stop && *options->stop) {
            report.end = DRIVE_STOPPED;
            break;
        }
        if (i >= driven && at_rest_s >= rest_hold_s && simulator_time_s(simulator) >= ramp_s)
            break;
        if (options->paced)
            sleep_until(begin + i * step_ns);
        bool scripted = options->script && i < driven;
        Command command = scripted ? script_at(options->script, (double)i * scene->dt / 1000, &cursor) : (Command){0, 0};
        simulator_step(simulator, command);
        at_rest_s = simulator_fastest_mm_s(simulator) <= rest_speed_mm_s ? at_rest_s + step_s : 0;
        if (options->paced && wall_ns() > begin + (i + 1) * step_ns)
            report.deadline_misses++;
        if (options->after_step && !options->after_step(options->context, simulator, command)) {
            report.end = DRIVE_STOPPED;
            break;
        }
        if (simulator_last(simulator)->flags & STEP_DIVERGED) {
            report.end = DRIVE_DIVERGED;
            break;
        }
    }
    report.wall_s = (double)(wall_ns() - begin) * 1e-9;
    report.settled = report.end != DRIVE_DIVERGED && at_rest_s >= rest_hold_s - step_s / 2 && simulator_time_s(simulator) >= ramp_s;
    return report;
}
