// seldinger bench track: trackers on synthetic angiograms with truth, labelled as in Kerrien et al. 2017, Table 2.
//
// Each row is for all trees of a kind: random trees at four noise levels, and the difficulties listed in the paper: vessels in contact, bone, aneurysms,
// anisotropic voxels, fading contrast, clipped brightness. "from one click" tracks the whole tree from the root's start. The other methods are used as in the
// paper (5.2.1): one run per branch, started in it with the true point, direction and radius, and judged on that branch alone.
#include "base/output.h"
#include "bench/bench.h"
#include "bench/starts.h"

#include "base/parallel.h"
#include "bench/mht_track.h"
#include "bench/track_score.h"
#include "recon/track/ransac_cylinder.h"
#include "recon/volume/blurred_edge.h"

#include <stdlib.h>
#include <string.h>

enum { CLICK, STARTS, PAPER, MHT, MHT_PAPER, METHODS };
static const char *const method_name[METHODS] = {"RBT from one click", "RBT, a start a branch", "RBT, the paper's values", "MHT at its best",
                                                 "MHT, the paper's values"};

// --- Cases ---

enum { CASE_OPTIONS = 6 };
typedef struct Case {
    int group;
    const char *shape;
    char option[CASE_OPTIONS][2][64];
    int option_count;
    VolumeOptions volume;
} Case;

enum { MOST_TREES = 24, MOST_CASES = 4 * MOST_TREES + 40, MOST_GROUPS = 24, BINS = 400 };
static const double bin_voxels = 0.01;

typedef struct Tally {           // of branches of one width
    int branches, label[TRACK_LABELS];
    double true_mm, covered_mm;
    int samples, bin[BINS];      // of the centre's error
    double center, radius, exact, exact_abs;   // sums [voxel]: centre, radius after the closed form, after the exact edge
} Tally;

typedef struct Figures {         // of a group and a method
    Tally wide, narrow;          // radius of two voxels or more, and below
    int trees, invented[TRACK_LABELS], wrong_attachments, links, background_links, false_sacs;
    double invented_mm, tracked_mm, cpu_s;
    int64_t nodes;
} Figures;

typedef struct Group {
    char name[48];
    double noise;                // of the random trees with required figures; < 0: none
    bool is_size;                // not in the table: only for the time of a tree of this size
    Figures figures[METHODS];
} Group;

static void add_option(Case *c, const char *key, double value)
{
    snprintf(c->option[c->option_count][0], 64, "%s", key);
    snprintf(c->option[c->option_count++][1], 64, "%.17g", value);
}

static Case *add_case(Case *list, int *count, int group, const char *shape, double noise)
{
    Case *c = &list[(*count)++];
    *c = (Case){.group = group, .shape = shape, .volume = volume_default_options()};
    c->volume.noise = noise;
    c->volume.seed = 1000 + (uint64_t)*count;
    add_option(c, "points", 8);
    return c;
}

static int add_group(Group *list, int *count, const char *name, double noise)
{
    list[*count] = (Group){.noise = noise};
    snprintf(list[*count].name, sizeof list->name, "%s", name);
    return (*count)++;
}

static Case *add_tree(Case *list, int *count, int group, double noise, int branches, int seed)
{
    Case *c = add_case(list, count, group, "tree", noise);
    add_option(c, "branches", branches);
    add_option(c, "seed", seed);
    add_option(c, "radius_mm", 1.2);
    return c;
}

