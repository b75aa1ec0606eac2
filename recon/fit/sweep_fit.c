#include "recon/fit/sweep_fit.h"

#include "recon/fit/sweep_draft.h"
#include "recon/fit/sweep_rows.h"
#include "recon/fit/sweep_sacs.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CENTRINGS = 2, SECTION_ROUNDS = 4, TUNINGS = 6, THINNED_ROUNDS = 3, THINNED = 3, MOST_SIGHTS = 4 };
static const double SKIP = 0.7;              // [parent's radii] of a child's start whose points its sections leave out
static const double KNEE_NOISE = 2.5;        // distance at which a point's trust has fallen to a half, in standard deviations of the noise …
// … and at least, in radii, round by round: from far away, a sharp knee would take the wall for outliers
static const double section_knee[SECTION_ROUNDS] = {0.5, 0.2, 0.1, 0.06}, round_knee[] = {0.6, 0.4, 0.3, 0.2, 0.1, 0.1};
enum { KNEES = sizeof round_knee / sizeof round_knee[0], REFIT = 4 };    // rounds of these; round before which sacs are fitted again
static const double GAIN = 0.98;             // a round that leaves more of the mean distance than this is the last but one
static const double FIRST_NOISE = 0.03;      // [radii]
// Least noise of each round, in radii: while the blends are far from the wall, exact points must not be followed closely.
static const double round_noise[] = {0.02, 0.01, 0.004, 0.002, 0.001, 0.0005};
static const double LEAST_SLOPE = 0.5;       // of the blended field, in distances
static const double TRIM_NOISE = 0.2, TRIM_RADIUS = 3e-4;
static const double OUT = 0.5;               // [radii] points further from the wall are left out of the figures

SweepFitOptions sweep_fit_default_options(void)
{
    return (SweepFitOptions){.spacing = 1, .fork_spacing = 0.4, .harmonics = SWEEP_HARMONICS, .rounds = 9, .blend = 0.6};
}

static bool check_options(const SweepFitOptions *o, Faults *faults)
{
    int before = faults->count;
    const struct {
        const char *name;
        double value, least, most;
    } range[] = {{"spacing", o->spacing, 0.1, 10}, {"fork spacing", o->fork_spacing, 0.1, 10}, {"harmonics", o->harmonics, 1, SWEEP_HARMONICS},
                 {"rounds", o->rounds, 0, 100},    {"voxel-mm", o->voxel_mm, 0, 100},          {"blend", o->blend, 0, 2}};
    for (size_t i = 0; i < sizeof range / sizeof range[0]; i++)
        if (!(range[i].value >= range[i].least && range[i].value <= range[i].most))
            faults_add(faults, "fit", 0, 0, "%s is %g; expected %g to %g", range[i].name, range[i].value, range[i].least, range[i].most);
    return faults->count == before;
}

static double now_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// --- Sections ---

typedef struct Sections {
    SweepDraft *draft;
    SweepSystem *system;
    SweepField *field;
    double *rho;             // (points)
} Sections;

static SweepSight sight_of(const SweepField *field, const SweepPart *part, double share)
{
    SweepBasis basis = sweep_field_basis(field, part->branch, part->t);
    double rho = fmax(part->rho, 1e-12);
    SweepSight sight = {
        .branch = part->branch, .first = basis.first - field->model->branch[part->branch].first_row, .zeta = {part->n / rho, part->b / rho}, .share = share};
    memcpy(sight.weight, basis.weight, sizeof sight.weight);
    return sight;
}

static void see_own_branch(void *context, long p)
{
    Sections *s = context;
    SweepPart part;
    sweep_field_branch(s->field, s->draft->owner[p], s->draft->point[p], s->draft->t[p], &part);
    s->rho[p] = part.rho;
    s->system->sight[p] = sight_of(s->field, &part, 1);
    s->system->first[p] = p;
}

static double radius_at(const SweepDraft *d, const SweepSight *sight)
{
    const SweepBranch *b = &d->model->branch[sight->branch];
    double re = 1, im = 0, sum = 0;
    const double *row = d->model->row + (size_t)(b->first_row + sight->first) * SWEEP_TERMS;
    for (int k = 0; k <= SWEEP_HARMONICS; k++) {
        for (int j = 0; j < 4; j++) {
            const double *c = row + j * SWEEP_TERMS;
            sum += sight->weight[j] * (k == 0 ? c[0] : c[2 * k - 1] * re + c[2 * k] * im);
        }
        double next = re * sight->zeta[0] - im * sight->zeta[1];
        im = re * sight->zeta[1] + im * sight->zeta[0];
        re = next;
    }
    return sum;
}

