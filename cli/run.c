// seldinger run: runs a scene headless and writes summary, final state, recording, picture.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/run_options.h"
#include "sim/sim.h"

#include <string.h>

// Reads scene and script and checks all output files, so that one pass reports everything that is wrong before the run.
static Scene *prepare_scene(const RunOptions *run, Faults *faults)
{
    Scene *scene = scene_load(run->scene, faults);
    if (run->script)
        scene_use_script(scene, run->script, faults);
    OutputPlan plan = {.faults = faults};
    run_files_plan(&run->files, &plan);
    output_plan_read_scene(&plan, scene);
    output_plan_read(&plan, "--script", run->script);
    for (int i = 0; i < run->device_count; i++)
        output_plan_read(&plan, "--device", run->device[i]);
    if (scene && run->contact >= 0)
        scene->contact = run_contact_kind[run->contact];
    if (scene && !scene->script && run->headless.duration_s < 0 && run->headless.settle_s < 0)
        faults_add(faults, run->scene, 0, 0, "has no script; give --script F, --duration-s S or --settle-s S");
    return scene;
}

typedef struct Run {         // state of one call of the verb
    Scene *scene;
    OpenVessel open;
    HeadlessRun headless;
    RunChart *chart;
    RunHands *hands;
} Run;

static void watch_step(void *context, const HeadlessRun *headless)
{
    Run *run = context;
    if (run->hands)
        run_hands_answer(run->hands, simulator_last(headless->simulator), simulator_totals(headless->simulator)->steps);
    if (run->chart)
        run_chart_step(run->chart, headless->simulator);
}

// Opens simulator, chart and hands. False with faults.
static bool begin(Run *run, const RunOptions *wanted, Faults *faults)
{
    if (!headless_open(&run->headless, &wanted->headless, run->scene, &run->open, faults))
        return false;
    run->headless.watch = watch_step;
    run->headless.context = run;
    if (wanted->files.chart && !(run->chart = run_chart_create(headless_steps(&wanted->headless, run->scene))))
        faults_add(faults, run->scene->path, 0, 0, "out of memory");
    else if (wanted->device_count)
        run->hands = run_hands_open(wanted->device_count, wanted->device, run->scene, faults);
    return faults->count == 0;
}

static int simulate(Run *run, const RunOptions *wanted, Faults *faults)
{
    HeadlessRun *headless = &run->headless;
    const char *contact = wanted->contact < 0 ? NULL : run_contact[wanted->contact];
    if (!headless_drive(headless, run->hands ? run_hands_command : NULL, run->hands, faults))
        return EXIT_BAD_INPUT;
    if (wanted->headless.paced && !headless->report.real_time_priority && !wanted->quiet)
        fprintf(stderr, "seldinger run: SCHED_FIFO is not permitted here (see `ulimit -r` and CAP_SYS_NICE); without real-time priority other programs "
                        "delay steps\n");
    // a run that ended early because its recording failed is not the requested run: write no other files
    bool good = headless->is_broken_off || run_files_write(&wanted->files, headless, &run->open, run->chart, contact, faults);
    if (!wanted->quiet)
        run_print(wanted->files.summary && !strcmp(wanted->files.summary, "-") ? stderr : stdout, headless->simulator, &headless->report, headless->node);
    run_print_warnings(stderr, headless->simulator, &headless->report);
    return good && headless->is_whole && !run_left_vessel(simulator_totals(headless->simulator)) ? EXIT_DONE : EXIT_UNTRUSTED;
}

static int call(void *structure, Faults *faults)
{
    RunOptions *wanted = structure;
    Run run = {0};
    int code = EXIT_BAD_INPUT;
    recording_prepare_process();
    wanted->headless.stop = process_stop_in_order();
    run.scene = prepare_scene(wanted, faults);
    if (faults->count == 0 && cli_open_scene(run.scene, wanted->threads, wanted->quiet, &run.open, faults) && begin(&run, wanted, faults))
        code = simulate(&run, wanted, faults);
    run_hands_close(run.hands);
    run_chart_free(run.chart);
    headless_close(&run.headless);
    open_vessel_close(&run.open);
    scene_free(run.scene);
    return code;
}

const Verb run_verb = {.options = &run_options, .call = call};
