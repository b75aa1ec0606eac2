#include "cli/sweep_report.h"

#include "cli/cli.h"
#include "render/render.h"
#include "study/study.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Simulates a run of the results again for its picture. The recording of a run that ends in another state is removed: it is of another program or scene.
static bool record_run(OpenStudy *open, const SweepResults *results, int row, const char *recordings, Faults *why)
{
    char path[PATH_MAX], state[100];
    snprintf(path, sizeof path, "%.4000s/%d.h5", recordings, row);
    if (access(path, F_OK) == 0)
        return true;
    int hash = sweep_results_find(results, "state_hash");
    char *line = one_run(open, row, recordings, NULL, why);
    snprintf(state, sizeof state, "\"state_hash\":\"%s\"", hash >= 0 ? results->column[hash].text[row] : "");
    bool same = line && strstr(line, state);
    if (line && !same) {
        remove(path);
        faults_add(why, path, 0, 0, "run %d now ends in another state than in the table; expected the program, specification and scene of these results", row);
    }
    free(line);
    return same;
}

// Records those of the worst runs that the sweep did not record. Without the specification's files the page has no pictures of them.
static void record_worst(const SweepOptions *options, const SweepResults *results)
{
    Faults *why = HEAP_ZEROED(1, sizeof *why);
    Study *study = study_load(options->spec, why);
    if (study)
        study->record = RECORD_ALL;
    OpenStudy *open = study ? open_study(study, why) : NULL;
    char recordings[PATH_MAX];
    int rows[SWEEP_WORST_MOST], count = open ? sweep_worst_runs(results, rows) : 0;
    snprintf(recordings, sizeof recordings, "%.4000s/recordings", options->report);
    bool good = count > 0 && folders_create(recordings);
    for (int i = 0; good && i < count && rows[i] < study->runs; i++)
        good = record_run(open, results, rows[i], recordings, why);
    if (why->count > 0)
        fprintf(stderr, "seldinger sweep: pictures of the worst runs are missing: %s\n", why->text[0]);
    open_study_close(open);
    study_free(study);
    free(why);
}

int sweep_report(const SweepOptions *options, Faults *faults)
{
    SweepResults *results = sweep_results_load(options->report, faults);
    char *path = text_file_in(options->report, "report.html"), *copy = text_file_in(options->report, "spec.yaml");
    size_t length;
    char *specification = results && copy ? text_file_read(copy, &length, faults) : NULL;
    OutputText text;
    if (results && options->spec)
        record_worst(options, results);
    bool good = results && specification && path && output_check(path, faults);
    if (good && !output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "out of memory");
        good = false;
    }
    if (good) {
        sweep_page(text.stream, &(SweepPage){.folder = options->report, .results = results, .specification = specification, .path = options->spec});
        good = output_text_write(&text, path, faults);
    }
    if (good && !options->quiet)
        printf("%s\n", path);
    free(specification);
    free(copy);
    free(path);
    sweep_results_free(results);
    return good ? EXIT_DONE : EXIT_BAD_INPUT;
}
