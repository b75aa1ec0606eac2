// Curves, breaks and wall points of the swept model's fit. See sweep_draft.h.
#include "recon/fit/sweep_draft.h"

#include "recon/fit/band_matrix.h"
#include "recon/fit/sweep_spline.h"

#include <stdlib.h>
#include <string.h>

static const double KNOTS_APART = 0.85;      // [radii]
// A fork's zone: from where the child's wall leaves the parent's lumen to where the two walls are apart, and this much further [child's and parent's radii].
static const double ZONE_CHILD = 1.2, ZONE_PARENT = 0.5, ZONE_MOST = 12;
static const double GRADE = 0.35;            // growth of the spacing away from a zone
enum { SMOOTHINGS = 2, RELAXATIONS = 60 };
// A bend whose radius of curvature is less than the vessel's has places with two feet on the curve. A section may have any shape, so the curve need not be central:
// where it bends more than SHARP_BEND [1/radii], it is relaxed to less than MOST_BEND, as long as no knot moves further than this [radii].
static const double SHARP_BEND = 1.1, MOST_BEND = 0.85, FURTHEST = 0.5, TIGHT = 1e3;

typedef struct Zone {
    int branch;
    double low, high, spacing;       // spacing [mm]
} Zone;

void sweep_draft_free(SweepDraft *d)
{
    for (int i = 0; i < d->count; i++) {
        if (d->knot)
            free(d->knot[i]);
        if (d->curve)
            sweep_curve_free(d->curve[i]);
    }
    free(d->knot);
    free(d->knot_count);
    free(d->curve);
    free(d->node_t);
    sweep_model_free(d->model);
    free(d->scale);
    free(d->is_fork);
    free(d->harmonics);
    free(d->prior_radius);
    free(d->is_hidden);
    free(d->point);
    free(d->owner);
    free(d->node);
    free(d->t);
    free(d->guard);
    vessel_branches_free(d->branches);
    *d = (SweepDraft){0};
}

// --- Curves ---

// The centres of a branch, from the node that it springs from on. Returns their number.
static int line_of(const SweepDraft *d, int branch, Vec3 *center, double *radius)
{
    const VesselTree *tree = d->tree;
    const VesselBranch *b = &d->branches->branch[branch];
    int count = 0, from = b->from_node;
    if (from >= 0)
        center[0] = tree->center[from], radius[count++] = tree->radius[d->branches->node[b->first]];
    for (int k = 0; k < b->count; k++) {
        int node = d->branches->node[b->first + k];
        center[count] = tree->center[node], radius[count++] = tree->radius[node];
    }
    for (int pass = 0; pass < SMOOTHINGS; pass++) {
        Vec3 before = center[0];
        for (int k = 1; k < count - 1; k++) {
            Vec3 here = center[k];
            center[k] = vec3_mix(vec3_mix(before, center[k + 1], 0.5), here, 0.5);
            before = here;
        }
    }
    return count;
}

// Keeps centres that are about KNOTS_APART radii apart, and the last one.
static int thin_line(Vec3 *center, double *radius, int count)
{
    int kept = 1;
    for (int k = 1; k < count; k++) {
        double apart = vec3_distance(center[k], center[kept - 1]);
        bool is_last = k == count - 1;
        if (!is_last && apart < KNOTS_APART * radius[k])
            continue;
        if (is_last && kept > 1 && apart < 0.5 * KNOTS_APART * radius[k])
            kept--;
        if (vec3_distance(center[k], center[kept - 1]) > 1e-6 * radius[k])
            center[kept] = center[k], radius[kept++] = radius[k];
    }
    return kept;
}

static bool lay_knots(SweepDraft *d, int branch)
{
    const VesselBranch *b = &d->branches->branch[branch];
    size_t room = (size_t)b->count + 2;
    Vec3 *center = malloc(room * sizeof *center);
    double *radius = malloc(room * sizeof *radius);
    if (center && radius) {
        int count = thin_line(center, radius, line_of(d, branch, center, radius));
        if (count < 2) {     // a single node: its cylinder
            int node = d->branches->node[b->first + b->count - 1];
            center[1] = vec3_add_scaled(d->tree->center[node], 0.5 * d->tree->radius[node], d->tree->direction[node]);
            center[0] = vec3_add_scaled(d->tree->center[node], -0.5 * d->tree->radius[node], d->tree->direction[node]);
            count = 2;
        }
        d->knot[branch] = center;
        d->knot_count[branch] = count;
        center = NULL;
    }
    free(center);
    free(radius);
    return d->knot[branch] != NULL;
}

