// seldinger report: a session's file, its recording beside it and earlier sessions of the same trainee as one page, and that printed by a browser.
#include "cli/session_report.h"

#include "base/heap.h"
#include "base/output.h"
#include "base/text_file.h"
#include "base/whole_file.h"
#include "cli/file_kind.h"
#include "cli/output_plan.h"
#include "cli/report.h"
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

static const char own_style[] =
    ".points{font-size:2.6rem;font-weight:700;line-height:1;font-variant-numeric:tabular-nums}\n"
    ".points small{font-size:1rem;font-weight:400;color:var(--muted)}\n"
    ".top{display:flex;flex-wrap:wrap;gap:.5rem 2.5rem;align-items:center;margin:1rem 0}\n"
    ".state{font-weight:600;padding:.15rem .6rem;border:2px solid currentColor;border-radius:1rem}\n"
    ".state.reached{color:var(--o3)}.state.time_out,.state.running,.state.waiting{color:var(--bad)}\n"
    ".bar{fill:currentColor}.error{stroke:var(--bad);fill:none;stroke-dasharray:3 3}text.error{stroke:var(--panel);stroke-dasharray:none}\n"
    "svg text.error{fill:var(--bad)}circle.error{stroke-width:2;stroke-dasharray:none}\n"
    ".vessel path{fill:none;stroke:var(--muted);stroke-linecap:round}.vessel circle{fill:var(--muted)}.vessel{opacity:.32}svg.view{margin:0;max-width:none}\n"
    ".halo{fill:none;stroke:#fff;stroke-width:5;stroke-linejoin:round;stroke-linecap:round}.way{fill:none;stroke-width:2.6;stroke-linejoin:round}\n"
    ".tool{fill:none;stroke:var(--ink);stroke-width:1}.held{fill:currentColor}.missed{fill:var(--panel);stroke:currentColor;stroke-width:2}\n"
    "tr.own{background:var(--panel);font-weight:600}td.mark-letter{color:var(--bad);font-weight:700}meter{width:7rem}\n"
    "@media print{body{font-size:10pt}section{break-inside:auto}figure{max-width:100%}}\n";

// --- the page ---

static const char *const part_words[PART_COUNT] = {"Time",           "Fluoroscopy time",   "Contrast agent",
                                                   "Way of the tip", "Largest wall force", "Wall force over time"};
static const char *const part_unit[PART_COUNT] = {"s", "s", "ml", "times the straight way", "N", "N s"};

static void figures_of(const ScoreFigures *f, double figure[PART_COUNT])
{
    figure[PART_TIME] = f->time_s;
    figure[PART_FLUOROSCOPY] = f->fluoroscopy_s;
    figure[PART_CONTRAST] = f->contrast_ml;
    figure[PART_PATH] = f->way_mm > 0 ? f->path_mm / f->way_mm : 0;
    figure[PART_WALL_FORCE] = f->wall_force_peak_n;
    figure[PART_WALL_IMPULSE] = f->wall_impulse_n_s;
}

static void item(FILE *out, const char *term, const char *text)
{
    fprintf(out, "<dt>%s</dt><dd>", term);
    report_text(out, *text ? text : "not said");
    fprintf(out, "</dd>\n");
}

static void print_top(const SessionPage *page)
{
    static const char *const words[] = {"not begun", "target not held", "target held", "out of time"};
    FILE *out = page->out;
    const Session *s = page->session;
    const ScoreFigures *f = &s->figures;
    fprintf(out, "<section id=\"summary\"><div class=\"top\">");
    if (f->has_exercise)
        fprintf(out, "<div class=\"points\">%.0f <small>of 100 points</small></div><div class=\"state %s\">%s</div>", f->points, score_state_name[f->state],
                words[f->state]);
    fprintf(out, "</div>\n<dl>\n");
    item(out, "Trainee", s->trainee);
    item(out, "Date", s->date);
    item(out, "Device", s->device);
    item(out, "Target", s->target);
    fprintf(out, "</dl></section>\n");
}