static int make_cases(bool quick, int trees, Case *cases, Group *groups, int *group_count)
{
    static const double noises[] = {0.05, 0, 0.1, 0.2}, gaps[] = {0.5, 1, 1.5, 2, 3}, angles[] = {0, 30, 60, 90};
    int count = 0, branches = quick ? 25 : 51;
    *group_count = 0;
    for (int k = 0; k < (quick ? 1 : 4); k++) {
        char name[48];
        snprintf(name, sizeof name, "random trees, noise %g %%", 100 * noises[k]);
        int group = add_group(groups, group_count, name, noises[k]);
        for (int i = 0; i < trees; i++)
            add_tree(cases, &count, group, noises[k], branches, i + 1);
    }
    for (int k = quick ? 1 : 0; k < (quick ? 2 : 5); k++) {
        char name[48];
        snprintf(name, sizeof name, "kissing, gap %g voxels", gaps[k]);
        int group = add_group(groups, group_count, name, -1);
        for (int i = 0; i < (quick ? 1 : 4); i++) {
            Case *c = add_case(cases, &count, group, "kissing", 0.05);
            add_option(c, "gap_mm", gaps[k] * c->volume.voxel_mm[0]);
            add_option(c, "crossing_deg", angles[i]);
            add_option(c, "radius_mm", i % 2 ? 0.6 : 1);
        }
    }
    int group = add_group(groups, group_count, "bone in contact", -1);
    for (int i = 0; i < (quick ? 1 : 4); i++) {
        Case *c = add_case(cases, &count, group, "bone", 0.05);
        add_option(c, "seed", i + 1);
        add_option(c, "radius_mm", i % 2 ? 0.6 : 1);
    }
    if (!quick)
        add_option(add_tree(cases, &count, group, 0.05, branches, 6), "blocks", 10);
    group = add_group(groups, group_count, "aneurysms", -1);
    add_option(add_tree(cases, &count, group, 0.05, branches, 7), "sacs", quick ? 2 : 5);
    for (int k = 0; k < (quick ? 1 : 4); k++) {
        static const char *const names[] = {"anisotropic 0.2 x 0.2 x 0.4 mm, turned 30 deg", "fading by 60 %", "clipped at 0.1, saturated at 0.7",
                                            "PSF 0.35 mm"};
        group = add_group(groups, group_count, names[k], -1);
        Case *c = add_tree(cases, &count, group, 0.05, branches, 8 + k);
        if (k == 0)
            c->volume.voxel_mm[2] = 0.4, c->volume.rotate_deg = 30;
        else if (k == 1)
            c->volume.fade = 0.6;
        else if (k == 2)
            c->volume.clip = 0.1, c->volume.saturate = 0.7;
        else
            c->volume.psf_mm = 0.35;
    }
    for (int k = 0; k < 2; k++) {
        int size = quick ? (k ? 40 : 10) : (k ? 200 : 25);
        char name[48];
        snprintf(name, sizeof name, "%d branches", size);
        group = add_group(groups, group_count, name, -1);
        groups[group].is_size = true;
        add_tree(cases, &count, group, 0.05, size, 12);
    }
    return count;
}

// --- Runs ---

typedef struct Angiogram {           // a synthetic case
    const Case *about;
    Shape *shape;
    VesselTree *truth;
    Volume *volume;
    TrackTruth known;
    TrackScore plan;             // the truth's branches
    double voxel_mm;
} Angiogram;

typedef struct Trial {           // one run of a tracker
    TrackScore score;
    double cpu_s;
    int64_t nodes;
    bool failed;
} Trial;

typedef struct Trials {
    const Angiogram *image;
    Trial *trial;                // 1 + (METHODS - 1) branches
} Trials;

// A node of the branch `way` mm from its start, and the next one.
static RbtSeed seed_at(const Angiogram *image, const TrackBranch *branch, double way)
{
    const VesselTree *truth = image->truth;
    int at = branch->last_node, next = at;
    double left = branch->length;
    while (truth->parent[at] != branch->first_node) {
        double step = vec3_distance(truth->center[at], truth->center[truth->parent[at]]);
        if (left - step < way && at != branch->last_node)
            break;
        left -= step;
        next = at;
        at = truth->parent[at];
    }
    return (RbtSeed){.start = truth->center[at], .toward = truth->center[next], .has_toward = true, .radius = truth->radius[at], .name = "start"};
}

// b, the standard deviation of the total blur of the image.
static double blur_of(const Angiogram *image, const RbtParameters *parameters)
{
    double v2 = 0;
    for (int k = 0; k < 3; k++)
        v2 += pow(image->about->volume.voxel_mm[k], 2) / 3;
    return sqrt(pow(image->about->volume.psf_mm, 2) + blurred_edge_grid2(v2) + blurred_edge_average2(parameters->ray_smoothing_voxels, v2));
}