static int nearest_on_branch(const SweepDraft *d, int branch, Vec3 x)
{
    const VesselBranch *b = &d->branches->branch[branch];
    int best = d->branches->node[b->first];
    for (int k = 1; k < b->count; k++) {
        int node = d->branches->node[b->first + k];
        if (vec3_distance(d->tree->center[node], x) < vec3_distance(d->tree->center[best], x))
            best = node;
    }
    return best;
}

// [1/mm] at the start of an interval.
static double curvature_at(const SweepInterval *at)
{
    Vec3 bend = vec3_scale(at->s[2], 2);
    double speed = vec3_norm(at->s[1]);
    return vec3_norm(vec3_cross(at->s[1], bend)) / (speed * speed * speed);
}

// Knots near which the curve bends too much are moved to the minimum of sum w_k |x_k - x_k0|^2 / r_k^2 + sum |turn of the chords at k|^2; where a bend remains
// sharp, w is reduced.
typedef struct Relaxation {
    int count;
    double *radius, *hold, *apart;   // (knots) w; [mm] from the knot before
    Vec3 *first;             // (knots) x_0
} Relaxation;

// Returns whether a bend is sharp and can still give way.
static bool loosen(Relaxation *r, const SweepCurve *curve, const Vec3 *knot)
{
    static const double BY = 0.5;
    bool any = false;
    for (int k = 1; k < r->count - 1; k++) {
        // the wall on the inner side is nearer to a curve that has moved inwards
        double moved = vec3_distance(knot[k], r->first[k]), bend = curvature_at(&curve->interval[k + 1]) * (r->radius[k] - 0.5 * moved);
        if (r->hold[k] > TIGHT || bend < (r->hold[k] < TIGHT ? MOST_BEND : SHARP_BEND) || moved > FURTHEST * r->radius[k])
            continue;
        any = true;
        for (int i = k > 2 ? k - 2 : 1; i <= k + 2 && i < r->count - 1; i++)
            r->hold[i] *= r->hold[i] > TIGHT ? 1 : i == k ? BY : i == k - 1 || i == k + 1 ? 0.5 * (1 + BY) : 0.75 + 0.25 * BY;
    }
    return any;
}

// Returns false if out of memory.
static bool settle(const Relaxation *r, Vec3 *knot)
{
    enum { W = 2 };
    int n = r->count;
    double *band = calloc((size_t)n * (W + 1), sizeof *band), *x = malloc((size_t)n * sizeof *x);
    bool good = band && x;
    for (int k = 0; good && k < n; k++)
        band[k * (W + 1)] = r->hold[k] / same_square(r->radius[k]);
    for (int k = 1; good && k < n - 1; k++) {
        double c[3] = {1 / r->apart[k], -1 / r->apart[k] - 1 / r->apart[k + 1], 1 / r->apart[k + 1]};
        for (int i = 0; i < 3; i++)
            for (int j = i; j < 3; j++)
                band[(k - 1 + i) * (W + 1) + j - i] += c[i] * c[j];
    }
    good = good && band_factor(band, n, W);
    for (int axis = 0; good && axis < 3; axis++) {
        for (int k = 0; k < n; k++)
            x[k] = r->hold[k] / same_square(r->radius[k]) * (axis == 0 ? r->first[k].x : axis == 1 ? r->first[k].y : r->first[k].z);
        band_solve(band, n, W, x);
        for (int k = 1; k < n - 1; k++)
            *(axis == 0 ? &knot[k].x : axis == 1 ? &knot[k].y : &knot[k].z) = x[k];
    }
    free(band);
    free(x);
    return good;
}

static bool relax_bends(Relaxation *r, Vec3 *knot)
{
    for (int pass = 0; pass < RELAXATIONS; pass++) {
        SweepCurve *curve = sweep_curve_create(r->count, knot);
        if (!curve)
            return false;
        bool any = loosen(r, curve, knot);
        sweep_curve_free(curve);
        if (!any)
            break;
        if (!settle(r, knot))
            return false;
    }
    return true;
}