static double trust_of(double e, double noise, double least) { return 1 / (1 + same_square(same_square(e / fmax(KNEE_NOISE * noise, least)))); }

static void measure_sections(Sections *s, double knee, int every)
{
    SweepDraft *d = s->draft;
    SweepSystem *y = s->system;
    for (int64_t p = 0; p < d->vessel_point_count; p++) {
        int parent = d->model->branch[d->owner[p]].parent;
        double skipped = parent < 0 ? -HUGE_VAL : SKIP * sweep_draft_radius(d, parent, d->model->branch[d->owner[p]].parent_t);
        y->distance[p] = radius_at(d, &y->sight[p]) - s->rho[p];
        y->trust[p] = d->t[p] < skipped || p % every != 0 ? 0 : trust_of(y->distance[p], y->noise, knee * d->tree->radius[d->node[p]]);
    }
}

// Returns whether t lies at a fork, where sections alone lean towards the other vessel.
static bool is_at_fork(const SweepDraft *d, int branch, double t)
{
    const SweepBranch *b = &d->model->branch[branch];
    int q = 0;
    while (q + 2 < b->break_count && d->model->break_t[b->first_break + q + 1] <= t)
        q++;
    return d->is_fork[b->first_break + q];
}

typedef struct Bin {
    int64_t key;             // of the place along a branch and around it
    double rho;              // [radii]
} Bin;

static int compare_bins(const void *a, const void *b)
{
    const Bin *p = a, *q = b;
    return p->key != q->key ? (p->key > q->key) - (p->key < q->key) : (p->rho > q->rho) - (p->rho < q->rho);
}

// Points on tubes where the wall has two sheets: seen from the curve, in one direction, some are much further than the others. At forks that is no finding.
static int64_t count_second_sheets(const Sections *s)
{
    static const double ALONG = 0.3, APART = 0.35;   // [radii]
    enum { AROUND = 16 };
    const SweepDraft *d = s->draft;
    Bin *bin = malloc(((size_t)d->vessel_point_count + 1) * sizeof *bin);
    int64_t bins = 0, found = 0;
    for (int64_t p = 0; bin && p < d->vessel_point_count; p++) {
        const SweepSight *sight = &s->system->sight[p];
        double r = d->tree->radius[d->node[p]], angle = same_atan2(sight->zeta[1], sight->zeta[0]), length = d->curve[sight->branch]->length;
        if (!(d->t[p] > 0 && d->t[p] < length) || is_at_fork(d, sight->branch, d->t[p]))
            continue;
        int64_t place = (int64_t)(d->t[p] / (ALONG * d->branches->branch[sight->branch].radius_least)), around = (int64_t)((angle / (2 * PI) + 0.5) * AROUND);
        bin[bins++] = (Bin){((int64_t)sight->branch << 40) + place * (AROUND + 1) + around, s->rho[p] / r};
    }
    if (bins > 0)
        qsort(bin, (size_t)bins, sizeof *bin, compare_bins);
    for (int64_t from = 0, to; from < bins; from = to) {
        int64_t step = -1;
        for (to = from + 1; to < bins && bin[to].key == bin[from].key; to++)
            if (bin[to].rho - bin[to - 1].rho > APART)
                step = to;
        if (step >= 0)
            found += step - from < to - step ? step - from : to - step;
    }
    free(bin);
    return found;
}

