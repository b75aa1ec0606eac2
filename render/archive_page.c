#include "render/archive_page.h"

#include "base/base.h"
#include "render/learning_curve.h"
#include "render/page.h"
#include "render/session_figures.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char own_style[] = ".held{fill:currentColor}.missed{fill:var(--panel);stroke:currentColor;stroke-width:2}svg text.name{fill:currentColor}\n"
                                ".plots{gap:1rem}td.letters,td.words{white-space:nowrap}td.why{white-space:normal}\n"
                                "@media print{body{font-size:10pt}section{break-inside:auto}}\n";
static const char no_exercise[] = "Session without an exercise";

// The sessions of a trainee, of an exercise, or of both, oldest first.
typedef struct Series {
    int count;
    const ArchivedSession **at;  // (count)
} Series;

typedef struct Page {
    FILE *out;
    const SessionArchive *archive;
    const char *trainee;         // NULL: all
    int figures;                 // so far, for their ids
} Page;

// One of the figures that pages show.
typedef struct Figure {
    const char *title, *unit;
    const char *head;            // in tables
    int decimals;
    double least_top;
    double (*of)(const ScoreFigures *figures);
} Figure;

static double points_of(const ScoreFigures *f) { return f->points; }
static double time_of(const ScoreFigures *f) { return f->time_s; }
static double fluoroscopy_of(const ScoreFigures *f) { return f->fluoroscopy_s; }
static double dose_of(const ScoreFigures *f) { return f->dose_area_cm2; }
static double contrast_of(const ScoreFigures *f) { return f->contrast_ml; }
static double wall_of(const ScoreFigures *f) { return f->wall_force_peak_n; }
static double tip_of(const ScoreFigures *f) { return f->tip_force_peak_n; }
static double errors_of(const ScoreFigures *f) { return f->error_total; }

static const Figure figure_table[] = {
    {"Points", "of 100", "Points", 0, 100, points_of},        {"Time", "s", "Time", 1, 1, time_of},
    {"X-ray time", "s", "X-rays", 1, 1, fluoroscopy_of},      {"Dose: open field, summed over pulses", "cm²", "Dose area", 0, 1, dose_of},
    {"Contrast agent", "ml", "Contrast", 1, 1, contrast_of},  {"Wall force, largest", "N", "Wall force", 3, 0.1, wall_of},
    {"Tip force, largest", "N", "Tip force", 3, 0.1, tip_of}, {"Handling errors", "number", "Errors", 0, 4, errors_of}};
enum { FIGURES = sizeof figure_table / sizeof figure_table[0] };

static const char *title_of(const Session *session) { return *session->title ? session->title : no_exercise; }
static const char *trainee_of(const Session *session) { return *session->trainee ? session->trainee : "(no name)"; }

// NULL for trainee or title: any.
static Series select_sessions(const SessionArchive *archive, const char *trainee, const char *title)
{
    Series series = {.at = HEAP_ZEROED((size_t)archive->count + 1, sizeof(const ArchivedSession *))};
    for (int i = 0; i < archive->count; i++) {
        const Session *s = &archive->entry[i].session;
        if ((!trainee || !strcmp(trainee, s->trainee)) && (!title || !strcmp(title, s->title)))
            series.at[series.count++] = &archive->entry[i];
    }
    return series;
}

static int compare_names(const void *a, const void *b) { return strcmp(*(const char *const *)a, *(const char *const *)b); }

// The different names that `of` gives, in alphabetical order; the caller frees the list.
static const char **different(const Series *series, const char *(*of)(const Session *), int *count)
{
    const char **name = HEAP_ZEROED((size_t)series->count + 1, sizeof *name);
    for (int i = 0; i < series->count; i++)
        name[i] = of(&series->at[i]->session);
    qsort(name, (size_t)series->count, sizeof *name, compare_names);
    *count = 0;
    for (int i = 0; i < series->count; i++)
        if (i == 0 || strcmp(name[*count - 1], name[i]))
            name[(*count)++] = name[i];
    return name;
}

static const char *title_key(const Session *session) { return session->title; }
static const char *trainee_key(const Session *session) { return session->trainee; }

static bool is_held(const Session *session) { return session->figures.state == SCORE_REACHED; }

// --- figures ---