static bool relax_branch(SweepDraft *d, int branch)
{
    size_t count = (size_t)d->knot_count[branch];
    Relaxation r = {(int)count, malloc(3 * count * sizeof *r.radius), NULL, NULL, malloc(count * sizeof *r.first)};
    bool good = r.radius && r.first;
    if (good)
        r.hold = r.radius + count, r.apart = r.hold + count;
    size_t held = branch == 0 ? 2 : 1;       // the root's direction is that of the lumen upstream
    for (size_t k = 0; good && k < count; k++) {
        r.radius[k] = d->tree->radius[nearest_on_branch(d, branch, d->knot[branch][k])];
        r.first[k] = d->knot[branch][k];
        r.hold[k] = k < held || k == count - 1 ? 1e3 * TIGHT : TIGHT;
        r.apart[k] = k > 0 ? vec3_distance(d->knot[branch][k], d->knot[branch][k - 1]) : 0;
    }
    good = good && relax_bends(&r, d->knot[branch]);
    free(r.radius);
    free(r.first);
    return good;
}

bool sweep_draft_relax(SweepDraft *d)
{
    bool good = true;
    for (int i = 0; i < d->count && good; i++)
        good = relax_branch(d, i);
    return good;
}

bool sweep_draft_curves(SweepDraft *d)
{
    for (int i = 0; i < d->count; i++) {
        SEL_ASSERT(d->knot_count[i] >= 2, "a curve has two knots");
        sweep_curve_free(d->curve[i]);
        if (!(d->curve[i] = sweep_curve_create(d->knot_count[i], d->knot[i])))
            return false;
        const VesselBranch *b = &d->branches->branch[i];
        double t = 0, length = d->curve[i]->length, whole = b->length;
        for (int k = 0; k < b->count; k++) {
            int node = d->branches->node[b->first + k];
            double share = whole > 0 ? d->branches->along[b->first + k] / whole : 1;
            double at = sweep_curve_project(d->curve[i], d->tree->center[node], share * length, d->tree->radius[node]);
            t = fmax(t, fmin(length, at));
            d->node_t[node] = t;
        }
    }
    return true;
}

static bool gather_points(SweepDraft *d)
{
    const VesselTree *tree = d->tree;
    size_t room = (size_t)tree->point_count + 1;
    d->point = malloc(room * sizeof *d->point);
    d->owner = malloc(room * sizeof *d->owner);
    d->node = malloc(room * sizeof *d->node);
    if (!d->point || !d->owner || !d->node)
        return false;
    for (int i = 0; i < d->count; i++)
        for (int k = 0; k < d->branches->branch[i].count; k++) {
            int node = d->branches->node[d->branches->branch[i].first + k];
            for (int64_t p = tree->point_offset[node]; p < tree->point_offset[node + 1]; p++) {
                d->point[d->point_count] = tree->point[p];
                d->owner[d->point_count] = i;
                d->node[d->point_count++] = node;
            }
        }
    d->vessel_point_count = d->point_count;
    for (int i = 0; i < tree->node_count; i++)
        for (int64_t p = tree->point_offset[i]; p < tree->point_offset[i + 1] && tree->kind[i] == NODE_ANEURYSM; p++) {
            d->point[d->point_count] = tree->point[p];
            d->owner[d->point_count] = -1;
            d->node[d->point_count++] = i;
        }
    return true;
}

bool sweep_draft_create(SweepDraft *d, const VesselTree *tree, const SweepFitOptions *options)
{
    *d = (SweepDraft){.tree = tree, .options = options, .branches = vessel_branches_create(tree)};
    if (!d->branches)
        return false;
    size_t count = (size_t)d->branches->count;
    d->knot = calloc(count + 1, sizeof *d->knot);
    d->knot_count = calloc(count + 1, sizeof *d->knot_count);
    d->curve = calloc(count + 1, sizeof *d->curve);
    d->node_t = calloc((size_t)tree->node_count, sizeof *d->node_t);
    if (!d->knot || !d->knot_count || !d->curve || !d->node_t)
        return false;
    d->count = d->branches->count;
    for (int i = 0; i < d->count; i++)
        if (!lay_knots(d, i))
            return false;
    return gather_points(d) && sweep_draft_curves(d);
}

double sweep_draft_radius(const SweepDraft *d, int branch, double t)
{
    SEL_ASSERT(branch >= 0 && branch < d->count && !isnan(t), "the branch is one of the draft's, and t is a number");
    const VesselBranch *b = &d->branches->branch[branch];
    const int *node = d->branches->node + b->first;
    int low = 0, high = b->count - 1;
    if (t <= d->node_t[node[0]])
        return d->tree->radius[node[0]];
    if (t >= d->node_t[node[high]])
        return d->tree->radius[node[high]];
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (d->node_t[node[middle]] <= t)
            low = middle;
        else
            high = middle;
    }
    double t0 = d->node_t[node[low]], t1 = d->node_t[node[high]], share = t1 > t0 ? (t - t0) / (t1 - t0) : 0.5;
    return d->tree->radius[node[low]] + share * (d->tree->radius[node[high]] - d->tree->radius[node[low]]);
}