static void run_trial(void *context, long index)
{
    const Trials *session = context;
    const Angiogram *image = session->image;
    Trial *trial = &session->trial[index];
    int method = index == 0 ? CLICK : 1 + (int)((index - 1) / image->plan.branch_count), which = index == 0 ? 0 : (int)((index - 1) % image->plan.branch_count);
    const TrackBranch *branch = &image->plan.branch[which];
    Faults *faults = calloc(1, sizeof *faults);
    RbtSeed seed = seed_at(image, branch, branch->skip);
    TrackTruth known = image->known;
    VesselTree *tracked = NULL;
    int64_t begin = bench_cpu_ns();
    if (method == MHT || method == MHT_PAPER) {
        MhtParameters parameters = method == MHT ? mht_default_parameters() : mht_paper_parameters();
        parameters.max_length_mm = 1.3 * branch->length + 4 * branch->radius;
        known.blur_mm = 0;       // there is no closed form for the bias of the template's radius
        tracked = faults ? mht_track(image->volume, &parameters, &seed, 1, 1, NULL, NULL, "bench", faults) : NULL;
    } else {
        RbtParameters parameters = method == PAPER ? rbt_paper_parameters() : rbt_default_parameters();
        if (method == CLICK)
            parameters.automatic = 1;
        else
            parameters.max_length_mm = 1.3 * branch->length + 4 * branch->radius;
        parameters.powell *= cylinder_refine_has_powell();   // or Gauss-Newton: the same minimum
        known.blur_mm = blur_of(image, &parameters);
        tracked = faults ? rbt_track(image->volume, &parameters, &seed, 1, NULL, 0, 1, NULL, NULL, "bench", faults) : NULL;
    }
    trial->cpu_s = (double)(bench_cpu_ns() - begin) * 1e-9;
    trial->nodes = tracked ? tracked->node_count : 0;
    trial->failed = !faults || !track_score(&known, tracked, &trial->score);
    vessel_tree_free(tracked);
    free(faults);
}

// `skip`: the first part of the branch is not scored.
static void tally_branch(Tally *tally, const TrackBranch *branch, double skip)
{
    tally->branches++;
    tally->label[branch->label]++;
    tally->true_mm += branch->length - skip;
    tally->covered_mm += fmin(branch->covered, branch->length - skip);
}

// `only`: the branch that is judged, or -1: all.
static void tally_score(Figures *figures, const Trial *trial, int only, double voxel)
{
    const TrackScore *score = &trial->score;
    for (int b = 0; b < score->branch_count; b++)
        if (only < 0 || b == only)
            tally_branch(score->branch[b].radius >= 2 * voxel ? &figures->wide : &figures->narrow, &score->branch[b], only < 0 ? 0 : score->branch[b].skip);
    for (int i = 0; i < score->sample_count; i++) {
        const TrackSample *s = &score->sample[i];
        if (only >= 0 && s->branch != only)
            continue;
        Tally *tally = score->branch[s->branch].radius >= 2 * voxel ? &figures->wide : &figures->narrow;
        tally->samples++;
        tally->center += s->center / voxel;
        tally->radius += s->radius / voxel;
        tally->exact += s->radius_exact / voxel;
        tally->exact_abs += fabs(s->radius_exact) / voxel;
        int bin = (int)(s->center / voxel / bin_voxels);
        tally->bin[bin < BINS ? bin : BINS - 1]++;
    }
    for (int k = 0; k < TRACK_LABELS && only < 0; k++) {
        figures->invented[k] += score->invented[k];
        figures->invented_mm += score->invented_mm[k];
    }
    figures->wrong_attachments += only < 0 ? score->wrong_attachments : 0;
    figures->background_links += only < 0 ? score->background_links : 0;
    figures->links += score->links;
    figures->false_sacs += score->false_sacs;
    figures->tracked_mm += score->tracked_mm;
    figures->cpu_s += trial->cpu_s;
    figures->nodes += trial->nodes;
}