static void print_parts(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures *f = &page->session->figures;
    const Exercise *e = page->scene ? page->scene->exercise : NULL;
    double figure[PART_COUNT], weights = 0;
    figures_of(f, figure);
    if (!f->has_exercise)
        return;
    for (int i = 0; e && i < PART_COUNT; i++)
        weights += e->par[i] > 0 ? e->weight[i] : 0;
    fprintf(out, "<section id=\"parts\"><h2>Points</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Part</th><th scope=\"col\">Measured</th><th "
                 "scope=\"col\">Full points up to</th><th scope=\"col\">Weight</th><th scope=\"col\" class=\"words\">Reached</th></tr></thead><tbody>\n");
    for (int i = 0; i < PART_COUNT; i++) {
        bool judged = !e || (e->par[i] > 0 && e->weight[i] > 0);
        fprintf(out, "<tr><th scope=\"row\">%s [%s]</th><td>%.2f</td>", part_words[i], part_unit[i], figure[i]);
        if (e && judged)
            fprintf(out, "<td>%g</td><td>%.0f %%</td>", e->par[i], 100 * e->weight[i] / weights);
        else
            fprintf(out, "<td>%s</td><td>–</td>", e ? "not judged" : "not known");
        if (judged)
            fprintf(out, "<td class=\"words\"><meter min=\"0\" max=\"1\" value=\"%.3f\">%.0f %%</meter> %.0f %%</td></tr>\n", f->part[i], 100 * f->part[i],
                    100 * f->part[i]);
        else
            fprintf(out, "<td class=\"words\">–</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div>\n<p>What was reached counts by weight, ");
    if (f->state == SCORE_REACHED)
        fprintf(out, "in full since the target was held");
    else
        fprintf(out, "times half of the part of the way that was covered (%.0f %%), since the target was not held",
                f->way_mm > 0 ? 100 * fmax(1 - f->least_remaining_mm / f->way_mm, 0) : 0);
    if (e && f->error_total > 0)
        fprintf(out, "; less %g points for each of %d error%s", e->error_points, f->error_total, f->error_total == 1 ? "" : "s");
    fprintf(out, ".</p></section>\n");
}

static void print_figures(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures *f = &page->session->figures;
    fprintf(out,
            "<section id=\"figures\"><h2>Figures</h2>\n<dl>\n<dt>Way of the tip</dt><dd>%.0f mm; straight way to the target %.0f mm; efficiency %.0f %%</dd>\n"
            "<dt>%s</dt><dd>pushed in %.0f mm, pulled back %.0f mm in all</dd>\n<dt>Forces</dt><dd>wall at most %.3f N, over time %.2f N s; tip at most %.3f "
            "N (mean over 20 ms)</dd>\n",
            f->path_mm, f->way_mm, 100 * f->efficiency, f->tool_count > 1 ? "Tools" : "Tool", f->inserted_mm, f->withdrawn_mm, f->wall_force_peak_n, f->wall_impulse_n_s, f->tip_force_peak_n);
    if (f->has_xray)
        fprintf(out, "<dt>X-rays</dt><dd>%.1f s, %lld pulses, %.0f cm² of open field summed over pulses; contrast agent %.1f ml</dd>\n", f->fluoroscopy_s,
                (long long)f->pulses, f->dose_area_cm2, f->contrast_ml);
    else
        fprintf(out, "<dt>X-rays</dt><dd>nobody watched: a run without a screen</dd>\n");
    fprintf(out, "</dl></section>\n");
}

static void print_tools(const SessionPage *page)
{
    FILE *out = page->out;
    const ScoreFigures *f = &page->session->figures;
    if (f->tool_count < 2)
        return;
    fprintf(out, "<section id=\"tools\"><h2>Tools</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Tool</th>"
                 "<th scope=\"col\">Pushed in [mm]</th>"
                 "<th scope=\"col\">Pulled back [mm]</th><th scope=\"col\">Tip force [N]</th><th scope=\"col\">Tip's speed, hand at rest [mm/s]</th>"
                 "<th scope=\"col\">Tip behind the one around it [mm]</th></tr></thead><tbody>\n");
    for (int k = 0; k < f->tool_count; k++) {
        const ScoreToolFigures *tool = &f->tool[k];
        fprintf(out, "<tr><th scope=\"row\">");
        report_text(out, tool->name);
        fprintf(out, "</th><td>%.0f</td><td>%.0f</td><td>%.3f</td><td>%.0f</td>", tool->inserted_mm, tool->withdrawn_mm, tool->tip_force_peak_n,
                tool->kick_peak_mm_s);
        if (k > 0)
            fprintf(out, "<td>%.1f</td></tr>\n", tool->behind_mm);
        else
            fprintf(out, "<td>–</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div><p>Forces and speeds are the largest of the session; where the tip is, is at its end.</p></section>\n");
}

static void print_errors(const SessionPage *page)
{
    FILE *out = page->out;
    const Session *s = page->session;
    fprintf(out, "<section id=\"errors\"><h2>Handling errors</h2>\n");
    if (s->figures.error_total == 0) {
        fprintf(out, "<p>None.</p></section>\n");
        return;
    }
    fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Mark</th><th scope=\"col\" class=\"words\">Error</th><th "
                 "scope=\"col\">Times</th><th scope=\"col\" class=\"words\">Begun at [s]</th></tr></thead><tbody>\n");
    for (int kind = 0; kind < ERROR_COUNT; kind++) {
        if (s->figures.error[kind].count == 0)
            continue;
        const char *comma = "";
        fprintf(out, "<tr><td class=\"mark-letter\">%c</td><td class=\"words\">%s</td><td>%d</td><td class=\"words\">", session_error_letter((ScoreError)kind),
                score_error_words[kind], s->figures.error[kind].count);
        for (int i = 0; i < s->event_count; i++)
            if (s->event[i].kind == (ScoreError)kind) {
                fprintf(out, "%s%.2f", comma, s->event[i].time_s);
                if (s->figures.tool_count > 1 && s->event[i].tool >= 0) {
                    fprintf(out, " (");
                    report_text(out, s->figures.tool[s->event[i].tool].name);
                    fprintf(out, ")");
                }
                comma = ", ";
            }
        fprintf(out, "</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

static void print_earlier(const SessionPage *page)
{
    FILE *out = page->out;
    fprintf(out, "<section id=\"earlier\"><h2>Sessions of this trainee at this exercise</h2>\n");
    if (page->broken > 0)
        fprintf(out, "<p>%d session file%s in the folder could not be read and %s left out.</p>\n", page->broken, page->broken == 1 ? "" : "s",
                page->broken == 1 ? "is" : "are");
    if (page->earlier_count < 2) {
        fprintf(out, "<p>This is the only one that was found.</p></section>\n");
        return;
    }
    session_trend_figure(page);
    fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">No.</th><th scope=\"col\" class=\"words\">Date</th><th "
                 "scope=\"col\">Points</th><th scope=\"col\" class=\"words\">Target</th><th scope=\"col\">Time [s]</th><th scope=\"col\">X-rays [s]</th><th "
                 "scope=\"col\">Contrast [ml]</th><th scope=\"col\">Way / straight</th>"
                 "<th scope=\"col\">Wall force [N]</th><th scope=\"col\">Errors</th></tr></thead><tbody>\n");
    for (int i = 0; i < page->earlier_count; i++) {
        const Session *s = &page->earlier[i];
        bool own = !strcmp(s->date, page->session->date) && !strcmp(s->series_sha256, page->session->series_sha256);
        fprintf(out,
                "<tr%s><th scope=\"row\">%d</th><td class=\"words\">%s</td><td>%.0f</td><td "
                "class=\"words\">%s</td><td>%.1f</td><td>%.1f</td><td>%.1f</td><td>%.2f</td><td>%.3f</td>"
                "<td>%d</td></tr>\n",
                own ? " class=\"own\"" : "", i + 1, s->date, s->figures.points, s->figures.state == SCORE_REACHED ? "held" : "not held", s->figures.time_s,
                s->figures.fluoroscopy_s, s->figures.contrast_ml, s->figures.way_mm > 0 ? s->figures.path_mm / s->figures.way_mm : 0,
                s->figures.wall_force_peak_n, s->figures.error_total);
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

static void print_origin(const SessionPage *page)
{
    FILE *out = page->out;
    const Session *s = page->session;
    char steps[96];
    snprintf(steps, sizeof steps, "%lld steps of %g ms, last state %016llx", (long long)s->steps, s->step_ms, (unsigned long long)s->state_hash);
    fprintf(out, "<footer><section id=\"origin\"><h2>Where it comes from</h2>\n<dl>\n");
    item(out, "Session", page->path);
    item(out, "Scene", s->scene_path);
    item(out, "Recording", s->recording_path);
    item(out, "Recorded", steps);
    fprintf(out, "<dt>Recording is this session's</dt><dd>%s</dd>\n",
            !page->run         ? "not there: no plots"
            : page->run_is_its ? "yes, its series have the session's sum"
                               : "no");
    item(out, "Made by", s->version);
    fprintf(out, "</dl>\n<p>Written by seldinger " SELDINGER_VERSION ".</p></section></footer>");
}

void session_page(const SessionPage *page)
{
    FILE *out = page->out;
    const Session *s = page->session;
    const char *title = *s->title ? s->title : "Session without an exercise";
    fprintf(out, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
                 "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n<title>Session: ");
    report_text(out, title);
    fprintf(out, "</title>\n<style>\n%s%s</style></head>\n<body><header><h1>", report_style, own_style);
    report_text(out, title);
    fprintf(out, "</h1>\n<p class=\"notice\" role=\"note\"><strong>For training and research. Not a medical device:</strong> points compare sessions at this "
                 "simulator; they say nothing about the treatment of patients.</p>\n");
    if (page->run && !page->run_is_its)
        fprintf(out, "<p class=\"notice\" role=\"alert\">The recording beside this session is another one: plots and path below are not this session's.</p>\n");
    fprintf(out, "</header>\n<main>\n");
    print_top(page);
    print_parts(page);
    print_errors(page);
    fprintf(out, "<section id=\"time\"><h2>Over time</h2>\n");
    session_time_figure(page);
    fprintf(out, "%s</section>\n<section id=\"path\"><h2>Path of the tip</h2>\n", page->run ? "" : "<p>The recording was not found.</p>");
    session_path_figure(page);
    fprintf(out, "%s</section>\n",
            !page->run ? "<p>The recording was not found.</p>" : page->run->frame_count < 1 ? "<p>The recording is too long for it, or holds no pictures.</p>" : "");
    print_figures(page);
    print_tools(page);
    print_earlier(page);
    fprintf(out, "</main>\n");
    print_origin(page);
    fprintf(out, "</body></html>\n");
}

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

// --- paper ---

// A stop by the user that waits for the folder to be removed.
static bool is_stopped(void)
{
    sigset_t pending;
    return sigpending(&pending) == 0 && (sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1 || sigismember(&pending, SIGHUP) == 1);
}

// Of the browser and what it has started, which are a group of their own; stopped with us.
static bool has_succeeded(pid_t child)
{
    int status = -1;
    pid_t ended;
    while ((ended = waitpid(child, &status, WNOHANG)) == 0) {
        if (is_stopped())
            kill(-child, SIGKILL);
        nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    }
    return ended == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// Runs a browser without a shell; its own chatter is not ours. False where it cannot be run or fails.
static bool browser_prints(const char *browser, const char *html, const char *pdf, const sigset_t *signals)
{
    char print[4200], url[4200], profile[4200];
    snprintf(print, sizeof print, "--print-to-pdf=%s", pdf);
    snprintf(url, sizeof url, "file://%s", html);
    snprintf(profile, sizeof profile, "--user-data-dir=%s.profile", html);
    const char *argument[] = {browser, "--headless", "--disable-gpu", "--no-pdf-header-footer", "--print-to-pdf-no-header", profile, print,
                              geteuid() == 0 ? "--no-sandbox" : url, geteuid() == 0 ? url : NULL, NULL};
    pid_t child = fork();
    if (child == 0) {
        setpgid(0, 0);
        sigprocmask(SIG_SETMASK, signals, NULL);
        if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr))
            _exit(127);
        alarm(120);
        execvp(browser, (char *const *)argument);
        _exit(127);
    }
    if (child > 0)
        setpgid(child, child);
    return child > 0 && has_succeeded(child);
}

static void remove_folder(const char *path)
{
    pid_t child = fork();
    if (child == 0) {
        execl("/bin/rm", "rm", "-r", "-f", "--", path, (char *)NULL);
        _exit(127);
    }
    if (child > 0)
        waitpid(child, NULL, 0);
}

// The PDF's bytes; NULL where no browser made it. The caller frees.
static char *print_page(const char *folder, const char *path, const char *page, size_t length, const sigset_t *signals, size_t *pdf_length, Faults *faults)
{
    static const char *const browsers[] = {"chromium", "chromium-browser", "google-chrome"};
    char html[64], pdf[64];
    snprintf(html, sizeof html, "%s/page.html", folder);
    snprintf(pdf, sizeof pdf, "%s/page.pdf", folder);
    bool written = output_write(html, page, length, faults), printed = false;
    for (int i = 0; written && i < 3 && !printed && !is_stopped(); i++)
        printed = browser_prints(browsers[i], html, pdf, signals) && access(pdf, R_OK) == 0;
    Faults own;
    faults_clear(&own);
    char *bytes = printed ? whole_file_read(pdf, pdf_length, &own) : NULL;
    if (bytes && *pdf_length > 4 && !memcmp(bytes, "%PDF", 4))
        return bytes;
    free(bytes);
    if (written)
        faults_add(faults, path, 0, 0, "no PDF: chromium is not installed or could not print; --html F.html needs no browser");
    return NULL;
}

static bool write_pdf(const char *path, const char *page, size_t length, Faults *faults)
{
    char folder[] = "/tmp/seldinger-page-XXXXXX";
    sigset_t stops, before;
    size_t pdf_length = 0;
    // the folder holds a trainee's page: a stop waits until it is removed
    sigemptyset(&stops);
    sigaddset(&stops, SIGINT);
    sigaddset(&stops, SIGTERM);
    sigaddset(&stops, SIGHUP);
    sigprocmask(SIG_BLOCK, &stops, &before);
    bool is_made = mkdtemp(folder) != NULL;
    char *pdf = is_made ? print_page(folder, path, page, length, &before, &pdf_length, faults) : NULL;
    if (is_made)
        remove_folder(folder);
    else
        faults_add(faults, path, 0, 0, "no folder for the browser could be made in /tmp");
    sigprocmask(SIG_SETMASK, &before, NULL);
    bool good = pdf && output_write(path, pdf, pdf_length, faults);
    free(pdf);
    return good;
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
    good = good && (!options.pdf || write_pdf(options.pdf, page, length, &faults));
    if (good && !options.quiet && options.html && strcmp(options.html, "-") != 0)
        printf("%s\n", options.html);
    if (good && !options.quiet && options.pdf)
        printf("%s\n", options.pdf);
    free(page);
    free(session);
    return good ? EXIT_DONE : cli_bad_input(&faults);
}