// --- Breaks ---

// The zones of the fork where `child` springs from its parent.
static void find_zone(const SweepDraft *d, int child, Zone zone[2], double *parent_t)
{
    int parent = d->branches->branch[child].parent;
    const SweepCurve *own = d->curve[child], *other = d->curve[parent];
    int from = d->branches->branch[child].from_node;
    double start = d->branches->of_node[from] == parent ? d->node_t[from] : 0;
    double rp = sweep_draft_radius(d, parent, start), foot = sweep_curve_project(other, own->interval[1].s[0], start, rp),
           rc = sweep_draft_radius(d, child, rp);
    *parent_t = foot = fmax(0, fmin(other->length, foot));
    double in = 0, clear = 0, low = foot, high = foot;
    bool is_out = false;
    for (double t = 0; t < fmin(own->length, ZONE_MOST * rp); t += 0.2 * rc) {
        Vec3 x = sweep_curve_at(own, t).s;
        foot = sweep_curve_project(other, x, foot, rp);
        double inside = fmax(0, fmin(other->length, foot)), apart = vec3_distance(x, sweep_curve_at(other, foot).s);
        rc = sweep_draft_radius(d, child, t);
        rp = sweep_draft_radius(d, parent, inside);
        clear = t;
        if (!is_out && apart < rp - rc)
            in = t;
        else
            is_out = true;
        low = fmin(low, inside), high = fmax(high, inside);
        if (apart > rp + rc)
            break;
    }
    double around = ZONE_CHILD * rc + ZONE_PARENT * rp;
    zone[0] = (Zone){parent, low - around, high + around, d->options->fork_spacing * fmax(rc, 0.5 * rp)};
    zone[1] = (Zone){child, in, clear + ZONE_CHILD * rc, d->options->fork_spacing * rc};
}

// The zone of a neck: where `vessel` is linked to `sac`.
static Zone neck_zone(const SweepDraft *d, int vessel, int sac)
{
    double r = d->tree->radius[vessel], t = d->node_t[vessel], around = fmax(r, fmin(d->tree->radius[sac], 2 * r)) + r;
    return (Zone){d->branches->of_node[vessel], t - around, t + around, d->options->fork_spacing * r};
}

static double spacing_at(const SweepDraft *d, const Zone *zone, int zones, int branch, double t, double spacing)
{
    double h = spacing * sweep_draft_radius(d, branch, t);
    for (int z = 0; z < zones; z++)
        if (zone[z].branch == branch)
            h = fmin(h, zone[z].spacing + GRADE * fmax(0, fmax(zone[z].low - t, t - zone[z].high)));
    return h;
}

// Breaks of one branch into `at` (may be NULL). Returns their number.
static int divide_branch(const SweepDraft *d, const Zone *zone, int zones, int branch, double spacing, double *at)
{
    double length = d->curve[branch]->length, total = 0;
    double step = fmin(length / 8, 0.05 * d->branches->branch[branch].radius_least);
    int steps = (int)fmin(1e6, ceil(length / step)), placed = 1;
    step = length / steps;
    for (int i = 0; i < steps; i++)
        total += step / spacing_at(d, zone, zones, branch, (i + 0.5) * step, spacing);
    int parts = (int)fmax(1, ceil(total - 0.25));
    if (!at)
        return parts + 1;
    double done = 0;
    at[0] = 0;
    for (int i = 0; i < steps && placed < parts; i++) {
        double more = step / spacing_at(d, zone, zones, branch, (i + 0.5) * step, spacing), next = total * placed / parts;
        if (done + more >= next)
            at[placed++] = (i + (next - done) / more) * step;
        done += more;
    }
    at[parts] = length;
    return parts + 1;
}

