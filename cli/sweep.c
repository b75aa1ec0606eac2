// seldinger sweep: many runs of a scene with other values.
#include "cli/sweep_options.h"

#include "cli/cli.h"
#include "cli/sweep_forecast.h"
#include "cli/sweep_report.h"
#include "study/study.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct Sweep {
    const SweepOptions *options;
    const volatile sig_atomic_t *stop;
    Ranks ranks;
    Study *study;
    OpenStudy *open;
    cJSON *heading;
    char *heading_text, recordings[PATH_MAX];
    Faults *faults;
} Sweep;

static bool prepare_folder(const Sweep *sweep)
{
    char path[PATH_MAX];
    const char *folder = sweep->options->output;
    snprintf(path, sizeof path, "%.4000s/spec.yaml", folder);
    bool good = output_write(path, sweep->study->text, sweep->study->length, sweep->faults);
    if (good && sweep->study->record != RECORD_NONE && mkdir(sweep->recordings, 0777) != 0 && errno != EEXIST) {
        faults_add(sweep->faults, sweep->recordings, 0, 0, "cannot be created: %s", strerror(errno));
        good = false;
    }
    return good;
}

static void print_end(const Sweep *sweep, const QueueState *state)
{
    if (isatty(STDERR_FILENO))
        fputc('\n', stderr);
    printf("%s: %lld of %lld runs: %lld done, %lld diverged, %lld left the vessel, %lld failed%s; %.1f s", sweep->study->path, (long long)state->finished,
           (long long)state->runs, (long long)state->count[RUN_DONE], (long long)state->count[RUN_DIVERGED], (long long)state->count[RUN_LEFT],
           (long long)state->count[RUN_FAILED], state->count[RUN_FAILED] > 0 ? " (the column 'message' says why)" : "", state->elapsed_s);
    if (state->before > 0)
        printf(", %lld of them from before", (long long)state->before);
    printf("\n");
    if (state->damaged > 0)
        fprintf(stderr, "%s/journal.txt: %lld damaged lines; their runs were repeated\n", sweep->options->output, (long long)state->damaged);
}

// Returns an exit code.
static int manage(Sweep *sweep)
{
    int64_t runs = (int64_t)sweep->study->runs;
    Journal *journal = journal_open(sweep->options->output, sweep->heading, runs, sweep->faults);
    bool good = journal && prepare_folder(sweep);
    if (sweep->ranks.count > 1)
        ranks_start(&sweep->ranks, good, sweep->heading_text);
    int code = EXIT_DONE;
    Queue *queue = good ? queue_create(runs, journal, sweep->stop, sweep->faults) : NULL;
    if (queue) {
        bool shows = !sweep->options->quiet && isatty(STDERR_FILENO);
        sweep_work(sweep->open, queue, &sweep->ranks, sweep->options->threads, sweep->recordings, sweep->stop, shows);
        QueueState state = queue_state(queue);
        if (!sweep->options->quiet)
            print_end(sweep, &state);
        if (state.finished == runs)
            table_write(sweep->options->output, sweep->study, journal, runs, sweep->faults);
        else if (sweep->faults->count == 0) {
            fprintf(stderr, "seldinger sweep: stopped; the same command goes on\n");
            code = EXIT_DIFFERENT;
        }
    }
    queue_free(queue);
    journal_close(journal);
    return code;
}

static int repeat(Sweep *sweep)
{
    char folder[PATH_MAX];
    snprintf(folder, sizeof folder, "%.4000s", sweep->options->output);
    if (sweep->options->run >= sweep->study->runs)
        faults_add(sweep->faults, sweep->study->path, 0, 0, "has %.0f runs; expected --run 0 to %.0f", sweep->study->runs, sweep->study->runs - 1);
    else if (!folders_create(folder))
        faults_add(sweep->faults, folder, 0, 0, "cannot be created: %s", strerror(errno));
    char *line = sweep->faults->count == 0 ? one_run_repeat(sweep->open, (int64_t)sweep->options->run, folder, sweep->faults) : NULL;
    if (line && !sweep->options->quiet)
        printf("%s\n", line);
    free(line);
    return EXIT_DONE;
}

static int carry_out(Sweep *sweep)
{
    const SweepOptions *options = sweep->options;
    Faults *faults = sweep->faults;
    if (sweep->open)
        sweep->heading = open_study_heading(sweep->open);
    sweep->heading_text = sweep->heading ? cJSON_PrintUnformatted(sweep->heading) : NULL;
    if (sweep->open && options->dry_run)
        return sweep_dry_run(sweep->open, options, faults);
    if (sweep->open && options->run >= 0)
        return repeat(sweep);
    if (sweep->open && sweep->study->runs > (double)STUDY_RUNS_MOST)
        faults_add(faults, options->spec, sweep->study->runs_line, sweep->study->runs_column,
                   "has %.0f runs; expected at most %lld (divide it into several specifications)", sweep->study->runs, (long long)STUDY_RUNS_MOST);
    if (sweep->ranks.rank > 0) {
        int code = ranks_work(&sweep->ranks, sweep->open, faults->count == 0 ? sweep->heading_text : NULL, faults->text[0], sweep->recordings, sweep->stop);
        faults_clear(faults);        // rank 0 prints them
        return code;
    }
    if (faults->count > 0 && sweep->ranks.count > 1)
        ranks_start(&sweep->ranks, false, "");
    else if (faults->count == 0 && options->simulate_ranks > 0)
        return sweep_simulate_ranks(options, sweep->heading, (int64_t)sweep->study->runs, faults);
    else if (faults->count == 0)
        return manage(sweep);
    return EXIT_DONE;
}

static int call(void *structure, Faults *faults)
{
    Sweep sweep = {.options = structure, .faults = faults};
    int code = EXIT_BAD_INPUT;
    recording_prepare_process();
    if (sweep.options->report)
        return sweep_report(sweep.options, faults);
    sweep.stop = process_stop_in_order();
    if (sweep.options->output)
        snprintf(sweep.recordings, sizeof sweep.recordings, "%.4000s/recordings", sweep.options->output);
    bool alone = sweep.options->dry_run || sweep.options->run >= 0 || sweep.options->simulate_ranks > 0;
    sweep.ranks.count = 1;
    if (alone || ranks_begin(&sweep.ranks, faults)) {
        sweep.study = study_load(sweep.options->spec, faults);
        sweep.open = sweep.study ? open_study(sweep.study, faults) : NULL;
        code = carry_out(&sweep);
    }
    ranks_end(&sweep.ranks);
    open_study_close(sweep.open);
    study_free(sweep.study);
    cJSON_Delete(sweep.heading);
    free(sweep.heading_text);
    return code;
}

const Verb sweep_verb = {.options = &sweep_options, .call = call};
