#include "sim/headless.h"

#include <math.h>
#include <stdlib.h>

int64_t headless_steps(const HeadlessOptions *options, const Scene *scene)
{
    double seconds = options->duration_s >= 0 ? options->duration_s : scene->script ? script_duration_s(scene->script) : 0;
    return (int64_t)ceil((seconds + fmax(options->settle_s, 0)) * 1000 / scene->dt) + 1;
}

bool headless_open(HeadlessRun *run, const HeadlessOptions *options, const Scene *scene, const OpenVessel *open, Faults *faults)
{
    run->options = options;
    run->simulator = simulator_create(scene, open->vessel, faults);
    if (!run->simulator)
        return false;
    run->node = calloc((size_t)stepper_node_capacity(simulator_stepper(run->simulator)), sizeof *run->node);
    bool good = run->node != NULL;
    if (options->has_moments)
        good = moments_open(&run->moments, run->simulator, options->moment_count, options->moment_s) && good;
    if (options->scores)
        good = (run->tracker = session_tracker_create(run->simulator, open->tree)) && good;
    if (!good)
        faults_add(faults, scene->path, 0, 0, "out of memory");
    simulator_watch_energy(run->simulator);
    return good;
}

static bool after_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    HeadlessRun *run = context;
    moments_step(&run->moments, simulator, commands);
    if (run->tracker)
        session_tracker_step(run->tracker, simulator, commands, NULL);
    if (run->watch)
        run->watch(run->context, run);
    if (run->recording && !recording_step(run->recording, simulator, commands, NULL))
        run->is_broken_off = true;
    return !run->is_broken_off;
}

bool headless_drive(HeadlessRun *run, ToolCommands (*hand)(void *context), void *hand_context, Faults *faults)
{
    const HeadlessOptions *options = run->options;
    const Scene *scene = simulator_scene(run->simulator);
    RecordingOptions record = recording_default_options();
    DriveOptions drive = drive_default_options();
    record.expected_steps = headless_steps(options, scene);
    if (options->record && !(run->recording = recording_create(options->record, run->simulator, &record, faults)))
        return false;
    drive.script = hand ? NULL : scene->script;
    drive.hand = hand;
    drive.hand_context = hand_context;
    drive.duration_s = options->duration_s;
    drive.settle_s = fmax(options->settle_s, 0);
    drive.paced = options->paced;
    drive.stop = options->stop;
    drive.after_step = after_step;
    drive.context = run;
    run->report = simulator_drive(run->simulator, &drive);
    stepper_node_report(simulator_stepper(run->simulator), run->node);
    moments_end(&run->moments, run->simulator);
    run->is_whole = !run->recording || recording_close(run->recording, run->simulator, faults);
    run->is_whole &= run->report.end != DRIVE_DIVERGED;
    run->recording = NULL;
    return true;
}

void headless_close(HeadlessRun *run)
{
    recording_abandon(run->recording);
    session_tracker_free(run->tracker);
    moments_close(&run->moments);
    free(run->node);
    simulator_destroy(run->simulator);
    *run = (HeadlessRun){0};
}
