// seldinger segment: RBT, a volume to a tree of centreline nodes with local point sets (recon/track/rbt_track.h).
#include "cli/cli.h"
#include "base/same_math.h"

#include "base/heap.h"
#include "base/output.h"
#include "cli/output_plan.h"
#include "recon/track/rbt_track.h"
#include "recon/track/trace.h"
#include "recon/tree_file.h"
#include "recon/volume/blurred_edge.h"
#include "recon/volume/volume_file.h"
#include "recon/volume/volume_noise.h"
#ifdef SELDINGER_RENDER
#include "render/picture.h"
#endif

#include <argp.h>
#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { KEY_TRACE = 't', KEY_OUT = 'o', KEY_QUIET = 'q', KEY_THREADS = 1000, KEY_SEED, KEY_JSON, KEY_PICTURE, KEY_START, KEY_UNTIL, KEY_NOT };
enum { MOST_POINTS = 64 };

static const struct argp_option options[] = {
    {"trace", KEY_TRACE, "F.yaml", 0, "where branches start, aneurysms, parameters", 0},
    {"start", KEY_START, "X,Y,Z", 0, "instead of a trace: one point in a vessel [mm]; the whole tree is found from it", 0},
    {"until", KEY_UNTIL, "X,Y,Z", 0, "the tree ends at this point in a vessel [mm]; may be given several times", 0},
    {"not", KEY_NOT, "X,Y,Z", 0, "a point in a vessel that is not wanted [mm]: it is tracked too, and the tree ends where it meets it; several times", 0},
    {"output", KEY_OUT, "TREE.h5", 0, "the tree (needed)", 0},
    {"threads", KEY_THREADS, "N", 0, "threads, default 0: all cores; the tree does not depend on it", 0},
    {"seed", KEY_SEED, "N", 0, "seed of the random numbers, default 1 or the trace's", 0},
    {"json", KEY_JSON, "F", 0, "the figures of the table, and more, as JSON", 0},
    {"picture", KEY_PICTURE, "F.png", 0, "maximum intensity projections along the three axes with the tree drawn over", 0},
    {"quiet", KEY_QUIET, 0, 0, "no table, no progress bar", 0},
    {0},
};

typedef struct SegmentArguments {
    const char *volume, *trace, *start, *out, *json, *picture;
    Vec3 until[MOST_POINTS], rival[MOST_POINTS];
    int until_count, rival_count;
    int threads;
    double seed;             // -1: the trace's
    bool quiet;
} SegmentArguments;

static error_t take_point(struct argp_state *state, const char *option, const char *text, Vec3 *list, int *count)
{
    if (*count == MOST_POINTS)
        argp_error(state, "%s is given more than %d times", option, MOST_POINTS);
    if (!cli_point(option, text, &list[*count]))
        argp_error(state, "%s takes a point X,Y,Z [mm]", option);
    ++*count;
    return 0;
}

static error_t parse_option(int key, char *text, struct argp_state *state)
{
    SegmentArguments *a = state->input;
    double number;
    switch (key) {
    case KEY_TRACE: a->trace = text; return 0;
    case KEY_START: a->start = text; return 0;
    case KEY_UNTIL: return take_point(state, "--until", text, a->until, &a->until_count);
    case KEY_NOT: return take_point(state, "--not", text, a->rival, &a->rival_count);
    case KEY_OUT: a->out = text; return 0;
    case KEY_JSON: a->json = text; return 0;
    case KEY_PICTURE: a->picture = text; return 0;
    case KEY_QUIET: a->quiet = true; return 0;
    case KEY_THREADS:
        if (!cli_number("--threads", text, 0, 256, &number) || floor(number) != number)
            argp_error(state, "--threads takes a whole number from 0 to 256");
        a->threads = (int)number;
        return 0;
    case KEY_SEED:
        if (!cli_number("--seed", text, 0, 9007199254740991.0, &a->seed) || floor(a->seed) != a->seed)
            argp_error(state, "--seed takes a whole number from 0 to 2^53");
        return 0;
    case ARGP_KEY_ARG:
        if (a->volume)
            argp_error(state, "one volume, not also '%s'", text);
        a->volume = text;
        return 0;
    case ARGP_KEY_END:
        if (!a->volume || !a->trace == !a->start || !a->out)
            argp_error(state, "%s", !a->volume ? "no volume is named" : !a->out ? "-o TREE.h5 is needed" : "either --trace F.yaml or --start X,Y,Z is needed");
        return 0;
    default: return ARGP_ERR_UNKNOWN;
    }
}

