#include "cli/sweep_report.h"

#include "cli/cli.h"
#include "render/render.h"

#include <stdlib.h>

int sweep_report(const SweepOptions *options, Faults *faults)
{
    SweepResults *results = sweep_results_load(options->report, faults);
    char *path = text_file_in(options->report, "report.html"), *copy = text_file_in(options->report, "spec.yaml");
    size_t length;
    char *specification = results && copy ? text_file_read(copy, &length, faults) : NULL;
    OutputText text;
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