static void describe(const ArchivedSession *entry, int number, const Figure *figure, char *text, size_t capacity)
{
    const Session *s = &entry->session;
    snprintf(text, capacity, "%d: %s, %.*f %s, %s%s", number, s->date, figure->decimals, figure->of(&s->figures), figure->unit,
             is_held(s) ? "target held" : "target not held", s->is_examination ? ", examination" : "");
}

// One line for each of `count` series.
static void print_curve(Page *page, const Figure *figure, const Series *series, const char *const *name, int count, int width, int height)
{
    enum { NOTE = 160 };
    char id[32], title[120];
    CurveSeries *line = HEAP_ZEROED((size_t)count + 1, sizeof *line);
    CurvePoint **point = HEAP_ZEROED((size_t)count + 1, sizeof *point);
    char(**note)[NOTE] = HEAP_ZEROED((size_t)count + 1, sizeof *note);
    for (int k = 0; k < count; k++) {
        point[k] = HEAP_ZEROED((size_t)series[k].count + 1, sizeof *point[k]);
        note[k] = HEAP_ZEROED((size_t)series[k].count + 1, sizeof *note[k]);
        for (int i = 0; i < series[k].count; i++) {
            const Session *s = &series[k].at[i]->session;
            describe(series[k].at[i], i + 1, figure, note[k][i], sizeof note[k][i]);
            point[k][i] = (CurvePoint){figure->of(&s->figures), is_held(s), note[k][i]};
        }
        line[k] = (CurveSeries){name ? name[k] : NULL, series[k].count, point[k]};
    }
    snprintf(id, sizeof id, "curve-%d", ++page->figures);
    snprintf(title, sizeof title, "%s [%s]", figure->title, figure->unit);
    LearningCurve curve = {.id = id, .title = title, .least_top = figure->least_top, .width = width, .height = height, .series_count = count, .series = line};
    learning_curve(page->out, &curve);
    for (int k = 0; k < count; k++) {
        free(point[k]);
        free(note[k]);
    }
    free(note);
    free(point);
    free(line);
}

// --- tables ---

static void print_cell(FILE *out, const char *element, const char *text)
{
    fprintf(out, "<%s class=\"words%s", element, strcmp(element, "th") ? " why\">" : "\" scope=\"row\">");
    page_text(out, text);
    fprintf(out, "</%s>", element);
}

static void print_heads(FILE *out, const char *const *text, int words)
{
    fprintf(out, "<div class=\"scroll\"><table><thead><tr>");
    for (int i = 0; text[i]; i++)
        fprintf(out, "<th scope=\"col\"%s>%s</th>", i < words ? " class=\"words\"" : "", text[i]);
}

static void print_figure_heads(FILE *out)
{
    for (int i = 0; i < FIGURES; i++)
        fprintf(out, "<th scope=\"col\">%s [%s]</th>", figure_table[i].head, figure_table[i].unit);
}

static void print_figure_cells(FILE *out, const ScoreFigures *f)
{
    for (int i = 0; i < FIGURES; i++)
        fprintf(out, "<td>%.*f</td>", figure_table[i].decimals, figure_table[i].of(f));
}

// "W 2, T": the letters of the errors with their numbers.
static void print_letters(FILE *out, const ScoreFigures *f)
{
    const char *comma = "";
    fprintf(out, "<td class=\"words letters\">");
    for (int i = 0; i < ERROR_COUNT; i++)
        if (f->error[i].count > 0) {
            fprintf(out, "%s%c %d", comma, session_error_letter((ScoreError)i), f->error[i].count);
            comma = ", ";
        }
    fprintf(out, "</td>");
}

static void print_session_table(FILE *out, const Series *series)
{
    static const char *const heads[] = {"No.", "Date (UTC)", "Mode", "Target", NULL};
    print_heads(out, heads, 4);
    print_figure_heads(out);
    fprintf(out, "<th scope=\"col\" class=\"words\">Errors by kind</th></tr></thead><tbody>\n");
    for (int i = 0; i < series->count; i++) {
        const Session *s = &series->at[i]->session;
        fprintf(out, "<tr><th scope=\"row\">%d</th><td class=\"words\">%.10s %.5s</td><td class=\"words\">%s</td><td class=\"words\">%s</td>", i + 1, s->date,
                s->date + 11, s->is_examination ? "examination" : "practice", is_held(s) ? "held" : "not held");
        print_figure_cells(out, &s->figures);
        print_letters(out, &s->figures);
        fprintf(out, "</tr>\n");
    }
    fprintf(out, "</tbody></table></div>\n");
}

