// seldinger report: makes one page from a session file, its recording and earlier sessions of the same trainee, or from all sessions of a folder.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "cli/report_folder.h"
#include "render/render.h"
#include "sim/sim.h"

#include <stdlib.h>
#include <unistd.h>

// Finds the session file of a recording, in the same folder; it may have to be made first.
static void name_session_file(ReportOptions *options)
{
    if (file_kind(options->session) != FILE_RECORDING)
        return;
    session_file_beside(options->session, ".json", options->beside, sizeof options->beside);
    options->recording = options->session;
    options->session = options->beside;
}

static bool make_session_file(const ReportOptions *options, Faults *faults)
{
    if (!options->recording || access(options->session, F_OK) == 0)
        return true;
    if (!options->quiet)
        fprintf(stderr, "%s has no session file; simulating it again\n", options->recording);
    return recover_session(options->recording, &(OpenVesselOptions){.note = cli_note}, NULL, NULL, faults);
}

static void print_written(const ReportOptions *options)
{
    const char *const path[] = {options->html, options->pdf, options->csv};
    for (int i = 0; i < 3 && !options->quiet; i++)
        if (path[i] && !cli_is_standard_output(path[i]))
            printf("%s\n", path[i]);
}

static bool report_session(const ReportOptions *options, Faults *faults)
{
    size_t length = 0;
    Session *session = HEAP_ZEROED(1, sizeof *session);
    bool good = faults->count == 0 && make_session_file(options, faults) && session_load(options->session, session, faults);
    char *page = good ? session_report(options->session, session, options->with, cli_note, &length, faults) : NULL;
    good = good && report_write(options, page, length, faults);
    free(session);
    return good;
}

static int call(void *structure, Faults *faults)
{
    ReportOptions *options = structure;
    if (!options->is_folder)
        name_session_file(options);
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--html", options->html);
    output_plan_write_file(&plan, "--pdf", options->pdf);
    output_plan_write(&plan, "--csv", options->csv);
    if (!options->is_folder) {
        output_plan_read(&plan, "the session", options->session);
        output_plan_read(&plan, "the recording", options->recording);
    }
    output_plan_read_folder(&plan, "the session", options->with, ".json");
    if (options->is_folder ? report_of_folder(options, faults) : report_session(options, faults))
        print_written(options);
    return EXIT_DONE;
}

const Verb report_verb = {.options = &report_options, .call = call};