static const char intro[] =
    "Tracks vessels through an angiogram (RBT, Kerrien et al. 2017, section 3): VOLUME to a tree of cylinders, each with its points on the wall.\v"
    "VOLUME is NRRD (raw, gzip or text, attached or detached), MetaImage, NIfTI-1, or DICOM (the folder of a series, one of its files, or a "
    "multi-frame file), recognised by its content.\n\n"
    "The trace is YAML. The first branch needs a start; its direction (toward, a point further down the vessel) and radius_mm are estimated where they are "
    "not given. It becomes the root of the tree, and without a toward one of its two ends does, at the volume's border or wider than the other. Where it is "
    "the only one (or with automatic: 1) the rest of the tree is found from it, downstream, aneurysms too. Further branches need a start alone: it is "
    "projected to the tree tracked so far and the tracking starts beside the parent; with a `toward` it starts at the point itself and runs both ways. All "
    "of mm may be voxels (start_voxel, toward_voxel, centers_voxel):\n\n"
    "  branches:\n"
    "    - {name: carotid, start_mm: [74.8, 12.8, 60.8], toward_mm: [72.8, 16, 61.6], radius_mm: 2}\n"
    "    - {start_voxel: [95, 118, 172]}\n"
    "  aneurysms:\n"
    "    - {centers_mm: [[44, 42.4, 64]]}\n"
    "  parameters: default        # or paper: the values of the paper, without what was added\n"
    "  p_inl: 0.7                 # and any of these by name\n\n"
    "Where a branch leaves its parent the image decides: the best path beside the straight link is supported where its darkest place keeps half of the "
    "branch's contrast, doubtful down to a quarter; with less the branch hangs on another vessel that a path leads to, or is left out with what hangs on "
    "it (one that the trace names stays, with a warning, and nothing opens into it). The summary names all but the supported ones.\n\n"
    "Corrections leave the rest of the tree as it is, bit for bit; with automatic: 1 further branches are one, tracked after all that was found:\n\n"
    "  automatic: 1\n"
    "  forbid: [{center_voxel: [120, 90, 60], radius_mm: 3}]   # no node in this ball\n"
    "  cut: [{point_mm: [40, 31, 22]}]                        # the nearest branch ends here, and what hangs on it goes; a stub of it goes too\n"
    "  until: [{point_mm: [44, 20, 70]}]                      # (--until) tracking does not pass this point of a vessel\n"
    "  not: [{point_voxel: [150, 40, 90]}]                    # (--not) in a vessel that is not wanted, say a sinus: it competes for the lumen\n\n"
    "A vessel of `not` is tracked with its branches, and left out at the end: the tree ends where it meets it; one lumen that holds both points is divided at its "
    "narrowest place between them. Where a branch's end meets another branch of the tree a loop is reported: the tree has none. `until` or `not` can take out the side "
    "that is not wanted.\n\n"
    "Starts are judged: refused where the vessel found lies more than two of its radii from the click, is wider than the volume, or does not stand out of the noise; "
    "warned of (on standard error, and in --json) where the click lies outside its radius, where less than half of the edge points lie on the cylinders, and more. A volume "
    "whose voxels are noisier than the vessel is bright is smoothed first, and that is said.\n\n"
    "Parameters of the tracking (default; paper):\n";

