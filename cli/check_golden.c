#include "cli/check_golden.h"

#include "cli/check_rows.h"
#include "sim/sim.h"

#include <stdlib.h>

// Each open scene belongs to one thread, so memory grows with the threads and not with the scenes.
typedef struct Job {
    CheckCase result;
    char message[GOLDEN_MESSAGE];
    char *row, *complaint;   // for standard output and standard error
    size_t row_length;
    ATOMIC(bool) is_done;
} Job;

typedef struct Check {
    const GoldenOptions *options;
    CheckLog *log;
    pthread_mutex_t opening;
    Job *job;
    long printed;
    int worst;
} Check;

enum { COMPLAINT = (FAULTS_CAPACITY + 1) * FAULT_LENGTH };

static void check_job(void *context, long index)
{
    Check *check = context;
    Job *job = &check->job[index];
    double begin = clock_s(CLOCK_MONOTONIC);
    Faults *faults = HEAP_ZEROED(1, sizeof *faults);
    FILE *row = open_memstream(&job->row, &job->row_length);
    if (!row)
        heap_is_empty(1, __FILE__);
    golden_case(check->options, &check->opening, &job->result, job->message, row, faults);
    fclose(row);
    if (faults->count > 0) {
        job->complaint = HEAP_ZEROED(COMPLAINT, 1);
        faults_print(faults, job->complaint, COMPLAINT);
        job->result.code = job->result.code > EXIT_BAD_INPUT ? job->result.code : EXIT_BAD_INPUT;
        job->result.status = CHECK_ERROR;
    }
    free(faults);
    job->result.time_s = clock_s(CLOCK_MONOTONIC) - begin;
    atomic_store(&job->is_done, true);
}

// Called by the thread that waits for the others.
static void print_ready(void *context, long done, long total)
{
    Check *check = context;
    (void)done;
    for (; check->printed < total && atomic_load(&check->job[check->printed].is_done); check->printed++) {
        Job *job = &check->job[check->printed];
        CheckCase one = job->result;
        fputs(job->row, stdout);
        fflush(stdout);
        if (job->complaint)
            fputs(job->complaint, stderr);
        else if (one.code == EXIT_UNTRUSTED)
            fprintf(stderr, "%s: %s\n", one.scene, job->message);
        one.message = job->complaint ? job->complaint : job->message;
        check_log_add(check->log, &one);
        check->worst = one.code > check->worst ? one.code : check->worst;
        free(job->row);
        free(job->complaint);
    }
}

int check_golden(const SceneList *list, const GoldenOptions *options, CheckLog *log)
{
    Check check = {.options = options, .log = log, .job = HEAP_ZEROED((size_t)list->count + 1, sizeof *check.job)};
    for (int i = 0; i < list->count; i++)
        check.job[i].result = (CheckCase){.scene = list->path[i], .name = "golden run", .status = CHECK_ERROR, .code = EXIT_BAD_INPUT};
    if (list->count > 0 && !options->quiet && !options->writes)
        printf("%-44s %-9s %12s  %9s %5s %12s\n", "scene", "", "worst mm", "first s", "node", "by mm");
    pthread_mutex_init(&check.opening, NULL);
    if (list->count > 0)
        parallel_for(options->threads, list->count, check_job, &check, &(Progress){print_ready, &check, NULL});
    pthread_mutex_destroy(&check.opening);
    free(check.job);
    return check.worst;
}
