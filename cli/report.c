// seldinger report: a session's file, its recording beside it and earlier sessions of the same trainee as one page, and that printed by a browser.
#include "cli/cli.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/text_file.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "render/page_pdf.h"
#include "render/session_page.h"
#include "sim/recording.h"
#include "sim/recover.h"
#include "sim/session_files.h"
#include "sim/tube_tree.h"

#include <getopt.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char help[] =
    "Usage: seldinger report SESSION.json|RECORDING.h5 [options]\n\n"
    "A page about a trainee's session: points and how they came about, errors, plots over time, the tip's path over the vessel, and earlier\n"
    "sessions of the same trainee at the same exercise. The recording is looked for where the session says, beside it. Of a recording without a\n"
    "session file, as of a program that was killed, the session file is made first, by simulating it again.\n\n"
    "  --html F.html   the page, one file that needs nothing else; default: SESSION.html, unless --pdf is given\n"
    "  --pdf F.pdf     the same on paper, printed by chromium where that is installed\n"
    "  --with FOLDER   where earlier sessions lie; default: the session's own folder\n"
    "  --quiet         says nothing where all went well\n\n"
    "Exit codes: 0 done (also where recording, vessel or scene lack and the page is shorter for it); 2 wrong usage or bad input.\n";

// --- what the page is made of ---

// Scene and tree as recorded; what cannot be had stays NULL. Any fault is only said: the page is then shorter.
static Scene *open_scene(const RecordedRun *run, OpenVessel *open, VesselTree **tree, Faults *faults)
{
    Scene *scene = run && run->scene_text ? scene_parse(run->scene_text, strlen(run->scene_text), run->scene_path ? run->scene_path : "scene", faults) : NULL;
    if (!scene)
        return NULL;
    if (scene->source == SOURCE_MODEL || scene->source == SOURCE_SHAPE)
        scene->contact = CONTACT_LIM;            // the tree is wanted, not the wall
    if (scene->source == SOURCE_MODEL || scene->source == SOURCE_SHAPE || scene->source == SOURCE_TUBE)
        cli_open_vessel(scene, 0, true, open, faults);
    *tree = open->tree;
    if (scene->source == SOURCE_TUBE && open->vessel)
        *tree = tube_tree(open->vessel, &scene->tube, scene->path, faults);
    return scene;
}

static void say(const Faults *faults)
{
    for (int i = 0; i < faults->count && i < FAULTS_CAPACITY; i++)
        fprintf(stderr, "seldinger report: %s\n", faults->text[i]);
}

// An hour's frames would fill the memory of a small machine: of such a recording only what every step has, and the path is left out.
static RecordedRun *load_run(const char *path, Faults *faults)
{
    static const off_t most_bytes = 1500 * 1000 * (off_t)1000;
    struct stat file;
    bool is_long = stat(path, &file) == 0 && file.st_size > most_bytes;
    return is_long ? recorded_run_load_series(path, faults) : recorded_run_load(path, faults);
}

static char *make_page(const char *path, const Session *session, const char *with, size_t *length, Faults *faults)
{
    char *bytes = NULL, *recording = text_file_beside(path, session->recording_path);
    Faults *gone = calloc(1, sizeof *gone);
    FILE *out = recording && gone ? open_memstream(&bytes, length) : NULL;
    if (out) {
        OpenVessel open = {0};
        VesselTree *tree = NULL;
        SessionPage page = {.out = out, .path = path, .session = session};
        RecordedRun *run = *session->recording_path ? load_run(recording, gone) : NULL;
        Scene *scene = open_scene(run, &open, &tree, gone);
        Session *earlier = session_list(with, session->trainee, session->title, &page.earlier_count, &page.broken, gone);
        say(gone);
        if (page.broken > 0)
            fprintf(stderr, "seldinger report: %s: %d session file%s could not be read\n", with, page.broken, page.broken == 1 ? "" : "s");
        page.run = run;
        page.run_is_its = run && session_is_of(session, run);
        page.scene = scene;
        page.tree = tree;
        page.earlier = earlier;
        session_page(&page);
        free(earlier);
        if (tree != open.tree)
            vessel_tree_free(tree);
        open_vessel_close(&open);
        scene_free(scene);
        recorded_run_free(run);
    }
    bool good = out && !ferror(out);
    good = out && fclose(out) == 0 && good;
    free(gone);
    free(recording);
    if (!good) {
        faults_add(faults, path, 0, 0, "no memory for the page");
        free(bytes);
        return NULL;
    }
    return bytes;
}

