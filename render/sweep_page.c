#include "render/sweep_page.h"

#include "render/page.h"
#include "render/sweep_figures.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char own_style[] =
    ".vessel{stroke:var(--ink);fill:var(--ink);opacity:.12;stroke-linecap:round}.dots{fill:var(--o1);fill-opacity:.55}\n"
    "svg.index{background:none;margin:0;vertical-align:middle}.worst{display:flex;flex-wrap:wrap;gap:1.5rem}.run{width:20rem;break-inside:avoid}\n"
    "h3{font-size:1rem;margin:.5rem 0}.run dl{font-size:.8rem;grid-template-columns:1fr}.run pre{margin:.4rem 0}\n"
    ".faint{color:var(--muted)}td.index{white-space:nowrap}td.index svg{display:block;margin-left:auto}section{break-inside:auto}\n"
    "@media print{.scroll{overflow:visible}table{font-size:8pt}.worst{display:block}.run{display:inline-block;width:48%;vertical-align:top}.plots "
    "figure{width:32%}}\n";

enum { FEW_RUNS = 400 };     // the index is too low by at most 0.05

static void print_head(FILE *out, const SweepPage *page)
{
    const SweepResults *results = page->results;
    fprintf(out, "<dl><dt>Results</dt><dd>");
    page_text(out, page->folder);
    fprintf(out, "</dd><dt>Report by</dt><dd>seldinger %s</dd><dt>Runs</dt><dd>%d: ", SELDINGER_VERSION, results->row_count);
    for (int k = 0; run_status_name[k]; k++)
        fprintf(out, "%s%d %s", k > 0 ? ", " : "", sweep_results_count(results, run_status_name[k]), run_status_name[k]);
    fprintf(out, "</dd><dt>Varied</dt><dd>");
    for (int k = 0; k < results->key_count; k++) {
        fprintf(out, "%s", k > 0 ? ", " : "");
        page_text(out, results->column[results->key_first + k].name);
    }
    fprintf(out, "</dd></dl></header>\n");
}

