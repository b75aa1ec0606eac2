// seldinger report: a session's file, its recording beside it and earlier sessions of the same trainee as one page, and that printed by a browser.
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
    const char *recording;   // NULL where a session file was given
    bool quiet;
    char own_html[4096], own_folder[4096], beside[4096];
} ReportOptions;

static const Option rows[] = {
    {"html", "F.html", OPTION_FILE, OPTION_AT(ReportOptions, html), "the page, one file that needs nothing else",
     .otherwise = "SESSION.html, unless --pdf is given"},
    {"pdf", "F.pdf", OPTION_FILE, OPTION_AT(ReportOptions, pdf), "the same on paper, printed by chromium where that is installed"},
    {"with", "FOLDER", OPTION_FOLDER, OPTION_AT(ReportOptions, with), "where earlier sessions lie", .otherwise = "the session's own folder"},
    CLI_QUIET(ReportOptions, quiet, "says nothing where all went well"),
};

static const char *check(void *structure)
{
    ReportOptions *options = structure;
    const char *slash = strrchr(options->session, '/'), *dot = strrchr(options->session, '.');
    int stem = dot && (!slash || dot > slash) ? (int)(dot - options->session) : (int)strlen(options->session);
    if (strlen(options->session) > sizeof options->own_html - 16)
        return "takes one session file or recording; the path of this one is too long";
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
    .does = "a page about a trainee's session: points, errors, plots, path, earlier sessions; HTML or PDF",
    .usage = "SESSION.json|REC.h5 [options]",
    .intro =
        "A page about a trainee's session: points and how they came about, errors, plots over time, the tip's path over the vessel, and earlier sessions of "
        "the same "
        "trainee at the same exercise. The recording is looked for where the session says, beside it. Of a recording without a session file, as of a program "
        "that was killed, the session file is made first, by simulating it again.",
    .exits = "0 done (also where recording, vessel or scene lack and the page is shorter for it); 2 wrong usage or bad input",
    CLI_OPTIONS(rows, ReportOptions),
    .check = check,
    .takes_argument = true,
    .argument = offsetof(ReportOptions, session),
    .missing = "takes one session file or recording",
    .too_many = "takes one session file or recording, not also ",
};

// Of a recording: the session file beside it, which may have to be made first.
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