static void angiogram_free(Angiogram *image)
{
    track_score_free(&image->plan);
    volume_free(image->volume);
    vessel_tree_free(image->truth);
    shape_free(image->shape);
}

static bool run_case(const Case *c, Group *groups, bool click_only, int threads, Faults *faults)
{
    Angiogram image = {.about = c, .shape = shape_create(c->shape, c->option_count, c->option, "bench", faults)};
    VolumeOptions volume = c->volume;
    volume.threads = threads;
    const Shape *neighbour = image.shape ? shape_neighbour(image.shape) : NULL;
    VesselTree *other = neighbour ? shape_sample(neighbour, faults) : NULL;
    image.truth = image.shape ? shape_sample(image.shape, faults) : NULL;
    image.volume = image.truth ? shape_volume(image.shape, &volume, faults) : NULL;
    image.voxel_mm = image.volume ? volume_voxel_size(image.volume) : 0;
    image.known = (TrackTruth){.tree = image.truth, .neighbour = other, .voxel_mm = image.voxel_mm};
    bool good = image.volume && track_score(&image.known, NULL, &image.plan);
    if (good)
        image.known.block = shape_blocks(image.shape, &image.known.block_count);
    long runs = good ? 1 + (click_only ? 0 : (METHODS - 1) * (long)image.plan.branch_count) : 0;
    Trials session = {&image, calloc((size_t)runs + 1, sizeof(Trial))};
    good = good && session.trial;
    if (good)
        parallel_for(threads, runs, run_trial, &session, NULL);
    for (long i = 0; i < runs && session.trial; i++) {
        int method = i == 0 ? CLICK : 1 + (int)((i - 1) / image.plan.branch_count);
        good = good && !session.trial[i].failed;
        tally_score(&groups[c->group].figures[method], &session.trial[i], i == 0 ? -1 : (int)((i - 1) % image.plan.branch_count), image.voxel_mm);
        track_score_free(&session.trial[i].score);
    }
    for (int m = 0; m < METHODS; m++)
        groups[c->group].figures[m].trees++;
    if (!good && faults->count == 0)
        faults_add(faults, "bench track", 0, 0, "not enough memory");
    free(session.trial);
    vessel_tree_free(other);
    angiogram_free(&image);
    return good;
}

// --- Table ---

static Tally sum_of(const Tally *a, const Tally *b)
{
    Tally s = *a;
    s.branches += b->branches, s.true_mm += b->true_mm, s.covered_mm += b->covered_mm, s.samples += b->samples;
    s.center += b->center, s.radius += b->radius, s.exact += b->exact, s.exact_abs += b->exact_abs;
    for (int k = 0; k < TRACK_LABELS; k++)
        s.label[k] += b->label[k];
    for (int k = 0; k < BINS; k++)
        s.bin[k] += b->bin[k];
    return s;
}

static double center_p95(const Tally *t)
{
    int seen = 0, k = 0;
    while (k < BINS - 1 && (seen += t->bin[k]) < 0.95 * t->samples)
        k++;
    return (k + 1) * bin_voxels;
}

static int leaks(const Figures *f)
{
    int sum = 0;
    for (int k = TRACK_KV; k < TRACK_LABELS; k++)
        sum += f->invented[k];
    return sum;
}

static void print_tally(FILE *out, const char *name, const Tally *t, const Figures *f)
{
    if (t->branches == 0)
        return;
    fprintf(out, "  %-26s %5d", name, t->branches);
    for (int k = 0; k < TRACK_LABELS; k++)
        fprintf(out, " %6.2f", 100.0 * t->label[k] / t->branches);
    fprintf(out, "  %5.1f %%", 100 * t->covered_mm / t->true_mm);
    if (t->samples > 0)
        fprintf(out, "  %5.3f %5.2f  %+6.3f %+6.3f %5.3f", t->center / t->samples, center_p95(t), t->radius / t->samples, t->exact / t->samples,
                t->exact_abs / t->samples);
    else
        fprintf(out, "  %5s %5s  %6s %6s %5s", "-", "-", "-", "-", "-");
    if (f)
        fprintf(out, "  %3d %6.1f %4d %4.1f  %6.2f %5.2f", leaks(f), f->invented_mm, f->wrong_attachments,
                f->links ? 100.0 * f->background_links / f->links : 0, f->cpu_s / f->trees, f->nodes ? 1000 * f->cpu_s / (double)f->nodes : 0);
    fprintf(out, "\n");
}

