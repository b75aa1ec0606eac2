// seldinger check: every scene that has a golden tool path (X.yaml with X.golden.csv beside it) is run headless and compared with it;
// every scene with a `verify:` key is measured against its references (check_verify.c).
#include "cli/check_verify.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/text_file.h"
#include "cli/output_plan.h"
#include "sim/compare.h"
#include "sim/drive.h"

#include <dirent.h>
#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char help[] =
    "Usage: seldinger check PATH... [options]\n\n"
    "Runs every scene (X.yaml) below PATH that has a golden tool path (X.golden.csv) and compares point by point over time. The table names\n"
    "each scene, its worst distance, and the first time, node and distance beyond the tolerance.\n"
    "Then every scene below PATH with the key `verify:` is measured against exact solutions, at several numbers of elements: case, reference,\n"
    "result, error, tolerance, and the order in which the error falls. The key is described in scenes/verify/README.md.\n\n"
    "  --tolerance-mm X   largest distance [mm] between golden and run that passes; default 0.00001: other machines pass, one per cent\n"
    "                     of a parameter does not\n"
    "  --update           rewrites the goldens; a scene named itself gets one that had none\n"
    "  --duration-s S     with --update: simulated time [s] of the golden; default: the script's, else the old golden's, else 1\n"
    "  --threads N        threads of fitting a shape and of verifying; default 0: all cores\n"
    "  --quiet            only what differs or misses its tolerance\n\n"
    "Scenes whose vessel file is not there are skipped by name.\n"
    "Exit codes: 0 all pass; 1 a path differs or a tolerance is missed; 2 wrong usage or a scene or golden that cannot be read; 3 a run diverged.\n";

typedef struct SceneList {
    int count, capacity;
    char **path;
} SceneList;

typedef struct CheckOptions {
    double tolerance_mm, duration_s;   // duration < 0: not given
    bool update, quiet;
    int threads;
} CheckOptions;

// --- which scenes ---

static void list_add(SceneList *list, const char *path)
{
    for (int i = 0; i < list->count; i++)
        if (!strcmp(list->path[i], path))
            return;
    if (list->count == list->capacity) {
        list->capacity = list->capacity * 2 + 16;
        list->path = HEAP_GROWN(list->path, (size_t)list->capacity, sizeof *list->path);
    }
    list->path[list->count++] = HEAP_TEXT(path);
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n > m && !strcmp(text + n - m, end);
}

static char *golden_of(const char *scene)
{
    char *golden = golden_path_of(scene);
    if (!golden)
        heap_is_empty(strlen(scene), __FILE__);
    return golden;
}

