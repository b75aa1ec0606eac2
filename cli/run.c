// seldinger run: a scene headless, with what it leaves: summary, final state, recording, picture.
#include "cli/cli.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/process.h"
#include "cli/output_plan.h"
#include "cli/run_chart.h"
#include "cli/run_hands.h"
#include "sim/lesson.h"
#include "sim/pose.h"
#include "sim/recording.h"
#include "sim/run_summary.h"
#ifdef SELDINGER_RENDER
#include "render/picture.h"
#endif

#include <getopt.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_MOMENTS = 6 };

typedef struct RunOptions {
    const char *scene, *script, *record, *summary, *final, *picture, *chart, *contact, *score;
    const char *device[RUN_MAPS];
    int device_count;
    double duration_s, settle_s;   // < 0: not given
    double moment_s[MOST_MOMENTS];
    int moment_count;
    int threads;
    bool paced, quiet;
} RunOptions;

static const char help[] =
    "Usage: seldinger run SCENE [options]\n\n"
    "Runs a scene (YAML) headless, as fast as it goes, and prints a short summary.\n\n"
    "  --script F         script of the hand (CSV t_s,push_mm_s,twist_deg_s) instead of the scene's; of several tools\n"
    "                     t_s,NAME.push_mm_s,NAME.twist_deg_s,…; a further column released, NAME.released, is 1 where no hand holds it\n"
    "  --device F.yaml    instead of a script a device drives, by this map or (auto) a built-in one: the first tool, or that of the map's key `tool`; paced;\n"
    "                     repeated for up to 8 maps. Needs --duration-s\n"
    "  --duration-s S     simulated time [s]; default: the script's; needed where there is no script\n"
    "  --settle-s S       afterwards goes on without input for at most S [s], until nothing moves faster than 0.01 mm/s; default 0\n"
    "  --record F.h5      recording (HDF5): every step's figures, the wire every 10 ms; readable while it is written\n"
    "  --summary F.json   figures of the run; - is standard output (also: --json)\n"
    "  --score F.json     what the hand was worth: times, ways, forces, handling errors, points (`exercise:` of the scene)\n"
    "  --final F.csv      the last state, one row a node\n"
    "  --picture F.png    vessel and tool at the end\n"
    "  --picture-at S     instead of the end, this moment [s]; up to 6 of them stand side by side\n"
    "  --chart F.png      forces at the hand and the wall, contacts, depth, CPU time, iterations and residual over time\n"
    "  --contact KIND     the surface that answers contact queries: lim, lim_blend, lim_switch, mesh, smooth_mesh,\n"
    "                     flat_mesh, grid or tube; default: the scene's\n"
    "  --paced            one step each millisecond of real time, on SCHED_FIFO where that is permitted. Over load simulated time slows\n"
    "                     down and the summary says so (deadline_misses, slowed_s); no step is skipped, none is hurried afterwards\n"
    "  --threads N        threads of offline work such as fitting a shape; default 0: all cores\n"
    "  --quiet            no summary, no progress\n\n"
    "Scene defaults: 200 elements, poisson_ratio 0.3, density 6.45 g/cm3, no damping, no friction, no gravity, inserted 0 mm, step 1 ms,\n"
    "contact tolerance 1e-6, `normal` (where a rest curvature with plane 0 bends) the coordinate axis after the direction's largest component, made\n"
    "perpendicular. docs/scene-format.md describes every key of a scene.\n"
    "Exit codes: 0 done (also when stopped by SIGINT or SIGTERM); 2 wrong usage or bad input; 3 the run diverged, left the vessel, or a file\n"
    "could not be written to its end.\n";

static volatile sig_atomic_t stop_requested;