static void print_groups(FILE *out, const Group *groups, int count)
{
    static const double paper[2][TRACK_LABELS] = {{82.55, 12.89, 4.16, 0.40, 0, 0, 0, 0}, {59.87, 0.27, 9.66, 13.02, 2.55, 0.27, 8.86, 5.50}};
    fprintf(out, "%-28s %5s %6s %6s %6s %6s %6s %6s %6s %6s %8s %12s %21s %4s %6s %4s %5s %7s %5s\n", "% of branches", "n", "ST", "PS", "WT", "KV", "KB", "KA",
            "LB", "BT", "length", "centre p95", "radius  exact   |.|", "inv.", "mm", "att.", "bg %", "s/tree", "ms/n");
    fprintf(out, "the paper's Table 2, six patients\n");
    for (int m = 0; m < 2; m++) {
        fprintf(out, "  %-26s %5d", m ? "MHT" : "RBT", 745);
        for (int k = 0; k < TRACK_LABELS; k++)
            fprintf(out, " %6.2f", paper[m][k]);
        fprintf(out, "\n");
    }
    for (int g = 0; g < count; g++) {
        if (groups[g].is_size)
            continue;
        fprintf(out, "%s\n", groups[g].name);
        for (int m = 0; m < METHODS; m++) {
            const Figures *f = &groups[g].figures[m];
            Tally all = sum_of(&f->wide, &f->narrow);
            print_tally(out, method_name[m], &all, f);
            if (f->wide.branches > 0 && f->narrow.branches > 0) {
                print_tally(out, "  radius >= 2 voxels", &f->wide, NULL);
                print_tally(out, "  radius < 2 voxels", &f->narrow, NULL);
            }
        }
    }
    fprintf(out,
            "\nlength: tracked fraction of the true length. centre, radius: mean errors [voxel]. radius: after the known bias b^2 / (2 R), which is only the\n"
            "first term; exact: after the true steepest edge of a blurred disc; |.|: mean of its absolute value. MHT: without bias. inv., mm: runs of two\n"
            "radii or more outside the vessels of the tree, and their length; att.: links between places that are far apart in the true tree; bg: links\n"
            "that leave the lumen. Only for whole trees: a run for one branch is judged on this branch alone. s/tree: CPU seconds.\n");
}

// Time per tracked length and per node: narrow vessels have more nodes per millimetre, and larger trees have more narrow vessels.
static void print_sizes(FILE *out, const Group *groups, int count)
{
    fprintf(out, "\ncost of whole trees from one click, 5 %% noise\n");
    for (int g = 0; g < count; g++) {
        const Figures *f = &groups[g].figures[CLICK];
        if (groups[g].is_size && f->tracked_mm > 0)
            fprintf(out, "  %-26s %8.0f mm tracked %8.2f CPU s %8.2f ms a mm %6lld nodes %8.2f ms a node\n", groups[g].name, f->tracked_mm, f->cpu_s,
                    1000 * f->cpu_s / f->tracked_mm, (long long)f->nodes, 1000 * f->cpu_s / (double)f->nodes);
    }
}

typedef struct Verdict {
    const char *what;
    double found, limit;
    bool at_least, must;
} Verdict;

