// seldinger check: runs scenes headless and compares them with golden runs (golden_case.c), beside the scenes or in a baseline, or writes these; measures scenes
// with a `verify:` key against their references (check_verify.c).
#include "cli/check_files.h"
#include "cli/check_golden.h"
#include "cli/check_scenes.h"
#include "cli/check_verify.h"

#include "sim/sim.h"

#include <limits.h>

typedef struct CheckOptions {
    char **path;
    int path_count;
    bool update;
    const char *tolerances, *store, *version, *against;
    CheckFiles files;
    GoldenOptions golden;
} CheckOptions;

#define AT(member) OPTION_AT(CheckOptions, member)
static const Option rows[] = {
    {"tolerance-mm", "X", OPTION_NUMBER, AT(golden.tolerance_mm),
     "largest distance [mm] between golden and run that passes; rounding on other machines stays below the default, a change of a parameter by 1 % does not. "
     "If it is given, paths alone are compared",
     .most = 1e6, .otherwise = "that of the scene or of --tolerances, else 1e-05"},
    {"tolerances", "F", OPTION_FILE, AT(tolerances), "tolerances by quantity, YAML; the key `check:` of a scene comes before them", .otherwise = ""},
    {"update", NULL, OPTION_FLAG, AT(update), "rewrites the golden runs; a scene given as PATH gets one if it has none"},
    {"duration-s", "S", OPTION_NUMBER, AT(golden.duration_s), "with --update or --store: simulated time [s] of the golden", .most = SCRIPT_LONGEST_S,
     .otherwise = "the script's, else the old golden's, else 1"},
    CLI_THREADS(CheckOptions, golden.threads),
    CLI_QUIET(CheckOptions, golden.quiet, "only what differs or misses its tolerance"),
    {"json", "F", OPTION_FILE, AT(files.json), "writes all cases as JSON", .otherwise = "", .group = "Results for other programs and readers"},
    {"junit", "F", OPTION_FILE, AT(files.junit), "writes all cases as JUnit XML, which GitLab, Jenkins and GitHub's actions show", .otherwise = ""},
    {"page", "F", OPTION_FILE, AT(files.page), "writes a page (HTML) that shows where paths part", .otherwise = ""},
    {"store", "FOLDER", OPTION_FOLDER, AT(store), "runs every scene below PATH and stores golden runs as the baseline FOLDER/VERSION", .otherwise = "",
     .group = "Baselines of versions"},
    {"as", "VERSION", OPTION_TEXT, AT(version), "with --store: the name of the baseline", .otherwise = "this program's version"},
    {"against", "FOLDER/VERSION", OPTION_FOLDER, AT(against), "compares with that baseline instead of the golden runs beside the scenes", .otherwise = ""},
};

static void set_defaults(void *structure) { *(CheckOptions *)structure = (CheckOptions){.golden = {.tolerance_mm = -1, .duration_s = -1}}; }

static const char *check_combination(void *structure)
{
    const CheckOptions *options = structure;
    if (options->update + (options->store != NULL) + (options->against != NULL) > 1)
        return "--update, --store and --against exclude each other";
    return options->version && !options->store ? "--as needs --store" : NULL;
}

static const OptionTable table = {
    .program = "seldinger check",
    .does = "runs every scene that has a golden tool path and compares the paths",
    .usage = "PATH... [options]",
    .intro =
        "Runs every scene (X.yaml) below PATH that has a golden tool path (X.golden.csv), several at once, and compares the two paths point by point over "
        "time, "
        "and the figures if there are golden ones (X.golden-figures.csv). The table shows each scene, its worst distance, the first time, node and distance "
        "beyond the tolerance, and the figures beyond theirs.\n"
        "Then every scene below PATH with the key `verify:` is measured against exact solutions, at several numbers of elements: case, reference, result, "
        "error, tolerance, and the order of convergence of the error. The key is described in scenes/verify/README.md.",
    .notes = "Scenes whose vessel file is missing are skipped and listed. A scene that is missing, cannot be read or diverges is one case; the others go on. "
             "Scenes are named in a baseline by their path below the current folder.",
    .exits = "0 all pass; 1 a path or figure differs or a tolerance is missed; 2 wrong usage or a scene or golden that cannot be read; 3 a run diverged",
    CLI_OPTIONS(rows, CheckOptions),
    .set_defaults = set_defaults,
    .check = check_combination,
    .takes_argument = true,
    .argument = offsetof(CheckOptions, path),
    .argument_count = offsetof(CheckOptions, path_count),
    .missing = "missing the scenes or folders to check",
};

static int call(void *structure, Faults *faults)
{
    CheckOptions *options = structure;
    GoldenOptions *golden = &options->golden;
    CheckScenes scenes = {.update = options->update, .stores = options->store != NULL, .baseline = options->against};
    CheckLog log = {0};
    char baseline[PATH_MAX];
    OutputPlan plan = {.faults = faults};
    check_files_plan(&options->files, &plan);
    output_plan_read(&plan, "--tolerances", options->tolerances);
    golden->has_page = options->files.page != NULL;
    golden->writes = options->update || options->store;
    if (options->tolerances)
        tolerances_load(options->tolerances, &golden->tolerances, faults);
    if (options->against && baseline_check(options->against, faults))
        golden->baseline = options->against;
    if (options->store && faults->count == 0 && baseline_begin(options->store, options->version ? options->version : SELDINGER_VERSION, baseline, faults))
        golden->baseline = baseline;
    if (faults->count > 0)
        return EXIT_BAD_INPUT;
    int worst = check_scenes_gather(&scenes, options->path_count, options->path, &log), code = check_golden(&scenes.golden, golden, &log);
    worst = code > worst ? code : worst;
    code = check_verify(scenes.verify.count, scenes.verify.path, golden->threads, golden->quiet, &log, faults);
    worst = code > worst ? code : worst;
    if (log.count == 0) {
        // a check without any comparison has not passed
        fprintf(stderr, "seldinger check: no given scene or folder has a golden tool path or the key `verify:`; `--update SCENE` makes a golden path\n");
        worst = EXIT_BAD_INPUT;
    }
    check_files_write(&options->files, &log, faults);
    check_log_free(&log);
    check_scenes_free(&scenes);
    return worst;
}

const Verb check_verb = {.options = &table, .call = call};
