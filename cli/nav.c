// seldinger nav: the trainer.
#include "cli/cli.h"

#include "base/output.h"
#include "cli/output_plan.h"
#include "render/trainer.h"
#include "sim/replay.h"
#include "sim/session_files.h"

#include <cJSON.h>
#include <getopt.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "Usage: seldinger nav SCENE [options]\n\n"
    "Opens the trainer's window: steer the tools by keyboard, gamepad, HID or USB device. `?` lists the keys. Each session is recorded, and its score\n"
    "written beside the recording; `seldinger report` makes a report of it, `seldinger replay` shows it again.\n\n"
    "  --device F.yaml    map of a device (scenes/devices has examples, `seldinger devices` lists what is there); up to 8. Joysticks, gamepads and haptic\n"
    "                     devices have maps already\n"
    "  --only-mapped      no device without a map given here\n"
    "  --trainee NAME     for the report\n"
    "  --sessions FOLDER  where sessions go; default $XDG_DATA_HOME/seldinger/sessions, else ~/.local/share/seldinger/sessions\n"
    "  --no-record        leaves no recording and no session file\n"
    "  --resume REC.h5    goes on where a recording of this scene ended …\n"
    "  --at S             … or at this moment of it [s of simulated time]\n"
    "  --tools FOLDER     device files that the tray offers where the scene names none under exchange:; default scenes/tools\n"
    "  --cine F.cine      a saved cine loop of this scene, to be replayed\n"
    "  --view V           first view: fluoroscopy (default), 3d, angioscopy or all\n"
    "  --size WxH         of the window [pixel]; default 1280x720\n"
    "  --full-screen      fills the screen\n"
    "  --duration-s S     ends by itself after S seconds of real time\n"
    "  --figures F.json   at the end: frames, their CPU time, lateness of the 1 kHz thread, memory; - is standard output\n"
    "  --threads N        threads of fitting a shape; default 0: all cores\n"
    "  --quiet            no progress\n\n"
    "Exit codes: 0 done; 2 wrong usage, bad input or no display; 3 the simulation diverged or the recording is not whole.\n";