static bool has_golden(const char *scene)
{
    char *golden = golden_of(scene);
    bool there = access(golden, F_OK) == 0;
    free(golden);
    return there;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

enum { DEEPEST_FOLDER = 32 };

// Symbolic links to folders are not followed, so there are no cycles.
static void find_scenes(const char *folder, int depth, SceneList *list)
{
    DIR *open = depth < DEEPEST_FOLDER ? opendir(folder) : NULL;
    for (struct dirent *entry; open && (entry = readdir(open));) {
        struct stat status;
        size_t room = strlen(folder) + strlen(entry->d_name) + 2;
        if (entry->d_name[0] == '.')
            continue;
        char *path = HEAP_ZEROED(room, 1);
        bool slash = ends_with(folder, "/");
        snprintf(path, room, "%s%s%s", folder, slash ? "" : "/", entry->d_name);
        if (lstat(path, &status) == 0 && S_ISDIR(status.st_mode))
            find_scenes(path, depth + 1, list);
        else if ((ends_with(path, ".yaml") || ends_with(path, ".yml")) && (has_golden(path) || check_has_verify(path)))
            list_add(list, path);
        free(path);
    }
    if (open)
        closedir(open);
}

// --- one scene ---

typedef struct Sampling {
    ToolPath *path;
    bool no_memory;
} Sampling;

static bool sample_step(void *context, Simulator *simulator, const ToolCommands *commands)
{
    (void)commands;
    Sampling *sampling = context;
    sampling->no_memory |= !tool_path_sample(sampling->path, simulator, false);
    return !sampling->no_memory;
}

// The tool path of a run of `duration_s`; NULL with faults. *diverged says that it ended early.
static ToolPath *run_path(Scene *scene, double duration_s, const CheckOptions *options, bool *diverged, Faults *faults)
{
    OpenVessel open = {0};
    Sampling sampling = {0};
    Simulator *simulator = NULL;
    if (cli_open_vessel(scene, options->threads, options->quiet, &open, faults) && open_vessel_inlet(scene, &open, faults))
        simulator = simulator_create(scene, open.vessel, faults);
    if (simulator && (sampling.path = tool_path_create(simulator, duration_s))) {
        DriveOptions drive = drive_default_options();
        drive.script = scene->script;
        drive.duration_s = duration_s;
        drive.after_step = sample_step;
        drive.context = &sampling;
        *diverged = simulator_drive(simulator, &drive).end == DRIVE_DIVERGED;
        sampling.no_memory |= !tool_path_sample(sampling.path, simulator, true);
    }
    if (simulator && (!sampling.path || sampling.no_memory)) {
        faults_add(faults, scene->path, 0, 0, "no memory for its tool path");
        tool_path_free(sampling.path);
        sampling.path = NULL;
    }
    simulator_destroy(simulator);
    open_vessel_close(&open);
    return sampling.path;
}

static ToolPath *load_golden(const char *path, Faults *faults)
{
    size_t length;
    char *text = text_file_read(path, &length, faults);
    ToolPath *golden = text ? tool_path_parse(text, length, path, faults) : NULL;
    free(text);
    return golden;
}

static void save_golden(const char *path, const ToolPath *run, Faults *faults)
{
    size_t length;
    char *text = tool_path_print(run, &length);
    if (text)
        output_write(path, text, length, faults);
    else
        faults_add(faults, path, 0, 0, "no memory");
    free(text);
}

static void print_row(const char *path, const Scene *scene, const PathDifference *difference, const CheckOptions *options)
{
    if (!difference->differs) {
        if (!options->quiet)
            printf("%-44s same      %12.7f\n", path, difference->worst_mm);
        return;
    }
    printf("%-44s DIFFERS   %12.7f", path, difference->worst_mm);
    if (difference->first_node >= 0)
        printf("  %9.3f %5d %12.7f", difference->first_t_s, difference->first_node, difference->first_mm);
    else
        printf("  %9s %5s %12s", "-", "-", "-");
    if (difference->first_node >= 0 && scene->tool_count > 1 && difference->first_tool < scene->tool_count)
        printf("  of %s", scene->tool[difference->first_tool].name);
    printf("%s%s\n", difference->remark[0] ? "  " : "", difference->remark);
}

// Exit code for one scene; prints its row.
static int check_scene(const char *path, const CheckOptions *options, Faults *faults)
{
    int before = faults->count, code = EXIT_BAD_INPUT;
    char *golden_path = golden_of(path);
    Scene *scene = scene_load(path, faults);
    ToolPath *golden = NULL, *run = NULL;
    bool diverged = false, there = access(golden_path, F_OK) == 0;
    const char *needed = scene ? scene_needed_file(scene) : NULL;
    if (needed && access(needed, F_OK) != 0) {
        printf("%-44s skipped   %s is not there\n", path, needed);
        scene_free(scene);
        free(golden_path);
        return EXIT_DONE;
    }
    if (there)
        golden = load_golden(golden_path, faults);
    // a golden that cannot be read is rewritten by --update all the same
    if (options->update && !golden && scene)
        faults->count = before;
    double duration = golden ? golden->duration_s : 1;
    if (scene && options->update)
        duration = options->duration_s >= 0 ? options->duration_s : scene->script ? script_duration_s(scene->script) : duration;
    if (scene && faults->count == before)
        run = run_path(scene, duration, options, &diverged, faults);
    if (run && options->update) {
        OutputPlan plan = {.faults = faults};
        output_plan_write_file(&plan, "--update", golden_path);
        output_plan_read_scene(&plan, scene);
        if (faults->count == before)
            save_golden(golden_path, run, faults);
        if (faults->count == before) {
            printf("%-44s %s   %12s\n", path, there ? "rewritten" : "written  ", "");
            code = EXIT_DONE;
        }
    } else if (run && golden) {
        PathDifference difference = tool_path_compare(golden, run, options->tolerance_mm);
        print_row(path, scene, &difference, options);
        code = difference.differs ? EXIT_DIFFERENT : EXIT_DONE;
    }
    if (diverged) {
        fprintf(stderr, "%s: the run diverged\n", path);
        code = EXIT_UNTRUSTED;
    }
    tool_path_free(run);
    tool_path_free(golden);
    scene_free(scene);
    free(golden_path);
    return code;
}

// --- the verb ---

static int parse_options(int argc, char **argv, CheckOptions *options)
{
    enum { TOLERANCE = 256, UPDATE, DURATION, THREADS, QUIET, HELP };
    static const struct option table[] = {{"tolerance-mm", required_argument, NULL, TOLERANCE},
                                          {"update", no_argument, NULL, UPDATE},
                                          {"duration-s", required_argument, NULL, DURATION},
                                          {"threads", required_argument, NULL, THREADS},
                                          {"quiet", no_argument, NULL, QUIET},
                                          {"help", no_argument, NULL, HELP},
                                          {0}};
    *options = (CheckOptions){.tolerance_mm = COMPARE_TOLERANCE_MM, .duration_s = -1};
    double number;
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case TOLERANCE:
            if (!cli_number("--tolerance-mm", optarg, 0, 1e6, &options->tolerance_mm))
                return EXIT_BAD_INPUT;
            break;
        case DURATION:
            if (!cli_number("--duration-s", optarg, 0, SCRIPT_LONGEST_S, &options->duration_s))
                return EXIT_BAD_INPUT;
            break;
        case THREADS:
            if (!cli_whole_number("--threads", optarg, 0, 256, &number))
                return EXIT_BAD_INPUT;
            options->threads = (int)number;
            break;
        case UPDATE: options->update = true; break;
        case QUIET: options->quiet = true; break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: fprintf(stderr, "seldinger check: unknown option or lacking value; see `seldinger check --help`\n"); return EXIT_BAD_INPUT;
        }
    }
    if (optind == argc) {
        fprintf(stderr, "seldinger check: lacks the scenes or folders to check; see `seldinger check --help`\n");
        return EXIT_BAD_INPUT;
    }
    return -1;
}

