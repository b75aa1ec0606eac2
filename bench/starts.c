// A trial is a random tree with its own band, noise and click. If the trunk is visible, the correct result is a start in it with its radius, and a tree that
// covers four fifths of its length. If noise hides the trunk, or the click is outside all vessels, the correct result is a refusal. A wrong result must come
// with a warning.
#include "bench/starts.h"

#include "base/parallel.h"
#include "bench/track_score.h"
#include "recon/phantom/phantom_parts.h"
#include "recon/track/rbt_track.h"

#include <stdlib.h>
#include <string.h>

typedef struct Kind {
    const char *name;
    double contrast, noise, band;            // [grey values]
    double band_radii, radius;               // thickness of the band, radius of the trunk [voxel]
    bool is_hidden;          // a refusal is correct
    bool is_beside;          // the click lies on background
} Kind;

static const Kind kinds[] = {
    {"contrast 15, noise 2, band 60", 15, 2, 60, 8, 4, false, false},
    {"contrast 15, noise 11", 15, 11, 0, 0, 4, false, false},
    {"contrast 15, noise 11, band 40", 15, 11, 40, 8, 4, false, false},
    {"contrast 13, noise 16, band 40", 13, 16, 40, 8, 4, false, false},
    {"contrast 13, noise 16, narrow band 40", 13, 16, 40, 3, 4, false, false},
    {"contrast 12, noise 21", 12, 21, 0, 0, 4, false, false},
    {"contrast 12, noise 21, band 60", 12, 21, 60, 8, 4, false, false},
    {"contrast 15, noise 11, band 40, thin trunk", 15, 11, 40, 8, 2.5, false, false},
    {"contrast 3, noise 40", 3, 40, 0, 0, 3, true, false},
    {"contrast 12, noise 60, thin trunk", 12, 60, 0, 0, 1.2, true, false},
    {"contrast 12, noise 21, click beside", 12, 21, 0, 0, 4, true, true},
    {"contrast 15, noise 11, band 40, click beside", 15, 11, 40, 8, 4, true, true},
};
enum { KINDS = sizeof kinds / sizeof kinds[0], ENOUGH = 8 };

typedef struct Trial {
    bool is_refused, is_right, failed;
    int warnings;            // except the warning that a smoothed copy was tracked
    bool is_smoothed;
    double drift, offset;    // [true radii] distance of the axis found from the click and from the true axis
    double radius;           // found radius over true radius
    double trunk;            // tracked fraction of the trunk's length, whichever end became the root
    bool is_turned;          // the root is not on the trunk: labels are not counted, as they follow the tree downstream
    int branches, correct, too_short, missed, leaks;
    double cpu_s;
} Trial;

typedef struct Trials {
    int seeds;
    Trial *trial;            // (KINDS, seeds)
} Trials;

static double centreline_distance(const VesselTree *tree, Vec3 x, double *radius)
{
    double least = HUGE_VAL;
    for (int i = 0; i < tree->node_count; i++) {
        Vec3 a = tree->center[i], b = tree->parent[i] >= 0 ? tree->center[tree->parent[i]] : a, ab = vec3_sub(b, a);
        double l2 = vec3_norm2(ab), s = l2 > 0 ? fmax(0, fmin(1, vec3_dot(vec3_sub(x, a), ab) / l2)) : 0, d = vec3_distance(x, vec3_add_scaled(a, s, ab));
        if (d < least) {
            least = d;
            *radius = tree->radius[i];
        }
    }
    return least;
}

// A point in the trunk, between three and seven tenths of its length and up to 0.4 radii off its axis, or a point at least seven radii from all vessel axes.
static bool click_of(const Kind *kind, const VesselTree *truth, const TrackBranch *trunk, const Volume *volume, Random *random, Vec3 *click)
{
    if (kind->is_beside) {
        for (int i = 0; i < 1000; i++) {
            double radius, margin = 0.15, u[3];
            for (int k = 0; k < 3; k++)
                u[k] = (margin + (1 - 2 * margin) * random_open(random)) * (volume->size[k] - 1);
            *click = volume_point_of(volume, vec3(u[0], u[1], u[2]));
            if (centreline_distance(truth, *click, &radius) > 3 * kind->radius)
                return true;
        }
        return false;
    }
    double share = 0.3 + 0.4 * random_open(random), left = (1 - share) * trunk->length, off = 0.4 * random_open(random), angle = 2 * PI * random_open(random);
    int at = trunk->last_node;
    for (; truth->parent[at] != trunk->first_node && left > 0; at = truth->parent[at])
        left -= vec3_distance(truth->center[at], truth->center[truth->parent[at]]);
    Vec3 e1 = vec3_normal_to(truth->direction[at]), e2 = vec3_cross(truth->direction[at], e1);
    *click = vec3_add_scaled(vec3_add_scaled(truth->center[at], off * truth->radius[at] * cos(angle), e1), off * truth->radius[at] * sin(angle), e2);
    return true;
}

