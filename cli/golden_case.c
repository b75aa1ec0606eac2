#include "cli/golden_case.h"

#include "cli/check_rows.h"
#include "cli/output_plan.h"
#include "sim/sim.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// What one run takes and gives.
typedef struct One {
    const GoldenOptions *options;
    pthread_mutex_t *opening;
    Scene *scene;
    OpenVessel open;
    char *golden_path, *figures_path;
    ToolPath *golden, *run;
    GoldenFigures golden_figures, run_figures;
    bool has_figures, diverged;
    FILE *row;
    Faults *faults;
} One;

static int write_golden(const One *one)
{
    int before = one->faults->count;
    bool there = access(one->golden_path, F_OK) == 0;
    OutputPlan plan = {.faults = one->faults};
    char folder[PATH_MAX];
    snprintf(folder, sizeof folder, "%s", one->golden_path);
    char *slash = strrchr(folder, '/');
    if (one->options->baseline && slash) {
        *slash = 0;
        if (!folders_create(folder))
            faults_add(one->faults, folder, 0, 0, "cannot be created; expected a folder in which files can be written");
    }
    output_plan_write_file(&plan, "--update", one->golden_path);
    output_plan_write_file(&plan, "--update", one->figures_path);
    output_plan_read_scene(&plan, one->scene);
    if (one->faults->count == before)
        golden_save(one->golden_path, one->run, one->faults);
    if (one->faults->count == before)
        golden_figures_save(one->figures_path, &one->run_figures, one->faults);
    if (one->faults->count > before)
        return EXIT_BAD_INPUT;
    fprintf(one->row, "%-44s %s   %12s\n", one->scene->path, there ? "rewritten" : "written  ", "");
    return EXIT_DONE;
}

static GoldenComparison *compare(One *one)
{
    Tolerances own = tolerances_of_scene(one->scene->text), tolerances = tolerances_over(&own, &one->options->tolerances);
    GoldenComparison *comparison = HEAP_ZEROED(1, sizeof *comparison);
    double position = one->options->tolerance_mm >= 0 ? one->options->tolerance_mm : tolerance_of(&tolerances, TOLERANCE_POSITION);
    PathDifference *path = &comparison->path;
    *path = tool_path_compare(one->golden, one->run, position);
    if (one->has_figures)
        golden_figures_compare(&one->golden_figures, &one->run_figures, &tolerances, comparison->quantity, comparison->remark, sizeof comparison->remark);
    comparison->quantity[TOLERANCE_POSITION] = (FigureDifference){true, path->worst_mm, position, path->first_node >= 0 ? path->first_t_s : -1, path->first_mm};
    if (one->options->has_page && check_differs(comparison)) {
        comparison->golden = one->golden;
        comparison->run = one->run;
        comparison->figures = one->run_figures;
        one->golden = one->run = NULL;
        one->run_figures = (GoldenFigures){0};
        check_wall_copy(&comparison->wall, one->scene, &one->open);
    }
    return comparison;
}

static void simulate(One *one)
{
    const GoldenOptions *options = one->options;
    int before = one->faults->count;
    bool there = access(one->golden_path, F_OK) == 0;
    if (there && !(one->golden = golden_load(one->golden_path, one->faults)) && options->writes)
        one->faults->count = before;     // a golden path that cannot be read is rewritten
    if (!options->writes && options->tolerance_mm < 0 && access(one->figures_path, F_OK) == 0)
        one->has_figures = golden_figures_load(one->figures_path, &one->golden_figures, one->faults);
    double duration = one->golden ? one->golden->duration_s : 1;
    if (options->writes)
        duration = options->duration_s >= 0 ? options->duration_s : one->scene->script ? script_duration_s(one->scene->script) : duration;
    if (one->faults->count > before)
        return;
    pthread_mutex_lock(one->opening);
    bool is_open = cli_open_scene(one->scene, options->threads, true, &one->open, one->faults);
    pthread_mutex_unlock(one->opening);
    if (is_open)
        one->run = golden_run_measured(one->scene, &one->open, duration, &one->run_figures, &one->diverged, one->faults);
}

static void judge(One *one, CheckCase *result, char message[GOLDEN_MESSAGE])
{
    const char *needed = scene_needed_file(one->scene);
    if (needed && access(needed, F_OK) != 0) {
        snprintf(message, GOLDEN_MESSAGE, "%s is missing", needed);
        fprintf(one->row, "%-44s skipped   %s\n", result->scene, message);
        result->code = EXIT_DONE;
        result->status = CHECK_SKIPPED;
    } else {
        simulate(one);
        if (one->diverged)
            snprintf(message, GOLDEN_MESSAGE, "the run diverged at %.3f s", one->run_figures.end_s);
        if (one->run && one->options->writes) {
            result->code = write_golden(one);
        } else if (one->run && one->golden) {
            result->comparison = compare(one);
            if (!one->diverged) {        // else its message says it
                check_print_row(one->row, one->scene, result->comparison, one->options->quiet);
                check_describe(result->comparison, message, GOLDEN_MESSAGE);
            }
            result->code = check_differs(result->comparison) ? EXIT_DIFFERENT : EXIT_DONE;
        }
        result->code = one->diverged ? EXIT_UNTRUSTED : result->code;
        result->status = result->code == EXIT_DONE ? CHECK_PASSED : result->code == EXIT_DIFFERENT ? CHECK_FAILED : CHECK_ERROR;
    }
}

void golden_case(const GoldenOptions *options, pthread_mutex_t *opening, CheckCase *result, char message[GOLDEN_MESSAGE], FILE *row, Faults *faults)
{
    One one = {.options = options, .opening = opening, .row = row, .faults = faults};
    one.golden_path = options->baseline ? baseline_path_of(options->baseline, result->scene) : golden_path_of(result->scene);
    if (!one.golden_path)
        heap_is_empty(strlen(result->scene), __FILE__);
    one.figures_path = golden_figures_path(one.golden_path);
    if ((one.scene = scene_load(result->scene, faults)))
        judge(&one, result, message);
    tool_path_free(one.run);
    tool_path_free(one.golden);
    golden_figures_free(&one.run_figures);
    golden_figures_free(&one.golden_figures);
    open_vessel_close(&one.open);
    scene_free(one.scene);
    free(one.golden_path);
    free(one.figures_path);
}