static void request_stop(int signal_number)
{
    // a second one ends the program at once
    if (stop_requested)
        process_stop(signal_number);
    stop_requested = 1;
}

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger run: %s%s; see `seldinger run --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

// -1: go on; otherwise the exit code.
static int parse_options(int argc, char **argv, RunOptions *options)
{
    enum { SCRIPT = 256, DURATION, SETTLE, RECORD, SUMMARY, FINAL, PICTURE, PICTURE_AT, CHART, CONTACT, SCORE, DEVICE, PACED, THREADS, QUIET, HELP };
    static const struct option table[] = {
        {"script", required_argument, NULL, SCRIPT},   {"duration-s", required_argument, NULL, DURATION}, {"settle-s", required_argument, NULL, SETTLE},
        {"record", required_argument, NULL, RECORD},   {"summary", required_argument, NULL, SUMMARY},     {"json", required_argument, NULL, SUMMARY},
        {"final", required_argument, NULL, FINAL},     {"picture", required_argument, NULL, PICTURE},     {"picture-at", required_argument, NULL, PICTURE_AT},
        {"contact", required_argument, NULL, CONTACT}, {"paced", no_argument, NULL, PACED},               {"threads", required_argument, NULL, THREADS},
        {"quiet", no_argument, NULL, QUIET},           {"help", no_argument, NULL, HELP},
        {"chart", required_argument, NULL, CHART},     {"score", required_argument, NULL, SCORE},         {"device", required_argument, NULL, DEVICE},
        {0}};
    *options = (RunOptions){.duration_s = -1, .settle_s = -1};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case SCRIPT: options->script = optarg; break;
        case RECORD: options->record = optarg; break;
        case SUMMARY: options->summary = optarg; break;
        case FINAL: options->final = optarg; break;
        case PICTURE: options->picture = optarg; break;
        case CHART: options->chart = optarg; break;
        case CONTACT: options->contact = optarg; break;
        case SCORE: options->score = optarg; break;
        case DEVICE:
            if (options->device_count == RUN_MAPS)
                return usage_fault("at most 8 device maps", "");
            options->device[options->device_count++] = optarg;
            options->paced = true;
            break;
        case PACED: options->paced = true; break;
        case QUIET: options->quiet = true; break;
        case DURATION:
            if (!cli_number("--duration-s", optarg, 0, SCRIPT_LONGEST_S, &options->duration_s))
                return EXIT_BAD_INPUT;
            break;
        case SETTLE:
            if (!cli_number("--settle-s", optarg, 0, SCRIPT_LONGEST_S, &options->settle_s))
                return EXIT_BAD_INPUT;
            break;
        case PICTURE_AT:
            if (options->moment_count == MOST_MOMENTS)
                return usage_fault("at most 6 moments fit a picture", "");
            if (!cli_number("--picture-at", optarg, 0, SCRIPT_LONGEST_S, &options->moment_s[options->moment_count++]))
                return EXIT_BAD_INPUT;
            break;
        case THREADS:
            if (!cli_whole_number("--threads", optarg, 0, 256, &number))
                return EXIT_BAD_INPUT;
            options->threads = (int)number;
            break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: return usage_fault("unknown option or lacking value", "");
        }
    }
    if (optind != argc - 1)
        return usage_fault(optind < argc ? "one scene at a time, not also " : "lacks the scene to run", optind < argc ? argv[optind + 1] : "");
    options->scene = argv[optind];
    if (options->moment_count && !options->picture)
        return usage_fault("--picture-at goes with --picture F.png", "");
    if (options->device_count && (options->script || options->duration_s < 0))
        return usage_fault(options->script ? "--device and --script are two hands; one of them" : "--device needs --duration-s S", "");
    return -1;
}

// Scene, script and all output files: everything that can be wrong before the run, in one pass.
static Scene *prepare_scene(const RunOptions *options, Faults *faults)
{
    Scene *scene = scene_load(options->scene, faults);
    ToolNames tools = scene ? scene_tool_names(scene) : (ToolNames){0};
    Script *script = options->script ? script_load_tools(options->script, scene ? &tools : NULL, faults) : NULL;
    int kind = -1;
    for (int i = 0; options->contact && i < CONTACT_COUNT; i++)
        if (!strcmp(options->contact, contact_name[i]))
            kind = i;
    if (options->contact && kind < 0)
        faults_add(faults, "--contact", 0, 0, "'%.40s' is not known; valid: lim, lim_blend, lim_switch, mesh, smooth_mesh, flat_mesh, grid, tube", options->contact);
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--summary", options->summary);
    output_plan_write(&plan, "--final", options->final);
    output_plan_write(&plan, "--score", options->score);
    output_plan_write_file(&plan, "--picture", options->picture);
    output_plan_write_file(&plan, "--chart", options->chart);
    output_plan_write_file(&plan, "--record", options->record);
    output_plan_read_scene(&plan, scene);
    output_plan_read(&plan, "--script", options->script);
    for (int i = 0; i < options->device_count; i++)
        output_plan_read(&plan, "--device", options->device[i]);
#ifndef SELDINGER_RENDER
    if (options->picture || options->chart)
        faults_add(faults, options->picture ? "--picture" : "--chart", 0, 0, "this build has no pictures; build with -DSELDINGER_RENDER=ON");
#endif
    if (scene && script) {
        script_free(scene->script);
        free(scene->script_path);
        scene->script = script;
        scene->script_path = HEAP_TEXT(options->script);
    } else {
        script_free(script);
    }
    if (scene && kind >= 0)
        scene->contact = (ContactKind)kind;
    if (scene && !scene->script && options->duration_s < 0 && options->settle_s < 0)
        faults_add(faults, options->scene, 0, 0, "has no script; give --script F, --duration-s S or --settle-s S");
    if (faults->count > 0) {
        scene_free(scene);
        return NULL;
    }
    return scene;
}

// --- moments for the picture ---

typedef struct Moment {
    bool taken;
    Pose *pose;
} Moment;

typedef struct Watch {       // what after_step sees
    const RunOptions *options;
    Recording *recording;
    RunChart *chart;
    RunHands *hands;
    Lesson *lesson;
    Moment moment[MOST_MOMENTS];
    int moment_count;
    bool recording_failed;
} Watch;

static void take_moment(Moment *moment, Simulator *simulator, const ToolCommands *commands)
{
    const XrayControl xray = xray_default_control();
    pose_take(moment->pose, simulator, commands, &xray);
    moment->taken = true;
}

static bool watch_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    Watch *watch = context;
    for (int i = 0; i < watch->options->moment_count; i++)
        if (!watch->moment[i].taken && simulator_time_s(simulator) >= watch->options->moment_s[i] - 1e-9)
            take_moment(&watch->moment[i], simulator, commands);
    if (watch->hands)
        run_hands_answer(watch->hands, simulator_last(simulator), simulator_totals(simulator)->steps);
    if (watch->lesson)
        lesson_step(watch->lesson, simulator, commands, NULL);
    if (watch->chart)
        run_chart_step(watch->chart, simulator);
    if (watch->recording && !recording_step(watch->recording, simulator, commands, NULL))
        watch->recording_failed = true;
    return !watch->recording_failed;
}

static bool make_moments(Watch *watch, Simulator *simulator)
{
    watch->moment_count = !watch->options->picture ? 0 : watch->options->moment_count ? watch->options->moment_count : 1;
    bool good = true;
    for (int i = 0; good && i < watch->moment_count; i++)
        good = (watch->moment[i].pose = pose_create_for(simulator)) != NULL;
    return good;
}

static void free_moments(Watch *watch)
{
    for (int i = 0; i < MOST_MOMENTS; i++)
        pose_free(watch->moment[i].pose);
}

#ifdef SELDINGER_RENDER
// False with a fault where there is none: what was asked for is missing, though the run is as good as it was.
static bool draw_picture(const RunOptions *options, const Watch *watch, Simulator *simulator, OpenVessel *open, Faults *faults)
{
    const Scene *scene = simulator_scene(simulator);
    int nodes = stepper_node_capacity(simulator_stepper(simulator)), count = 0;
    char message[512] = "";
    PictureTool tool[MOST_MOMENTS] = {0};
    ToolLooks looks;
    bool has_looks = tool_looks_make(&looks, scene);
    double *radius = HEAP_ZEROED((size_t)nodes * MOST_MOMENTS, sizeof *radius);
    Vec3 *force = HEAP_ZEROED((size_t)nodes * MOST_MOMENTS, sizeof *force);
    for (int m = 0; has_looks && m < watch->moment_count; m++) {
        const Pose *pose = watch->moment[m].pose;
        Vec3 *at = force + (size_t)m * (size_t)nodes;
        double *thick = radius + (size_t)m * (size_t)nodes;
        if (!watch->moment[m].taken)
            continue;
        for (int i = 0; i < pose->node_count; i++) {
            thick[i] = pose->node[i].radius;
            at[i] = pose->node[i].force;
        }
        tool[count++] = (PictureTool){.node_count = pose->node_count, .position = pose->position, .radius = thick, .force = at,
                                      .first_free_node = pose->first_free_node, .time_s = pose->time_s, .inserted_mm = pose->inserted_mm,
                                      .push_force_n = pose->report.proximal_force, .torque_n_mm = pose->report.proximal_torque, .pose = pose, .looks = &looks};
    }
    PictureOptions look = picture_default_options();
    PictureScene shown = {.vessel = open_vessel_mesh(scene, open), .target_count = scene->target_count, .target = scene->target,
                          .has_entry = scene->wire.has_sheath, .entry = scene->wire.start};
    char title[300];
    snprintf(title, sizeof title, "%.200s%s%s", scene->path, options->contact ? ", contact: " : "", options->contact ? contact_name[scene->contact] : "");
    look.title = title;
    bool good = count == 1   ? picture_of_run(options->picture, &look, &shown, tool, message, sizeof message)
                : count > 1 ? picture_of_moments(options->picture, &look, &shown, count, tool, message, sizeof message)
                            : (snprintf(message, sizeof message, "the run ended before the first moment of --picture-at"), false);
    if (!good)
        faults_add(faults, options->picture, 0, 0, "no picture: %s", message[0] ? message : "not enough memory");
    free(radius);
    free(force);
    tool_looks_free(&looks);
    return good;
}
#endif

// --- the run ---

static int64_t expected_steps(const RunOptions *options, const Scene *scene)
{
    double seconds = options->duration_s >= 0 ? options->duration_s : scene->script ? script_duration_s(scene->script) : 0;
    return (int64_t)ceil((seconds + fmax(options->settle_s, 0)) * 1000 / scene->dt) + 1;
}

// Files after the run; false with faults where one could not be written.
static bool write_files(const RunOptions *options, Simulator *simulator, const DriveReport *drive, const NodeReport *node, Faults *faults)
{
    int before = faults->count;
    size_t length;
    if (options->summary)
        output_write_line(options->summary, run_summary_json(simulator, drive, node), faults);
    if (options->final) {
        char *text = run_final_csv(simulator, node, &length);
        if (text)
            output_write(options->final, text, length, faults);
        else
            faults_add(faults, options->final, 0, 0, "cannot be written: no memory");
        free(text);
    }
    return faults->count == before;
}

static bool write_score(const RunOptions *options, const Watch *watch, const Scene *scene, Faults *faults)
{
    if (!options->score)
        return true;
    ScoreFigures figures = score_figures(lesson_score(watch->lesson));
    char *text = score_json(&figures, scene);
    bool good = text && output_write(options->score, text, strlen(text), faults);
    free(text);
    return good;
}

// How long a run waits for its device.
static const double device_patience_s = 5;

// No node of a run that can be shown is further outside the wall than this.
static const double deep_mm = 0.2;

static void say_untrusted(const Simulator *simulator, const DriveReport *drive)
{
    const RunTotals *totals = simulator_totals(simulator);
    const char *path = simulator_scene(simulator)->path;
    if (drive->end == DRIVE_DIVERGED)
        fprintf(stderr, "%s: diverged at %.3f s; the last good state is kept. Smaller step_ms, shorter elements or slower motion may help\n", path,
                simulator_time_s(simulator));
    if (run_left_vessel(totals))
        fprintf(stderr, "%s: the tool left the vessel (deepest %.3f mm outside the wall); the run cannot be trusted\n", path, totals->penetration_max);
    else if (totals->penetration_max > deep_mm)
        fprintf(stderr, "%s: warning: a node was %.3f mm outside the wall\n", path, totals->penetration_max);
    if (totals->flags & STEP_OUT_OF_VESSEL)
        fprintf(stderr, "%s: warning: the tool passed an open end of the vessel\n", path);
    if (totals->disagreeing_steps > 0)
        fprintf(stderr, "%s: warning: in %lld of %lld steps two parts of the vessel's model put the wall at different places; "
                        "fit the model again with this version\n", path, (long long)totals->disagreeing_steps, (long long)totals->steps);
    const EnergyBalance *energy = simulator_energy(simulator);
    if (simulator_gains_energy(simulator))
        fprintf(stderr, "%s: warning: single steps gained %.3g mJ that nobody gave, of %.4g mJ of work (most: %.3g mJ at %.3f s)\n", path, energy->gained,
                energy->work, energy->gained_most, energy->gained_at_s);
    if (totals->not_converged_steps > 0)
        fprintf(stderr, "%s: warning: the contact solve of %lld of %lld steps stopped at its cap (residual at most %.2g)\n", path,
                (long long)totals->not_converged_steps, (long long)totals->steps, totals->residual_max);
}

static int simulate(const RunOptions *options, const Scene *scene, OpenVessel *open, Faults *faults)
{
    Watch watch = {.options = options};
    Simulator *simulator = simulator_create(scene, open->vessel, faults);
    if (!simulator)
        return EXIT_BAD_INPUT;
    int nodes = stepper_node_capacity(simulator_stepper(simulator)), code = EXIT_BAD_INPUT;
    NodeReport *node = calloc((size_t)nodes, sizeof *node);
    RecordingOptions record = recording_default_options();
    record.expected_steps = expected_steps(options, scene);
    if (options->chart)
        watch.chart = run_chart_create(record.expected_steps);
    if (!node || !make_moments(&watch, simulator) || (options->chart && !watch.chart))
        faults_add(faults, scene->path, 0, 0, "no memory");
    if (options->score && !(watch.lesson = lesson_create(simulator, open->tree)))
        faults_add(faults, scene->path, 0, 0, "no memory");
    simulator_watch_energy(simulator);
    if (options->device_count && faults->count == 0)
        watch.hands = run_hands_open(options->device_count, options->device, scene, device_patience_s, faults);
    // last, as it begins a file
    if (options->record && faults->count == 0)
        watch.recording = recording_create(options->record, simulator, &record, faults);
    if (faults->count > 0)
        run_hands_close(watch.hands);
    else {
        DriveOptions drive = drive_default_options();
        drive.script = watch.hands ? NULL : scene->script;
        drive.hand = watch.hands ? run_hands_command : NULL;
        drive.hand_context = watch.hands;
        drive.duration_s = options->duration_s;
        drive.settle_s = fmax(options->settle_s, 0);
        drive.paced = options->paced;
        drive.stop = &stop_requested;
        drive.after_step = watch_step;
        drive.context = &watch;
        DriveReport report = simulator_drive(simulator, &drive);
        run_hands_close(watch.hands);
        if (options->paced && !report.real_time_priority && !options->quiet)
            fprintf(stderr, "seldinger run: without real-time priority (SCHED_FIFO is not permitted here; see `ulimit -r` and CAP_SYS_NICE) other programs "
                            "delay steps\n");
        stepper_node_report(simulator_stepper(simulator), node);
        if (options->picture && options->moment_count == 0)
            take_moment(&watch.moment[0], simulator, &(ToolCommands){0});
        bool whole = !watch.recording || recording_close(watch.recording, simulator, faults);
        // what a recording that could not go on has broken off is another run than was asked for
        bool is_this_run = !watch.recording_failed;
        if (is_this_run) {
            whole &= write_files(options, simulator, &report, node, faults);
            whole &= write_score(options, &watch, scene, faults);
        }
        if (!options->quiet)
            run_print(options->summary && !strcmp(options->summary, "-") ? stderr : stdout, simulator, &report, node);
        say_untrusted(simulator, &report);
#ifdef SELDINGER_RENDER
        whole = (!is_this_run || !options->picture || draw_picture(options, &watch, simulator, open, faults)) && whole;
#endif
        char message[512];
        if (is_this_run && options->chart && !run_chart_draw(watch.chart, simulator, options->chart, message, sizeof message)) {
            faults_add(faults, options->chart, 0, 0, "no chart: %s", message);
            whole = false;
        }
        code = whole && report.end != DRIVE_DIVERGED && !run_left_vessel(simulator_totals(simulator)) ? EXIT_DONE : EXIT_UNTRUSTED;
    }
    lesson_free(watch.lesson);
    free_moments(&watch);
    run_chart_free(watch.chart);
    free(node);
    simulator_destroy(simulator);
    return code;
}

static void install_signals(void)
{
    struct sigaction stop = {.sa_handler = request_stop, .sa_flags = SA_RESTART};
    sigaction(SIGINT, &stop, NULL);
    sigaction(SIGTERM, &stop, NULL);
}

int verb_run(int argc, char **argv)
{
    RunOptions options;
    static Faults faults;
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    recording_prepare_process();
    install_signals();
    faults_clear(&faults);
    OpenVessel open = {0};
    Scene *scene = prepare_scene(&options, &faults);
    if (!scene)
        return cli_bad_input(&faults);
    code = EXIT_BAD_INPUT;
    if (cli_open_vessel(scene, options.threads, options.quiet, &open, &faults) && open_vessel_inlet(scene, &open, &faults))
        code = simulate(&options, scene, &open, &faults);
    if (faults.count > 0)
        cli_bad_input(&faults);
    open_vessel_close(&open);
    scene_free(scene);
    return code;
}
