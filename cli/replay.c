// seldinger replay: a recording shown, simulated again, made into a scene.
#include "cli/cli.h"

#include "base/sha256.h"
#include "cli/output_plan.h"
#include "sim/replay_scene.h"
#ifdef SELDINGER_RENDER
#include "render/film.h"
#include "render/replay_window.h"
#include "render/trainer.h"
#include "sim/session_files.h"
#endif

#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char help[] =
    "Usage: seldinger replay REC.h5 [options]\n\n"
    "Shows a recording that `nav` or `run --record` wrote, in a window: play, stop, search (Left, Right, the strip below), and go on from any moment (F5) as a\n"
    "new session. With one of the first four options no window is opened.\n\n"
    "  --verify           simulates it again headless, with the recorded hand, and compares the state's hash at each step\n"
    "  --scene FOLDER     makes a regression scene of it: scene.yaml, hand.csv and the golden tool path, for `seldinger check FOLDER`\n"
    "  --movie F.mp4      all of it as a film (H.264 by ffmpeg), off screen\n"
    "  --picture F.png    what the trainee saw at the end, off screen …\n"
    "  --at S             … or at this moment [s of simulated time]; the window begins there\n"
    "  --from S, --to S   of a film [s of simulated time]\n"
    "  --fps N            frames a second of a film; default 30\n"
    "  --speed X          simulated seconds a second of film; default 1\n"
    "  --view V           fluoroscopy (default), 3d, angioscopy or all\n"
    "  --size WxH         [pixel]; default 1280x720\n"
    "  --no-panels        the views alone\n"
    "  --close-up MM      so much around the tools' tips, as they are at the beginning: in 3D, and in X-ray (40 at least) where nobody looked at it\n"
    "  --lao DEG, --cra DEG   C-arm for a recording that nobody looked at (`run --record`); negative: RAO, CAU\n"
    "  --sessions FOLDER  where a session that goes on is recorded, as for `nav`\n"
    "  --duration-s S     the window closes by itself after S seconds of real time\n"
    "  --threads N        threads of fitting a shape; default 0: all cores\n"
    "  --quiet            no progress; --verify says only what differs\n\n"
    "Exit codes: 0 done, the same; 1 a step differs; 2 wrong usage or bad input; 3 the run diverged.\n";