static int verdicts(const Group *group, Verdict *list)
{
    const Figures *f = &group->figures[CLICK];
    const Tally *t = &f->wide;
    int n = 0;
    if (t->branches == 0 || !(group->noise == 0.05 || group->noise == 0.1))
        return 0;
    bool five = group->noise == 0.05;
    list[n++] = (Verdict){"branches correct, R >= 2 voxels [%]", 100.0 * t->label[TRACK_ST] / t->branches, five ? 98 : 95, true, true};
    if (five) {
        list[n++] = (Verdict){"leaks", leaks(f), 0, false, true};
        list[n++] = (Verdict){"wrong attachments", f->wrong_attachments, 0, false, true};
        list[n++] = (Verdict){"mean centre error [voxel]", t->center / fmax(1, t->samples), 0.25, false, true};
        list[n++] = (Verdict){"mean radius error after bias [voxel]", fabs(t->radius) / fmax(1, t->samples), 0.15, false, true};
        list[n++] = (Verdict){"mean absolute radius error after the exact edge [voxel]", t->exact_abs / fmax(1, t->samples), 0.15, false, false};
    }
    return n;
}

static bool reached(const Verdict *v) { return v->at_least ? v->found >= v->limit : v->found <= v->limit; }

static void json_tally(cJSON *parent, const char *name, const Tally *t)
{
    cJSON *item = cJSON_AddObjectToObject(parent, name);
    cJSON_AddNumberToObject(item, "branches", t->branches);
    for (int k = 0; k < TRACK_LABELS; k++)
        cJSON_AddNumberToObject(item, track_label_name[k], t->label[k]);
    cJSON_AddNumberToObject(item, "true_mm", t->true_mm);
    cJSON_AddNumberToObject(item, "covered_mm", t->covered_mm);
    if (t->samples > 0) {
        cJSON_AddNumberToObject(item, "centre_error_mean_voxels", t->center / t->samples);
        cJSON_AddNumberToObject(item, "centre_error_p95_voxels", center_p95(t));
        cJSON_AddNumberToObject(item, "radius_error_mean_voxels", t->radius / t->samples);
        cJSON_AddNumberToObject(item, "radius_error_after_exact_edge_voxels", t->exact / t->samples);
        cJSON_AddNumberToObject(item, "radius_error_after_exact_edge_absolute_voxels", t->exact_abs / t->samples);
    }
}

static cJSON *json_of(const Group *groups, int count)
{
    cJSON *root = cJSON_CreateObject(), *list = cJSON_AddArrayToObject(root, "groups");
    for (int g = 0; g < count; g++) {
        cJSON *group = cJSON_CreateObject(), *methods = cJSON_AddArrayToObject(group, "methods");
        cJSON_AddStringToObject(group, "name", groups[g].name);
        for (int m = 0; m < METHODS; m++) {
            const Figures *f = &groups[g].figures[m];
            cJSON *item = cJSON_CreateObject(), *invented = cJSON_AddObjectToObject(item, "invented");
            cJSON_AddStringToObject(item, "name", method_name[m]);
            json_tally(item, "wide", &f->wide);
            json_tally(item, "narrow", &f->narrow);
            for (int k = TRACK_KV; k < TRACK_LABELS; k++)
                cJSON_AddNumberToObject(invented, track_label_name[k], f->invented[k]);
            cJSON_AddNumberToObject(item, "invented_mm", f->invented_mm);
            cJSON_AddNumberToObject(item, "wrong_attachments", f->wrong_attachments);
            cJSON_AddNumberToObject(item, "links", f->links);
            cJSON_AddNumberToObject(item, "background_links", f->background_links);
            cJSON_AddNumberToObject(item, "false_sacs", f->false_sacs);
            cJSON_AddNumberToObject(item, "tracked_mm", f->tracked_mm);
            cJSON_AddNumberToObject(item, "trees", f->trees);
            cJSON_AddNumberToObject(item, "nodes", (double)f->nodes);
            cJSON_AddNumberToObject(item, "cpu_s", f->cpu_s);
            cJSON_AddItemToArray(methods, item);
        }
        cJSON_AddItemToArray(list, group);
    }
    return root;
}

typedef struct TrackBench {
    BenchOptions common;
    bool click_only, only_starts;
    int starts;                  // per kind
    int trees;                   // random trees per noise level
} TrackBench;