typedef struct NavOptions {
    const char *scene, *sessions, *resume, *figures;
    int map_count;
    const char *map[TRAINER_MAPS];
    bool quiet;
    TrainerOptions trainer;
} NavOptions;

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger nav: %s%s; see `seldinger nav --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

static int parse_options(int argc, char **argv, NavOptions *options)
{
    enum { DEVICE = 256, ONLY_MAPPED, TRAINEE, SESSIONS, NO_RECORD, RESUME, AT, TOOLS, CINE, VIEW, SIZE, FULL_SCREEN, DURATION, FIGURES, THREADS, QUIET, HELP };
    static const struct option table[] = {
        {"device", required_argument, NULL, DEVICE},   {"only-mapped", no_argument, NULL, ONLY_MAPPED}, {"trainee", required_argument, NULL, TRAINEE},
        {"sessions", required_argument, NULL, SESSIONS}, {"no-record", no_argument, NULL, NO_RECORD},   {"resume", required_argument, NULL, RESUME},
        {"at", required_argument, NULL, AT},           {"tools", required_argument, NULL, TOOLS},       {"cine", required_argument, NULL, CINE},         {"view", required_argument, NULL, VIEW},         {"size", required_argument, NULL, SIZE},
        {"full-screen", no_argument, NULL, FULL_SCREEN}, {"duration-s", required_argument, NULL, DURATION}, {"figures", required_argument, NULL, FIGURES},
        {"threads", required_argument, NULL, THREADS}, {"quiet", no_argument, NULL, QUIET},             {"help", no_argument, NULL, HELP}, {0}};
    *options = (NavOptions){.trainer = {.is_recorded = true, .has_built_in_maps = true, .trainee = "", .resume_s = SCRIPT_LONGEST_S, .width = 1280, .height = 720}};
    TrainerOptions *trainer = &options->trainer;
    double number;
    int view;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case DEVICE:
            if (options->map_count == TRAINER_MAPS)
                return usage_fault("at most 8 device maps", "");
            options->map[options->map_count++] = optarg;
            break;
        case ONLY_MAPPED: trainer->has_built_in_maps = false; break;
        case TRAINEE: trainer->trainee = optarg; break;
        case SESSIONS: options->sessions = optarg; break;
        case NO_RECORD: trainer->is_recorded = false; break;
        case RESUME: options->resume = optarg; break;
        case TOOLS: trainer->library = optarg; break;
        case CINE: trainer->cine = optarg; break;
        case FULL_SCREEN: trainer->is_full_screen = true; break;
        case FIGURES: options->figures = optarg; break;
        case QUIET: options->quiet = true; break;
        case AT:
            if (!cli_number("--at", optarg, 0, SCRIPT_LONGEST_S, &trainer->resume_s))
                return EXIT_BAD_INPUT;
            break;
        case VIEW:
            if (!cli_view(optarg, &view))
                return EXIT_BAD_INPUT;
            trainer->view = (PanelView)view;
            break;
        case SIZE:
            if (!cli_size(optarg, &trainer->width, &trainer->height))
                return EXIT_BAD_INPUT;
            break;
        case DURATION:
            if (!cli_number("--duration-s", optarg, 0, SCRIPT_LONGEST_S, &trainer->duration_s))
                return EXIT_BAD_INPUT;
            break;
        case THREADS:
            if (!cli_whole_number("--threads", optarg, 0, 256, &number))
                return EXIT_BAD_INPUT;
            trainer->threads = (int)number;
            break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: return usage_fault("unknown option or lacking value", "");
        }
    }
    if (optind != argc - 1)
        return usage_fault(optind < argc ? "one scene at a time, not also " : "lacks the scene to steer in", optind < argc ? argv[optind + 1] : "");
    if (trainer->resume_s < SCRIPT_LONGEST_S && !options->resume)
        return usage_fault("--at goes with --resume REC.h5", "");
    options->scene = argv[optind];
    return -1;
}

static void write_figures(const char *path, const TrainerFigures *figures, Faults *faults)
{
    cJSON *out = cJSON_CreateObject();
    cJSON_AddNumberToObject(out, "first_picture_s", figures->first_picture_s);
    cJSON_AddNumberToObject(out, "frames", (double)figures->frames);
    cJSON_AddNumberToObject(out, "frames_skipped", (double)figures->frames_skipped);
    static const char *const quantile[] = {"median", "p99", "max"}, *const step_quantile[] = {"median", "p999", "max"};
    cJSON *frame = cJSON_AddObjectToObject(out, "frame_cpu_ms"), *step = cJSON_AddObjectToObject(out, "step_us"), *late = cJSON_AddObjectToObject(out, "late_us");
    for (int i = 0; i < 3; i++) {
        cJSON_AddNumberToObject(frame, quantile[i], figures->frame_cpu_ms[i]);
        cJSON_AddNumberToObject(step, step_quantile[i], figures->step_us[i]);
        cJSON_AddNumberToObject(late, quantile[i], figures->late_us[i]);
    }
    cJSON_AddNumberToObject(out, "deadline_misses", (double)figures->deadline_misses);
    cJSON_AddNumberToObject(out, "slowed_s", figures->slowed_s);
    cJSON_AddBoolToObject(out, "real_time_priority", figures->real_time_priority);
    cJSON_AddNumberToObject(out, "resident_mb_after_first_minute", figures->resident_mb[0]);
    cJSON_AddNumberToObject(out, "resident_mb_at_end", figures->resident_mb[1]);
    cJSON_AddNumberToObject(out, "device_reports", (double)figures->reports);
    cJSON_AddStringToObject(out, "state_hash", figures->hash);
    cJSON_AddStringToObject(out, "recording", figures->recording);
    output_write_line(path, cJSON_Print(out), faults);
    cJSON_Delete(out);
}

// A recording goes on in its own scene only: the same text.
static bool is_same_scene(const RecordedRun *run, const Scene *scene, const char *recording, Faults *faults)
{
    if (run->scene_text && !strcmp(run->scene_text, scene->text) && run->step_ms == scene->dt)
        return true;
    faults_add(faults, recording, 0, 0, "is a recording of another scene than %s, of an older state of it, or with devices added from the tray; `seldinger replay` goes on from any (F5)",
               scene->path);
    return false;
}

static int steer(const NavOptions *options, Scene *scene, OpenVessel *open, const RecordedRun *resume, Faults *faults)
{
    TrainerOptions trainer = options->trainer;
    TrainerFigures figures = {0};
    DeviceMap *map[TRAINER_MAPS] = {0};
    const ToolNames tools = scene_tool_names(scene);
    char folder[4096] = "";
    int code = EXIT_BAD_INPUT;
    for (int i = 0; i < options->map_count; i++)
        if ((map[i] = device_map_load(options->map[i], faults)) && device_map_find_tools(map[i], &tools, faults))
            trainer.map_count++;
    if (trainer.is_recorded)
        session_folder(options->sessions, folder, sizeof folder, faults);
    trainer.folder = folder;
    trainer.note = cli_note;
    trainer.map = map;
    trainer.resume = resume;
    if (faults->count == 0) {
        code = trainer_run(scene, open, &trainer, &figures, faults);
        if (options->figures && figures.frames > 0)
            write_figures(options->figures, &figures, faults);
        if (figures.recording[0] && !options->quiet)
            printf("%s\n", figures.recording);
    }
    for (int i = 0; i < TRAINER_MAPS; i++)
        free(map[i]);
    return code;
}

int verb_nav(int argc, char **argv)
{
    NavOptions options;
    static Faults faults;
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    recording_prepare_process();
    faults_clear(&faults);
    OpenVessel open = {0};
    Scene *scene = scene_load(options.scene, &faults);
    OutputPlan plan = {.faults = &faults};
    output_plan_write(&plan, "--figures", options.figures);
    output_plan_read_scene(&plan, scene);
    output_plan_read(&plan, "--resume", options.resume);
    for (int i = 0; i < options.map_count; i++)
        output_plan_read(&plan, "--device", options.map[i]);
    RecordedRun *resume = scene && options.resume ? recorded_run_load_series(options.resume, &faults) : NULL;
    code = EXIT_BAD_INPUT;
    if (scene && (!resume || is_same_scene(resume, scene, options.resume, &faults)) && faults.count == 0 &&
        cli_open_vessel(scene, options.trainer.threads, options.quiet, &open, &faults) && open_vessel_inlet(scene, &open, &faults))
        code = steer(&options, scene, &open, resume, &faults);
    if (faults.count > 0) {
        int bad = cli_bad_input(&faults);
        code = code == EXIT_DONE ? bad : code;
    }
    recorded_run_free(resume);
    open_vessel_close(&open);
    scene_free(scene);
    return code;
}