// Fraction of the trunk's centreline within one true radius of the tracked centreline, sampled at the true nodes; the first two radii are not scored.
static double trunk_share(const TrackBranch *trunk, const VesselTree *truth, const VesselTree *tracked)
{
    int asked = 0, met = 0;
    Vec3 root = truth->center[trunk->first_node];
    for (int i = trunk->last_node; i != trunk->first_node; i = truth->parent[i]) {
        double radius;
        if (vec3_distance(truth->center[i], root) < 2 * truth->radius[i])
            continue;
        asked++;
        met += centreline_distance(tracked, truth->center[i], &radius) < truth->radius[i];
    }
    return asked > 0 ? (double)met / asked : 0;
}

static bool is_on(const TrackBranch *trunk, const VesselTree *truth, Vec3 x)
{
    int nearest = 0;
    for (int i = 0; i < truth->node_count; i++)
        if (vec3_distance(x, truth->center[i]) < vec3_distance(x, truth->center[nearest]))
            nearest = i;
    for (int i = trunk->last_node; i != trunk->first_node; i = truth->parent[i])
        if (i == nearest)
            return true;
    return nearest == trunk->first_node;
}

static void score_trial(Trial *trial, const Kind *kind, const VesselTree *truth, const VesselTree *tracked, const RbtReport *report)
{
    TrackTruth known = {.tree = truth, .voxel_mm = 1};
    TrackScore score;
    double true_radius = kind->radius;
    const RbtStartCheck *check = &report->check;
    if (!track_score(&known, tracked, &score)) {
        trial->failed = true;
        return;
    }
    const TrackBranch *trunk = &score.branch[0];
    trial->offset = centreline_distance(truth, check->cylinder.center, &true_radius) / true_radius;
    trial->drift = check->drift / true_radius;
    trial->radius = check->cylinder.radius / true_radius;
    trial->trunk = trunk_share(trunk, truth, tracked);
    trial->is_turned = !is_on(trunk, truth, tracked->center[0]);
    trial->is_smoothed = check->smoothing_mm > 0;
    for (int i = 0; i < check->warning_count; i++)
        trial->warnings += check->warning[i].kind != RBT_NOISE;
    for (int b = 0; b < score.branch_count && !trial->is_turned; b++) {
        trial->branches++;
        trial->correct += score.branch[b].label == TRACK_ST;
        trial->too_short += score.branch[b].label == TRACK_PS;
        trial->missed += score.branch[b].label == TRACK_WT;
    }
    for (int k = TRACK_KV; k < TRACK_LABELS && !trial->is_turned; k++)
        trial->leaks += score.invented[k];
    trial->is_right = trial->offset < 0.5 && fabs(trial->radius - 1) < 0.3 && trial->trunk >= 0.8;
    track_score_free(&score);
}

static void run_trial(void *context, long index)
{
    const Trials *session = context;
    const Kind *kind = &kinds[index / session->seeds];
    int seed = (int)(index % session->seeds) + 1;
    Trial *trial = &session->trial[index];
    Faults *faults = calloc(1, sizeof *faults);
    char option[4][2][64] = {{"points", "8"}, {"branches", "13"}, {"seed", ""}, {"radius_mm", ""}};
    snprintf(option[2][1], 64, "%d", seed);
    snprintf(option[3][1], 64, "%g", kind->radius);
    Shape *shape = faults ? shape_create("tree", 4, (const char(*)[2][64])option, "bench", faults) : NULL;
    VolumeOptions o = volume_default_options();
    o.voxel_mm[0] = o.voxel_mm[1] = o.voxel_mm[2] = 1;
    o.psf_mm = 0.5;
    o.contrast_grey = kind->contrast;
    o.noise = kind->noise / kind->contrast;
    o.band = kind->band / kind->contrast;
    o.band_mm = fmax(1, kind->band_radii * kind->radius);
    o.seed = 1 + (uint64_t)seed;   // the same as `synth --seed`
    o.threads = 1;
    VesselTree *truth = shape ? shape_sample(shape, faults) : NULL, *tracked = NULL;
    Volume *volume = truth ? shape_volume(shape, &o, faults) : NULL;
    TrackTruth known = {.tree = truth, .voxel_mm = 1};
    TrackScore plan;
    Random random = {77 * (uint64_t)seed + (uint64_t)(index / session->seeds)};
    RbtSeed click = {.line = 1};
    RbtReport report = {0};
    trial->failed = true;
    if (volume && track_score(&known, NULL, &plan)) {
        trial->failed = !click_of(kind, truth, &plan.branch[0], volume, &random, &click.start);
        track_score_free(&plan);
    }
    if (!trial->failed) {
        RbtParameters parameters = rbt_default_parameters();
        parameters.automatic = 1;
        int64_t begin = bench_cpu_ns();
        tracked = rbt_track(volume, &parameters, &click, 1, NULL, 0, 1, NULL, &report, "bench", faults);
        trial->cpu_s = (double)(bench_cpu_ns() - begin) * 1e-9;
        trial->is_refused = !tracked;
        if (tracked)
            score_trial(trial, kind, truth, tracked, &report);
        rbt_report_free(&report);
    }
    vessel_tree_free(tracked);
    volume_free(volume);
    vessel_tree_free(truth);
    shape_free(shape);
    free(faults);
}

