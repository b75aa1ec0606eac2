// seldinger report: makes one page from a session file, its recording and earlier sessions of the same trainee; a browser prints it as PDF.
#include "cli/cli.h"

#include "base/base.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "render/render.h"
#include "sim/sim.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct ReportOptions {
    const char *session, *html, *pdf, *with;
    const char *recording;   // NULL if a session file was given
    bool quiet;
    char own_html[4096], own_folder[4096], beside[4096];
} ReportOptions;

static const Option rows[] = {
    {"html", "F.html", OPTION_FILE, OPTION_AT(ReportOptions, html), "the page, a single self-contained file",
     .otherwise = "SESSION.html, unless --pdf is given"},
    {"pdf", "F.pdf", OPTION_FILE, OPTION_AT(ReportOptions, pdf), "the page as PDF, printed by chromium if that is installed"},
    {"with", "FOLDER", OPTION_FOLDER, OPTION_AT(ReportOptions, with), "folder of earlier sessions", .otherwise = "the session's own folder"},
    CLI_QUIET(ReportOptions, quiet, "prints nothing if all went well"),
};

static const char *check(void *structure)
{
    ReportOptions *options = structure;
    const char *slash = strrchr(options->session, '/'), *dot = strrchr(options->session, '.');
    int stem = dot && (!slash || dot > slash) ? (int)(dot - options->session) : (int)strlen(options->session);
    if (strlen(options->session) > sizeof options->own_html - 16)
        return "the path of the session file or recording is too long";
    snprintf(options->own_html, sizeof options->own_html, "%.*s.html", stem, options->session);
    snprintf(options->own_folder, sizeof options->own_folder, "%.*s", slash ? (int)(slash - options->session + 1) : 1, slash ? options->session : ".");
    if (!options->html && !options->pdf)
        options->html = options->own_html;
    if (!options->with)
        options->with = options->own_folder;
    return NULL;
}

static const OptionTable table = {
    .program = "seldinger report",
    .does = "makes a page about a trainee's session: points, errors, plots, path, earlier sessions; HTML or PDF",
    .usage = "SESSION.json|REC.h5 [options]",
    .intro =
        "A page about a trainee's session: points and how they were earned, errors, plots over time, the tip's path through the vessel, and earlier sessions "
        "of the same trainee at the same exercise. The recording is searched for at the path given in the session file, relative to that file. For a "
        "recording without a session file, such as that of a program that was killed, the session file is made first by simulating the recording again.",
    .exits = "0 done (also if recording, vessel or scene are missing and the page is therefore shorter); 2 wrong usage or bad input",
    CLI_OPTIONS(rows, ReportOptions),
    .check = check,
    .takes_argument = true,
    .argument = offsetof(ReportOptions, session),
    .missing = "expected one session file or recording",
    .too_many = "expected one session file or recording, not also ",
};

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

static int call(void *structure, Faults *faults)
{
    ReportOptions *options = structure;
    size_t length = 0;
    Session *session = HEAP_ZEROED(1, sizeof *session);
    name_session_file(options);
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "--html", options->html);
    output_plan_write_file(&plan, "--pdf", options->pdf);
    output_plan_read(&plan, "the session", options->session);
    output_plan_read(&plan, "the recording", options->recording);
    output_plan_read_folder(&plan, "the session", options->with, ".json");
    bool good = faults->count == 0 && make_session_file(options, faults) && session_load(options->session, session, faults);
    char *page = good ? session_report(options->session, session, options->with, cli_note, &length, faults) : NULL;
    good = page && (!options->html || output_write(options->html, page, length, faults));
    good = good && (!options->pdf || page_write_pdf(options->pdf, page, length, faults));
    if (good && !options->quiet && options->html && !cli_is_standard_output(options->html))
        printf("%s\n", options->html);
    if (good && !options->quiet && options->pdf)
        printf("%s\n", options->pdf);
    free(page);
    free(session);
    return EXIT_DONE;
}

const Verb report_verb = {.options = &table, .call = call};
