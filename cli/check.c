// seldinger check: runs every scene with a golden tool path (X.yaml with X.golden.csv in the same folder) headless and compares the paths; measures every scene
// with a
// `verify:` key against its references (check_verify.c).
#include "cli/check_golden.h"
#include "cli/check_verify.h"

#include "sim/sim.h"

#include <sys/stat.h>

typedef struct CheckOptions {
    char **path;
    int path_count;
    GoldenOptions golden;
} CheckOptions;

#define AT(member) OPTION_AT(CheckOptions, member)
static const Option rows[] = {
    {"tolerance-mm", "X", OPTION_NUMBER, AT(golden.tolerance_mm),
     "largest distance [mm] between golden and run that passes; rounding on other machines stays below the default, a change of a parameter by 1 % does not",
     .most = 1e6},
    {"update", NULL, OPTION_FLAG, AT(golden.update), "rewrites the golden paths; a scene given as PATH gets one if it has none"},
    {"duration-s", "S", OPTION_NUMBER, AT(golden.duration_s), "with --update: simulated time [s] of the golden", .most = SCRIPT_LONGEST_S,
     .otherwise = "the script's, else the old golden's, else 1"},
    CLI_THREADS(CheckOptions, golden.threads),
    CLI_QUIET(CheckOptions, golden.quiet, "only what differs or misses its tolerance"),
};

static void set_defaults(void *structure) { *(CheckOptions *)structure = (CheckOptions){.golden = {.tolerance_mm = COMPARE_TOLERANCE_MM, .duration_s = -1}}; }

static const OptionTable table = {
    .program = "seldinger check",
    .does = "runs every scene that has a golden tool path and compares the paths",
    .usage = "PATH... [options]",
    .intro =
        "Runs every scene (X.yaml) below PATH that has a golden tool path (X.golden.csv) and compares the two paths point by point over time. The table shows "
        "each scene, its worst distance, and the first time, node and distance beyond the tolerance.\n"
        "Then every scene below PATH with the key `verify:` is measured against exact solutions, at several numbers of elements: case, reference, result, "
        "error, tolerance, and the order of convergence of the error. The key is described in scenes/verify/README.md.",
    .notes = "Scenes whose vessel file is missing are skipped and listed.",
    .exits = "0 all pass; 1 a path differs or a tolerance is missed; 2 wrong usage or a scene or golden that cannot be read; 3 a run diverged",
    CLI_OPTIONS(rows, CheckOptions),
    .set_defaults = set_defaults,
    .takes_argument = true,
    .argument = offsetof(CheckOptions, path),
    .argument_count = offsetof(CheckOptions, path_count),
    .missing = "missing the scenes or folders to check",
};

static void gather(const CheckOptions *options, SceneList *list, Faults *faults)
{
    for (int i = 0; i < options->path_count; i++) {
        const char *path = options->path[i];
        struct stat status;
        if (stat(path, &status) != 0)
            faults_add(faults, path, 0, 0, "does not exist; give a scene (X.yaml) or a folder");
        else if (S_ISDIR(status.st_mode))
            scene_list_add_folder(list, path);
        else if (options->golden.update || scene_has_golden(path) || scene_has_verify(path))
            scene_list_add(list, path);
        else
            faults_add(faults, path, 0, 0, "has no golden tool path in its folder and no key `verify:`; `seldinger check --update` makes a golden path");
    }
}

static int call(void *structure, Faults *faults)
{
    const CheckOptions *wanted = structure;
    const GoldenOptions *options = &wanted->golden;
    SceneList list = {0};
    int worst = EXIT_DONE, code;
    bool headed = options->quiet || options->update;
    gather(wanted, &list, faults);
    if (list.count == 0 && faults->count == 0) {
        // a check without any comparison has not passed
        fprintf(stderr, "seldinger check: no given scene or folder has a golden tool path or the key `verify:`; `--update SCENE` makes a golden path\n");
        worst = EXIT_BAD_INPUT;
    }
    for (int i = 0; i < list.count; i++) {
        // --update with a folder renews the existing golden paths; with a scene it also creates one
        if (!scene_has_golden(list.path[i]) && scene_has_verify(list.path[i]))
            continue;
        if (!headed)
            printf("%-44s %-9s %12s  %9s %5s %12s\n", "scene", "", "worst mm", "first s", "node", "by mm");
        headed = true;
        code = check_golden(list.path[i], options, faults);
        worst = code > worst ? code : worst;
        fflush(stdout);
    }
    code = options->update ? EXIT_DONE : check_verify(list.count, list.path, options->threads, options->quiet, faults);
    scene_list_free(&list);
    return code > worst ? code : worst;
}

const Verb check_verb = {.options = &table, .call = call};
