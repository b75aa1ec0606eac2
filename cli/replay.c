// seldinger replay: a recording shown, simulated again, made into a scene.
#include "cli/cli.h"

#include "cli/replay_scene.h"
#include "sim/sha256.h"

#include <getopt.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "Usage: seldinger replay REC.h5 [options]\n\n"
    "Shows a recording that `nav` or `run --record` wrote.\n\n"
    "  --verify           simulates it again headless, with the recorded hand, and compares the state's hash at each step\n"
    "  --scene FOLDER     makes a regression scene of it: scene.yaml, hand.csv and the golden tool path, for `seldinger check FOLDER`\n"
    "  --threads N        threads of fitting a shape; default 0: all cores\n"
    "  --quiet            no progress; --verify says only what differs\n\n"
    "Exit codes: 0 done, the same; 1 a step differs; 2 wrong usage or bad input; 3 the run diverged.\n";

typedef struct ReplayOptions {
    const char *recording, *scene_folder;
    bool verify, quiet;
    int threads;
} ReplayOptions;

static int usage_fault(const char *message, const char *what)
{
    fprintf(stderr, "seldinger replay: %s%s; see `seldinger replay --help`\n", message, what);
    return EXIT_BAD_INPUT;
}

static int parse_options(int argc, char **argv, ReplayOptions *options)
{
    enum { VERIFY = 256, SCENE, THREADS, QUIET, HELP };
    static const struct option table[] = {{"verify", no_argument, NULL, VERIFY},    {"scene", required_argument, NULL, SCENE},
                                          {"threads", required_argument, NULL, THREADS}, {"quiet", no_argument, NULL, QUIET},
                                          {"help", no_argument, NULL, HELP},        {0}};
    *options = (ReplayOptions){0};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case VERIFY: options->verify = true; break;
        case SCENE: options->scene_folder = optarg; break;
        case QUIET: options->quiet = true; break;
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

static bool sample(void *context, Simulator *simulator, Command command, const XrayControl *xray)
{
    (void)command;
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
    if (run->node_count != simulator_state(simulator)->node_count)
        faults_add(faults, options->recording, 0, 0, "holds a tool of %d nodes, its scene one of %d", run->node_count, simulator_state(simulator)->node_count);
    else if (options->scene_folder && !(sampling.path = tool_path_create(simulator, (double)run->step_count * run->step_ms / 1000)))
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

int verb_replay(int argc, char **argv)
{
    ReplayOptions options;
    static Faults faults;
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    faults_clear(&faults);
    OpenVessel open = {0};
    RecordedRun *run = recorded_run_load(options.recording, &faults);
    Scene *scene = run ? replay_scene(run, options.recording, &faults) : NULL;
    code = EXIT_BAD_INPUT;
    if (scene && open_vessel(scene, options.threads, options.quiet, &open, &faults) && open_vessel_inlet(scene, &open, &faults))
        code = simulate_again(&options, run, scene, &open, &faults);
    if (faults.count > 0)
        code = cli_bad_input(&faults);
    open_vessel_close(&open);
    scene_free(scene);
    recorded_run_free(run);
    return code;
}