// Fits all rows to the branches' own points; if not `tuned`, roughly, with every third point and the strengths of the start. `system` is created here.
static bool fit_sections(SweepDraft *d, SweepSystem *system, bool tuned)
{
    double noise = system->noise, strength[PENALTIES][SWEEP_HARMONICS + 1];
    memcpy(strength, system->strength, sizeof strength);
    sweep_system_free(system);
    bool good = sweep_draft_guard(d) && sweep_system_create(system, d) && sweep_draft_project(d);
    if (noise > 0)
        memcpy(system->strength, strength, sizeof strength);
    system->noise = noise > 0 ? noise : FIRST_NOISE * d->branches->branch[0].radius_mean;
    Sections s = {d, system, good ? sweep_field_create(d->model) : NULL, calloc((size_t)d->point_count + 1, sizeof *s.rho)};
    good = good && s.field && s.rho;
    if (good) {
        parallel_for(d->options->threads, (long)d->vessel_point_count, see_own_branch, &s, NULL);
        for (int64_t p = d->vessel_point_count; p <= system->count; p++)
            system->first[p] = d->vessel_point_count;
    }
    for (int k = 0; good && k < (tuned ? SECTION_ROUNDS : THINNED_ROUNDS); k++) {
        measure_sections(&s, section_knee[k], tuned ? 1 : THINNED);
        good = sweep_system_sum(system) && sweep_system_step(system, false);
    }
    for (int k = 0; good && tuned && k < TUNINGS; k++) {
        measure_sections(&s, section_knee[SECTION_ROUNDS - 1], 1);
        good = sweep_system_tune(system) && sweep_system_step(system, false);
    }
    if (good && tuned)
        d->second_sheets = count_second_sheets(&s);
    sweep_field_free(s.field);
    free(s.rho);
    return good;
}

// --- Knots to the middle of their sections ---

// How far the end has to move along its tangent. A dome: by what its points say. An end that was cut, without points across it: beyond the last point.
static double end_shift(const SweepDraft *d, const SweepSystem *system, int branch)
{
    static const double ACROSS = 0.6, CAP = 0.05;    // [radii] from the tangent; share of such points that make an end a dome
    const SweepCurve *curve = d->curve[branch];
    SweepJet end = sweep_curve_at(curve, curve->length);
    Vec3 out = vec3_unit(end.s1);
    double product = 0, square = 0, r = sweep_draft_radius(d, branch, curve->length), furthest = 0;
    int beyond = 0, across = 0;
    for (int64_t p = 0; p < d->vessel_point_count; p++)
        if (d->owner[p] == branch && d->t[p] > curve->length) {
            Vec3 u = vec3_sub(d->point[p], end.s);
            double height = vec3_dot(u, out), aside = vec3_norm(vec3_add_scaled(u, -height, out)), steep = height / fmax(vec3_norm(u), 1e-9 * r);
            product -= system->trust[p] * steep * system->distance[p], square += system->trust[p] * steep * steep;
            beyond++;
            across += aside < ACROSS * r;
            if (aside < 1.5 * r)
                furthest = fmax(furthest, height);
        }
    if (across <= CAP * beyond)
        return fmin(1.5 * r, furthest);
    return square > 2 ? fmax(-0.5 * r, fmin(0.5 * r, product / square)) : 0;
}

static void centre_knots(SweepDraft *d, const SweepSystem *system, int branch, bool forks)
{
    const SweepCurve *curve = d->curve[branch];
    const SweepBranch *b = &d->model->branch[branch];
    double hidden = b->parent >= 0 ? sweep_draft_radius(d, b->parent, b->parent_t) : -1;
    for (int k = 0; k < b->knot_count; k++) {
        double t = curve->knot_t[k], r = sweep_draft_radius(d, branch, t);
        if (t <= hidden || (!forks && is_at_fork(d, branch, t)))
            continue;
        SweepJet jet = sweep_curve_at(curve, t);
        Vec3 shift = vec3_add(vec3_scale(jet.n, sweep_draft_term(d, branch, 1, t)), vec3_scale(jet.b, sweep_draft_term(d, branch, 2, t)));
        if (k == b->knot_count - 1)
            shift = vec3_add_scaled(shift, end_shift(d, system, branch), vec3_unit(jet.s1));
        double size = vec3_norm(shift), most = 0.5 * r;
        d->knot[branch][k] = vec3_add_scaled(d->knot[branch][k], size > most ? most / size : 1, shift);
    }
}

// Knots that have come too close to each other are left out.
static void space_knots(SweepDraft *d, int branch)
{
    Vec3 *knot = d->knot[branch];
    int kept = 1, count = d->knot_count[branch];
    for (int k = 1; k < count; k++) {
        double r = d->branches->branch[branch].radius_least;
        if (vec3_distance(knot[k], knot[kept - 1]) > 0.1 * r || (k == count - 1 && kept == 1))
            knot[kept++] = knot[k];
        else if (k == count - 1)
            knot[kept - 1] = knot[k];
    }
    d->knot_count[branch] = kept;
}

static bool lay_curves(SweepDraft *d, SweepSystem *system)
{
    bool good = true;
    for (int k = 0; k < CENTRINGS && good; k++) {
        good = sweep_draft_divide(d, d->options->spacing) && fit_sections(d, system, k > 0);
        for (int i = 0; i < d->count && good; i++) {
            centre_knots(d, system, i, k == 0);
            space_knots(d, i);
        }
        good = good && sweep_draft_curves(d);
    }
    return good;
}