static int call(void *structure, Faults *faults)
{
    const TrackBench *bench = structure;
    BenchOptions options = bench->common;
    int group_count = 0;
    if (!output_check(options.json, faults))
        return EXIT_BAD_INPUT;
    Case *cases = calloc(MOST_CASES, sizeof *cases);
    Group *groups = calloc(MOST_GROUPS, sizeof *groups);
    bool good = cases && groups, kept = true;
    int count = good && !bench->only_starts ? make_cases(options.quick, bench->trees, cases, groups, &group_count) : 0;
    for (int i = 0; i < count && good; i++)
        good = run_case(&cases[i], groups, bench->click_only || groups[cases[i].group].is_size, options.threads, faults);
    if (good) {
        FILE *out = bench_text(&options);
        fprintf(out, "bench track on %s\n", bench_processor());
        if (count > 0) {
            print_groups(out, groups, group_count);
            print_sizes(out, groups, group_count);
            fprintf(out, "\n");
        }
        for (int g = 0; g < group_count; g++) {
            Verdict list[8];
            for (int k = 0, n = verdicts(&groups[g], list); k < n; k++) {
                fprintf(out, "%-4s %-4s %s, %s: %.4g, %s %g\n", list[k].must ? "must" : "aim", reached(&list[k]) ? "yes" : "NO", groups[g].name, list[k].what,
                        list[k].found, list[k].at_least ? "at least" : "at most", list[k].limit);
                kept = kept && (reached(&list[k]) || !list[k].must);
            }
        }
        cJSON *root = json_of(groups, group_count);
        good = bench_starts(out, bench->starts, options.threads, root, &kept, faults) && bench_write_json(&options, root, faults);
        cJSON_Delete(root);
    } else if (faults->count == 0) {
        faults_add(faults, "bench track", 0, 0, "not enough memory");
    }
    free(cases);
    free(groups);
    return !good ? EXIT_BAD_INPUT : kept ? EXIT_DONE : EXIT_DIFFERENT;
}

static const Option options[] = {
    {"trees", "N", OPTION_INT, OPTION_AT(TrackBench, trees), "random trees (51 branches each) per noise level", .least = 1, .most = MOST_TREES,
     .otherwise = "5"},
    {"click", NULL, OPTION_FLAG, OPTION_AT(TrackBench, click_only), "only whole trees from one click, without the other trackers"},
    {"starts", "N", OPTION_INT, OPTION_AT(TrackBench, starts), "clicks in noisy volumes of each kind", .least = 1, .most = 100, .otherwise = "8"},
    {"only-starts", NULL, OPTION_FLAG, OPTION_AT(TrackBench, only_starts), "only these clicks"},
    BENCH_OPTIONS(TrackBench, common, "one small tree at 5 % noise and one tree of each difficulty"),
};

static const char *check(void *structure)
{
    TrackBench *bench = structure;
    if (bench->trees == 0)
        bench->trees = bench->common.quick ? 1 : 5;
    if (bench->starts == 0)
        bench->starts = bench->common.quick ? 1 : 8;
    return NULL;
}

static const OptionTable table = {
    .program = "seldinger bench track",
    .does = "trackers on synthetic angiograms with truth: the labels of the paper's Table 2, errors, times",
    .usage = "[options]",
    .intro =
        "Trackers on synthetic angiograms with exact truth, branch by branch with the labels of Kerrien et al. 2017, Table 2: random trees of at least 200 "
        "branches with a radius of two voxels or more at each of 0, 5, 10 and 20 % noise; touching vessels 0.5 to 3 voxels apart; bone in contact; aneurysms; "
        "anisotropic, fading and clipped volumes. Then the time per millimetre of vessel in trees of two sizes, and clicks in volumes as noisy as VascuSynth's "
        "(contrast 12 to 15 of 255, noise 11 to 21, a bright band), with counts of rejections and warnings.",
    .exits = "0 done; 1 a required figure was missed; 2 wrong usage or bad input",
    CLI_OPTIONS(options, TrackBench),
    .check = check,
    .too_many = "unexpected argument ",
};

const Verb bench_track = {.options = &table, .call = call};
