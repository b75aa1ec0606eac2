#include "recon/track/segment_report.h"

#include <math.h>

static const char *const support_name[] = {"supported", "doubtful", "refused", "kept"};

// Number of junctions with this support, without gaps within branches.
static int junctions_with(const RbtReport *report, RbtSupport support)
{
    int count = 0;
    for (int i = 0; i < report->junction_count; i++)
        count += !report->junction[i].is_inner && report->junction[i].support == support;
    return count;
}

// Prints each junction that the image does not clearly support.
static void print_junctions(FILE *out, const RbtReport *report)
{
    int moved = 0, inner = 0, nodes = 0;
    long points = 0;
    for (int i = 0; i < report->junction_count; i++) {
        const RbtJunction *j = &report->junction[i];
        moved += j->is_moved && j->support < RBT_REFUSED;
        inner += j->is_inner;
        nodes += j->node_count;
        points += j->point_count;
    }
    if (report->junction_count == 0)
        return;
    fprintf(out, "%d junctions: %d supported by the image, %d doubtful, %d refused", report->junction_count - inner, junctions_with(report, RBT_SUPPORTED),
            junctions_with(report, RBT_DOUBTFUL), junctions_with(report, RBT_REFUSED) + junctions_with(report, RBT_KEPT));
    if (moved)
        fprintf(out, "; %d attached to another parent", moved);
    if (inner)
        fprintf(out, "; %d gaps within branches", inner);
    fprintf(out, "; %d nodes with %ld points on their links\n", nodes, points);
    for (int i = 0; i < report->junction_count; i++) {
        const RbtJunction *j = &report->junction[i];
        if ((j->support == RBT_SUPPORTED && !j->is_moved) || (j->is_inner && j->support == RBT_DOUBTFUL))
            continue;
        fprintf(out, "  %-9s %s at (%.2f, %.2f, %.2f) mm, link %.2f mm, darkest place %.0f %% of the contrast", support_name[j->support],
                j->is_inner ? "gap" : "junction", j->place.x, j->place.y, j->place.z, j->length, 100 * j->share);
        if (j->support == RBT_REFUSED)
            fprintf(out, ": %d nodes, %.1f mm removed", j->dropped_nodes, j->dropped_mm);
        else
            fprintf(out, ": branch %d on %d%s", j->branch + 1, j->parent + 1, j->is_moved ? ", its second parent" : "");
        fprintf(out, "%s\n", j->support == RBT_KEPT ? "; warning: kept because the trace file gives it, but no tool can enter it" : "");
    }
}

void segment_report_print(FILE *out, const VesselTree *tree, const RbtReport *report, double load_s, double track_s)
{
    double length = 0;
    fprintf(out, "%-4s %-16s %6s %5s %6s %6s %10s %10s %8s %6s  %s\n", "#", "branch", "parent", "order", "nodes", "points", "length_mm", "radius_mm", "inliers",
            "least", "ends because");
    for (int i = 0; i < report->branch_count; i++) {
        const RbtBranchReport *b = &report->branch[i];
        char parent[16] = "-";
        if (b->parent >= 0)
            snprintf(parent, sizeof parent, "%d", b->parent + 1);
        fprintf(out, "%-4d %-16s %6s %5d %6d %6ld %10.1f %10.2f %7.0f%% %5.0f%%  ", i + 1,
                b->name[0]       ? b->name
                : b->is_aneurysm ? "(aneurysm)"
                : b->is_found    ? "(found)"
                                 : "(branch)",
                parent, b->order, b->node_count, (long)(tree->point_offset[b->first_node + b->node_count] - tree->point_offset[b->first_node]), b->length,
                b->radius, 100 * b->inlier_rate, 100 * b->inlier_rate_min);
        if (b->is_aneurysm)
            fprintf(out, "aneurysm about (%.1f, %.1f, %.1f) mm\n", b->center.x, b->center.y, b->center.z);
        else
            fprintf(out, "%s\n", b->end);
        length += b->length;
    }
    if (report->start[0])
        fprintf(out, "%s\n", report->start);
    print_junctions(out, report);
    for (int i = 0; i < report->loop_count; i++) {
        const RbtLoop *l = &report->loop[i];
        fprintf(out, "loop: the end of branch %d touches branch %d at (%.2f, %.2f, %.2f) mm; the loop is %.1f mm long\n", l->branch + 1, l->meets + 1,
                l->place.x, l->place.y, l->place.z, l->length);
    }
    if (report->left_out_count > 0)
        fprintf(out, "removed because of `not`: %d branches, %.0f mm\n", report->left_out_count, report->left_out_length);
    fprintf(out, "%d branches, %.0f mm, %d nodes, %ld points; volume read in %.2f s, tracked in %.2f s\n", report->branch_count, length, tree->node_count,
            (long)tree->point_count, load_s, track_s);
}

static void add_junctions(cJSON *root, const RbtReport *report)
{
    cJSON *summary = cJSON_AddObjectToObject(root, "junctions"), *list = cJSON_AddArrayToObject(summary, "list");
    int inner = 0;
    for (int i = 0; i < report->junction_count; i++) {
        const RbtJunction *j = &report->junction[i];
        cJSON *entry = cJSON_CreateObject();
        inner += j->is_inner;
        cJSON_AddStringToObject(entry, "support", support_name[j->support]);
        cJSON_AddBoolToObject(entry, "within_branch", j->is_inner);
        cJSON_AddBoolToObject(entry, "moved", j->is_moved);
        cJSON_AddNumberToObject(entry, "branch", j->branch);
        cJSON_AddNumberToObject(entry, "parent", j->parent);
        cJSON_AddItemToObject(entry, "place_mm", cJSON_CreateDoubleArray((double[3]){j->place.x, j->place.y, j->place.z}, 3));
        cJSON_AddNumberToObject(entry, "length_mm", j->length);
        cJSON_AddNumberToObject(entry, "darkest_share", j->share);
        cJSON_AddNumberToObject(entry, "nodes", j->node_count);
        cJSON_AddNumberToObject(entry, "points", j->point_count);
        cJSON_AddNumberToObject(entry, "dropped_nodes", j->dropped_nodes);
        cJSON_AddNumberToObject(entry, "dropped_mm", j->dropped_mm);
        cJSON_AddItemToArray(list, entry);
    }
    cJSON_AddNumberToObject(summary, "count", report->junction_count - inner);
    for (int k = RBT_SUPPORTED; k <= RBT_KEPT; k++)
        cJSON_AddNumberToObject(summary, support_name[k], junctions_with(report, (RbtSupport)k));
}

