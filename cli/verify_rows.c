// A row of the table is a case at one number of elements: reference, result, error, tolerance, and the order of convergence p computed from this row and the
// one above,
// error = C N^-p. At the floor of an error (rounding, the digits of the reference, a term that the reference omits) the error falls no further; the order
// shown is then a lower bound.
#include "cli/verify_rows.h"

#include "sim/sim.h"

#include <math.h>

void verify_print_heading(void) { printf("%-40s %5s %16s %16s %9s %9s %6s\n", "case", "N", "reference", "result", "error", "tolerance", "order"); }

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

// The time of a run is shared by its cases.
static int add_case(CheckLog *log, const VerifyRun *run, const char *name, CheckStatus status, int code, const char *message)
{
    const Scene *scene = run->of->scene;
    char full[160];
    snprintf(full, sizeof full, "%s, %d elements", name, run->elements);
    return check_log_add(
        log,
        &(CheckCase){
            .scene = scene->path, .name = full, .status = status, .message = message, .time_s = run->wall_s / (scene->verify.case_count + 1), .code = code});
}

// Returns the exit code.
static int print_case(const VerifyRun *run, int runs, int index, bool quiet, CheckLog *log)
{
    const VerifyCase *c = &run[0].of->scene->verify.cases[index];
    int code = EXIT_DONE;
    double before = NAN;
    for (int i = 0; i < runs; i++) {
        if (run[i].diverged) {       // said once for the scene
            before = NAN;
            continue;
        }
        double result = run[i].result[index], error = fabs(result - c->reference);
        double tolerance = c->tolerance[c->tolerance_count > 1 ? i : 0], ratio = i > 0 ? (double)run[i].elements / run[i - 1].elements : 0;
        char order[16];
        const char *wrong = judge(c, error, tolerance, ratio, before, order);
        if (!quiet || *wrong)
            printf("%-40s %5d %16.9g %16.9g %9.1e %9.1e %6s%s\n", c->name, run[i].elements, c->reference, result, error, tolerance, order, wrong);
        char message[200] = "";
        if (*wrong)
            snprintf(message, sizeof message, "%s: %.9g instead of %.9g, error %.1e, tolerance %.1e%s%s", wrong + 2, result, c->reference, error, tolerance,
                     *order ? ", order of convergence " : "", order);
        int one = add_case(log, &run[i], c->name, *wrong ? CHECK_FAILED : CHECK_PASSED, *wrong ? EXIT_DIFFERENT : EXIT_DONE, message);
        code = one > code ? one : code;
        before = error;
    }
    return code;
}

// Whether the run came to rest and stayed valid. Returns the exit code.
static int print_end(const VerifyRun *run, bool quiet, CheckLog *log)
{
    const Scene *scene = run->of->scene;
    char message[120];
    for (int k = 0; k < STEP_FLAG_COUNT; k++)
        if (run->flags & ((1u << k) & ~(unsigned)(STEP_LIMITED | STEP_DIVERGED)) && !quiet)
            printf("%-40s %5d flag %s\n", scene->path, run->elements, step_flag_name[k]);
    if (run->diverged)
        return add_case(log, run, "run", CHECK_ERROR, EXIT_UNTRUSTED, "the run diverged");
    if (run->rested)
        return add_case(log, run, "run", CHECK_PASSED, EXIT_DONE, "");
    snprintf(message, sizeof message, "not at rest (%g mm/s) within rest_s %g s", scene->verify.rest_speed_mm_s, scene->verify.rest_s);
    printf("%-40s %5d %s  MISSED\n", scene->path, run->elements, message);
    return add_case(log, run, "run", CHECK_FAILED, EXIT_DIFFERENT, message);
}

static void print_diverged(const VerifyRun *run, int runs)
{
    bool is_first = true;
    for (int i = 0; i < runs; i++)
        if (run[i].diverged) {
            if (is_first)
                fprintf(stderr, "%s: the run diverged with %d", run->of->scene->path, run[i].elements);
            else
                fprintf(stderr, ", %d", run[i].elements);
            is_first = false;
        }
    fputs(is_first ? "" : " elements\n", stderr);
}

int verify_print_scene(const VerifyRun *run, int runs, bool quiet, CheckLog *log)
{
    const Scene *scene = run[0].of->scene;
    int code = EXIT_DONE;
    if (!quiet)
        printf("# %s\n", scene->path);
    for (int i = 0; i < runs; i++) {
        char text[FAULT_LENGTH * 2];
        faults_print(&run[i].faults, text, sizeof text);
        if (run[i].faults.count > 0) {
            fprintf(stderr, "with %d elements: %s", run[i].elements, text);
            return add_case(log, &run[i], "run", CHECK_ERROR, EXIT_BAD_INPUT, text);
        }
    }
    print_diverged(run, runs);
    for (int i = 0; i < scene->verify.case_count; i++) {
        int one = print_case(run, runs, i, quiet, log);
        code = one > code ? one : code;
    }
    for (int i = 0; i < runs; i++) {
        int one = print_end(&run[i], quiet, log);
        code = one > code ? one : code;
    }
    return code;
}