typedef struct Row {             // of a kind
    int trials, right, refused, warned, silent, smoothed, tracked, turned;
    int branches, correct, too_short, missed, leaks;
    double drift_mean, drift_most, radius, trunk, cpu_s;
} Row;

static Row row_of(const Trial *trial, int count)
{
    Row r = {.trials = count};
    for (int i = 0; i < count; i++) {
        const Trial *t = &trial[i];
        r.cpu_s += t->cpu_s / count;
        r.refused += t->is_refused;
        if (t->is_refused)
            continue;
        r.tracked++;
        r.right += t->is_right;
        r.warned += t->warnings > 0;
        r.silent += !t->is_right && t->warnings == 0;
        r.smoothed += t->is_smoothed;
        r.turned += t->is_turned;
        r.drift_mean += t->drift;
        r.drift_most = fmax(r.drift_most, t->drift);
        r.radius += t->radius;
        r.trunk += t->trunk;
        r.branches += t->branches, r.correct += t->correct, r.too_short += t->too_short, r.missed += t->missed, r.leaks += t->leaks;
    }
    if (r.tracked > 0) {
        r.drift_mean /= r.tracked;
        r.radius /= r.tracked;
        r.trunk /= r.tracked;
    }
    return r;
}

static double percent(int part, int whole) { return whole > 0 ? 100.0 * part / whole : 0; }

static void print_row(FILE *out, const Kind *kind, const Row *r)
{
    fprintf(out, "  %-46s %4d %5d %5d %5d %5d %5d", kind->name, r->trials, r->right, r->refused, r->warned, r->silent, r->smoothed);
    if (r->tracked > 0 && !kind->is_hidden)
        fprintf(out, "  %5.2f %5.2f %7.2f %6.1f %% %5d  %5.1f %5.1f %5.1f %5d", r->drift_mean, r->drift_most, r->radius, 100 * r->trunk, r->turned,
                percent(r->correct, r->branches), percent(r->too_short, r->branches), percent(r->missed, r->branches), r->leaks);
    else
        fprintf(out, "  %5s %5s %7s %8s %5s  %5s %5s %5s %5s", "-", "-", "-", "-", "-", "-", "-", "-", "-");
    fprintf(out, " %6.2f\n", r->cpu_s);
}

static void json_row(cJSON *list, const Kind *kind, const Row *r)
{
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "name", kind->name);
    cJSON_AddNumberToObject(item, "contrast_grey", kind->contrast);
    cJSON_AddNumberToObject(item, "noise_grey", kind->noise);
    cJSON_AddNumberToObject(item, "band_grey", kind->band);
    cJSON_AddNumberToObject(item, "trunk_radius_voxels", kind->radius);
    cJSON_AddBoolToObject(item, "refusal_is_right", kind->is_hidden);
    cJSON_AddNumberToObject(item, "trials", r->trials);
    cJSON_AddNumberToObject(item, "right", r->right);
    cJSON_AddNumberToObject(item, "refused", r->refused);
    cJSON_AddNumberToObject(item, "warned", r->warned);
    cJSON_AddNumberToObject(item, "wrong_without_a_word", r->silent);
    cJSON_AddNumberToObject(item, "smoothed", r->smoothed);
    cJSON_AddNumberToObject(item, "drift_mean_radii", r->drift_mean);
    cJSON_AddNumberToObject(item, "drift_most_radii", r->drift_most);
    cJSON_AddNumberToObject(item, "radius_over_true", r->radius);
    cJSON_AddNumberToObject(item, "trunk_share", r->trunk);
    cJSON_AddNumberToObject(item, "root_elsewhere", r->turned);
    cJSON_AddNumberToObject(item, "branches", r->branches);
    cJSON_AddNumberToObject(item, "correct", r->correct);
    cJSON_AddNumberToObject(item, "too_short", r->too_short);
    cJSON_AddNumberToObject(item, "not_tracked", r->missed);
    cJSON_AddNumberToObject(item, "leaks", r->leaks);
    cJSON_AddNumberToObject(item, "cpu_s", r->cpu_s);
    cJSON_AddItemToArray(list, item);
}