typedef struct ReplayOptions {
    const char *recording, *scene_folder, *picture, *movie, *sessions;
    double duration_s, at_s, from_s, to_s, fps, speed, lao_deg, cra_deg, close_up_mm;
    int width, height, view;
    bool verify, quiet, no_panels;
    int threads;
} ReplayOptions;

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger replay: %s%s; see `seldinger replay --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

typedef struct NumberOption {
    const char *name;
    double least, most;
    size_t offset;           // in ReplayOptions
} NumberOption;

static const NumberOption number_option[] = {
    {"--at", 0, SCRIPT_LONGEST_S, offsetof(ReplayOptions, at_s)},     {"--from", 0, SCRIPT_LONGEST_S, offsetof(ReplayOptions, from_s)},
    {"--to", 0, SCRIPT_LONGEST_S, offsetof(ReplayOptions, to_s)},     {"--fps", 1, 240, offsetof(ReplayOptions, fps)},
    {"--speed", 0.01, 1000, offsetof(ReplayOptions, speed)},          {"--lao", -90, 90, offsetof(ReplayOptions, lao_deg)},
    {"--cra", -45, 45, offsetof(ReplayOptions, cra_deg)},             {"--duration-s", 0, SCRIPT_LONGEST_S, offsetof(ReplayOptions, duration_s)},
    {"--close-up", 5, 400, offsetof(ReplayOptions, close_up_mm)},
};

static int parse_options(int argc, char **argv, ReplayOptions *options)
{
    // the first ones in the order of number_option
    enum { NUMBERS = 256, VERIFY = 300, SCENE, PICTURE, MOVIE, SESSIONS, VIEW, SIZE, NO_PANELS, THREADS, QUIET, HELP };
    static const struct option table[] = {
        {"at", required_argument, NULL, NUMBERS},          {"from", required_argument, NULL, NUMBERS + 1}, {"to", required_argument, NULL, NUMBERS + 2},
        {"fps", required_argument, NULL, NUMBERS + 3},     {"speed", required_argument, NULL, NUMBERS + 4}, {"lao", required_argument, NULL, NUMBERS + 5},
        {"cra", required_argument, NULL, NUMBERS + 6},     {"duration-s", required_argument, NULL, NUMBERS + 7},
        {"close-up", required_argument, NULL, NUMBERS + 8},
        {"sessions", required_argument, NULL, SESSIONS},   {"verify", no_argument, NULL, VERIFY},          {"scene", required_argument, NULL, SCENE},
        {"picture", required_argument, NULL, PICTURE},     {"movie", required_argument, NULL, MOVIE},      {"view", required_argument, NULL, VIEW},
        {"size", required_argument, NULL, SIZE},           {"no-panels", no_argument, NULL, NO_PANELS},    {"threads", required_argument, NULL, THREADS},
        {"quiet", no_argument, NULL, QUIET},               {"help", no_argument, NULL, HELP},              {0}};
    *options = (ReplayOptions){.lao_deg = NAN, .cra_deg = NAN, .at_s = HUGE_VAL, .to_s = HUGE_VAL, .fps = 30, .speed = 1, .width = 1280, .height = 720};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        if (choice >= NUMBERS && choice < VERIFY) {
            const NumberOption *option = &number_option[choice - NUMBERS];
            if (!cli_number(option->name, optarg, option->least, option->most, (double *)(void *)((char *)options + option->offset)))
                return EXIT_BAD_INPUT;
            continue;
        }
        switch (choice) {
        case VERIFY: options->verify = true; break;
        case SCENE: options->scene_folder = optarg; break;
        case PICTURE: options->picture = optarg; break;
        case MOVIE: options->movie = optarg; break;
        case SESSIONS: options->sessions = optarg; break;
        case NO_PANELS: options->no_panels = true; break;
        case QUIET: options->quiet = true; break;
        case VIEW:
            if (!cli_view(optarg, &options->view))
                return EXIT_BAD_INPUT;
            break;
        case SIZE:
            if (!cli_size(optarg, &options->width, &options->height))
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
        return usage_fault(optind < argc ? "one recording at a time, not also " : "lacks the recording to show", optind < argc ? argv[optind + 1] : "");
    options->recording = argv[optind];
    return -1;
}

// Says which of the files that the run was made from are no longer what they were.
static void say_changed_files(const RecordedRun *run)
{
    const char *file = run->files ? run->files : "", *sum = run->sha256 ? run->sha256 : "";
    while (*file && *sum) {
        size_t n = strcspn(file, "\n"), m = strcspn(sum, "\n");
        char path[4096], hex[65] = "";
        snprintf(path, sizeof path, "%.*s", (int)n, file);
        if (!sha256_of_file(path, hex))
            fprintf(stderr, "%s: cannot be read; the recording was made with it\n", path);
        else if (strlen(hex) != m || strncmp(hex, sum, m) != 0)
            fprintf(stderr, "%s: is not what the recording was made with; its sha256 was %.*s\n", path, (int)m, sum);
        file += n + (file[n] == '\n');
        sum += m + (sum[m] == '\n');
    }
}

typedef struct Sampling {
    ToolPath *path;          // NULL: none wanted
    bool no_memory;
} Sampling;

static bool sample(void *context, Simulator *simulator, const ToolCommands *commands, const XrayControl *xray)
{
    (void)commands;
    (void)xray;
    Sampling *sampling = context;
    sampling->no_memory |= sampling->path && !tool_path_sample(sampling->path, simulator, false);
    return !sampling->no_memory;
}

static int report(const ReplayOptions *options, const RecordedRun *run, const ReplayVerdict *verdict)
{
    if (verdict->first_different >= 0) {
        fprintf(stderr, "%s: differs from step %" PRId64 " (%.3f s) on: recorded %016" PRIx64 ", simulated %016" PRIx64 "\n", options->recording,
                verdict->first_different, run->time_s[verdict->first_different], verdict->recorded, verdict->simulated);
        say_changed_files(run);
        return EXIT_DIFFERENT;
    }
    if (!options->quiet)
        printf("%s: %" PRId64 " steps (%.3f s) simulated again, the same state at each; the last is %016" PRIx64 "\n", options->recording, verdict->steps,
               run->step_count ? run->time_s[run->step_count - 1] : 0, verdict->simulated);
    return EXIT_DONE;
}

static int simulate_again(const ReplayOptions *options, const RecordedRun *run, const Scene *scene, const OpenVessel *open, Faults *faults)
{
    Simulator *simulator = simulator_create(scene, open->vessel, faults);
    Sampling sampling = {0};
    int code = EXIT_BAD_INPUT;
    if (!simulator)
        return code;
    bool samples = replay_fits(run, simulator, faults) && options->scene_folder;
    if (samples && !(sampling.path = tool_path_create(simulator, (double)run->step_count * run->step_ms / 1000)))
        faults_add(faults, options->recording, 0, 0, "no memory for its tool path");
    if (faults->count == 0) {
        ReplayVerdict verdict = replay_verify(simulator, run, -1, options->scene_folder != NULL, sample, &sampling);
        code = report(options, run, &verdict);
        if (simulator_totals(simulator)->flags & STEP_DIVERGED)
            code = EXIT_UNTRUSTED;
        if (sampling.path && (!tool_path_sample(sampling.path, simulator, true) || sampling.no_memory))
            faults_add(faults, options->recording, 0, 0, "no memory for its tool path");
        else if (sampling.path && replay_write_scene(run, scene, options->scene_folder, faults) &&
                 replay_write_golden(sampling.path, options->scene_folder, faults) && !options->quiet)
            printf("%s: scene.yaml, hand.csv, scene.golden.csv; `seldinger check %s` compares\n", options->scene_folder, options->scene_folder);
    }
    tool_path_free(sampling.path);
    simulator_destroy(simulator);
    return code;
}

// Pictures and films.
static bool draw(const ReplayOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
#ifdef SELDINGER_RENDER
    FilmOptions film = film_default_options();
    film.width = options->width;
    film.height = options->height;
    film.view = (PanelView)options->view;
    film.has_panels = !options->no_panels;
    film.to_s = options->to_s;
    film.fps = options->fps;
    film.speed = options->speed;
    film.is_quiet = options->quiet;
    film.lao_deg = options->lao_deg;
    film.cra_deg = options->cra_deg;
    film.close_up_mm = options->close_up_mm;
    film.from_s = fmin(options->at_s, run->step_count > 0 ? run->time_s[run->step_count - 1] : 0);
    bool good = !options->picture || film_picture(options->picture, &film, run, scene, open, faults);
    film.from_s = options->from_s;
    return (!options->movie || film_movie(options->movie, &film, run, scene, open, faults)) && good;
#else
    (void)run, (void)scene, (void)open;
    if (options->picture || options->movie)
        faults_add(faults, options->picture ? "--picture" : "--movie", 0, 0, "this build has no pictures; build with -DSELDINGER_RENDER=ON");
    return faults->count == 0;
#endif
}

// The window; a session goes on from a moment of it where the user wants that.
static int show(const ReplayOptions *options, const RecordedRun *run, Scene *scene, OpenVessel *open, Faults *faults)
{
#ifdef SELDINGER_RENDER
    ReplayWindowOptions window = {.name = options->recording, .width = options->width, .height = options->height, .view = (PanelView)options->view,
                                  .at_s = isfinite(options->at_s) ? options->at_s : 0, .duration_s = options->duration_s, .lao_deg = options->lao_deg,
                                  .cra_deg = options->cra_deg};
    bool resumes = false;
    double resume_s = 0;
    if (!replay_window_run(&window, run, scene, open, &resumes, &resume_s, faults))
        return EXIT_BAD_INPUT;
    if (!resumes)
        return EXIT_DONE;
    char folder[4096];
    TrainerFigures figures = {0};
    TrainerOptions trainer = {.folder = folder, .note = cli_note, .is_recorded = true, .trainee = "", .has_built_in_maps = true, .resume = run, .resume_s = resume_s,
                              .width = options->width, .height = options->height, .view = window.view, .duration_s = options->duration_s};
    if (!session_folder(options->sessions, folder, sizeof folder, faults))
        return EXIT_BAD_INPUT;
    int code = trainer_run(scene, open, &trainer, &figures, faults);
    if (figures.recording[0] && !options->quiet)
        printf("%s\n", figures.recording);
    return code;
#else
    (void)run, (void)scene, (void)open, (void)options;
    faults_add(faults, "replay", 0, 0, "this build has no window; --verify and --scene work, or build with -DSELDINGER_RENDER=ON");
    return EXIT_BAD_INPUT;
#endif
}

// The scene's folder gets three files; the recording's own scene may lie in it.
static void plan_outputs(const ReplayOptions *options, const RecordedRun *run, const Scene *scene, Faults *faults)
{
    static const char *const part[] = {"scene.yaml", "hand.csv", "scene.golden.csv"};
    char path[3][PATH_MAX];
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "--picture", options->picture);
    output_plan_write_file(&plan, "--movie", options->movie);
    bool is_there = options->scene_folder && access(options->scene_folder, F_OK) == 0;
    for (int i = 0; is_there && i < 3; i++)
        if (snprintf(path[i], sizeof path[i], "%s/%s", options->scene_folder, part[i]) < (int)sizeof path[i])
            output_plan_write_file(&plan, "--scene", path[i]);
    output_plan_read(&plan, "the recording", options->recording);
    output_plan_read_scene(&plan, scene);
    if (run && run->scene_path)
        output_plan_read(&plan, "the recording's scene", run->scene_path);
}

int verb_replay(int argc, char **argv)
{
    ReplayOptions options;
    static Faults faults;
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    recording_prepare_process();
    faults_clear(&faults);
    OpenVessel open = {0};
    RecordedRun *run = recorded_run_load(options.recording, &faults);
    Scene *scene = run ? replay_scene(run, options.recording, &faults) : NULL;
    code = EXIT_BAD_INPUT;
    plan_outputs(&options, run, scene, &faults);
    if (scene && faults.count == 0 && cli_open_vessel(scene, options.threads, options.quiet, &open, &faults) && open_vessel_inlet(scene, &open, &faults)) {
        code = EXIT_DONE;
        if (options.verify || options.scene_folder)
            code = simulate_again(&options, run, scene, &open, &faults);
        else if (!options.picture && !options.movie)
            code = show(&options, run, scene, &open, &faults);
        if (!draw(&options, run, scene, &open, &faults))
            code = EXIT_BAD_INPUT;
    }
    if (faults.count > 0)
        code = cli_bad_input(&faults);
    open_vessel_close(&open);
    scene_free(scene);
    recorded_run_free(run);
    return code;
}