// --- Refinement ---

typedef struct Refinement {
    SweepDraft *draft;
    SweepSystem *system;
    SweepField *field;
    SweepSight (*sight)[MOST_SIGHTS];        // (points)
    int *count;              // (points)
    int *sac_of;             // (N) node of the sacs' tree, -1: none
    double knee, mean;
} Refinement;

static void see_blend(void *context, long p)
{
    Refinement *r = context;
    SweepDraft *d = r->draft;
    SweepBlend blend;
    SweepPlace place = {.branch = d->owner[p], .sac = -1};
    if (place.branch >= 0)
        place.t = d->t[p];
    else
        place.sac = r->sac_of[d->node[p]];
    sweep_field_blend(r->field, place, d->point[p], &blend);
    double slope = fmax(vec3_norm(blend.gradient), LEAST_SLOPE);
    r->system->distance[p] = blend.f / slope;
    // a point on its own branch's wall is no outlier, even if another branch's section has grown over it
    double e = fabs(blend.f) / slope;
    for (int i = 0; i < blend.count; i++)
        if (blend.part[i].branch >= 0 && blend.part[i].branch == d->owner[p])
            e = fmin(e, fabs(blend.part[i].f));
    r->system->trust[p] = trust_of(e, r->system->noise, r->knee * d->tree->radius[d->node[p]]);
    r->count[p] = 0;
    for (int i = 0; i < blend.count && r->count[p] < MOST_SIGHTS; i++)
        if (blend.part[i].branch >= 0 && fabs(blend.part[i].share) > 1e-4)
            r->sight[p][r->count[p]++] = sight_of(r->field, &blend.part[i], blend.part[i].share / slope);
}

// A guard holds a section near the tree's radius where it is deep in another vessel's lumen; no point does.
static void see_guard(void *context, long index)
{
    // [radii] depth in the other lumen; standard deviation; and the least weight relative to a point's: exact points would outweigh any deviation
    static const double DEEP = 0.2, LOOSE = 0.1, LEAST = 4e-4;
    Refinement *r = context;
    const SweepGuard *guard = &r->draft->guard[index];
    int64_t p = r->draft->point_count + index;
    SweepBlend blend;
    SweepPart part;
    sweep_field_blend(r->field, (SweepPlace){.branch = guard->branch, .t = guard->t, .sac = -1}, guard->x, &blend);
    sweep_field_branch(r->field, guard->branch, guard->x, guard->t, &part);
    double deepest = -HUGE_VAL;
    for (int i = 0; i < blend.count; i++)
        if (blend.part[i].branch != guard->branch)
            deepest = fmax(deepest, blend.part[i].f);
    r->sight[p][0] = sight_of(r->field, &part, 1);
    r->count[p] = 1;
    r->system->distance[p] = part.f;
    r->system->trust[p] = deepest > DEEP * guard->rho ? fmax(LEAST, same_square(r->system->noise / (LOOSE * guard->rho))) : 0;
}

static bool look_at_blend(Refinement *r, double knee)
{
    SweepDraft *d = r->draft;
    r->knee = knee;
    sweep_field_free(r->field);
    if (!(r->field = sweep_field_create(d->model)))
        return false;
    parallel_for(d->options->threads, (long)d->point_count, see_blend, r, NULL);
    parallel_for(d->options->threads, (long)d->guard_count, see_guard, r, NULL);
    int64_t sum = 0;
    for (int64_t p = 0; p < r->system->count; p++)
        sum += r->count[p];
    if (!sweep_system_reserve(r->system, sum))
        return false;
    sum = 0;
    for (int64_t p = 0; p < r->system->count; p++) {
        r->system->first[p] = sum;
        memcpy(r->system->sight + sum, r->sight[p], (size_t)r->count[p] * sizeof(SweepSight));
        sum += r->count[p];
    }
    r->system->first[r->system->count] = sum;
    return true;
}

