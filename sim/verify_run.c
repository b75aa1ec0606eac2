#include "sim/verify_run.h"

#include "sim/drive.h"

#include <math.h>

static const double rest_hold_s = 0.1;           // a pause shorter than this is a turning point
enum { REST_HOLD_STEPS = 3 };

typedef struct Watch {
    VerifyMeasure *measure;
    const VerifyPlan *plan;
    double driven_s, at_rest_s, hold_s, step_s, ramp_s;
    bool rested;
} Watch;

static bool after_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    (void)commands;
    Watch *watch = context;
    double time_s = simulator_time_s(simulator);
    verify_measure_step(watch->measure, false);
    bool slow = simulator_fastest_mm_s(simulator) <= watch->plan->rest_speed_mm_s;
    watch->at_rest_s = slow ? watch->at_rest_s + watch->step_s : 0;
    watch->rested = watch->at_rest_s >= watch->hold_s && time_s >= watch->ramp_s;
    return !(watch->rested && time_s >= watch->driven_s - watch->step_s / 2);
}

static void drive(VerifyRun *run, const Scene *scene, Simulator *simulator)
{
    const VerifyPlan *plan = &scene->verify;
    Watch watch = {.measure = verify_measure_create(plan, simulator), .plan = plan, .step_s = scene->dt / 1000};
    if (!watch.measure) {
        faults_add(&run->faults, scene->path, 0, 0, "out of memory");
        return;
    }
    watch.hold_s = fmax(rest_hold_s, REST_HOLD_STEPS * watch.step_s) - watch.step_s / 2;
    watch.driven_s = plan->duration_s >= 0 ? plan->duration_s : scene->script ? script_duration_s(scene->script) : 0;
    for (int i = 0; i < scene->wire.load_count; i++)
        watch.ramp_s = fmax(watch.ramp_s, scene->wire.load[i].ramp / 1000);
    DriveOptions options = drive_default_options();
    options.script = scene->script;
    options.duration_s = watch.driven_s;
    // rest is detected by after_step, which is stricter than the criterion of `run`
    bool settles = plan->rest_s > 0;
    options.context = &watch;
    options.after_step = after_step;
    verify_measure_step(watch.measure, false);
    if (settles)
        options.duration_s += plan->rest_s;
    else
        watch.driven_s = HUGE_VAL;
    DriveReport report = simulator_drive(simulator, &options);
    run->diverged = report.end == DRIVE_DIVERGED;
    run->wall_s = report.wall_s;
    run->rested = !settles || watch.rested;
    run->flags = simulator_totals(simulator)->flags;
    verify_measure_step(watch.measure, true);
    for (int i = 0; i < plan->case_count; i++)
        run->result[i] = verify_measure_result(watch.measure, i);
    verify_measure_free(watch.measure);
}

void verify_run_job(void *context, long index)
{
    VerifyRun *run = &((VerifyRun *)context)[index];
    const Scene *read = run->of->scene;
    Scene scene = *read;     // shares all but the numbers of elements
    scene.wire.elements = run->elements;
    for (int k = 1; k < scene.tool_count; k++)
        scene.tool[k].wire.elements = (int)fmax(1, floor((double)read->tool[k].wire.elements * run->elements / read->wire.elements + 0.5));
    Simulator *simulator = simulator_create(&scene, run->of->open.vessel, &run->faults);
    if (simulator)
        drive(run, &scene, simulator);
    simulator_destroy(simulator);
}