static void print_letter_key(FILE *out)
{
    fprintf(out, "<p class=\"key\">Errors by kind: ");
    for (int i = 0; i < ERROR_COUNT; i++)
        fprintf(out, "%s%c %s", i > 0 ? ", " : "", session_error_letter((ScoreError)i), score_error_words[i]);
    fprintf(out, ".</p>\n");
}

static void print_gaps(FILE *out, const SessionArchive *archive)
{
    fprintf(out, "<section id=\"unreadable\"><h2>Files that could not be read</h2>\n");
    if (archive->gap_count == 0) {
        fprintf(out, "<p>None.</p></section>\n");
        return;
    }
    static const char *const heads[] = {"File", "Reason", NULL};
    print_heads(out, heads, 2);
    fprintf(out, "</tr></thead><tbody>\n");
    for (int i = 0; i < archive->gap_count; i++) {
        fprintf(out, "<tr>");
        print_cell(out, "th", archive->gap[i].file);
        print_cell(out, "td", archive->gap[i].why);
        fprintf(out, "</tr>\n");
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

// --- a trainee ---

static void print_totals(FILE *out, const Series *series)
{
    double time_s = 0, fluoroscopy_s = 0, contrast_ml = 0;
    int errors = 0, held = 0;
    for (int i = 0; i < series->count; i++) {
        const ScoreFigures *f = &series->at[i]->session.figures;
        time_s += f->time_s, fluoroscopy_s += f->fluoroscopy_s, contrast_ml += f->contrast_ml;
        errors += f->error_total, held += is_held(&series->at[i]->session);
    }
    fprintf(out, "<dl><dt>Sessions</dt><dd>%d, the target held in %d</dd>\n", series->count, held);
    if (series->count > 0)
        fprintf(out,
                "<dt>From</dt><dd>%s to %s</dd>\n<dt>In total</dt><dd>%.1f min of practice, %.1f min of X-rays, %.1f ml of contrast agent, %d handling "
                "errors</dd>\n",
                series->at[0]->session.date, series->at[series->count - 1]->session.date, time_s / 60, fluoroscopy_s / 60, contrast_ml, errors);
    fprintf(out, "</dl>\n");
}

static void print_trainees_case(Page *page, const char *title, int number)
{
    FILE *out = page->out;
    Series series = select_sessions(page->archive, page->trainee, title);
    fprintf(out, "<section id=\"case-%d\"><h2>", number);
    page_text(out, title_of(&series.at[0]->session));
    fprintf(out, "</h2>\n<figure><div class=\"plots\">\n");
    for (int i = 0; i < FIGURES; i++)
        print_curve(page, &figure_table[i], &series, NULL, 1, 260, 110);
    fprintf(out, "</div><figcaption>By session, as numbered in the table; filled: target held, open: not.</figcaption></figure>\n");
    print_session_table(out, &series);
    fprintf(out, "</section>\n");
    free(series.at);
}

static void print_trainee(Page *page)
{
    Series own = select_sessions(page->archive, page->trainee, NULL);
    int count;
    const char **title = different(&own, title_key, &count);
    print_totals(page->out, &own);
    if (own.count > 0)
        print_letter_key(page->out);
    for (int i = 0; i < count; i++)
        print_trainees_case(page, title[i], i + 1);
    free(title);
    free(own.at);
}

// --- all trainees ---

static void print_trainee_row(FILE *out, const Series *series)
{
    const ScoreFigures *first = &series->at[0]->session.figures, *last = &series->at[series->count - 1]->session.figures;
    double best = 0;
    int held = 0;
    for (int i = 0; i < series->count; i++) {
        best = series->at[i]->session.figures.points > best ? series->at[i]->session.figures.points : best;
        held += is_held(&series->at[i]->session);
    }
    fprintf(out, "<tr>");
    print_cell(out, "th", trainee_of(&series->at[0]->session));
    fprintf(out, "<td>%d</td><td>%d</td><td>%.0f</td><td>%.0f</td>", series->count, held, first->points, best);
    print_figure_cells(out, last);
    fprintf(out, "</tr>\n");
}

static void print_case(Page *page, const char *title, int number)
{
    static const char *const heads[] = {"Trainee", "Sessions", "Target held", "Points, first session", "Points, best", NULL};
    FILE *out = page->out;
    Series all = select_sessions(page->archive, NULL, title);
    int count;
    const char **trainee = different(&all, trainee_key, &count);
    Series *series = HEAP_ZEROED((size_t)count + 1, sizeof *series);
    const char **name = HEAP_ZEROED((size_t)count + 1, sizeof *name);
    for (int k = 0; k < count; k++) {
        series[k] = select_sessions(page->archive, trainee[k], title);
        name[k] = trainee_of(&series[k].at[0]->session);
    }
    fprintf(out, "<section id=\"case-%d\"><h2>", number);
    page_text(out, title_of(&all.at[0]->session));
    fprintf(out, "</h2>\n<figure>");
    print_curve(page, &figure_table[0], series, name, count, 620, count * CURVE_NAME_LINE > 180 ? count * CURVE_NAME_LINE : 180);      // room for the names
    fprintf(out, "<figcaption>Points by session, a line for each trainee; filled: target held, open: not.</figcaption></figure>\n");
    print_heads(out, heads, 1);
    print_figure_heads(out);
    fprintf(out, "</tr></thead><tbody>\n");
    for (int k = 0; k < count; k++) {
        print_trainee_row(out, &series[k]);
        free(series[k].at);
    }
    fprintf(out, "</tbody></table></div>\n<p>The columns after the best points are those of the last session.</p></section>\n");
    free(name);
    free(series);
    free(trainee);
    free(all.at);
}

// The mean number of errors a session, by kind.
static void print_errors(Page *page, const char *const *trainee, int count)
{
    FILE *out = page->out;
    fprintf(out, "<section id=\"errors\"><h2>Handling errors per session, by kind</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\" "
                 "class=\"words\">Trainee</th><th scope=\"col\">Sessions</th>");
    for (int i = 0; i < ERROR_COUNT; i++)
        fprintf(out, "<th scope=\"col\">%s</th>", score_error_words[i]);
    fprintf(out, "</tr></thead><tbody>\n");
    for (int k = 0; k < count; k++) {
        Series series = select_sessions(page->archive, trainee[k], NULL);
        fprintf(out, "<tr>");
        print_cell(out, "th", trainee_of(&series.at[0]->session));
        fprintf(out, "<td>%d</td>", series.count);
        for (int e = 0; e < ERROR_COUNT; e++) {
            int sum = 0;
            for (int i = 0; i < series.count; i++)
                sum += series.at[i]->session.figures.error[e].count;
            fprintf(out, "<td>%.2f</td>", (double)sum / series.count);
        }
        fprintf(out, "</tr>\n");
        free(series.at);
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

static void print_trainees(Page *page)
{
    Series all = select_sessions(page->archive, NULL, NULL);
    int cases, trainees;
    const char **title = different(&all, title_key, &cases), **trainee = different(&all, trainee_key, &trainees);
    print_totals(page->out, &all);
    for (int i = 0; i < cases; i++)
        print_case(page, title[i], i + 1);
    if (trainees > 0)
        print_errors(page, trainee, trainees);
    free(trainee);
    free(title);
    free(all.at);
}

char *archive_page(const SessionArchive *archive, const char *folder, const char *trainee, size_t *length, Faults *faults)
{
    char *bytes = NULL;
    FILE *out = open_memstream(&bytes, length);
    if (out) {
        Page page = {.out = out, .archive = archive, .trainee = trainee};
        page_begin(out, trainee ? "Trainee" : "Sessions", trainee ? trainee : "Sessions of all trainees", own_style);
        fprintf(out, "<p class=\"notice\" role=\"note\"><strong>For training and research. Not a medical device:</strong> points compare sessions at this "
                     "simulator; they say nothing about the treatment of patients.</p></header>\n<main>\n");
        if (trainee)
            print_trainee(&page);
        else
            print_trainees(&page);
        print_gaps(out, archive);
        fprintf(out, "</main>\n<footer><p>Folder: ");
        page_text(out, folder);
        fprintf(out, ". Written by seldinger " SELDINGER_VERSION ".</p></footer></body></html>\n");
    }
    bool good = out && !ferror(out);
    good = out && fclose(out) == 0 && good;
    if (good)
        return bytes;
    faults_add(faults, folder, 0, 0, "out of memory for the page");
    free(bytes);
    return NULL;
}