// Holds at 0 the highest harmonics of rows where all of them together are less than a part of the noise and of the radius.
static void trim_harmonics(SweepDraft *d, double noise)
{
    for (int i = 0; i < d->model->row_count; i++) {
        double *row = d->model->row + (size_t)i * SWEEP_TERMS, most = fmax(TRIM_NOISE * noise, TRIM_RADIUS * d->prior_radius[i]), sum = 0;
        int k = d->harmonics[i];
        for (; k > 1 && (sum += same_hypot(row[2 * k - 1], row[2 * k])) < most; k--)
            row[2 * k - 1] = row[2 * k] = 0;
        d->harmonics[i] = (uint8_t)k;
    }
}

typedef struct Neck {
    const Refinement *refinement;
    Vec3 *moved;             // (tree's points)
    int64_t *index;          // (points) index of the tree's point
} Neck;

// Where the sac's own wall has to pass for the blended wall to pass through a point of the sac.
static void move_point(void *context, long i)
{
    static const double LEAST_SHARE = 0.2, LONGEST = 0.3;    // [radii of the link's vessel: of the stub]
    const Neck *neck = context;
    const SweepDraft *d = neck->refinement->draft;
    int64_t p = d->vessel_point_count + i;
    SweepBlend blend;
    sweep_field_blend(neck->refinement->field, (SweepPlace){.branch = -1, .sac = neck->refinement->sac_of[d->node[p]]}, d->point[p], &blend);
    const SweepPart *sac = &blend.part[blend.count - 1];
    if (sac->branch >= 0 || sac->share < LEAST_SHARE || sac->share > 0.9999)
        return;
    double slope = fmax(vec3_norm(sac->gradient), LEAST_SLOPE), most = LONGEST * d->tree->radius[d->node[p]];
    double raised = sac->f - blend.f / sac->share;   // of the sac's field at the point; the wall is where it is 0
    neck->moved[neck->index[p]] = vec3_add_scaled(d->point[p], -fmax(-most, fmin(most, raised / slope)), vec3_unit(sac->gradient));
}

// Fits the sacs' blobs again so that, blended with the vessels, they pass through their points.
static bool refit_sacs(Refinement *r, Faults *faults)
{
    SweepDraft *d = r->draft;
    VesselTree moved = *d->tree;
    Neck neck = {r, malloc(((size_t)moved.point_count + 1) * sizeof(Vec3)), malloc(((size_t)d->point_count + 1) * sizeof(int64_t))};
    bool good = neck.moved && neck.index;
    if (good) {
        memcpy(neck.moved, d->tree->point, (size_t)moved.point_count * sizeof(Vec3));
        int64_t p = d->vessel_point_count;
        for (int i = 0; i < moved.node_count; i++)
            for (int64_t k = moved.point_offset[i]; k < moved.point_offset[i + 1] && moved.kind[i] == NODE_ANEURYSM; k++)
                neck.index[p++] = k;
        parallel_for(d->options->threads, (long)(d->point_count - d->vessel_point_count), move_point, &neck, NULL);
        moved.point = neck.moved;
        vessel_tree_free(d->model->sac);
        free(d->model->sac_node);
        d->model->sac = NULL, d->model->sac_node = NULL;
        good = sweep_sacs_fit(&moved, d->options, d->model, faults);
    }
    free(neck.moved);
    free(neck.index);
    return good;
}

// Mean distance of the points that are trusted.
static double mean_distance(const SweepSystem *system)
{
    double sum = 0, trust = 0;
    for (int64_t p = 0; p < system->draft->point_count; p++)
        sum += system->trust[p] * fabs(system->distance[p]), trust += system->trust[p];
    return trust > 0 ? sum / trust : 0;
}

// One step of Gauss and Newton. `r->mean` is of the rows before it.
static bool run_round(Refinement *r, int k)
{
    SweepSystem *system = r->system;
    int at = k < KNEES ? k : KNEES - 1;
    double least = round_noise[at] * r->draft->branches->branch[0].radius_mean;
    system->noise = fmax(system->noise, least);
    if (!look_at_blend(r, round_knee[at]) || !sweep_system_sum(system) || (k > 0 && !sweep_system_tune(system)))
        return false;
    double found = system->noise;
    r->mean = mean_distance(system);
    system->noise = fmax(found, least);
    bool good = sweep_system_step(system, true);
    system->noise = found;
    return good;
}