// The introduction and a line for each parameter.
static char *help_text(void)
{
    enum { LINE = 260 };
    RbtParameters ours = rbt_default_parameters(), paper = rbt_paper_parameters();
    size_t capacity = sizeof intro + LINE * (size_t)(rbt_parameter_count + 2);
    char *text = HEAP_ZEROED(capacity, 1);
    size_t used = (size_t)snprintf(text, capacity, "%s", intro);
    for (int i = 0; i < rbt_parameter_count; i++) {
        const RbtParameterName *p = &rbt_parameter_table[i];
        double a = *(const double *)(const void *)((const char *)&ours + p->offset), b = *(const double *)(const void *)((const char *)&paper + p->offset);
        used += (size_t)snprintf(text + used, capacity - used, "  %-20s %s (%g; %g)\n", p->name, p->meaning, a, b);
    }
    snprintf(text + used, capacity - used, "  %-20s %s\n\nExit codes: 0 done; 2 wrong usage or bad input.", "retry_steps",
             "multiples of the step after a failed one ([1.7, 2.4, 3.1]; [])");
    return text;
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static const char *const support_name[] = {"supported", "doubtful", "refused", "kept"};

// How many junctions have this support; gaps within branches are none.
static int junctions_with(const RbtReport *report, RbtSupport support)
{
    int count = 0;
    for (int i = 0; i < report->junction_count; i++)
        count += !report->junction[i].is_inner && report->junction[i].support == support;
    return count;
}

// Names each junction that the image does not clearly support.
static void print_junctions(const RbtReport *report)
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
    printf("%d junctions: %d supported by the image, %d doubtful, %d refused", report->junction_count - inner, junctions_with(report, RBT_SUPPORTED),
           junctions_with(report, RBT_DOUBTFUL), junctions_with(report, RBT_REFUSED) + junctions_with(report, RBT_KEPT));
    if (moved)
        printf("; %d hung on another parent", moved);
    if (inner)
        printf("; %d gaps within branches", inner);
    printf("; %d nodes with %ld points on their links\n", nodes, points);
    for (int i = 0; i < report->junction_count; i++) {
        const RbtJunction *j = &report->junction[i];
        if ((j->support == RBT_SUPPORTED && !j->is_moved) || (j->is_inner && j->support == RBT_DOUBTFUL))
            continue;
        printf("  %-9s %s at (%.2f, %.2f, %.2f) mm, link %.2f mm, darkest place %.0f %% of the contrast", support_name[j->support], j->is_inner ? "gap" : "junction",
               j->place.x, j->place.y, j->place.z, j->length, 100 * j->share);
        if (j->support == RBT_REFUSED)
            printf(": %d nodes, %.1f mm dropped", j->dropped_nodes, j->dropped_mm);
        else
            printf(": branch %d on %d%s", j->branch + 1, j->parent + 1, j->is_moved ? ", its second parent" : "");
        printf("%s\n", j->support == RBT_KEPT ? "; warning: the trace names it, so it stays, but nothing opens into it" : "");
    }
}

// What makes the result doubtful stands on standard error, with --quiet too.
static void print_warnings(const SegmentArguments *a, const RbtStartCheck *check)
{
    for (int i = 0; i < check->warning_count; i++)
        fprintf(stderr, "%s: warning: %s\n", a->volume, check->warning[i].text);
}

static void print_table(const VesselTree *tree, const RbtReport *report, double load_s, double track_s)
{
    double length = 0;
    printf("%-4s %-16s %6s %5s %6s %6s %10s %10s %8s %6s  %s\n", "#", "branch", "parent", "order", "nodes", "points", "length_mm", "radius_mm", "inliers", "least", "ends because");
    for (int i = 0; i < report->branch_count; i++) {
        const RbtBranchReport *b = &report->branch[i];
        char parent[16] = "-";
        if (b->parent >= 0)
            snprintf(parent, sizeof parent, "%d", b->parent + 1);
        printf("%-4d %-16s %6s %5d %6d %6ld %10.1f %10.2f %7.0f%% %5.0f%%  ", i + 1,
               b->name[0] ? b->name : b->is_aneurysm ? "(aneurysm)" : b->is_found ? "(found)" : "(branch)", parent, b->order, b->node_count,
               (long)(tree->point_offset[b->first_node + b->node_count] - tree->point_offset[b->first_node]), b->length, b->radius, 100 * b->inlier_rate,
               100 * b->inlier_rate_min);
        if (b->is_aneurysm)
            printf("aneurysm about (%.1f, %.1f, %.1f) mm\n", b->center.x, b->center.y, b->center.z);
        else
            printf("%s\n", b->end);
        length += b->length;
    }
    if (report->start[0])
        printf("%s\n", report->start);
    print_junctions(report);
    for (int i = 0; i < report->loop_count; i++) {
        const RbtLoop *l = &report->loop[i];
        printf("loop: the end of branch %d meets branch %d at (%.2f, %.2f, %.2f) mm, %.1f mm around\n", l->branch + 1, l->meets + 1, l->place.x, l->place.y, l->place.z, l->length);
    }
    if (report->left_out_count > 0)
        printf("left out, as `not` says: %d branches, %.0f mm\n", report->left_out_count, report->left_out_length);
    printf("%d branches, %.0f mm, %d nodes, %ld points; volume read in %.2f s, tracked in %.2f s\n", report->branch_count, length, tree->node_count, (long)tree->point_count,
           load_s, track_s);
}

