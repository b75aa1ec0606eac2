#include "render/check_page.h"

#include "render/check_figures.h"
#include "render/page.h"

static const char own_style[] = ".golden{color:var(--o1)}.new{color:var(--o2)}.failed,.error{color:var(--bad);font-weight:600}.skipped{color:var(--muted)}\n"
                                ".line.golden{stroke-width:2.5}\n"
                                ".vessel{stroke:var(--ink);fill:var(--ink);opacity:.12;stroke-linecap:round}.line.new{stroke-dasharray:6 "
                                "3;stroke-width:2}td.why{white-space:normal;max-width:36rem}section{break-inside:avoid}\n";

static void print_cell(FILE *out, const char *class, const char *text)
{
    fprintf(out, "<td class=\"words %s\">", class);
    page_text(out, text);
    fprintf(out, "</td>");
}

static void print_row(FILE *out, const CheckCase *one, int index)
{
    bool has_figures = one->comparison && one->comparison->golden;
    fprintf(out, "<tr><th scope=\"row\" class=\"words\">");
    if (has_figures)
        fprintf(out, "<a href=\"#case-%d\">", index);
    page_text(out, one->scene);
    fprintf(out, "%s</th>", has_figures ? "</a>" : "");
    print_cell(out, "", one->name);
    print_cell(out, check_status_name[one->status], check_status_name[one->status]);
    fprintf(out, "<td>%.2f</td>", one->time_s);
    print_cell(out, "why", one->message);
    fprintf(out, "</tr>\n");
}

static void print_quantities(FILE *out, const GoldenComparison *comparison)
{
    fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Quantity</th><th scope=\"col\">Largest difference</th><th scope=\"col\">Tolerance"
                 "</th><th scope=\"col\">First above it [s]</th><th scope=\"col\">Difference there</th></tr></thead><tbody>\n");
    for (int k = 0; k < TOLERANCE_COUNT; k++) {
        const FigureDifference *difference = &comparison->quantity[k];
        if (!difference->is_compared)
            continue;
        fprintf(out, "<tr><th scope=\"row\">%s (%s)</th><td>%.3g</td><td>%g</td>", tolerance_info[k].what, tolerance_info[k].name, difference->worst,
                difference->tolerance);
        if (difference->first_t_s >= 0)
            fprintf(out, "<td class=\"failed\">%.3f</td><td>%.3g</td></tr>\n", difference->first_t_s, difference->first);
        else
            fprintf(out, "<td>–</td><td>–</td></tr>\n");
    }
    fprintf(out, "</tbody></table></div>\n");
}

static void print_case(FILE *out, const CheckCase *one, int index)
{
    fprintf(out, "<section id=\"case-%d\"><h2>", index);
    page_text(out, one->scene);
    fprintf(out, "</h2>\n<p>");
    page_text(out, one->message);
    fprintf(out, ".</p>\n");
    print_quantities(out, one->comparison);
    fprintf(out, "<div class=\"plots\">");
    check_part_figures(out, one->comparison, index);
    fprintf(out, "</div></section>\n");
}

void check_page(FILE *out, const CheckLog *log)
{
    page_begin(out, "seldinger check", "Golden runs and verification", own_style);
    fprintf(out, "<p>seldinger %s: ", SELDINGER_VERSION);
    for (int k = 0; k < CHECK_STATUS_COUNT; k++)
        fprintf(out, "%s%d %s", k > 0 ? ", " : "", check_log_count(log, NULL, (CheckStatus)k), check_status_name[k]);
    fprintf(out, "</p></header>\n<section id=\"cases\"><h2>Cases</h2><div class=\"scroll\"><table><thead><tr><th scope=\"col\">Scene</th>"
                 "<th scope=\"col\" class=\"words\">Case</th><th scope=\"col\" class=\"words\">Result</th><th scope=\"col\">Time [s]</th>"
                 "<th scope=\"col\" class=\"words\">What is wrong</th></tr></thead><tbody>\n");
    // what needs attention comes first
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < log->count; i++)
            if ((log->at[i].status == CHECK_PASSED) == pass)
                print_row(out, &log->at[i], i);
    fprintf(out, "</tbody></table></div></section>\n");
    for (int i = 0; i < log->count; i++)
        if (log->at[i].comparison && log->at[i].comparison->golden)
            print_case(out, &log->at[i], i);
    fprintf(out, "</body></html>\n");
}