static void print_failures(FILE *out, const SweepResults *results)
{
    enum { SHOWN = 50 };
    int shown = 0, failures = 0;
    for (int i = 0; i < results->row_count; i++)
        failures += !results->is_done[i];
    if (failures == 0)
        return;
    fprintf(out, "<section id=\"failures\"><h2>Runs without a result</h2><div class=\"scroll\"><table><thead><tr><th scope=\"col\">Run</th><th scope=\"col\" "
                 "class=\"words\">"
                 "Status</th><th scope=\"col\" class=\"words\">Message</th></tr></thead><tbody>\n");
    for (int i = 0; i < results->row_count && shown < SHOWN; i++) {
        if (results->is_done[i])
            continue;
        shown++;
        fprintf(out, "<tr><th scope=\"row\">%d</th><td class=\"words\">", i);
        page_text(out, results->column[results->status].text[i]);
        fprintf(out, "</td><td class=\"words\">");
        page_text(out, results->column[results->message].text[i]);
        fprintf(out, "</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div>");
    if (failures > shown)
        fprintf(out, "<p>%d more are in the table.</p>", failures - shown);
    fprintf(out, "</section>\n");
}

// The index of a figure for a key, from the runs that are done and have both.
static bool find_index(const SweepResults *results, int key, int figure, FirstOrder *index)
{
    const SweepColumn *x = &results->column[key], *y = &results->column[figure];
    double *held = HEAP_ZEROED(2 * (size_t)results->row_count + 2, sizeof *held), *with = held + results->row_count;
    int count = 0;
    for (int i = 0; i < results->row_count; i++)
        if (results->is_done[i] && !isnan(x->value[i]) && !isnan(y->value[i])) {
            held[count] = x->value[i];
            with[count++] = y->value[i];
        }
    bool good = first_order(count, held, with, !x->is_number, index);
    free(held);
    return good;
}

// A path that may be broken behind each dot.
static void print_path(FILE *out, const char *path)
{
    for (size_t length; *path; path += length) {
        char part[200];
        length = strcspn(path, ".");
        length += path[length] == '.';
        length = length < sizeof part ? length : sizeof part - 1;
        snprintf(part, sizeof part, "%.*s", (int)length, path);
        page_text(out, part);
        fprintf(out, "<wbr/>");
    }
}

// On evenly spread points the index is too low by at most (classes - 1) / (runs - classes), with sqrt(N) classes 1 / sqrt(N): sim/first_order.h.
static void print_trust(FILE *out, const SweepResults *results)
{
    int done = 0;
    for (int i = 0; i < results->row_count; i++)
        done += results->is_done[i];
    bool is_few = done < FEW_RUNS;
    fprintf(
        out, "<p%s>%s%d runs are done: on a grid or on Sobol's points an index can be too low by up to %.2f (1/√N), which the interval does not contain. %s",
        is_few ? " class=\"notice\"" : "", is_few ? "Few runs. " : "", done, done > 0 ? 1 / sqrt(done) : 1.0,
        "With 400 runs this is 0.05, with 2,500 it is 0.02, with 10,000 it is 0.01. Not known: the interval is wider than 1, because few runs differ.</p>\n");
}

static void print_sensitivity(FILE *out, const SweepResults *results)
{
    fprintf(
        out,
        "<section id=\"sensitivity\"><h2>Sensitivity</h2>\n<p>First-order Sobol index: the share of a figure's variance that one key explains alone, with an "
        "interval of at least 95 %%. Faint: the interval holds 0. What the indices of a row leave of 1 is interaction of keys, other causes such as random "
        "hands, and error. Estimated from the runs that are done by the correlation ratio of classes (Plischke, Borgonovo, Smith 2013).</p>\n");
    print_trust(out, results);
    fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Figure</th>");
    for (int k = 0; k < results->key_count; k++) {
        fprintf(out, "<th scope=\"col\">");
        print_path(out, results->column[results->key_first + k].name);
        fprintf(out, "</th>");
    }
    fprintf(out, "</tr></thead><tbody>\n");
    for (int c = results->figure_first; c < results->column_count; c++) {
        if (!sweep_results_is_figure(results, c) || !results->column[c].varies)
            continue;
        fprintf(out, "<tr><th scope=\"row\">");
        page_text(out, results->column[c].name);
        fprintf(out, "</th>");
        for (int k = 0; k < results->key_count; k++) {
            FirstOrder index;
            if (!find_index(results, results->key_first + k, c, &index)) {
                fprintf(out, "<td class=\"faint\">too few runs</td>");
                continue;
            }
            if (index.high - index.low > 1) {
                fprintf(out, "<td class=\"faint\">not known</td>");
                continue;
            }
            fprintf(out, "<td class=\"index%s\">", index.low <= 0 ? " faint" : "");
            sweep_index_bar(out, &index);
            fprintf(out, " %.2f (%.2f to %.2f)</td>", index.index, index.low, index.high);
        }
        fprintf(out, "</tr>\n");
    }
    fprintf(out, "</tbody></table></div></section>\n");
}

static void print_distributions(FILE *out, const SweepResults *results)
{
    const char *comma = "";
    fprintf(out, "<section id=\"distributions\"><h2>Distributions</h2><div class=\"plots\">\n");
    for (int c = results->figure_first; c < results->column_count; c++)
        if (sweep_results_is_figure(results, c) && results->column[c].varies)
            sweep_histogram(out, results, c, c);
    fprintf(out, "</div><p class=\"faint\">The same in all runs that are done: ");
    for (int c = results->figure_first; c < results->column_count; c++)
        if (sweep_results_is_figure(results, c) && !results->column[c].varies && !isnan(results->column[c].least)) {
            fprintf(out, "%s", comma);
            page_text(out, results->column[c].name);
            fprintf(out, " %.6g", results->column[c].least);
            comma = ", ";
        }
    fprintf(out, "%s.</p></section>\n", *comma ? "" : "none");
}

// The figures that most sweeps are made for come first, then others in the table's order.
static int choose_figures(const SweepResults *results, int chosen[], int most)
{
    static const char *const usual[] = {"score.points", "targets[0].distance_mm", "targets[0].time_s", "proximal.force_most_n", "wall_force_n.max",
                                        "inserted_mm",  "golden.worst_mm",        "penetration_mm.max"};
    enum { USUAL = sizeof usual / sizeof usual[0] };
    int count = 0;
    for (int i = 0; i < USUAL + results->column_count - results->figure_first && count < most; i++) {
        int c = i < USUAL ? sweep_results_find(results, usual[i]) : results->figure_first + i - USUAL;
        bool is_new = c >= 0 && sweep_results_is_figure(results, c) && results->column[c].varies;
        for (int k = 0; k < count; k++)
            is_new &= chosen[k] != c;
        if (is_new)
            chosen[count++] = c;
    }
    return count;
}

static void print_pairs(FILE *out, const SweepResults *results)
{
    enum { MOST = 6 };
    int chosen[MOST], count = choose_figures(results, chosen, MOST), number = 0;
    fprintf(out, "<section id=\"pairs\"><h2>Pairs</h2>\n");
    if (results->row_count > SWEEP_DOTS_MOST)
        fprintf(out, "<p class=\"faint\">Every %d-th run is drawn.</p>", results->row_count / (SWEEP_DOTS_MOST + 1) + 1);
    for (int i = 0; i < count; i++) {
        fprintf(out, "<div class=\"plots\">");
        for (int k = 0; k < results->key_count; k++)
            if (results->column[results->key_first + k].varies)
                sweep_scatter(out, results, results->key_first + k, chosen[i], ++number);
        fprintf(out, "</div>\n");
    }
    fprintf(out, "</section>\n");
}

void sweep_page(FILE *out, const SweepPage *page)
{
    page_begin(out, "sweep", page->folder, own_style);
    print_head(out, page);
    print_sensitivity(out, page->results);
    print_failures(out, page->results);
    sweep_worst_section(out, page);
    print_distributions(out, page->results);
    print_pairs(out, page->results);
    fprintf(out, "<section id=\"specification\"><h2>Specification</h2><pre>");
    page_text(out, page->specification);
    fprintf(out, "</pre></section>\n</body></html>\n");
}
