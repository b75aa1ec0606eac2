#include "cli/report.h"

#include "base/output.h"

#include <stdlib.h>
#include <string.h>

enum { PLOTS_MOST = 200, WORST = 10 };

const char report_style[] =
    ":root{color-scheme:light dark;--paper:#fff;--ink:#1a1d21;--muted:#545b64;--rule:#c9ced6;--panel:#f4f6f8;--o1:#0b5fa5;--o2:#a8480a;--o3:#00725a;--o4:#8a2d73;"
    "--o5:#6b5a00;--o6:#4a4f57;--bad:#b3001b;--wide:#8a5a00;--sac:#7a2ba0}\n"
    "@media (prefers-color-scheme:dark){:root{--paper:#14171a;--ink:#eceff2;--muted:#aeb6c0;--rule:#464d56;--panel:#1e2328;--o1:#6fb8f5;--o2:#f2a268;--o3:#4fd1ad;"
    "--o4:#e59ad2;--o5:#e3cc5c;--o6:#c3c9d1;--bad:#ff8080;--wide:#f0b849;--sac:#d59bf2}}\n"
    "body{font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:72rem;margin:0 auto;padding:1.5rem}\n"
    "h1{font-size:1.6rem;line-height:1.2;margin:.2rem 0}h2{font-size:1.2rem;margin:2rem 0 .5rem;border-bottom:1px solid var(--rule)}\n"
    ".notice{border-left:4px solid var(--bad);background:var(--panel);padding:.6rem 1rem;margin:1rem 0}\n"
    "table{border-collapse:collapse;width:100%;font-size:.9rem}caption{text-align:left;color:var(--muted);padding:.3rem 0}\n"
    "th,td{padding:.25rem .6rem;border-bottom:1px solid var(--rule);text-align:right;font-variant-numeric:tabular-nums}\n"
    "th:first-child,td:first-child,.words{text-align:left}thead th{border-bottom:2px solid var(--muted)}\n"
    ".scroll{overflow-x:auto}dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1.2rem;margin:0}dt{color:var(--muted)}dd{margin:0;overflow-wrap:anywhere}\n"
    "figure{margin:1rem 0}figcaption{color:var(--muted);font-size:.9rem}svg{max-width:100%;height:auto;background:var(--panel);margin:0 .5rem .5rem 0}\n"
    "svg text{fill:var(--ink);font:12px system-ui,sans-serif}svg text.tick{fill:var(--muted);font-size:11px}\n"
    ".label{paint-order:stroke;stroke:var(--panel);stroke-width:3px;font-weight:600}.plots{display:flex;flex-wrap:wrap;gap:.5rem}.plots figure{margin:0}\n"
    ".o1{color:var(--o1)}.o2{color:var(--o2)}.o3{color:var(--o3)}.o4{color:var(--o4)}.o5{color:var(--o5)}.o6{color:var(--o6)}\n"
    ".tube{fill:currentColor;fill-opacity:.28;stroke:none}.line{fill:none;stroke:currentColor;stroke-width:1.5}.sac{fill:var(--sac);fill-opacity:.15;stroke:var(--sac)}\n"
    ".root{fill:var(--paper);stroke:var(--ink);stroke-width:2}.axis{fill:none;stroke:var(--ink)}.grid{stroke:var(--rule)}.border{stroke:var(--ink);stroke-dasharray:4 3}\n"
    ".mark{fill:none;stroke:currentColor;stroke-width:2.5}.reference{stroke:currentColor;stroke-width:1.5;stroke-dasharray:3 2}\n"
    ".stenosis{color:var(--bad)}.dilatation{color:var(--wide)}.aneurysm{color:var(--sac)}svg .stenosis text,svg .dilatation text,svg .aneurysm text{fill:currentColor}\n"
    ".c1{fill:var(--o3)}.c2{fill:var(--o1)}.c3{fill:var(--o2)}.c4{fill:var(--bad)}.key span{margin-right:1.2rem;font-weight:600}\n"
    "pre{white-space:pre-wrap;background:var(--panel);padding:.8rem;font-size:.8rem}\n"
    "@media print{:root{--paper:#fff;--ink:#000;--muted:#444;--rule:#bbb;--panel:#fff;--o1:#0b5fa5;--o2:#a8480a;--o3:#00725a;--o4:#8a2d73;--o5:#6b5a00;--o6:#4a4f57;"
    "--bad:#b3001b;--wide:#8a5a00;--sac:#7a2ba0}body{max-width:none;padding:0;font-size:11pt}figure,tr,svg{break-inside:avoid}h2{break-after:avoid}}\n";