static void mark_intervals(SweepDraft *d, const Zone *zone, int zones, int branch)
{
    const SweepBranch *b = &d->model->branch[branch];
    const double *at = d->model->break_t + b->first_break;
    for (int q = 0; q < b->break_count; q++) {
        double low = at[q], high = at[q + 1 < b->break_count ? q + 1 : q];
        d->scale[b->first_break + q] = sweep_draft_radius(d, branch, 0.5 * (low + high));
        for (int z = 0; z < zones; z++)
            d->is_fork[b->first_break + q] |= zone[z].branch == branch && high > zone[z].low && low < zone[z].high;
    }
    for (int k = 0; k < b->break_count + 2; k++) {
        bool fork = false;
        for (int q = k - 3 > 0 ? k - 3 : 0; q <= k && q < b->break_count - 1; q++)
            fork |= d->is_fork[b->first_break + q];
        d->harmonics[b->first_row + k] = (uint8_t)(fork ? SWEEP_HARMONICS : d->options->harmonics);
    }
}

// Rows of round sections with the tree's radii, each at the mean of the three breaks inside its support (Greville's abscissa).
static void fill_round_rows(SweepDraft *d, int branch, double hidden)
{
    const SweepBranch *b = &d->model->branch[branch];
    const double *at = d->model->break_t + b->first_break;
    for (int k = 0; k < b->break_count + 2; k++) {
        double sum = 0;
        for (int i = k - 2; i <= k; i++)
            sum += at[i < 0 ? 0 : i < b->break_count ? i : b->break_count - 1] / 3;
        d->prior_radius[b->first_row + k] = d->model->row[(size_t)(b->first_row + k) * SWEEP_TERMS] = sweep_draft_radius(d, branch, sum);
        d->is_hidden[b->first_row + k] = sum <= hidden;
    }
}

static bool make_model(SweepDraft *d, const Zone *zone, int zones, double spacing, const double *parent_t)
{
    int knots = 0, breaks = 0;
    for (int i = 0; i < d->count; i++) {
        knots += d->knot_count[i];
        breaks += divide_branch(d, zone, zones, i, spacing, NULL);
    }
    int rows = breaks + 2 * d->count;
    sweep_model_free(d->model);
    free(d->scale);
    free(d->is_fork);
    free(d->harmonics);
    free(d->prior_radius);
    free(d->is_hidden);
    d->model = sweep_model_create(d->count, knots, breaks, rows);
    d->scale = calloc((size_t)breaks, sizeof *d->scale);
    d->is_fork = calloc((size_t)breaks, sizeof *d->is_fork);
    d->harmonics = calloc((size_t)rows, sizeof *d->harmonics);
    d->prior_radius = calloc((size_t)rows, sizeof *d->prior_radius);
    d->is_hidden = calloc((size_t)rows, sizeof *d->is_hidden);
    if (!d->model || !d->scale || !d->is_fork || !d->harmonics || !d->prior_radius || !d->is_hidden)
        return false;
    d->model->blend = d->options->blend;
    knots = breaks = 0;
    for (int i = 0; i < d->count; i++) {
        SweepBranch *b = &d->model->branch[i];
        int count = divide_branch(d, zone, zones, i, spacing, d->model->break_t + breaks);
        *b = (SweepBranch){.parent = i == 0 ? -1 : d->branches->branch[i].parent,
                           .parent_t = i == 0 ? 0 : parent_t[i],
                           .open_start = i == 0 && vessel_tree_root_is_open(d->tree),
                           .radius = d->branches->branch[i].radius_mean,
                           .first_knot = knots,
                           .knot_count = d->knot_count[i],
                           .first_break = breaks,
                           .break_count = count,
                           .first_row = breaks + 2 * i};
        memcpy(d->model->knot + knots, d->knot[i], (size_t)d->knot_count[i] * sizeof(Vec3));
        const VesselBranch *vb = &d->branches->branch[i];
        for (int k = 0, near = 0; k < b->knot_count; k++) {
            const int *node = d->branches->node + vb->first;
            double t = d->curve[i]->knot_t[k];
            while (near + 1 < vb->count && fabs(d->node_t[node[near + 1]] - t) <= fabs(d->node_t[node[near]] - t))
                near++;
            d->model->knot_node[knots + k] = node[near];
        }
        mark_intervals(d, zone, zones, i);
        fill_round_rows(d, i, i > 0 ? zone[2 * i - 1].low : -1);
        knots += b->knot_count, breaks += count;
    }
    return true;
}

