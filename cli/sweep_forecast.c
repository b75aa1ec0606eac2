#include "cli/sweep_forecast.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void print_time(double seconds)
{
    if (seconds < 120)
        printf("%.3g s", seconds);
    else if (seconds < 3 * 3600)
        printf("%.0f min", seconds / 60);
    else if (seconds < 3 * 86400)
        printf("%.1f h", seconds / 3600);
    else
        printf("%.1f days", seconds / 86400);
}

static double cpu_of(const char *line)
{
    const char *at = line ? strstr(line, "\"cpu_s\":") : NULL;
    return at ? strtod(at + strlen("\"cpu_s\":"), NULL) : 0;
}

static void print_run(int64_t run, const char *line)
{
    cJSON *result = cJSON_Parse(line);
    const char *message = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(result, "message"));
    printf("run %lld: %.3g s; %s%s%s\n", (long long)run, cpu_of(line), cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(result, "status")),
           *message ? ": " : "", message);
    cJSON_Delete(result);
}

int sweep_dry_run(OpenStudy *open, const SweepOptions *options, Faults *faults)
{
    const Study *study = open->study;
    const int cores = parallel_thread_count(options->threads);
    double sum = 0;
    int tried = study->runs < 3 ? (int)study->runs : 3;
    printf("%s: %.0f runs of %d scene%s, %d varied key%s%s\n", study->path, study->runs, open->scene_count, open->scene_count == 1 ? "" : "s",
           study->factor_count, study->factor_count == 1 ? "" : "s", study->hands.wanted ? ", random hands" : "");
    if (study->runs > (double)STUDY_RUNS_MOST)
        printf("This is more than the limit of %lld: divide it into several specifications.\n", (long long)STUDY_RUNS_MOST);
    fflush(stdout);
    for (int i = 0; i < tried; i++) {
        int64_t run = (int64_t)(study->runs * i / tried);
        char *line = one_run(open, run, NULL, NULL, faults);
        if (i > 0 || tried == 1)     // the first one opened the vessel
            sum += cpu_of(line);
        if (line)
            print_run(run, line);
        free(line);
    }
    double each = sum / (tried > 1 ? tried - 1 : 1);
    printf("about %.3g s of a core each: ", each);
    print_time(each * study->runs / (double)cores);
    printf(" on %d core%s\n", cores, cores == 1 ? "" : "s");
    return EXIT_DONE;
}

// --- simulated ranks ---

typedef struct Times {
    double *run_s;
    int64_t count, bytes;
    char *sample;            // a result, to be written again
} Times;

static void note_time(void *context, int64_t run, const char *text, int64_t offset)
{
    (void)offset;
    Times *times = context;
    times->run_s[run] = cpu_of(text);
    times->bytes += (int64_t)strlen(text);
    times->count++;
    if (!times->sample)
        times->sample = HEAP_TEXT(text);
}

typedef struct Service {     // for a result
    double cpu_s, disk_s;    // the manager's processor time; by the clock, with all of the journal on the disk
} Service;

// The manager takes results into a journal of its own in the same folder.
static Service service_time(const char *folder, const Times *times, const cJSON *heading, int64_t runs, Faults *faults)
{
    enum { RESULTS = 20000 };
    Service service = {0};
    char name[] = "/service-XXXXXX", path[PATH_MAX], file[PATH_MAX];
    snprintf(path, sizeof path, "%.3900s%s", folder, name);
    if (!mkdtemp(path)) {
        faults_add(faults, folder, 0, 0, "cannot be written to");
        return service;
    }
    Journal *journal = journal_open(path, heading, runs, faults);
    Queue *queue = journal ? queue_create(runs, journal, NULL, faults) : NULL;
    double begin = clock_s(CLOCK_THREAD_CPUTIME_ID), clock = clock_s(CLOCK_MONOTONIC);
    for (int i = 0; queue && i < RESULTS; i++) {
        queue_take(queue);
        queue_finish(queue, times->sample);
    }
    service.cpu_s = (clock_s(CLOCK_THREAD_CPUTIME_ID) - begin) / RESULTS;
    queue_free(queue);
    journal_close(journal);
    service.disk_s = (clock_s(CLOCK_MONOTONIC) - clock) / RESULTS;
    for (const char *const *of = (const char *const[]){"journal.txt", "lock", NULL}; *of; of++) {
        snprintf(file, sizeof file, "%.4000s/%s", path, *of);
        unlink(file);
    }
    rmdir(path);
    return service;
}

int sweep_simulate_ranks(const SweepOptions *options, const cJSON *heading, int64_t runs, Faults *faults)
{
    static const double message_s = 20e-6;       // a message of 2 kB between two nodes; rank 0 looks for messages every 100 us
    Journal *journal = journal_open(options->output, heading, runs, faults);
    Times times = {.run_s = HEAP_ZEROED((size_t)runs, sizeof(double))};
    if (journal)
        journal_read(journal, note_time, &times);
    journal_close(journal);
    if (faults->count == 0 && times.count < runs)
        faults_add(faults, options->output, 0, 0, "has %lld of %lld results; finish the sweep first", (long long)times.count, (long long)runs);
    if (faults->count == 0) {
        // enough runs that the last ones, which not all ranks share, count little
        int64_t modelled = runs > 100 * (int64_t)options->simulate_ranks ? runs : 100 * (int64_t)options->simulate_ranks;
        QueueModel model = {.runs = modelled, .measured = runs, .run_s = times.run_s, .message_s = message_s + 100e-6};
        Service service = service_time(options->output, &times, heading, runs, faults);
        double bytes = (double)times.bytes / (double)runs;
        model.service_s = service.cpu_s;
        printf(
            "SIMULATED: %lld runs with the measured times of %lld in turn\nmeasured: %.1f us of processor time of the manager for a result; %.0f bytes in the "
            "journal, which takes %.1f MB/s to the disk by the clock\nassumed: %.0f us for a message; a core for each rank; the manager's own run loses no "
            "time to its service\n",
            (long long)modelled, (long long)runs, service.cpu_s * 1e6, bytes, bytes / service.disk_s * 1e-6, model.message_s * 1e6);
        printf("%7s %12s %11s %14s %12s %14s\n", "ranks", "time [s]", "efficiency", "manager's share", "results/s", "journal [MB/s]");
        for (int ranks = 1;; ranks = ranks * 2 < options->simulate_ranks ? ranks * 2 : options->simulate_ranks) {
            model.ranks = ranks;
            QueueForecast f = queue_forecast(&model);
            printf("%7d %12.3f %11.3f %15.4f %12.1f %14.3f\n", ranks, f.wall_s, f.efficiency, f.manager_share, f.results_a_second,
                   f.results_a_second * bytes * 1e-6);
            if (ranks == options->simulate_ranks)
                break;
        }
    }
    free(times.sample);
    free(times.run_s);
    return faults->count == 0 ? EXIT_DONE : EXIT_BAD_INPUT;
}
