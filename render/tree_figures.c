// The report's figures. Colours are classes that the page's style sheet sets for light, dark and paper.
#include "render/tree_figures.h"

#include "base/base.h"
#include "render/page.h"
#include "render/tick_step.h"

#include <stdlib.h>

enum { LABELS_MOST = 80, BINS = 40 };
static const char *const finding_class[] = {"stenosis", "dilatation", "aneurysm"};

static int order_class(int order) { return order < 6 ? order : 6; }

void tree_page_label(const Report *report, int finding, char label[16])
{
    FindingKind kind = report->finding[finding].kind;
    int number = 0;
    for (int i = 0; i <= finding; i++)
        number += report->finding[i].kind == kind;
    snprintf(label, 16, "%c%d", "SDA"[kind], number);
}

// --- the tree ---

typedef struct Projection {
    int across, up;          // coordinates 0 to 2
    double low[3], high[3];  // [mm]
    double scale;            // [pixel/mm]
} Projection;

static double coordinate(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
static double place_x(const Projection *p, Vec3 v) { return p->scale * (coordinate(v, p->across) - p->low[p->across]); }
static double place_y(const Projection *p, Vec3 v) { return p->scale * (p->high[p->up] - coordinate(v, p->up)); }

// The branch's silhouette as a closed line, then its centreline. Points closer than half a pixel are left out.
static void draw_branch(const Report *report, const Projection *p, int index, double (*left)[2], double (*right)[2])
{
    const VesselTree *tree = report->tree;
    const VesselBranch *b = &report->branches->branch[index];
    const int *node = report->branches->node + b->first;
    int n = 0, from = b->from_node >= 0 && tree->kind[b->from_node] == NODE_VESSEL ? b->from_node : -1;
    double last_x = -1e9, last_y = -1e9;
    for (int k = 0; k < b->count; k++) {
        Vec3 c = tree->center[node[k]], before = tree->center[node[k > 0 ? k - 1 : 0]], after = tree->center[node[k + 1 < b->count ? k + 1 : k]];
        double x = place_x(p, c), y = place_y(p, c), dx = place_x(p, after) - place_x(p, before), dy = place_y(p, after) - place_y(p, before);
        double length = hypot(dx, dy), r = p->scale * tree->radius[node[k]];
        if (hypot(x - last_x, y - last_y) < 0.5 && k + 1 < b->count)
            continue;
        last_x = x, last_y = y;
        double nx = length > 1e-9 ? -dy / length : 0, ny = length > 1e-9 ? dx / length : 1;
        left[n][0] = x + r * nx, left[n][1] = y + r * ny;
        right[n][0] = x - r * nx, right[n++][1] = y - r * ny;
    }
    fprintf(report->out, "<g class=\"o%d\"><polygon class=\"tube\" points=\"", order_class(b->order));
    for (int k = 0; k < n; k++)
        fprintf(report->out, "%.1f,%.1f ", left[k][0], left[k][1]);
    for (int k = n - 1; k >= 0; k--)
        fprintf(report->out, "%.1f,%.1f ", right[k][0], right[k][1]);
    fprintf(report->out, "\"/><polyline class=\"line\" points=\"");
    if (from >= 0)
        fprintf(report->out, "%.1f,%.1f ", place_x(p, tree->center[from]), place_y(p, tree->center[from]));
    for (int k = 0; k < n; k++)
        fprintf(report->out, "%.1f,%.1f ", 0.5 * (left[k][0] + right[k][0]), 0.5 * (left[k][1] + right[k][1]));
    fprintf(report->out, "\"><title>branch %d, order %d</title></polyline></g>\n", index + 1, b->order);
}

static void draw_projection(const Report *report, const Projection *p, int number)
{
    static const char axis[] = "xyz";
    FILE *out = report->out;
    const VesselTree *tree = report->tree;
    double width = p->scale * (p->high[p->across] - p->low[p->across]), height = p->scale * (p->high[p->up] - p->low[p->up]);
    double bar = tick_step(width / p->scale, 4);
    double(*side)[2] = HEAP_ZEROED(2 * (size_t)tree->node_count, sizeof *side);
    fprintf(out,
            "<svg class=\"tree\" role=\"img\" aria-labelledby=\"tree%d-t tree%d-d\" viewBox=\"-12 -24 %.1f %.1f\" width=\"%.0f\" height=\"%.0f\">\n"
            "<title id=\"tree%d-t\">Vessel tree, %c across and %c up</title><desc id=\"tree%d-d\">Outlines and centrelines of %d branches, coloured by "
            "order, with %d candidates marked.</desc>\n",
            number, number, width + 24, height + 56, width + 24, height + 56, number, axis[p->across], axis[p->up], number, report->branches->count,
            report->finding_count);
    fprintf(out, "<text x=\"0\" y=\"-8\">%c across, %c up</text>\n", axis[p->across], axis[p->up]);
    for (int i = 0; i < report->branches->count; i++)
        draw_branch(report, p, i, side, side + tree->node_count);
    for (int i = 0; i < tree->node_count; i++)
        if (tree->kind[i] == NODE_ANEURYSM)
            fprintf(out, "<circle class=\"sac\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>\n", place_x(p, tree->center[i]), place_y(p, tree->center[i]),
                    p->scale * tree->radius[i]);
    for (int i = 0; i < report->branches->count && report->branches->count <= LABELS_MOST; i++) {
        const VesselBranch *b = &report->branches->branch[i];
        Vec3 at = tree->center[report->branches->node[b->first + b->count - 1]];
        fprintf(out, "<text class=\"label\" x=\"%.1f\" y=\"%.1f\">%d</text>\n", place_x(p, at) + 4, place_y(p, at) + 4, i + 1);
    }
    for (int i = 0; i < report->finding_count; i++) {
        char label[16];
        double x = place_x(p, tree->center[report->finding[i].node]), y = place_y(p, tree->center[report->finding[i].node]);
        tree_page_label(report, i, label);
        fprintf(out, "<g class=\"%s\"><circle class=\"mark\" cx=\"%.1f\" cy=\"%.1f\" r=\"6\"/><text class=\"label\" x=\"%.1f\" y=\"%.1f\">%s</text></g>\n",
                finding_class[report->finding[i].kind], x, y, x + 8, y - 5, label);
    }
    Vec3 root = tree->center[0];
    fprintf(out, "<circle class=\"root\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"><title>root</title></circle>\n", place_x(p, root), place_y(p, root));
    fprintf(out, "<path class=\"axis\" d=\"M0 %.1f h%.1f m0 -4 v8 M0 %.1f v8\"/><text x=\"%.1f\" y=\"%.1f\">%g mm</text>\n</svg>\n", height + 18,
            bar * p->scale, height + 14, bar * p->scale + 6, height + 22, bar);
    free(side);
}

void tree_page_branches_figure(const Report *report)
{
    static const int plane[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    const VesselTree *tree = report->tree;
    Projection p = {.low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, .high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    double longest = 0;
    for (int i = 0; i < tree->node_count; i++)
        for (int a = 0; a < 3; a++) {
            double x = coordinate(tree->center[i], a), r = tree->radius[i];
            p.low[a] = fmin(p.low[a], x - r);
            p.high[a] = fmax(p.high[a], x + r);
        }
    for (int a = 0; a < 3; a++)
        longest = fmax(longest, p.high[a] - p.low[a]);
    p.scale = 440 / longest;
    for (int k = 0; k < 3; k++) {
        p.across = plane[k][0], p.up = plane[k][1];
        draw_projection(report, &p, k + 1);
    }
}

// --- charts ---

typedef struct Chart {       // a plot area in pixels and what it spans
    double left, top, width, height, x_high, y_high;
} Chart;

static double chart_x(const Chart *c, double x) { return c->left + c->width * x / c->x_high; }
static double chart_y(const Chart *c, double y) { return c->top + c->height * (1 - y / c->y_high); }

static void draw_axes(FILE *out, const Chart *c, int ticks_x, int ticks_y, const char *x_name)
{
    double step = tick_step(c->x_high, ticks_x);
    fprintf(out, "<path class=\"axis\" d=\"M%.1f %.1f v%.1f h%.1f\"/>\n", c->left, c->top, c->height, c->width);
    for (int k = 0; k * step <= c->x_high * (1 + 1e-9); k++)
        fprintf(out, "<text class=\"tick\" text-anchor=\"middle\" x=\"%.1f\" y=\"%.1f\">%g</text>\n", chart_x(c, k * step), c->top + c->height + 14, k * step);
    step = tick_step(c->y_high, ticks_y);
    for (int k = 0; k * step <= c->y_high * (1 + 1e-9); k++)
        fprintf(out, "<path class=\"grid\" d=\"M%.1f %.1f h%.1f\"/><text class=\"tick\" text-anchor=\"end\" x=\"%.1f\" y=\"%.1f\">%g</text>\n", c->left,
                chart_y(c, k * step), c->width, c->left - 4, chart_y(c, k * step) + 4, k * step);
    fprintf(out, "<text class=\"tick\" text-anchor=\"end\" x=\"%.1f\" y=\"%.1f\">%s</text>\n", c->left + c->width, c->top + c->height + 28, x_name);
}

void tree_page_radius_figure(const Report *report, int branch)
{
    FILE *out = report->out;
    const VesselTree *tree = report->tree;
    const VesselBranch *b = &report->branches->branch[branch];
    const int *node = report->branches->node + b->first;
    const double *along = report->branches->along + b->first;
    Chart c = {.left = 34, .top = 10, .width = 270, .height = 96, .x_high = fmax(b->length, 1e-6), .y_high = 1.1 * b->radius_largest};
    fprintf(out,
            "<svg class=\"radius\" role=\"img\" aria-labelledby=\"r%d-t r%d-d\" viewBox=\"0 0 316 140\" width=\"316\" height=\"140\">"
            "<title id=\"r%d-t\">Radius along branch %d</title><desc id=\"r%d-d\">From %.2f mm at its start to %.2f mm at its end after %.1f mm; least %.2f, "
            "largest %.2f mm.</desc>\n",
            branch + 1, branch + 1, branch + 1, branch + 1, branch + 1, tree->radius[node[0]], tree->radius[node[b->count - 1]], b->length, b->radius_least,
            b->radius_largest);
    draw_axes(out, &c, 5, 4, "mm along the branch");
    fprintf(out, "<polyline class=\"line o%d\" points=\"", order_class(b->order));
    int stride = b->count / 2000 + 1;
    for (int k = 0; k < b->count; k += stride)
        fprintf(out, "%.1f,%.1f ", chart_x(&c, along[k]), chart_y(&c, tree->radius[node[k]]));
    fprintf(out, "\"/>\n");
    for (int i = 0; i < report->finding_count; i++) {
        const Finding *f = &report->finding[i];
        char label[16];
        if (f->branch != branch)
            continue;
        tree_page_label(report, i, label);
        double x = chart_x(&c, f->along), y = chart_y(&c, fmin(f->kind == FINDING_ANEURYSM ? f->reference : f->radius, c.y_high));
        fprintf(out, "<g class=\"%s\">", finding_class[f->kind]);
        if (f->kind != FINDING_ANEURYSM)
            fprintf(out, "<path class=\"reference\" d=\"M%.1f %.1f h20\"/>", fmax(x - 10, c.left), chart_y(&c, fmin(f->reference, c.y_high)));
        fprintf(out, "<circle class=\"mark\" cx=\"%.1f\" cy=\"%.1f\" r=\"5\"/><text class=\"label\" x=\"%.1f\" y=\"%.1f\">%s</text></g>\n", x, y, x + 7, y - 6,
                label);
    }
    fprintf(out, "</svg>\n");
}

void tree_page_error_figure(const Report *report)
{
    static const double border[3] = {0.5, 1, 2};
    FILE *out = report->out;
    const VesselTree *tree = report->tree;
    const double end = 2.5;
    int bin[BINS] = {0}, most = 1, class_count[4] = {0}, beyond = 0;
    for (int i = 0; i < tree->node_count; i++) {
        double x = tree->error[i] / report->voxel;
        int k = (int)fmin(x / end * BINS, BINS);
        class_count[x < 0.5 ? 0 : x < 1 ? 1 : x < 2 ? 2 : 3]++;
        beyond += k == BINS;
        if (k < BINS)
            bin[k]++;
    }
    for (int k = 0; k < BINS; k++)
        most = bin[k] > most ? bin[k] : most;
    Chart c = {.left = 48, .top = 26, .width = 560, .height = 180, .x_high = end, .y_high = 1.08 * most};
    fprintf(out,
            "<svg class=\"histogram\" role=\"img\" aria-labelledby=\"fit-t fit-d\" viewBox=\"0 0 624 250\" width=\"624\" height=\"250\">"
            "<title id=\"fit-t\">Nodes by their distance to the data</title><desc id=\"fit-d\">Histogram of d_a in voxels over %d nodes: C1 %d, C2 "
            "%d, C3 %d, C4 %d.</desc>\n",
            tree->node_count, class_count[0], class_count[1], class_count[2], class_count[3]);
    draw_axes(out, &c, 6, 5, "d_a [voxels]");
    for (int k = 0; k < BINS; k++) {
        double x = end * k / BINS;
        if (bin[k] > 0)
            fprintf(out, "<rect class=\"c%d\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n",
                    x < 0.5 ? 1
                    : x < 1 ? 2
                    : x < 2 ? 3
                            : 4,
                    chart_x(&c, x) + 0.5, chart_y(&c, bin[k]), c.width / BINS - 1, c.top + c.height - chart_y(&c, bin[k]));
    }
    for (int k = 0; k < 4; k++) {
        double x = k < 3 ? border[k] : end, low = k > 0 ? border[k - 1] : 0;
        if (k < 3)
            fprintf(out, "<path class=\"border\" d=\"M%.1f %.1f v%.1f\"/>", chart_x(&c, x), c.top - 6, c.height + 6);
        fprintf(out, "<text text-anchor=\"middle\" x=\"%.1f\" y=\"%.1f\">C%d %.1f %%</text>\n", chart_x(&c, 0.5 * (low + x)), c.top - 10, k + 1,
                100.0 * class_count[k] / tree->node_count);
    }
    if (beyond > 0)
        fprintf(out, "<text class=\"tick\" text-anchor=\"end\" x=\"%.1f\" y=\"%.1f\">%d beyond</text>\n", c.left + c.width, c.top + 14, beyond);
    fprintf(out, "</svg>\n");
}