static bool gather(int argc, char **argv, const CheckOptions *options, SceneList *list, Faults *faults)
{
    for (int i = optind; i < argc; i++) {
        struct stat status;
        int before = list->count;
        if (stat(argv[i], &status) != 0)
            faults_add(faults, argv[i], 0, 0, "is not there; give a scene (X.yaml) or a folder");
        else if (S_ISDIR(status.st_mode)) {
            find_scenes(argv[i], 0, list);
            qsort(list->path + before, (size_t)(list->count - before), sizeof *list->path, by_name);
        } else if (options->update || has_golden(argv[i]) || check_has_verify(argv[i]))
            list_add(list, argv[i]);
        else
            faults_add(faults, argv[i], 0, 0, "has no golden tool path beside it and no key `verify:`; `seldinger check --update` makes a golden path");
    }
    return faults->count == 0;
}

int verb_check(int argc, char **argv)
{
    static Faults faults;
    CheckOptions options;
    SceneList list = {0};
    int code = parse_options(argc, argv, &options), worst = EXIT_DONE;
    if (code >= 0)
        return code;
    faults_clear(&faults);
    gather(argc, argv, &options, &list, &faults);
    if (list.count == 0 && faults.count == 0) {
        // a check that checks nothing has not passed
        fprintf(stderr, "seldinger check: no scene with a golden tool path or the key `verify:` below what was given; `--update` with a scene makes a path\n");
        worst = EXIT_BAD_INPUT;
    }
    bool headed = options.quiet || options.update;
    for (int i = 0; i < list.count; i++) {
        // --update given a folder renews what is there; given a scene it makes one
        if (!has_golden(list.path[i]) && check_has_verify(list.path[i]))
            continue;
        if (!headed)
            printf("%-44s %-9s %12s  %9s %5s %12s\n", "scene", "", "worst mm", "first s", "node", "by mm");
        headed = true;
        code = check_scene(list.path[i], &options, &faults);
        worst = code > worst ? code : worst;
        fflush(stdout);
    }
    if (!options.update) {
        code = check_verify(list.count, list.path, options.threads, options.quiet, &faults);
        worst = code > worst ? code : worst;
    }
    if (faults.count > 0)
        worst = cli_bad_input(&faults) > worst ? EXIT_BAD_INPUT : worst;
    for (int i = 0; i < list.count; i++)
        free(list.path[i]);
    free(list.path);
    return worst;
}
