// Joint refinement of the swept model. See sweep_refine.h.
#include "recon/fit/sweep_refine.h"

#include "recon/fit/sweep_sacs.h"
#include "recon/fit/sweep_sections.h"

#include <stdlib.h>
#include <string.h>

// Knee of the trust, in radii, and least noise, in radii, round by round: while the blends are far from the wall, exact points must not be followed closely.
static const double round_knee[] = {0.6, 0.4, 0.3, 0.2, 0.1, 0.1}, round_noise[] = {0.02, 0.01, 0.004, 0.002, 0.001, 0.0005};
enum { KNEES = sizeof round_knee / sizeof round_knee[0], REFIT = 4, MOST_SIGHTS = 4 };   // rounds of these; round before which sacs are fitted again
static const double GAIN = 0.98;             // a round that leaves more of the mean distance than this is the last but one
static const double LEAST_SLOPE = 0.5;       // of the blended field, in distances
static const double TRIM_NOISE = 0.2, TRIM_RADIUS = 3e-4;    // harmonics below these are held at 0

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
    SEL_ASSERT(blend.count > 0 && isfinite(blend.f), "a place on the tree sees a wall");
    double slope = fmax(vec3_norm(blend.gradient), LEAST_SLOPE);
    r->system->distance[p] = blend.f / slope;
    // a point on its own branch's wall is no outlier, even if another branch's section has grown over it
    double e = fabs(blend.f) / slope;
    for (int i = 0; i < blend.count; i++)
        if (blend.part[i].branch >= 0 && blend.part[i].branch == d->owner[p])
            e = fmin(e, fabs(blend.part[i].f));
    r->system->trust[p] = sweep_trust_of(e, r->system->noise, r->knee * d->tree->radius[d->node[p]]);
    r->count[p] = 0;
    for (int i = 0; i < blend.count && r->count[p] < MOST_SIGHTS; i++)
        if (blend.part[i].branch >= 0 && fabs(blend.part[i].share) > 1e-4)
            r->sight[p][r->count[p]++] = sweep_sight_of(r->field, &blend.part[i], blend.part[i].share / slope);
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
    r->sight[p][0] = sweep_sight_of(r->field, &part, 1);
    r->count[p] = 1;
    r->system->distance[p] = part.f;
    r->system->trust[p] = deepest > DEEP * guard->rho ? fmin(1, fmax(LEAST, same_square(r->system->noise / (LOOSE * guard->rho)))) : 0;
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

bool sweep_refine(SweepDraft *d, SweepSystem *system, int rounds, Faults *faults)
{
    size_t points = (size_t)system->count + 1;
    Refinement r = {d, system, NULL, malloc(points * sizeof *r.sight), malloc(points * sizeof *r.count), malloc((size_t)d->tree->node_count * sizeof *r.sac_of),
                    0, 0};
    bool good = r.sight && r.count && r.sac_of;
    sweep_system_soften_forks(system);
    for (int i = 0; good && d->model->sac && i < d->model->sac->node_count; i++)
        r.sac_of[d->model->sac_node[i]] = i;
    int refit = rounds - 2 > REFIT ? REFIT : rounds - 2;
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