// `kept` is NULL for a desired value.
static void print_verdict(FILE *out, const char *what, double found, double limit, bool at_least, bool *kept)
{
    bool reached = at_least ? found >= limit : found <= limit;
    fprintf(out, "%-4s %-4s one click, noisy volumes: %s: %.3g, %s %g\n", kept ? "must" : "aim", reached ? "yes" : "NO", what, found,
            at_least ? "at least" : "at most", limit);
    if (kept)
        *kept = *kept && reached;
}

bool bench_starts(FILE *out, int seeds, int threads, cJSON *root, bool *kept, Faults *faults)
{
    Trials session = {seeds, calloc((size_t)KINDS * (size_t)seeds, sizeof(Trial))};
    bool good = session.trial != NULL;
    cJSON *list = cJSON_AddArrayToObject(root, "starts");
    int seen = 0, right = 0, false_refusals = 0, hidden = 0, missing = 0, silent = 0;
    if (good)
        parallel_for(threads, (long)KINDS * seeds, run_trial, &session, NULL);
    for (int i = 0; good && i < KINDS * seeds; i++)
        good = !session.trial[i].failed;
    if (good)
        fprintf(out,
                "\none click in volumes of whole grey values, as VascuSynth's: random trees of 13 branches, 1 mm voxels, trunk of 4 voxels' radius (thin: 2.5, "
                "hidden 3 and\n1.2), a band of 8 of its radii across it (narrow: 3)\n"
                "  %-46s %4s %5s %5s %5s %5s %5s  %11s %7s %8s %5s  %5s %5s %5s %5s %6s\n",
                "", "n", "right", "ref.", "warn", "wrong", "smth", "drift   max", "radius", "trunk", "turn.", "ST %", "PS %", "WT %", "leaks", "CPU s");
    for (int k = 0; good && k < KINDS; k++) {
        Row row = row_of(&session.trial[k * seeds], seeds);
        print_row(out, &kinds[k], &row);
        json_row(list, &kinds[k], &row);
        seen += kinds[k].is_hidden ? 0 : seeds;
        right += kinds[k].is_hidden ? 0 : row.right;
        false_refusals += kinds[k].is_hidden ? 0 : row.refused;
        hidden += kinds[k].is_hidden ? seeds : 0;
        missing += kinds[k].is_hidden ? row.tracked : 0;
        silent += row.silent;
    }
    bool *judged = seeds >= ENOUGH ? kept : NULL;   // one or two seeds cannot estimate a rate
    if (good) {
        fprintf(out,
                "right: the start is within half a radius of the true axis, its radius within 30 %%, four fifths of the trunk tracked; ref.: refused;\n"
                "warn: tracked with a warning (except that a smoothed copy was tracked: smth); wrong: tracked, not right, no such warning. drift: distance\n"
                "of the click from the axis found [true radii], mean and largest; radius: found over true; turn.: the root is not at the trunk's end\n"
                "(labels of these are not counted). In the last four kinds noise hides the vessel or there is none: a refusal is correct.\n");
        print_verdict(out, "right, of the visible [%]", percent(right, seen), 80, true, judged);
        print_verdict(out, "refused, of the visible [%]", percent(false_refusals, seen), 10, false, judged);
        print_verdict(out, "not refused, of the hidden [%]", percent(missing, hidden), 5, false, judged);
        print_verdict(out, "wrong without a warning, of all [%]", percent(silent, seen + hidden), 5, false, judged);
        print_verdict(out, "wrong without a warning, of all [%]", percent(silent, seen + hidden), 0, false, NULL);
    } else if (faults->count == 0) {
        faults_add(faults, "bench track", 0, 0, "not enough memory");
    }
    free(session.trial);
    return good;
}
