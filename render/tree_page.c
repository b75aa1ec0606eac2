#include "render/tree_page.h"

#include "base/base.h"
#include "render/page.h"
#include "render/tree_figures.h"

#include <stdlib.h>
#include <string.h>

enum { PLOTS_MOST = 200, WORST = 10 };

static void item(const Report *report, const char *term, const char *text)
{
    fprintf(report->out, "<dt>%s</dt><dd>", term);
    page_text(report->out, text);
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
    item(report, "Made from", report->info->source && *report->info->source ? report->info->source : "not given");
    item(report, "Made by", report->info->created_by && *report->info->created_by ? report->info->created_by : "not given");
    fprintf(out, "<dt>Vessels</dt><dd>%d branches, %.0f mm of centreline, radius %.2f to %.2f mm; %d nodes, %lld points on the wall</dd>\n",
            report->branches->count, length, report->branches->count > 0 ? least : 0, largest, tree->node_count, (long long)tree->point_count);
    fprintf(out, "<dt>Candidates</dt><dd>%d narrow, %d wide, %d aneurysm%s</dd>\n", by_kind[FINDING_STENOSIS], by_kind[FINDING_DILATATION],
            by_kind[FINDING_ANEURYSM], by_kind[FINDING_ANEURYSM] == 1 ? "" : "s");
    if (report->model->swept)
        fprintf(out, "<dt>Model</dt><dd>swept: %d branches, %d sections</dd>\n", report->model->swept->branch_count, report->model->swept->break_count);
    else if (vessel_tree_is_model(tree))
        fprintf(out, "<dt>Model</dt><dd>%lld blobs, %.1f per node</dd>\n", (long long)tree->blob_count, (double)tree->blob_count / tree->node_count);
    fprintf(out, "<dt>Units</dt><dd>lengths in millimetres, in the coordinate system of the volume or surface from which it was made</dd>\n</dl></section>\n");
}

static void print_tree(const Report *report)
{
    FILE *out = report->out;
    int highest = 0;
    for (int i = 0; i < report->branches->count; i++)
        highest = report->branches->branch[i].order > highest ? report->branches->branch[i].order : highest;
    fprintf(out, "<section id=\"tree\"><h2>Vessel tree</h2>\n<figure id=\"figure-tree\">\n");
    tree_page_branches_figure(report);
    fprintf(out, "<p class=\"key\">Order: ");
    for (int i = 1; i <= highest && i <= 6; i++)
        fprintf(out, "<span class=\"o%d\">%d%s</span>", i, i, i == 6 && highest > 6 ? " and more" : "");
    fprintf(out,
            "</p>\n<figcaption>Projections along the three axes. Numbers are branches, the ring is the root; S narrow places, D wide places, A aneurysms. A "
            "branch continues at a fork through the wider child; what leaves it is one order higher.</figcaption></figure></section>\n");
}

static void print_finding(const Report *report, int index)
{
    FILE *out = report->out;
    const Finding *f = &report->finding[index];
    Vec3 c = report->tree->center[f->node];
    char label[16];
    tree_page_label(report, index, label);
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
    fprintf(out, "<section id=\"findings\"><h2>Candidates for review</h2>\n");
    if (report->finding_count == 0) {
        fprintf(out, "<p>None found.</p>\n");
    } else {
        fprintf(
            out,
            "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Mark</th><th scope=\"col\" class=\"words\">Kind</th><th scope=\"col\">Branch</th><th "
            "scope=\"col\">At [mm]</th><th scope=\"col\">x, y, z [mm]</th><th scope=\"col\">Radius [mm]</th><th scope=\"col\">Reference [mm]</th><th "
            "scope=\"col\" class=\"words\">Size</th></tr></thead><tbody>\n");
        for (int i = 0; i < report->finding_count; i++)
            print_finding(report, i);
        fprintf(out, "</tbody></table></div>\n");
    }
    fprintf(out,
            "<p>Found by rule, not by a reader. Narrow: radius below %.0f %% of the reference; wide: above %.0f %%. The reference is the mean of the median "
            "radii on either side (2 to 8 branch radii away); within that of a branch’s ends, and where it leaves its parent, nothing is judged. Aneurysms "
            "are the nodes marked as such in the tree; the neck is the narrowest section between vessel and sac, given as the width of a circle of its "
            "area.</p></section>\n",
            100 * options.narrow, 100 * options.wide);
}