// b [mm] of all that moved the edges that were tracked: the image's blur, or what its voxels and the spline make at least, the smoothing of a noisy volume, and
// the average along the rays.
static double edge_blur(const RbtParameters *parameters, const Volume *volume, double smoothing, const VesselTree *tree)
{
    Volume *smooth = smoothing > 0 ? volume_smoothed(volume, smoothing, 0) : NULL;
    double v2 = same_square(volume_voxel_size(volume)), image = blurred_edge_measure(smooth ? smooth : volume, tree);
    volume_free(smooth);
    return sqrt((image > 0 ? image * image : blurred_edge_grid2(v2) + smoothing * smoothing) + blurred_edge_average2(parameters->ray_smoothing_voxels, v2));
}

// What was found beside the parameters that found it, in the words of a trace; to be freed.
static char *parameters_text(const RbtParameters *parameters, const RbtReport *report, const Volume *volume, const VesselTree *tree)
{
    enum { LINE = 120 };
    char *text = rbt_parameters_text(parameters, volume_voxel_size(volume));
    size_t used = strlen(text), capacity = used + LINE * ((size_t)report->branch_count + 3);
    for (int i = 0; i < tree->node_count; i++)
        capacity += tree->kind[i] == NODE_ANEURYSM ? LINE : 0;
    char *longer = realloc(text, capacity);
    if (!longer)
        heap_is_empty(capacity, __FILE__);
    used += (size_t)snprintf(longer + used, capacity - used, "edge_blur_mm: %.4f\n", edge_blur(parameters, volume, report->check.smoothing_mm, tree));
    const char *head = "aneurysms_found:\n";
    for (int i = 0; i < report->branch_count; i++) {
        const RbtBranchReport *b = &report->branch[i];
        if (!b->is_aneurysm || !b->is_found)
            continue;
        used += (size_t)snprintf(longer + used, capacity - used, "%s  - {centers_mm: [", head);
        head = "";
        const char *comma = "";
        for (int k = b->first_node; k < b->first_node + b->node_count; k++)
            if (tree->kind[k] == NODE_ANEURYSM) {
                Vec3 c = tree->center[k];
                used += (size_t)snprintf(longer + used, capacity - used, "%s[%.9g, %.9g, %.9g]", comma, c.x, c.y, c.z);
                comma = ", ";
            }
        used += (size_t)snprintf(longer + used, capacity - used, "]}\n");
    }
    return longer;
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

static bool write_json(const SegmentArguments *a, const VesselTree *tree, const RbtReport *report, double load_s, double track_s, Faults *faults)
{
    cJSON *root = cJSON_CreateObject(), *list = cJSON_AddArrayToObject(root, "branches");
    cJSON_AddStringToObject(root, "volume", a->volume);
    cJSON_AddStringToObject(root, a->start ? "start_mm" : "trace", a->start ? a->start : a->trace);
    cJSON_AddNumberToObject(root, "nodes", tree->node_count);
    cJSON_AddNumberToObject(root, "points", (double)tree->point_count);
    if (report->start[0])
        cJSON_AddStringToObject(root, "start", report->start);
    json_check(root, &report->check);
    json_loops(root, report);
    cJSON_AddNumberToObject(root, "load_s", load_s);
    cJSON_AddNumberToObject(root, "track_s", track_s);
    add_junctions(root, report);
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
    char *text = cJSON_Print(root);
    bool good = text && output_write(a->json, text, strlen(text), faults);
    cJSON_free(text);
    cJSON_Delete(root);
    return good;
}

// False with a fault where there is none; the tree is written all the same.
static bool draw_picture(const SegmentArguments *a, const Volume *volume, const VesselTree *tree, Faults *faults)
{
    char message[512] = "built without pictures";
    bool drawn = false;
#ifdef SELDINGER_RENDER
    PictureOptions picture = picture_default_options();
    picture.title = a->volume;
    drawn = picture_of_tree(a->picture, &picture, volume->size, volume->origin, volume->axis, volume->value, 0, 0, tree, 0, NULL, message, sizeof message);
#else
    (void)volume;
    (void)tree;
#endif
    if (!drawn)
        faults_add(faults, a->picture, 0, 0, "no picture: %s", message);
    return drawn;
}

static Trace *trace_of(const SegmentArguments *a, Faults *faults)
{
    char text[160];
    Vec3 x;
    Trace *trace = NULL;
    bool good = true;
    if (!a->start) {
        trace = trace_load(a->trace, faults);
    } else if (cli_point("--start", a->start, &x)) {
        int length = snprintf(text, sizeof text, "branches: [{start_mm: [%.17g, %.17g, %.17g]}]", x.x, x.y, x.z);
        trace = trace_parse(text, (size_t)length, "--start", faults);
    }
    for (int i = 0; trace && good && i < a->until_count; i++)
        good = trace_add_point(trace, "until", a->until[i]);
    for (int i = 0; trace && good && i < a->rival_count; i++)
        good = trace_add_point(trace, "not", a->rival[i]);
    if (!good)
        faults_add(faults, a->volume, 0, 0, "out of memory");
    return trace;
}

static int segment(const SegmentArguments *a, Faults *faults)
{
    OutputPlan plan = {.faults = faults};
    output_plan_write_file(&plan, "-o", a->out);
    output_plan_write(&plan, "--json", a->json);
    output_plan_write_file(&plan, "--picture", a->picture);
    output_plan_read_volume(&plan, "the volume", a->volume);
    output_plan_read(&plan, "--trace", a->trace);
    double start = seconds();
    Trace *trace = trace_of(a, faults);
    Volume *volume = volume_load(a->volume, faults);
    RbtReport report = {0};
    VesselTree *tree = NULL;
    double load_s = seconds() - start;
    if (trace && volume && faults->count == 0) {
        ProgressBar bar;
        Progress progress = progress_bar(&bar, "tracking", a->quiet);
        if (a->seed >= 0)
            trace->parameters.seed = a->seed;
        tree = rbt_track(volume, &trace->parameters, trace->branch, trace->branch_count, trace->aneurysm, trace->aneurysm_count, a->threads, &progress, &report,
                         a->start ? "--start" : a->trace, faults);
    }
    bool good = tree != NULL;
    if (good) {
        double track_s = seconds() - start - load_s;
        char created_by[] = "seldinger " SELDINGER_VERSION " segment", *text = parameters_text(&trace->parameters, &report, volume, tree);
        char *source = HEAP_TEXT(a->volume);
        TreeFileInfo info = {.source = source, .parameters = text, .created_by = created_by};
        good = tree_file_save(tree, &info, a->out, faults);
        free(source);
        free(text);
        good = good && (!a->json || write_json(a, tree, &report, load_s, track_s, faults));
        if (good && !a->quiet && !(a->json && !strcmp(a->json, "-")))
            print_table(tree, &report, load_s, track_s);
        if (good)
            print_warnings(a, &report.check);
        good = good && (!a->picture || draw_picture(a, volume, tree, faults));
    }
    rbt_report_free(&report);
    vessel_tree_free(tree);
    volume_free(volume);
    trace_free(trace);
    return good ? EXIT_DONE : cli_bad_input(faults);
}

int verb_segment(int argc, char **argv)
{
    SegmentArguments a = {.seed = -1};
    char *help = help_text();
    struct argp argp = {options, parse_option, "VOLUME --trace F.yaml -o TREE.h5\nVOLUME --start X,Y,Z -o TREE.h5", help, NULL, NULL, NULL};
    Faults *faults = HEAP_ZEROED(1, sizeof *faults);
    int code = EXIT_BAD_INPUT;
    argp_err_exit_status = EXIT_BAD_INPUT;
    setenv("ARGP_HELP_FMT", "rmargin=160", 0);   // lines of YAML stay whole
    if (argp_parse(&argp, argc, argv, 0, NULL, &a) == 0)
        code = segment(&a, faults);
    free(faults);
    free(help);
    return code;
}
