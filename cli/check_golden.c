#include "cli/check_golden.h"

#include "cli/output_plan.h"
#include "sim/sim.h"

#include <stdlib.h>
#include <unistd.h>

static void print_row(const char *path, const Scene *scene, const PathDifference *difference, const GoldenOptions *options)
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

static int update(const char *golden_path, bool there, const Scene *scene, const ToolPath *run, Faults *faults)
{
    int before = faults->count;
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "--update", golden_path);
    output_plan_read_scene(&plan, scene);
    if (faults->count == before)
        golden_save(golden_path, run, faults);
    if (faults->count > before)
        return EXIT_BAD_INPUT;
    printf("%-44s %s   %12s\n", scene->path, there ? "rewritten" : "written  ", "");
    return EXIT_DONE;
}

// Runs the scene and compares or writes its golden path; returns an exit code. The file `golden_path` may be missing.
static int check_path(const GoldenOptions *options, Scene *scene, const char *golden_path, Faults *faults)
{
    const char *path = scene->path;
    bool there = access(golden_path, F_OK) == 0, diverged = false;
    int before = faults->count, code = EXIT_BAD_INPUT;
    ToolPath *golden = there ? golden_load(golden_path, faults) : NULL, *run = NULL;
    OpenVessel open = {0};
    // --update rewrites a golden path even if it cannot be read
    if (options->update && !golden)
        faults->count = before;
    double duration = golden ? golden->duration_s : 1;
    if (options->update)
        duration = options->duration_s >= 0 ? options->duration_s : scene->script ? script_duration_s(scene->script) : duration;
    if (faults->count == before && cli_open_scene(scene, options->threads, options->quiet, &open, faults))
        run = golden_run(scene, &open, duration, &diverged, faults);
    if (run && options->update) {
        code = update(golden_path, there, scene, run, faults);
    } else if (run && golden) {
        PathDifference difference = tool_path_compare(golden, run, options->tolerance_mm);
        print_row(path, scene, &difference, options);
        code = difference.differs ? EXIT_DIFFERENT : EXIT_DONE;
    }
    if (diverged)
        fprintf(stderr, "%s: the run diverged\n", path);
    tool_path_free(run);
    tool_path_free(golden);
    open_vessel_close(&open);
    return diverged ? EXIT_UNTRUSTED : code;
}

int check_golden(const char *path, const GoldenOptions *options, Faults *faults)
{
    int code = EXIT_BAD_INPUT;
    char *golden_path = golden_path_of(path);
    Scene *scene = scene_load(path, faults);
    const char *needed = scene ? scene_needed_file(scene) : NULL;
    if (!golden_path) {
        faults_add(faults, path, 0, 0, "out of memory");
    } else if (needed && access(needed, F_OK) != 0) {
        printf("%-44s skipped   %s is missing\n", path, needed);
        code = EXIT_DONE;
    } else if (scene) {
        code = check_path(options, scene, golden_path, faults);
    }
    scene_free(scene);
    free(golden_path);
    return code;
}
