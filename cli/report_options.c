#include "cli/report_options.h"

#include "cli/cli.h"

#include <string.h>
#include <sys/stat.h>

static const Option rows[] = {
    {"html", "F.html", OPTION_FILE, OPTION_AT(ReportOptions, html), "the page, a single self-contained file",
     .otherwise = "SESSION.html, FOLDER/sessions.html or, with --trainee, FOLDER/trainee.html; none if --pdf or --csv is given"},
    {"pdf", "F.pdf", OPTION_FILE, OPTION_AT(ReportOptions, pdf), "the page as PDF, printed by chromium if that is installed"},
    {"trainee", "NAME", OPTION_TEXT, OPTION_AT(ReportOptions, trainee), "of a folder: only the sessions of this trainee"},
    {"csv", "F.csv", OPTION_FILE, OPTION_AT(ReportOptions, csv), "of a folder: a table of the sessions, one row each (docs/file-formats.md)"},
    {"with", "FOLDER", OPTION_FOLDER, OPTION_AT(ReportOptions, with), "of a session: folder of its earlier sessions", .otherwise = "the session's own folder"},
    CLI_QUIET(ReportOptions, quiet, "prints nothing if all went well"),
};

static const char *check(void *structure)
{
    ReportOptions *options = structure;
    const char *slash = strrchr(options->session, '/'), *dot = strrchr(options->session, '.');
    int stem = dot && (!slash || dot > slash) ? (int)(dot - options->session) : (int)strlen(options->session);
    struct stat status;
    if (strlen(options->session) > sizeof options->own_html - 16)
        return "the path of the session file, recording or folder is too long";
    options->is_folder = stat(options->session, &status) == 0 && S_ISDIR(status.st_mode);
    if (!options->is_folder && (options->trainee || options->csv))
        return "--trainee and --csv are for a folder of sessions";
    if (options->is_folder && options->with)
        return "--with is for a session, not for a folder of sessions";
    snprintf(options->own_folder, sizeof options->own_folder, "%.*s", slash ? (int)(slash - options->session + 1) : 1, slash ? options->session : ".");
    if (options->is_folder)
        snprintf(options->own_html, sizeof options->own_html, "%s/%s.html", options->session, options->trainee ? "trainee" : "sessions");
    else
        snprintf(options->own_html, sizeof options->own_html, "%.*s.html", stem, options->session);
    if (!options->html && !options->pdf && !options->csv)
        options->html = options->own_html;
    if (!options->with)
        options->with = options->is_folder ? options->session : options->own_folder;
    return NULL;
}

const OptionTable report_options = {
    .program = "seldinger report",
    .does = "makes a page about a trainee's session, about all sessions of a trainee, or about all trainees: HTML, PDF, CSV",
    .usage = "SESSION.json|REC.h5 [options]\n[--trainee NAME] FOLDER [options]",
    .intro =
        "A page about a trainee's session: points and how they were earned, errors, plots over time, the tip's path through the vessel, and earlier sessions "
        "of the same trainee at the same exercise. The recording is searched for at the path given in the session file, relative to that file. For a "
        "recording without a session file, such as that of a program that was killed, the session file is made first by simulating the recording again.\n"
        "Of a folder, such as that given to `nav --sessions`: with --trainee a page with the learning curves of that trainee for each exercise (points, time, "
        "X-rays, "
        "dose, contrast agent, forces, errors), without it a page over all trainees for their instructor. Files that cannot be read are listed with the "
        "reason.",
    .exits = "0 done (also if recording, vessel or scene are missing and the page is therefore shorter); 2 wrong usage or bad input",
    CLI_OPTIONS(rows, ReportOptions),
    .check = check,
    .takes_argument = true,
    .argument = offsetof(ReportOptions, session),
    .missing = "expected one session file, recording or folder of sessions",
    .too_many = "expected one session file, recording or folder, not also ",
};
