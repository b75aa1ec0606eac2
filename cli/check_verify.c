// A row of the table is a case at one number of elements: reference, result, error, tolerance, and the order of convergence p computed from this row and the
// one above,
// error = C N^-p. At the floor of an error (rounding, the digits of the reference, a term that the reference omits) the error falls no further; the order
// shown is then a lower bound.
#include "cli/check_verify.h"

#include "sim/sim.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

// --- the table ---

static void print_heading(void) { printf("%-40s %5s %16s %16s %9s %9s %6s\n", "case", "N", "reference", "result", "error", "tolerance", "order"); }

// Returns what is wrong with a row, "" for nothing; `order_text` is the order of convergence from the row above.
static const char *judge(const VerifyCase *c, double error, double tolerance, double ratio, double error_before, char order_text[16])
{
    // rounding error of a result of this size
    double floor_error = fmax(c->floor, 1e-11 * fmax(fabs(c->reference), 1e-3));
    order_text[0] = 0;
    if (isnan(error))
        return "  NOT MEASURED";
    bool comparable = c->order > 0 && ratio > 0 && !isnan(error_before) && error_before > floor_error;
    double order = comparable ? log(error_before / fmax(error, floor_error)) / log(ratio) : 0;
    if (comparable)
        snprintf(order_text, 16, "%s%.2f", error > floor_error ? "" : ">", order);
    if (!(error <= tolerance))
        return "  MISSED";
    if (comparable && error > floor_error && order < c->order)
        return "  ORDER";
    return "";
}

// Returns true if every row passes.
static bool print_case(const VerifyRun *run, int runs, int index, bool quiet)
{
    const VerifyCase *c = &run[0].of->scene->verify.cases[index];
    bool good = true;
    double before = NAN;
    for (int i = 0; i < runs; i++) {
        double result = run[i].result[index], error = fabs(result - c->reference);
        double tolerance = c->tolerance[c->tolerance_count > 1 ? i : 0], ratio = i > 0 ? (double)run[i].elements / run[i - 1].elements : 0;
        char order[16];
        const char *wrong = judge(c, error, tolerance, ratio, before, order);
        if (!quiet || *wrong)
            printf("%-40s %5d %16.9g %16.9g %9.1e %9.1e %6s%s\n", c->name, run[i].elements, c->reference, result, error, tolerance, order, wrong);
        good &= !*wrong;
        before = error;
    }
    return good;
}

static int print_scene(const VerifyRun *run, int runs, bool quiet, Faults *faults)
{
    const Scene *scene = run[0].of->scene;
    int code = EXIT_DONE;
    if (!quiet)
        printf("# %s\n", scene->path);
    for (int i = 0; i < runs; i++) {
        for (int k = 0; k < run[i].faults.count && k < FAULTS_CAPACITY; k++)
            faults_add(faults, run[i].faults.text[k], 0, 0, "with %d elements", run[i].elements);
        if (run[i].faults.count > 0)
            return EXIT_BAD_INPUT;
    }
    for (int i = 0; i < scene->verify.case_count; i++)
        if (!print_case(run, runs, i, quiet))
            code = EXIT_DIFFERENT;
    for (int i = 0; i < runs; i++) {
        if (!run[i].rested) {
            printf("%-40s %5d not at rest (%g mm/s) within rest_s %g s  MISSED\n", scene->path, run[i].elements, scene->verify.rest_speed_mm_s,
                   scene->verify.rest_s);
            code = code > EXIT_DIFFERENT ? code : EXIT_DIFFERENT;
        }
        for (int k = 0; k < STEP_FLAG_COUNT; k++)
            if (run[i].flags & ((1u << k) & ~(unsigned)STEP_LIMITED) && !quiet)
                printf("%-40s %5d flag %s\n", scene->path, run[i].elements, step_flag_name[k]);
        if (run[i].diverged)
            code = EXIT_UNTRUSTED;
    }
    return code;
}

// --- all scenes ---

static int runs_of(const Scene *scene) { return scene->verify.element_count > 0 ? scene->verify.element_count : 1; }

static bool open_scene(const char *path, int threads, bool quiet, VerifyScene *out, Faults *faults)
{
    int before = faults->count;
    Scene *scene = out->scene = scene_load(path, faults);
    if (!scene)
        return false;
    const char *needed = scene_needed_file(scene);
    if (needed && access(needed, F_OK) != 0) {
        printf("# %s: skipped, %s is missing\n", path, needed);
        return false;
    }
    return cli_open_vessel(scene, threads, quiet, &out->open, faults) && open_vessel_inlet(scene, &out->open, faults) && faults->count == before;
}

int check_verify(int count, char *const *path, int threads, bool quiet, Faults *faults)
{
    VerifyScene *scene = calloc((size_t)count + 1, sizeof *scene);
    int scenes = 0, runs = 0, code = EXIT_DONE;
    for (int i = 0; scene && i < count; i++) {
        if (!scene_has_verify(path[i]))
            continue;
        if (open_scene(path[i], threads, quiet, &scene[scenes], faults) && scene[scenes].scene->verify.case_count > 0)
            runs += runs_of(scene[scenes++].scene);
        else {
            open_vessel_close(&scene[scenes].open);
            scene_free(scene[scenes].scene);
            scene[scenes] = (VerifyScene){0};
        }
    }
    VerifyRun *run = scene ? calloc((size_t)runs + 1, sizeof *run) : NULL;
    if (!run)
        faults_add(faults, "seldinger check", 0, 0, "out of memory");
    for (int i = 0, k = 0; run && i < scenes; i++)
        for (int n = 0; n < runs_of(scene[i].scene); n++, k++) {
            const VerifyPlan *plan = &scene[i].scene->verify;
            run[k].of = &scene[i];
            run[k].elements = plan->element_count > 0 ? plan->element[n] : scene[i].scene->wire.elements;
        }
    ProgressBar bar;
    Progress progress = progress_bar(&bar, "verify", quiet);
    if (run && runs > 0) {
        parallel_for(threads, runs, verify_run_job, run, &progress);
        if (!quiet)
            print_heading();
        for (int i = 0, k = 0; i < scenes; k += runs_of(scene[i].scene), i++) {
            int one = print_scene(run + k, runs_of(scene[i].scene), quiet, faults);
            code = one > code ? one : code;
        }
    }
    for (int i = 0; i < scenes; i++) {
        open_vessel_close(&scene[i].open);
        scene_free(scene[i].scene);
    }
    free(scene);
    free(run);
    return code;
}