static bool refine(SweepDraft *d, SweepSystem *system, Faults *faults)
{
    size_t points = (size_t)system->count + 1;
    Refinement r = {d, system, NULL, malloc(points * sizeof *r.sight), malloc(points * sizeof *r.count), malloc((size_t)d->tree->node_count * sizeof *r.sac_of),
                    0, 0};
    bool good = r.sight && r.count && r.sac_of;
    sweep_system_soften_forks(system);
    for (int i = 0; good && d->model->sac && i < d->model->sac->node_count; i++)
        r.sac_of[d->model->sac_node[i]] = i;
    int rounds = d->options->rounds, refit = rounds - 2 > REFIT ? REFIT : rounds - 2;
    double before = HUGE_VAL;
    for (int k = 0; good && k < rounds; k++) {
        if (k == refit && d->model->sac)
            good = look_at_blend(&r, round_knee[k < KNEES ? k : KNEES - 1]) && refit_sacs(&r, faults);
        good = good && run_round(&r, k);
        if (k > refit && r.mean > GAIN * before)
            break;
        before = r.mean;
    }
    if (good && rounds > 0) {
        trim_harmonics(d, system->noise);    // one round more for the rest
        good = run_round(&r, KNEES);
    }
    good = good && look_at_blend(&r, round_knee[KNEES - 1]);
    sweep_field_free(r.field);
    free(r.sight);
    free(r.count);
    free(r.sac_of);
    return good;
}

// --- Figures ---

static void count_numbers(const SweepDraft *d, SweepFitFigures *figures)
{
    const SweepModel *m = d->model;
    figures->numbers = 3 * (int64_t)m->knot_count + m->break_count;
    for (int64_t i = 0; i < (int64_t)m->row_count * SWEEP_TERMS; i++)
        figures->numbers += m->row[i] != 0;
    if (m->sac)
        figures->numbers += 5 * m->sac->blob_count;
}

static bool take_figures(const SweepDraft *d, const SweepSystem *system, SweepFitFigures *figures)
{
    double *value = malloc(((size_t)d->point_count + 1) * sizeof *value), sum = 0;
    if (!value)
        return false;
    for (int64_t p = 0; p < d->point_count; p++) {
        double e = fabs(system->distance[p]);
        if (!(e < OUT * d->tree->radius[d->node[p]])) {
            figures->left_out++;
            continue;
        }
        value[figures->points++] = e;
        sum += e;
    }
    if (figures->points > 0) {
        sort_doubles(value, (size_t)figures->points);
        figures->mean = sum / (double)figures->points;
        figures->p99 = value[(int64_t)(0.99 * (double)(figures->points - 1))];
        figures->most = value[figures->points - 1];
    }
    figures->noise = system->noise;
    figures->not_star_shaped = d->second_sheets;
    for (int64_t p = 0; p < d->vessel_point_count; p++) {
        SweepJet jet = sweep_curve_at(d->curve[d->owner[p]], d->t[p]);
        double speed2 = vec3_norm2(jet.s1);
        figures->folded += speed2 - vec3_dot(vec3_sub(d->point[p], jet.s), jet.s2) < SWEEP_LEAST_D * speed2;
    }
    count_numbers(d, figures);
    free(value);
    return true;
}

static bool fit(SweepDraft *d, SweepSystem *system, Faults *faults)
{
    bool good = lay_curves(d, system) && sweep_draft_divide(d, d->options->spacing) && fit_sections(d, system, true);
    return good && sweep_sacs_fit(d->tree, d->options, d->model, faults) && refine(d, system, faults);
}

SweepModel *sweep_fit(const VesselTree *tree, const SweepFitOptions *options, SweepFitFigures *figures, Faults *faults)
{
    SweepFitFigures found = {0};
    SweepDraft draft;
    SweepSystem system = {0};
    SweepModel *model = NULL;
    double begin = now_seconds();
    int before = faults->count;
    if (!check_options(options, faults))
        return NULL;
    if (tree->point_count < 4 || tree->kind[0] != NODE_VESSEL) {
        faults_add(faults, "fit", 0, 0, "the tree has %lld points and its root is %s; expected at least 4 points on the wall, and a vessel",
                   (long long)tree->point_count, tree->kind[0] == NODE_VESSEL ? "a vessel" : "an aneurysm");
        return NULL;
    }
    if (sweep_draft_create(&draft, tree, options) && fit(&draft, &system, faults) && take_figures(&draft, &system, &found)) {
        model = draft.model;
        draft.model = NULL;
    } else if (faults->count == before) {
        faults_add(faults, "fit", 0, 0, "not enough memory");
    }
    sweep_system_free(&system);
    sweep_draft_free(&draft);
    found.seconds = now_seconds() - begin;
    if (figures)
        *figures = found;
    return model;
}