// The length of the UTF-8 character at s, 0 where there is none that HTML may hold.
static int character_length(const unsigned char *s)
{
    if (s[0] < 0x80)
        return s[0] >= 0x20 || s[0] == '\n' || s[0] == '\t' ? s[0] != 0x7f : 0;
    int length = s[0] >= 0xf0 && s[0] < 0xf5 ? 4 : s[0] >= 0xe0 && s[0] < 0xf0 ? 3 : s[0] >= 0xc2 && s[0] < 0xe0 ? 2 : 0;
    for (int i = 1; i < length; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    bool overlong = (s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xf0 && s[1] < 0x90), surrogate = s[0] == 0xed && s[1] >= 0xa0;
    bool control = s[0] == 0xc2 && s[1] < 0xa0, none = (s[0] == 0xf4 && s[1] >= 0x90) || (s[0] == 0xef && s[1] == 0xbf && s[2] >= 0xbe);
    return overlong || surrogate || control || none ? 0 : length;
}

void report_text(FILE *out, const char *text)
{
    for (const unsigned char *s = (const unsigned char *)(text ? text : ""); *s;) {
        int length = character_length(s);
        if (*s == '&' || *s == '<' || *s == '>' || *s == '"')
            fputs(*s == '&' ? "&amp;" : *s == '<' ? "&lt;" : *s == '>' ? "&gt;" : "&quot;", out);
        else if (length > 0)
            fwrite(s, 1, (size_t)length, out);
        else
            fputs("\xef\xbf\xbd", out);
        s += length > 0 ? length : 1;
    }
}

void report_label(const Report *report, int finding, char label[16])
{
    FindingKind kind = report->finding[finding].kind;
    int number = 0;
    for (int i = 0; i <= finding; i++)
        number += report->finding[i].kind == kind;
    snprintf(label, 16, "%c%d", "SDA"[kind], number);
}

static void item(const Report *report, const char *term, const char *text)
{
    fprintf(report->out, "<dt>%s</dt><dd>", term);
    report_text(report->out, text);
    fprintf(report->out, "</dd>\n");
}

static void print_summary(const Report *report)
{
    FILE *out = report->out;
    const VesselTree *tree = report->tree;
    double length = 0, least = HUGE_VAL, largest = 0;
    int by_kind[3] = {0};
    for (int i = 0; i < report->branches->count; i++)
        length += report->branches->branch[i].length;
    for (int i = 0; i < tree->node_count; i++)
        if (tree->kind[i] == NODE_VESSEL)
            least = fmin(least, tree->radius[i]), largest = fmax(largest, tree->radius[i]);
    for (int i = 0; i < report->finding_count; i++)
        by_kind[report->finding[i].kind]++;
    fprintf(out, "<section id=\"summary\"><h2>Summary</h2>\n<dl>\n");
    item(report, "File", report->name);
    item(report, "Made from", report->info->source && *report->info->source ? report->info->source : "not said");
    item(report, "Made by", report->info->created_by && *report->info->created_by ? report->info->created_by : "not said");
    fprintf(out, "<dt>Vessels</dt><dd>%d branches, %.0f mm of centreline, radius %.2f to %.2f mm; %d nodes, %lld points on the wall</dd>\n", report->branches->count,
            length, report->branches->count > 0 ? least : 0, largest, tree->node_count, (long long)tree->point_count);
    fprintf(out, "<dt>Candidates</dt><dd>%d narrow, %d wide, %d aneurysm%s</dd>\n", by_kind[FINDING_STENOSIS], by_kind[FINDING_DILATATION],
            by_kind[FINDING_ANEURYSM], by_kind[FINDING_ANEURYSM] == 1 ? "" : "s");
    if (vessel_tree_is_model(tree))
        fprintf(out, "<dt>Model</dt><dd>%lld blobs, %.1f a node</dd>\n", (long long)tree->blob_count, (double)tree->blob_count / tree->node_count);
    fprintf(out, "<dt>Units</dt><dd>lengths in millimetres, in the frame of the volume or surface it was made from</dd>\n</dl></section>\n");
}

static void print_tree(const Report *report)
{
    FILE *out = report->out;
    int highest = 0;
    for (int i = 0; i < report->branches->count; i++)
        highest = report->branches->branch[i].order > highest ? report->branches->branch[i].order : highest;
    fprintf(out, "<section id=\"tree\"><h2>Vessel tree</h2>\n<figure id=\"figure-tree\">\n");
    report_tree_figure(report);
    fprintf(out, "<p class=\"key\">Order: ");
    for (int i = 1; i <= highest && i <= 6; i++)
        fprintf(out, "<span class=\"o%d\">%d%s</span>", i, i, i == 6 && highest > 6 ? " and more" : "");
    fprintf(out, "</p>\n<figcaption>Projections along the three axes. Numbers are branches, the ring is the root; S narrow places, D wide places, A aneurysms. A "
                 "branch goes on at a fork through the wider child; what leaves it is one order higher.</figcaption></figure></section>\n");
}

static void print_finding(const Report *report, int index)
{
    FILE *out = report->out;
    const Finding *f = &report->finding[index];
    Vec3 c = report->tree->center[f->node];
    char label[16];
    report_label(report, index, label);
    fprintf(out, "<tr><th scope=\"row\" class=\"%s\">%s</th>", (const char *const[]){"stenosis", "dilatation", "aneurysm"}[f->kind], label);
    fprintf(out, "<td class=\"words\">%s</td>", (const char *const[]){"narrow place", "wide place (fusiform)", "aneurysm"}[f->kind]);
    if (f->branch >= 0)
        fprintf(out, "<td>%d</td><td>%.1f</td>", f->branch + 1, f->along);
    else
        fprintf(out, "<td>–</td><td>–</td>");
    fprintf(out, "<td>%.1f, %.1f, %.1f</td><td>%.2f</td><td>%.2f</td>", c.x, c.y, c.z, f->radius, f->reference);
    if (f->kind == FINDING_ANEURYSM) {
        fprintf(out, "<td class=\"words\">extent %.1f mm; neck ", f->extent);
        if (isfinite(f->neck))
            fprintf(out, "%.1f mm</td></tr>\n", f->neck);
        else
            fprintf(out, "not measured</td></tr>\n");
    } else {
        fprintf(out, "<td class=\"words\">%.0f %% %s, over %.1f mm</td></tr>\n", f->degree, f->kind == FINDING_STENOSIS ? "narrower" : "wider", f->length);
    }
}

static void print_findings(const Report *report)
{
    FILE *out = report->out;
    FindingOptions options = finding_default_options();
    fprintf(out, "<section id=\"findings\"><h2>Candidates to look at</h2>\n");
    if (report->finding_count == 0) {
        fprintf(out, "<p>None found.</p>\n");
    } else {
        fprintf(out, "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Mark</th><th scope=\"col\" class=\"words\">Kind</th><th scope=\"col\">Branch</th><th "
                     "scope=\"col\">At [mm]</th><th scope=\"col\">x, y, z [mm]</th><th scope=\"col\">Radius [mm]</th><th scope=\"col\">Reference [mm]</th><th "
                     "scope=\"col\" class=\"words\">Size</th></tr></thead><tbody>\n");
        for (int i = 0; i < report->finding_count; i++)
            print_finding(report, i);
        fprintf(out, "</tbody></table></div>\n");
    }
    fprintf(out,
            "<p>Found by rule, not by a reader. Narrow: radius below %.0f %% of the reference; wide: above %.0f %%. The reference is the mean of the median radii on "
            "either side (2 to 8 branch radii away); within that of a branch’s ends, and where it leaves its parent, nothing is judged. Aneurysms are the nodes marked "
            "as such in the tree; the neck is the narrowest section between vessel and sac, given as the width of a circle of its area.</p></section>\n",
            100 * options.narrow, 100 * options.wide);
}

static void print_branches(const Report *report)
{
    FILE *out = report->out;
    const VesselBranches *all = report->branches;
    fprintf(out, "<section id=\"branches\"><h2>Branches</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Branch</th><th scope=\"col\">Order</th><th "
                 "scope=\"col\">Leaves</th><th scope=\"col\">Nodes</th><th scope=\"col\">Length [mm]</th><th scope=\"col\">Mean radius [mm]</th><th "
                 "scope=\"col\">Least</th><th scope=\"col\">Largest</th><th scope=\"col\">Tortuosity</th></tr></thead><tbody>\n");
    for (int i = 0; i < all->count; i++) {
        const VesselBranch *b = &all->branch[i];
        fprintf(out, "<tr><th scope=\"row\">%d</th><td>%d</td><td>", i + 1, b->order);
        if (b->parent >= 0)
            fprintf(out, "%d", b->parent + 1);
        else
            fprintf(out, "root");
        fprintf(out, "</td><td>%d</td><td>%.1f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td><td>%.2f</td></tr>\n", b->count, b->length, b->radius_mean,
                b->radius_least, b->radius_largest, b->tortuosity);
    }
    fprintf(out, "</tbody></table></div>\n<p>Tortuosity: length along the branch over the straight distance of its ends.</p></section>\n");
}

static void print_radii(const Report *report)
{
    FILE *out = report->out;
    int shown = report->branches->count < PLOTS_MOST ? report->branches->count : PLOTS_MOST;
    fprintf(out, "<section id=\"radii\"><h2>Radius along each branch</h2>\n");
    if (shown < report->branches->count)
        fprintf(out, "<p>The first %d of %d branches.</p>\n", shown, report->branches->count);
    fprintf(out, "<div class=\"plots\">\n");
    for (int i = 0; i < shown; i++) {
        fprintf(out, "<figure id=\"figure-radius-%d\">\n", i + 1);
        report_radius_figure(report, i);
        fprintf(out, "<figcaption>Branch %d, radius [mm]</figcaption></figure>\n", i + 1);
    }
    fprintf(out, "</div></section>\n");
}

static void print_worst(const Report *report)
{
    FILE *out = report->out;
    const VesselTree *tree = report->tree;
    int worst[WORST], count = 0;
    for (int i = 0; i < tree->node_count; i++) {   // insertion into a short sorted list; ties keep the lower index
        int at = count;
        while (at > 0 && tree->error[i] > tree->error[worst[at - 1]])
            at--;
        if (at >= WORST)
            continue;
        count += count < WORST;
        for (int k = count - 1; k > at; k--)
            worst[k] = worst[k - 1];
        worst[at] = i;
    }
    fprintf(out, "<div class=\"scroll\"><table><caption>Local models furthest from their data</caption><thead><tr><th scope=\"col\">Node</th><th "
                 "scope=\"col\">Branch</th><th scope=\"col\">x, y, z [mm]</th><th scope=\"col\">Radius [mm]</th><th scope=\"col\">Blobs</th><th scope=\"col\">d_a "
                 "[mm]</th><th scope=\"col\">d_a [voxels]</th></tr></thead><tbody>\n");
    for (int k = 0; k < count; k++) {
        int i = worst[k], of = report->branches->of_node[i];
        Vec3 c = tree->center[i];
        fprintf(out, "<tr><th scope=\"row\">%d</th><td>", i);
        if (of >= 0)
            fprintf(out, "%d", of + 1);
        else
            fprintf(out, "sac");
        fprintf(out, "</td><td>%.1f, %.1f, %.1f</td><td>%.2f</td><td>%lld</td><td>%.3f</td><td>%.2f</td></tr>\n", c.x, c.y, c.z, tree->radius[i],
                (long long)(tree->blob_offset[i + 1] - tree->blob_offset[i]), tree->error[i], tree->error[i] / report->voxel);
    }
    fprintf(out, "</tbody></table></div>\n");
}

static void print_fit(const Report *report)
{
    FILE *out = report->out;
    fprintf(out, "<section id=\"fit\"><h2>How well the model fits</h2>\n");
    if (!vessel_tree_is_model(report->tree)) {
        fprintf(out, "<p>This tree has no fitted model yet.</p></section>\n");
        return;
    }
    fprintf(out, "<figure id=\"figure-fit\">\n");
    report_error_figure(report);
    fprintf(out,
            "<figcaption>d_a of a local model is the distance to it that 90 %% of its data points keep. Classes of Kerrien et al. 2017, Table 4: C1 under half a voxel, C2 "
            "under one, C3 under two, C4 beyond; voxel %g mm%s.</figcaption></figure>\n",
            report->voxel, report->voxel_is_known ? "" : " (assumed: the file does not say)");
    print_worst(report);
    fprintf(out, "</section>\n");
}

static void print_page(const Report *report)
{
    FILE *out = report->out;
    bool model = vessel_tree_is_model(report->tree);
    fprintf(out, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
                 "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n"
                 "<title>Vessel report: ");
    report_text(out, report->name);
    fprintf(out, "</title>\n<style>\n%s</style></head>\n<body><header><h1>Vessel %s report</h1>\n<p class=\"notice\" role=\"note\"><strong>For training and research. Not "
                 "a medical device:</strong> not for diagnosis or treatment. Everything here is measured by a program on a %s and was checked by nobody.</p></header>\n<main>\n",
            report_style, model ? "model" : "tree", model ? "fitted model" : "tracked tree");
    print_summary(report);
    print_tree(report);
    print_findings(report);
    print_branches(report);
    print_radii(report);
    print_fit(report);
    fprintf(out, "</main>\n<footer><section id=\"origin\"><h2>How it was made</h2>\n<details><summary>Parameters</summary><pre>");
    report_text(out, report->info->parameters && *report->info->parameters ? report->info->parameters : "not said");
    fprintf(out, "</pre></details>\n<p>Written by seldinger " SELDINGER_VERSION ".</p></section></footer></body></html>\n");
}

bool report_write(const char *path, const char *name, const VesselTree *tree, const TreeFileInfo *info, Faults *faults)
{
    char *bytes = NULL;
    size_t length = 0;
    int count = 0;
    FindingOptions options = finding_default_options();
    VesselBranches *branches = vessel_branches_create(tree);
    Finding *finding = branches ? vessel_findings(tree, branches, &options, &count) : NULL;
    FILE *out = finding ? open_memstream(&bytes, &length) : NULL;
    bool good = out != NULL;
    if (good) {
        double said = tree_file_number(info, "voxel_mm", 0);
        Report report = {out, name, tree, info, branches, finding, count, said > 0 ? said : 0.2, said > 0};
        print_page(&report);
        good = !ferror(out);
        good = fclose(out) == 0 && good;
    }
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written: no memory");
    good = good && output_write(path, bytes, length, faults);
    free(bytes);
    free(finding);
    vessel_branches_free(branches);
    return good;
}