static void print_branches(const Report *report)
{
    FILE *out = report->out;
    const VesselBranches *all = report->branches;
    fprintf(out,
            "<section id=\"branches\"><h2>Branches</h2>\n<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Branch</th><th scope=\"col\">Order</th><th "
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
        tree_page_radius_figure(report, i);
        fprintf(out, "<figcaption>Branch %d, radius [mm]</figcaption></figure>\n", i + 1);
    }
    fprintf(out, "</div></section>\n");
}

static void print_worst(const Report *report)
{
    FILE *out = report->out;
    const VesselTree *tree = report->tree;
    int worst[WORST], count = 0;
    for (int i = 0; i < tree->node_count; i++) {   // insertion into a short sorted list; equal values keep the lower index first
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
    fprintf(out,
            "<div class=\"scroll\"><table><caption>Nodes furthest from their data</caption><thead><tr><th scope=\"col\">Node</th><th "
            "scope=\"col\">Branch</th><th scope=\"col\">x, y, z [mm]</th><th scope=\"col\">Radius [mm]</th><th scope=\"col\">Blobs</th><th scope=\"col\">d_a "
            "[mm]</th><th scope=\"col\">d_a [voxels]</th></tr></thead><tbody>\n");
    for (int k = 0; k < count; k++) {
        int i = worst[k], of = report->branches->of_node[i];
        Vec3 c = tree->center[i];
        fprintf(out, "<tr><th scope=\"row\">%d</th><td>", model_field_file_node(report->model, i));
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
    fprintf(out, "<section id=\"fit\"><h2>Quality of the fit</h2>\n");
    if (!model_field_exists(report->model)) {
        fprintf(out, "<p>This tree has no fitted model yet.</p></section>\n");
        return;
    }
    fprintf(out, "<figure id=\"figure-fit\">\n");
    tree_page_error_figure(report);
    fprintf(out,
            "<figcaption>d_a of a node is the distance to the wall that 90 %% of its data points keep. Classes of Kerrien et al. 2017, Table 4: C1 under "
            "half a voxel, C2 under one, C3 under two, C4 beyond; voxel %g mm%s.</figcaption></figure>\n",
            report->voxel, report->voxel_is_known ? "" : " (assumed: the file does not say)");
    print_worst(report);
    fprintf(out, "</section>\n");
}

static void print_page(const Report *report)
{
    FILE *out = report->out;
    bool model = model_field_exists(report->model);
    fprintf(out, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
                 "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\"/>\n"
                 "<title>Vessel report: ");
    page_text(out, report->name);
    fprintf(out,
            "</title>\n<style>\n%s</style></head>\n<body><header><h1>Vessel %s report</h1>\n<p class=\"notice\" role=\"note\"><strong>For training and "
            "research. Not a medical device:</strong> not for diagnosis or treatment. All values were measured automatically on a %s and have not been "
            "checked.</p></header>\n<main>\n",
            page_style, model ? "model" : "tree", model ? "fitted model" : "tracked tree");
    print_summary(report);
    print_tree(report);
    print_findings(report);
    print_branches(report);
    print_radii(report);
    print_fit(report);
    fprintf(out, "</main>\n<footer><section id=\"origin\"><h2>How it was made</h2>\n<details><summary>Parameters</summary><pre>");
    page_text(out, report->info->parameters && *report->info->parameters ? report->info->parameters : "not given");
    fprintf(out, "</pre></details>\n<p>Written by seldinger " SELDINGER_VERSION ".</p></section></footer></body></html>\n");
}

bool tree_page_write(const char *path, const char *name, const ModelField *model, const TreeFileInfo *info, Faults *faults)
{
    char *bytes = NULL;
    size_t length = 0;
    int count = 0;
    FindingOptions options = finding_default_options();
    VesselBranches *branches = vessel_branches_create(model->tree);
    Finding *finding = branches ? vessel_findings(model, branches, &options, &count) : NULL;
    FILE *out = finding ? open_memstream(&bytes, &length) : NULL;
    bool good = out != NULL;
    if (good) {
        double stated = tree_file_number(info, "voxel_mm", 0);
        Report report = {out, name, model, model->tree, info, branches, finding, count, stated > 0 ? stated : 0.2, stated > 0};
        print_page(&report);
        good = !ferror(out);
        good = fclose(out) == 0 && good;
    }
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
    good = good && output_write(path, bytes, length, faults);
    free(bytes);
    free(finding);
    vessel_branches_free(branches);
    return good;
}