bool sweep_draft_divide(SweepDraft *d, double spacing)
{
    const VesselTree *tree = d->tree;
    int zones = 2 * d->count;
    for (int i = 1; i < tree->node_count; i++)
        zones += tree->kind[i] != tree->kind[tree->parent[i]];
    Zone *zone = calloc((size_t)zones + 1, sizeof *zone);
    double *parent_t = calloc((size_t)d->count + 1, sizeof *parent_t);
    bool good = zone && parent_t;
    zones = 0;
    for (int i = 1; good && i < d->count; i++, zones += 2)
        find_zone(d, i, zone + zones, &parent_t[i]);
    for (int i = 1; good && i < tree->node_count; i++)
        if (tree->kind[i] != tree->kind[tree->parent[i]])
            zone[zones++] = tree->kind[i] == NODE_VESSEL ? neck_zone(d, i, tree->parent[i]) : neck_zone(d, tree->parent[i], i);
    good = good && make_model(d, zone, zones, spacing, parent_t);
    free(zone);
    free(parent_t);
    return good;
}

// --- Sections and feet ---

double sweep_draft_term(const SweepDraft *d, int branch, int term, double t)
{
    SEL_ASSERT(d->model && term >= 0 && term < SWEEP_TERMS, "the curves were divided, and the term is one of a row");
    const SweepBranch *b = &d->model->branch[branch];
    double value[4], slope[4], bend[4], sum = 0;
    int row = b->first_row + sweep_spline(d->model->break_t + b->first_break, b->break_count, t, value, slope, bend);
    for (int k = 0; k < 4; k++)
        sum += value[k] * d->model->row[(size_t)(row + k) * SWEEP_TERMS + (size_t)term];
    return sum;
}

// The foot nearest to x, from the best of five starts about its node.
static double find_foot(const SweepDraft *d, int branch, int node, Vec3 x)
{
    const SweepCurve *curve = d->curve[branch];
    double r = d->tree->radius[node], best = d->node_t[node], least2 = HUGE_VAL;
    for (int k = -2; k <= 2; k++) {
        double t = fmax(0, fmin(curve->length, d->node_t[node] + 0.75 * k * r)), far2 = vec3_norm2(vec3_sub(x, sweep_curve_at(curve, t).s));
        if (far2 < least2)
            least2 = far2, best = t;
    }
    return sweep_curve_project(curve, x, best, 0.5 * r);
}

static void project(void *context, long index)
{
    SweepDraft *d = context;
    d->t[index] = find_foot(d, d->owner[index], d->node[index], d->point[index]);
}

bool sweep_draft_project(SweepDraft *d)
{
    free(d->t);
    d->t = malloc(((size_t)d->point_count + 1) * sizeof *d->t);
    if (d->t)
        parallel_for(d->options->threads, (long)d->vessel_point_count, project, d, NULL);
    return d->t != NULL;
}

bool sweep_draft_guard(SweepDraft *d)
{
    SEL_ASSERT(d->model, "the curves were divided");
    enum { AROUND = 20 };       // more than terms, or a section could pass between
    int64_t p = 0;
    free(d->guard);
    d->guard_count = 0;
    d->guard = malloc(((size_t)d->model->break_count * AROUND + 1) * sizeof *d->guard);
    for (int i = 0; d->guard && i < d->count; i++) {
        const SweepBranch *b = &d->model->branch[i];
        const double *at = d->model->break_t + b->first_break;
        while (p < d->vessel_point_count && d->owner[p] < i)
            p++;
        Vec3 origin = d->point[p < d->vessel_point_count ? p : 0];
        for (int q = 0; q < b->break_count - 1; q++) {
            if (!d->is_fork[b->first_break + q] && !d->is_hidden[b->first_row + q + 1])
                continue;
            double t = 0.5 * (at[q] + at[q + 1]), r = sweep_draft_radius(d, i, t);
            SweepJet jet = sweep_curve_at(d->curve[i], t);
            // angles count from the branch's first point, so that they do not depend on the coordinates' axes
            double first = same_atan2(vec3_dot(vec3_sub(origin, jet.s), jet.b), vec3_dot(vec3_sub(origin, jet.s), jet.n));
            for (int k = 0; k < AROUND; k++) {
                double angle = first + 2 * PI * (k + 0.5 * (q % 2)) / AROUND;
                Vec3 out = vec3_add(vec3_scale(jet.n, same_cos(angle)), vec3_scale(jet.b, same_sin(angle)));
                d->guard[d->guard_count++] = (SweepGuard){i, t, r, vec3_add_scaled(jet.s, r, out)};
            }
        }
    }
    return d->guard != NULL;
}