static void json_check(cJSON *root, const RbtStartCheck *check)
{
    cJSON *item = cJSON_AddObjectToObject(root, "start_check"), *list = cJSON_AddArrayToObject(root, "warnings");
    Vec3 c = check->cylinder.center;
    if (check->cylinder.radius > 0) {
        cJSON_AddItemToObject(item, "center_mm", cJSON_CreateDoubleArray((double[3]){c.x, c.y, c.z}, 3));
        cJSON_AddNumberToObject(item, "drift_mm", check->drift);
        cJSON_AddNumberToObject(item, "radius_mm", check->cylinder.radius);
        cJSON_AddNumberToObject(item, "inlier_rate", check->inlier_rate);
        cJSON_AddNumberToObject(item, "contrast", check->contrast);
        if (check->certainty < HUGE_VAL)
            cJSON_AddNumberToObject(item, "certainty", check->certainty);
    }
    cJSON_AddNumberToObject(item, "noise", check->noise);
    cJSON_AddNumberToObject(item, "smoothing_mm", check->smoothing_mm);
    for (int i = 0; i < check->warning_count; i++) {
        const RbtWarning *w = &check->warning[i];
        cJSON *entry = cJSON_CreateObject();
        cJSON_AddStringToObject(entry, "kind", rbt_doubt_name[w->kind]);
        cJSON_AddNumberToObject(entry, "measured", w->measured);
        cJSON_AddNumberToObject(entry, "limit", w->limit);
        cJSON_AddStringToObject(entry, "text", w->text);
        cJSON_AddItemToArray(list, entry);
    }
}

static void json_loops(cJSON *root, const RbtReport *report)
{
    cJSON *list = cJSON_AddArrayToObject(root, "loops"), *out = cJSON_AddObjectToObject(root, "left_out");
    for (int i = 0; i < report->loop_count; i++) {
        const RbtLoop *l = &report->loop[i];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToObject(item, "place_mm", cJSON_CreateDoubleArray((double[3]){l->place.x, l->place.y, l->place.z}, 3));
        cJSON_AddNumberToObject(item, "branch", l->branch);
        cJSON_AddNumberToObject(item, "meets", l->meets);
        cJSON_AddNumberToObject(item, "length_mm", l->length);
        cJSON_AddItemToArray(list, item);
    }
    cJSON_AddNumberToObject(out, "branches", report->left_out_count);
    cJSON_AddNumberToObject(out, "length_mm", report->left_out_length);
}

static void add_branches(cJSON *list, const RbtReport *report)
{
    for (int i = 0; i < report->branch_count; i++) {
        const RbtBranchReport *b = &report->branch[i];
        cJSON *entry = cJSON_CreateObject();
        cJSON_AddStringToObject(entry, "name", b->name);
        cJSON_AddStringToObject(entry, "kind", b->is_aneurysm ? "aneurysm" : "vessel");
        cJSON_AddBoolToObject(entry, "found", b->is_found);
        cJSON_AddNumberToObject(entry, "parent", b->parent);
        cJSON_AddNumberToObject(entry, "order", b->order);
        cJSON_AddNumberToObject(entry, "radius_mm", b->radius);
        if (b->is_aneurysm)
            cJSON_AddItemToObject(entry, "center_mm", cJSON_CreateDoubleArray((double[3]){b->center.x, b->center.y, b->center.z}, 3));
        cJSON_AddNumberToObject(entry, "first_node", b->first_node);
        cJSON_AddNumberToObject(entry, "nodes", b->node_count);
        cJSON_AddNumberToObject(entry, "length_mm", b->length);
        cJSON_AddNumberToObject(entry, "inlier_rate", b->inlier_rate);
        cJSON_AddNumberToObject(entry, "inlier_rate_min", b->inlier_rate_min);
        cJSON_AddNumberToObject(entry, "relaxed_nodes", b->relaxed_count);
        cJSON_AddNumberToObject(entry, "retried_nodes", b->retried_count);
        cJSON_AddNumberToObject(entry, "junction_nodes", b->junction_count);
        cJSON_AddNumberToObject(entry, "link_nodes", b->link_count);
        cJSON_AddStringToObject(entry, "end", b->end);
        cJSON_AddItemToArray(list, entry);
    }
}

void segment_report_add(cJSON *root, const VesselTree *tree, const RbtReport *report, double load_s, double track_s)
{
    cJSON *list = cJSON_AddArrayToObject(root, "branches");
    cJSON_AddNumberToObject(root, "nodes", tree->node_count);
    cJSON_AddNumberToObject(root, "points", (double)tree->point_count);
    if (report->start[0])
        cJSON_AddStringToObject(root, "start", report->start);
    json_check(root, &report->check);
    json_loops(root, report);
    cJSON_AddNumberToObject(root, "load_s", load_s);
    cJSON_AddNumberToObject(root, "track_s", track_s);
    add_junctions(root, report);
    add_branches(list, report);
}