// --- the verb ---

typedef struct ReportOptions {
    const char *session, *html, *pdf, *with;
    const char *recording;   // NULL where a session file was given
    bool quiet;
    char own_html[4096], own_folder[4096], beside[4096];
} ReportOptions;

static int parse_options(int argc, char **argv, ReportOptions *options)
{
    enum { HTML = 256, PDF, WITH, QUIET, HELP };
    static const struct option table[] = {{"html", required_argument, NULL, HTML}, {"pdf", required_argument, NULL, PDF},
                                          {"with", required_argument, NULL, WITH}, {"quiet", no_argument, NULL, QUIET},
                                          {"help", no_argument, NULL, HELP},       {0}};
    *options = (ReportOptions){0};
    optind = 1;
    for (int choice; (choice = getopt_long(argc, argv, "h", table, NULL)) != -1;) {
        switch (choice) {
        case HTML: options->html = optarg; break;
        case PDF: options->pdf = optarg; break;
        case WITH: options->with = optarg; break;
        case QUIET: options->quiet = true; break;
        case HELP:
        case 'h': fputs(help, stdout); return EXIT_DONE;
        default: fprintf(stderr, "seldinger report: unknown option or lacking value; see `seldinger report --help`\n"); return EXIT_BAD_INPUT;
        }
    }
    if (optind != argc - 1 || strlen(argv[optind]) > sizeof options->own_html - 16) {
        fprintf(stderr, "seldinger report: takes one session file or recording; see `seldinger report --help`\n");
        return EXIT_BAD_INPUT;
    }
    options->session = argv[optind];
    const char *slash = strrchr(options->session, '/'), *dot = strrchr(options->session, '.');
    int stem = dot && (!slash || dot > slash) ? (int)(dot - options->session) : (int)strlen(options->session);
    snprintf(options->own_html, sizeof options->own_html, "%.*s.html", stem, options->session);
    snprintf(options->own_folder, sizeof options->own_folder, "%.*s", slash ? (int)(slash - options->session + 1) : 1, slash ? options->session : ".");
    if (!options->html && !options->pdf)
        options->html = options->own_html;
    if (!options->with)
        options->with = options->own_folder;
    return -1;
}

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

int verb_report(int argc, char **argv)
{
    ReportOptions options;
    static Faults faults;
    size_t length = 0;
    int code = parse_options(argc, argv, &options);
    if (code >= 0)
        return code;
    faults_clear(&faults);
    Session *session = HEAP_ZEROED(1, sizeof *session);
    char *page = NULL;
    name_session_file(&options);
    OutputPlan plan = {.faults = &faults};
    output_plan_write(&plan, "--html", options.html);
    output_plan_write_file(&plan, "--pdf", options.pdf);
    output_plan_read(&plan, "the session", options.session);
    output_plan_read(&plan, "the recording", options.recording);
    output_plan_read_folder(&plan, "the session", options.with, ".json");
    bool good = faults.count == 0 && make_session_file(&options, &faults) && session_load(options.session, session, &faults);
    page = good ? make_page(options.session, session, options.with, &length, &faults) : NULL;
    good = page && (!options.html || output_write(options.html, page, length, &faults));
    good = good && (!options.pdf || page_write_pdf(options.pdf, page, length, &faults));
    if (good && !options.quiet && options.html && strcmp(options.html, "-") != 0)
        printf("%s\n", options.html);
    if (good && !options.quiet && options.pdf)
        printf("%s\n", options.pdf);
    free(page);
    free(session);
    return good ? EXIT_DONE : cli_bad_input(&faults);
}
