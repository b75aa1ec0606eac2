// Sections of single branches, and curves through their middles. See sweep_sections.h.
#include "recon/fit/sweep_sections.h"

#include <stdlib.h>
#include <string.h>

enum { CENTRINGS = 2, SECTION_ROUNDS = 4, TUNINGS = 6, THINNED_ROUNDS = 3, THINNED = 3 };
static const double SKIP = 0.7;              // [parent's radii] of a child's start whose points its sections leave out
static const double KNEE_NOISE = 2.5;        // distance at which a point's trust has fallen to a half, in standard deviations of the noise …
// … and at least, in radii, round by round: from far away, a sharp knee would take the wall for outliers
static const double section_knee[SECTION_ROUNDS] = {0.5, 0.2, 0.1, 0.06};
static const double FIRST_NOISE = 0.03;      // [radii]

SweepSight sweep_sight_of(const SweepField *field, const SweepPart *part, double share)
{
    SEL_ASSERT(part->branch >= 0 && isfinite(share), "a sac has no rows");
    SweepBasis basis = sweep_field_basis(field, part->branch, part->t);
    double rho = fmax(part->rho, 1e-12);
    SweepSight sight = {
        .branch = part->branch, .first = basis.first - field->model->branch[part->branch].first_row, .zeta = {part->n / rho, part->b / rho}, .share = share};
    memcpy(sight.weight, basis.weight, sizeof sight.weight);
    return sight;
}

double sweep_trust_of(double e, double noise, double least)
{
    SEL_ASSERT(!isnan(e) && least > 0, "a distance is a number");
    return 1 / (1 + same_square(same_square(e / fmax(KNEE_NOISE * noise, least))));
}

// Returns whether t lies at a fork, where sections alone lean towards the other vessel.
bool sweep_is_at_fork(const SweepDraft *d, int branch, double t)
{
    const SweepBranch *b = &d->model->branch[branch];
    int q = 0;
    while (q + 2 < b->break_count && d->model->break_t[b->first_break + q + 1] <= t)
        q++;
    return d->is_fork[b->first_break + q];
}

typedef struct Sections {
    SweepDraft *draft;
    SweepSystem *system;
    SweepField *field;
    double *rho;             // (points)
} Sections;

static void see_own_branch(void *context, long p)
{
    Sections *s = context;
    SweepPart part;
    sweep_field_branch(s->field, s->draft->owner[p], s->draft->point[p], s->draft->t[p], &part);
    s->rho[p] = part.rho;
    s->system->sight[p] = sweep_sight_of(s->field, &part, 1);
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

static void measure_sections(Sections *s, double knee, int every)
{
    SweepDraft *d = s->draft;
    SweepSystem *y = s->system;
    for (int64_t p = 0; p < d->vessel_point_count; p++) {
        int parent = d->model->branch[d->owner[p]].parent;
        double skipped = parent < 0 ? -HUGE_VAL : SKIP * sweep_draft_radius(d, parent, d->model->branch[d->owner[p]].parent_t);
        y->distance[p] = radius_at(d, &y->sight[p]) - s->rho[p];
        y->trust[p] = d->t[p] < skipped || p % every != 0 ? 0 : sweep_trust_of(y->distance[p], y->noise, knee * d->tree->radius[d->node[p]]);
    }
}

// Fits all rows to the branches' own points; if not `tuned`, roughly, with every third point and the strengths of the start. `system` is created here.
bool sweep_sections_fit(SweepDraft *d, SweepSystem *system, bool tuned)
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
        if (t <= hidden || (!forks && sweep_is_at_fork(d, branch, t)))
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

bool sweep_sections_lay_curves(SweepDraft *d, SweepSystem *system)
{
    bool good = true;
    for (int k = 0; k < CENTRINGS && good; k++) {
        good = sweep_draft_divide(d, d->options->spacing) && sweep_sections_fit(d, system, k > 0);
        for (int i = 0; i < d->count && good; i++) {
            centre_knots(d, system, i, k == 0);
            space_knots(d, i);
        }
        // once the curves are laid: centring would undo it
        good = good && (k + 1 < CENTRINGS || sweep_draft_relax(d)) && sweep_draft_curves(d);
    }
    return good;
}
