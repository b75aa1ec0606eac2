// Contact with a fitted tree: topological tracking by power distance (Kerrien 2017, 6.2.1) and Newton projection onto the local model of the
// point's node (6.2.2, iterated: a single step is Taubin's distance, up to 2.3 times too long).
//
// A point goes through
//   1. power_walk from its last node;
//   2. bounds that cost no field: the distance is 1-Lipschitz, so gap(X) >= gap(C) - |X - C| for the node's centre C, and
//      gap(X) >= gap(X_then) - |X - X_then| for the place where it was last measured;
//   3. one value of the field at X: its sign, and an estimate that shows when another wall has come closer than the remembered one;
//   4. Newton on {f = 0, (X - p) parallel to grad f} from the remembered foot p. With n = g/|g|, S = P H P/|g|, gap = (X - p).n, one step is
//      p += t + nu n,  t = -(I + gap S)^-1 P (p - X),  nu = -(f/|g| + t'S't / 2): the quadratic term makes one step nearly always enough;
//   5. where that fails, a march from X along the gradient, then again 4; where that fails, blobby_project (slow, robust).
// The march works on W = (f + T)^(-1/2) - T^(-1/2), which for one blob is a paraboloid |X - C|^2 - r^2 up to scale: Newton on it from outside never
// overshoots and arrives from any distance, where f itself is flat.
#include "geom/blob_lanes.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"

#include <limits.h>
#include <stdlib.h>

typedef struct NodeModel {
    const BlobGroup *group;
    int groups;
    int source;              // the node whose blobs these are: itself, or the nearest relative where it has none
    double clear;            // [mm] true distance from the node's centre to the wall of this model, less a margin; < 0: no bound
} NodeModel;

typedef struct LimVessel {
    Vessel vessel;           // first: a Vessel * to us is a LimVessel *
    const VesselTree *tree;
    LimVesselOptions options;
    const BlobKernels *kernels;
    BlobGroup *group;        // all nodes' groups
    NodeModel *model;        // (N)
    bool inlet_open;         // the root is an end of the tree
} LimVessel;

// A foot on one model. The shape operator is that of the last evaluation.
typedef struct Foot {
    Vec3 place, normal;
    Sym3 shape;
    double gap;
    bool sure;
} Foot;

// Points of a query are taken in batches, and each batch in stages (all fields at X, all first Newton steps, …): an evaluation alone waits mostly for
// its own division and sums, see BlobKernels. A point's answer does not depend on its batch.
enum { BATCH = 32 };

typedef enum { FOOT_PENDING, FOOT_DONE, FOOT_DEEP, FOOT_LOST } FootState;

typedef struct Projection {
    const NodeModel *model;
    int node;
    Vec3 x;
    FootState state;
    double longest;          // [mm] step bound; without `careful` a longer one is FOOT_LOST
    bool careful;            // go on near focal points and with bounded steps
    FieldJob at_x, at_foot;  // at_foot.x is the running foot
    Foot foot;
} Projection;

static Blobby blobs_of(const LimVessel *lim, int node)
{
    const VesselTree *tree = lim->tree;
    int64_t first = tree->blob_offset[lim->model[node].source], end = tree->blob_offset[lim->model[node].source + 1];
    return (Blobby){(int)(end - first), tree->blob_center + first, tree->blob_width + first, tree->iso_level};
}

static Projection new_projection(const LimVessel *lim, int node, Vec3 x)
{
    const NodeModel *m = &lim->model[node];
    FieldJob job = {.group = m->group, .groups = m->groups, .x = x};
    return (Projection){.model = m, .node = node, .x = x, .state = FOOT_LOST, .at_x = job, .at_foot = job};
}

static Sym3 shape_from(Vec3 n, double slope, const Sym3 *h)
{
    Vec3 hn = sym3_mul_vec(h, n);
    double nhn = vec3_dot(n, hn), s = 1 / slope;
    return (Sym3){s * (h->xx - 2 * n.x * hn.x + nhn * n.x * n.x),
                  s * (h->xy - n.x * hn.y - n.y * hn.x + nhn * n.x * n.y),
                  s * (h->xz - n.x * hn.z - n.z * hn.x + nhn * n.x * n.z),
                  s * (h->yy - 2 * n.y * hn.y + nhn * n.y * n.y),
                  s * (h->yz - n.y * hn.z - n.z * hn.y + nhn * n.y * n.z),
                  s * (h->zz - 2 * n.z * hn.z + nhn * n.z * n.z)};
}

// One Newton step from the sample at the running foot. FOOT_DEEP: X is near or beyond a focal point of this foot, another side may be closer.
static void newton_step(const LimVessel *lim, Projection *t)
{
    const FieldJob *s = &t->at_foot;
    double slope2 = vec3_norm2(s->g), curl = 1 / lim->tree->radius[t->node];
    if (!(slope2 > 1e-200)) {
        t->state = FOOT_LOST;
        return;
    }
    double slope = sqrt(slope2), flat = 1 / slope;
    Vec3 n = vec3_scale(s->g, flat), away = vec3_sub(s->x, t->x), t1 = vec3_normal_to(n), t2 = vec3_cross(n, t1);
    double gap = -vec3_dot(away, n), rest1 = vec3_dot(away, t1), rest2 = vec3_dot(away, t2);
    Vec3 h1 = sym3_mul_vec(&s->h, t1), h2 = sym3_mul_vec(&s->h, t2);
    double s11 = vec3_dot(t1, h1) * flat, s12 = vec3_dot(t2, h1) * flat, s22 = vec3_dot(t2, h2) * flat;
    double m11 = 1 + gap * s11, m12 = gap * s12, m22 = 1 + gap * s22;
    if (m11 < 0.3 || m22 < 0.3 || (m11 - 0.3) * (m22 - 0.3) < m12 * m12) {
        if (!t->careful) {
            t->state = FOOT_DEEP;
            return;
        }
        // without the coupling and with bounded divisors it still descends, if slowly
        m11 = fmax(fabs(m11), 0.3), m22 = fmax(fabs(m22), 0.3), m12 = 0;
    }
    double over = 1 / (m11 * m22 - m12 * m12), y1 = -(m22 * rest1 - m12 * rest2) * over, y2 = -(m11 * rest2 - m12 * rest1) * over;
    double taubin = s->f * flat, along = sqrt(y1 * y1 + y2 * y2);
    if (fabs(taubin) > t->longest || along > t->longest) {
        if (!t->careful) {
            t->state = FOOT_LOST;
            return;
        }
        double shrink = along > t->longest ? t->longest / along : 1;
        y1 *= shrink, y2 *= shrink, along *= shrink;
        taubin = fmax(-t->longest, fmin(t->longest, taubin));
    }
    double nu = -(taubin + 0.5 * (y1 * y1 * s11 + 2 * y1 * y2 * s12 + y2 * y2 * s22));
    Vec3 p = t->at_foot.x = vec3_add_scaled(vec3_add_scaled(vec3_add_scaled(s->x, y1, t1), y2, t2), nu, n);
    // what the step leaves: of the foot's place (hence the normal) second order, of f/|g| third order, in units of the curvature
    curl += fabs(s11) + fabs(s22) + 2 * fabs(s12);
    if (curl * along * along > 1e-6 || fabs(nu) > 1e-4 || curl * (along + fabs(nu)) * (curl * along * along + fabs(nu)) > 1e-9)
        return;
    n = vec3_unit(vec3_add_scaled(vec3_add_scaled(n, y1 * s11 + y2 * s12, t1), y1 * s12 + y2 * s22, t2));   // the normal turns by S t
    t->foot = (Foot){p, n, shape_from(n, slope, &s->h), vec3_dot(vec3_sub(t->x, p), n), true};
    t->state = FOOT_DONE;
}

// Both rounds consume their list: those that are not done move to its front.
static void newton_rounds(const LimVessel *lim, Projection **left, int count, int rounds)
{
    FieldJob *job[BATCH];
    int n = count;
    for (int round = 0; round < rounds && n > 0; round++) {
        for (int i = 0; i < n; i++)
            job[i] = &left[i]->at_foot;
        lim->kernels->hessian(job, n, lim->tree->iso_level);
        int kept = 0;
        for (int i = 0; i < n; i++) {
            newton_step(lim, left[i]);
            if (left[i]->state == FOOT_PENDING)
                left[kept++] = left[i];
        }
        n = kept;
    }
    for (int i = 0; i < n; i++)
        left[i]->state = FOOT_LOST;
}

// From the sample at t->at_foot.x one step of the march towards the wall; true where it is within a twentieth of the radius of it.
static bool march_step(const LimVessel *lim, Projection *t)
{
    const VesselTree *tree = lim->tree;
    FieldJob *s = &t->at_foot;
    double radius = tree->radius[t->node], level = 1 / sqrt(tree->iso_level), slope = vec3_norm(s->g), sum = s->f + tree->iso_level;
    if (!(slope > 1e-12 * sum)) {
        // on a symmetric axis or at a lone blob's centre any way out is as good, the same one always
        s->x = vec3_add_scaled(s->x, radius, vec3_normal_to(tree->direction[t->node]));
        return false;
    }
    double w = 1 / sqrt(sum), step = fmax(2 * (w - level) / (w * w * w * slope), -1.2 * radius);   // < 0 inside: outwards
    s->x = vec3_add_scaled(s->x, step / slope, s->g);
    return fabs(step) < 0.05 * radius;
}

static void march_rounds(const LimVessel *lim, Projection **left, int count)
{
    enum { STEPS = 12 };
    FieldJob *job[BATCH];
    int n = 0;
    for (int i = 0; i < count; i++) {
        FieldJob *s = &left[i]->at_foot;
        s->x = left[i]->x, s->f = left[i]->at_x.f, s->g = left[i]->at_x.g;
        if (!march_step(lim, left[i]))
            left[n++] = left[i];
    }
    for (int round = 0; round < STEPS && n > 0; round++) {
        for (int i = 0; i < n; i++)
            job[i] = &left[i]->at_foot;
        lim->kernels->gradient(job, n, lim->tree->iso_level);
        int kept = 0;
        for (int i = 0; i < n; i++)
            if (!march_step(lim, left[i]))
                left[kept++] = left[i];
        n = kept;
    }
}

static void project_slowly(const LimVessel *lim, Projection *t)
{
    Blobby model = blobs_of(lim, t->node);
    SurfacePoint s = blobby_project(&model, t->x, t->x);
    t->foot = (Foot){s.foot, s.normal, s.shape, s.distance, s.converged};
    t->state = FOOT_DONE;
    if (!s.converged) {
        double slope = vec3_norm(t->at_x.g);
        t->foot.normal = vec3_unit_or(t->at_x.g, s.normal);
        t->foot.gap = slope > 1e-100 && fabs(t->at_x.f / slope) < fabs(s.distance) ? t->at_x.f / slope : s.distance;
        t->foot.shape = (Sym3){0, 0, 0, 0, 0, 0};
    }
}

static bool is_on_wrong_side(const Projection *t) { return (t->foot.gap > 0) != (t->at_x.f > 0) && fabs(t->foot.gap) > 1e-6; }

// A foot on the wrong side of the wall, or on a wall that stands further off than another, is not the closest.
static bool is_plausible(const LimVessel *lim, const Projection *t)
{
    if (t->state != FOOT_DONE || is_on_wrong_side(t))
        return false;
    // Newton's step on W, inside one blob never below the distance
    double sum = t->at_x.f + lim->tree->iso_level, w = 1 / sqrt(sum), slope = vec3_norm(t->at_x.g);
    return 2 * fabs(w - 1 / sqrt(lim->tree->iso_level)) > 0.8 * fabs(t->foot.gap) * (w * w * w * slope);
}

// Feet of up to BATCH points on the models of their nodes. Those that start from a remembered foot are FOOT_PENDING with it in at_foot.x.
static void project_batch(const LimVessel *lim, Projection *task, int count)
{
    Projection *some[BATCH], *rest[BATCH];
    FieldJob *job[BATCH];
    int n = 0, again = 0;
    for (int i = 0; i < count; i++) {
        job[i] = &task[i].at_x;
        task[i].longest = 0.5 * lim->tree->radius[task[i].node];
        if (task[i].state == FOOT_PENDING)
            some[n++] = &task[i];
    }
    lim->kernels->gradient(job, count, lim->tree->iso_level);
    newton_rounds(lim, some, n, 4);
    for (int i = 0; i < count; i++)
        if (!is_plausible(lim, &task[i]))
            rest[again++] = some[i] = &task[i];
        else
            some[i] = NULL;
    march_rounds(lim, rest, again);
    again = 0;
    for (int i = 0; i < count; i++)
        if (some[i]) {
            some[i]->state = FOOT_PENDING;
            some[i]->careful = true;
            some[i]->longest = lim->tree->radius[some[i]->node];
            rest[again++] = some[i];
        }
    newton_rounds(lim, rest, again, 12);
    for (int i = 0; i < count; i++)
        if (some[i] && (some[i]->state != FOOT_DONE || is_on_wrong_side(some[i])))
            project_slowly(lim, some[i]);
}

// S (I + gap S)^-1: curvatures k / (1 + gap k), the divisor held at 0.1 near focal points.
static Sym3 hessian_at_point(const Foot *foot)
{
    Vec3 n = foot->normal, t1 = vec3_normal_to(n), t2 = vec3_cross(n, t1), s1 = sym3_mul_vec(&foot->shape, t1);
    double a = vec3_dot(t1, s1), b = vec3_dot(t2, s1), c = sym3_quadratic(&foot->shape, t2), gap = foot->gap;
    double m11 = 1 + gap * a, m12 = gap * b, m22 = 1 + gap * c, det = m11 * m22 - m12 * m12, h11, h12, h22;
    if (m11 > 0.1 && m22 > 0.1 && (m11 - 0.1) * (m22 - 0.1) > m12 * m12) {
        // S and (I + gap S)^-1 commute
        h11 = (a * m22 - b * m12) / det, h12 = (b * m11 - a * m12) / det, h22 = (c * m11 - b * m12) / det;
    } else {
        double mean = 0.5 * (a + c), spread = sqrt(0.25 * (a - c) * (a - c) + b * b), angle = 0.5 * atan2(2 * b, a - c);
        double k1 = (mean + spread) / fmax(1 + gap * (mean + spread), 0.1), k2 = (mean - spread) / fmax(1 + gap * (mean - spread), 0.1);
        double cs = cos(angle), sn = sin(angle);
        h11 = k1 * cs * cs + k2 * sn * sn, h12 = (k1 - k2) * cs * sn, h22 = k1 * sn * sn + k2 * cs * cs;
    }
    Vec3 u = vec3_add_scaled(vec3_scale(t1, h11), h12, t2), v = vec3_add_scaled(vec3_scale(t1, h12), h22, t2);   // H = u t1' + v t2'
    return (Sym3){u.x * t1.x + v.x * t2.x, u.x * t1.y + v.x * t2.y, u.x * t1.z + v.x * t2.z,
                  u.y * t1.y + v.y * t2.y, u.y * t1.z + v.y * t2.z, u.z * t1.z + v.z * t2.z};
}

// --- The inlet ---

// The wall in the plane through X across the inlet's direction d. Used where the foot lies upstream of the inlet: the blobs close there, the vessel
// does not. False where that section holds no wall.
static bool project_in_section(const LimVessel *lim, int node, Vec3 x, Vec3 d, Foot *foot)
{
    enum { STEPS = 30 };
    const NodeModel *m = &lim->model[node];
    double level = 1 / sqrt(lim->tree->iso_level), radius = lim->tree->radius[node];
    Vec3 e1 = vec3_normal_to(d), p = x;
    for (int i = 0; i < STEPS; i++) {
        FieldJob s = {.group = m->group, .groups = m->groups, .x = p}, *job = &s;
        lim->kernels->hessian(&job, 1, lim->tree->iso_level);
        Vec3 g = vec3_add_scaled(s.g, -vec3_dot(s.g, d), d);
        double slope = vec3_norm(g), sum = s.f + lim->tree->iso_level, w = 1 / sqrt(sum);
        if (!(slope > 1e-9 * sum)) {
            p = vec3_add_scaled(p, radius, e1);
            continue;
        }
        double step = fmax(2 * (w - level) / (w * w * w * slope), -1.2 * radius);
        if (!(step < 10 * radius))
            return false;
        if (fabs(step) > 0.05 * radius) {
            p = vec3_add_scaled(p, step / slope, g);
            continue;
        }
        // Newton in the section: one tangent
        Vec3 n = vec3_scale(g, 1 / slope), t = vec3_cross(d, n), away = vec3_sub(p, x);
        double gap = -vec3_dot(away, n), k = sym3_quadratic(&s.h, t) / slope, y = -vec3_dot(away, t) / fmax(fabs(1 + gap * k), 0.2);
        y = fmax(-0.5 * radius, fmin(0.5 * radius, y));
        double nu = -(s.f / slope + 0.5 * k * y * y);
        p = vec3_add_scaled(vec3_add_scaled(p, y, t), nu, n);
        if (fabs(y) + fabs(nu) > 1e-7)
            continue;
        *foot = (Foot){.place = p, .normal = n, .gap = vec3_dot(vec3_sub(x, p), n), .sure = true};
        foot->shape = (Sym3){k * t.x * t.x, k * t.x * t.y, k * t.x * t.z, k * t.y * t.y, k * t.y * t.z, k * t.z * t.z};
        return true;
    }
    return false;
}

static bool upstream_of_inlet(const LimVessel *lim, Vec3 x)
{
    return lim->inlet_open && vec3_dot(vec3_sub(x, lim->tree->center[0]), lim->tree->direction[0]) < 0;
}

// --- The blended field ---

enum { BLEND_MAX = 8 };
// Models closer than this fraction of the radius are mixed; one that says something else altogether is a ghost and left out.
static const double BLEND_AGREE = 0.25;
// Half width of the mixed zone: a neighbour counts where its power distance exceeds the best by less than this part of the node spacing squared,
// 0 at the cell's border, 1 at its middle.
static const double BLEND_BAND = 0.75;

typedef struct Blend {
    int count;
    int node[BLEND_MAX];
    double weight[BLEND_MAX];
} Blend;

static double spacing2(const VesselTree *tree, int node)
{
    double sum = 0;
    int first = tree->neighbour_offset[node], end = tree->neighbour_offset[node + 1];
    for (int k = first; k < end; k++)
        sum += vec3_norm2(vec3_sub(tree->center[node], tree->center[tree->neighbour[k]]));
    return end > first ? sum / (end - first) : 0;
}

static void blend_add(const VesselTree *tree, Vec3 x, double best, int node, Blend *blend)
{
    for (int i = 0; i < blend->count; i++)
        if (blend->node[i] == node)
            return;
    double behind = power_distance(x, tree->center[node], tree->radius[node]) - best, band = BLEND_BAND * spacing2(tree, node);
    if (blend->count == BLEND_MAX || !(behind < band))
        return;
    double q = behind / band, w = 1 - q * q;
    blend->node[blend->count] = node;
    blend->weight[blend->count++] = behind <= 0 ? 1 : w * w;
}

// The node and those up to two links away whose cells are close: two, so that the set stays the same when the node changes.
static void blend_collect(const VesselTree *tree, Vec3 x, int node, Blend *blend)
{
    double best = power_distance(x, tree->center[node], tree->radius[node]);
    *blend = (Blend){.count = 1, .node = {node}, .weight = {1}};
    for (int k = tree->neighbour_offset[node]; k < tree->neighbour_offset[node + 1]; k++) {
        int next = tree->neighbour[k];
        blend_add(tree, x, best, next, blend);
        for (int l = tree->neighbour_offset[next]; l < tree->neighbour_offset[next + 1]; l++)
            if (tree->neighbour[l] != node)
                blend_add(tree, x, best, tree->neighbour[l], blend);
    }
}

static void sym3_accumulate(Sym3 *sum, double s, const Sym3 *a)
{
    sum->xx += s * a->xx, sum->xy += s * a->xy, sum->xz += s * a->xz;
    sum->yy += s * a->yy, sum->yz += s * a->yz, sum->zz += s * a->zz;
}

// A point of the batch whose own foot is known, to be mixed with its neighbours'.
typedef struct Mixture {
    VesselHit *hit;
    const Foot *own;
    double gap, total;
    Vec3 normal;
    Sym3 hessian;
} Mixture;

static void mix_in(const LimVessel *lim, Mixture *mix, const Projection *t, double weight)
{
    double q = (t->foot.gap - mix->own->gap) / (BLEND_AGREE * lim->tree->radius[mix->hit->node]);
    if (t->state != FOOT_DONE || !(fabs(q) < 1) || vec3_dot(t->foot.normal, mix->own->normal) < 0.5 ||
        (t->node == 0 && upstream_of_inlet(lim, t->foot.place)))
        return;
    double w = weight * (1 - q * q) * (1 - q * q);
    Sym3 h = hessian_at_point(&t->foot);
    mix->total += w;
    mix->gap += w * t->foot.gap;
    mix->normal = vec3_add_scaled(mix->normal, w, t->foot.normal);
    sym3_accumulate(&mix->hessian, w, &h);
}

// Projects the queued neighbours from the own feet of their points, and mixes them in, in order.
static void mix_queue(const LimVessel *lim, Projection *task, Mixture *const *owner, const double *weight, int count)
{
    Projection *all[BATCH];
    for (int i = 0; i < count; i++)
        all[i] = &task[i];
    newton_rounds(lim, all, count, 4);
    for (int i = 0; i < count; i++)
        mix_in(lim, owner[i], &task[i], weight[i]);
}

static void blend_batch(const LimVessel *lim, const Projection *own, VesselHit *const *hit, int count)
{
    Mixture mixture[BATCH], *owner[BATCH];
    Projection queue[BATCH];
    double weight[BATCH];
    int queued = 0;
    for (int i = 0; i < count; i++) {
        Blend blend;
        Mixture *mix = &mixture[i];
        *mix = (Mixture){hit[i], &own[i].foot, hit[i]->gap, 1, hit[i]->normal, hit[i]->hessian};
        blend_collect(lim->tree, own[i].x, own[i].node, &blend);
        for (int k = 1; k < blend.count; k++) {
            if (queued == BATCH) {
                mix_queue(lim, queue, owner, weight, queued);
                queued = 0;
            }
            owner[queued] = mix;
            weight[queued] = blend.weight[k];
            queue[queued] = new_projection(lim, blend.node[k], own[i].x);
            queue[queued].state = FOOT_PENDING;
            queue[queued].at_foot.x = own[i].foot.place;
            queue[queued++].longest = 0.5 * lim->tree->radius[own[i].node];
        }
    }
    mix_queue(lim, queue, owner, weight, queued);
    for (int i = 0; i < count; i++) {
        const Mixture *mix = &mixture[i];
        if (mix->total == 1)
            continue;
        mix->hit->gap = mix->gap / mix->total;
        mix->hit->normal = vec3_unit(mix->normal);
        mix->hit->hessian = (Sym3){0, 0, 0, 0, 0, 0};
        sym3_accumulate(&mix->hit->hessian, 1 / mix->total, &mix->hessian);
    }
}

// --- Queries ---

static VesselHit open_end(VesselMemory *memory, int node)
{
    memory->has_foot = false;
    memory->clearance = 0;
    return (VesselHit){.gap = HUGE_VAL, .node = node, .flags = VESSEL_OPEN_END};
}

// Answers where no field is needed; false where one is.
static bool answer_cheaply(const LimVessel *lim, Vec3 x, double reach, VesselMemory *memory, VesselHit *hit)
{
    const VesselTree *tree = lim->tree;
    *hit = (VesselHit){.node = memory->node};
    if (!vec3_is_finite(x) || !(vec3_norm2(x) < 1e100)) {
        hit->flags = VESSEL_UNSURE;
        return true;
    }
    int node = power_walk(tree, x, memory->node, lim->options.hops);
    if (node != memory->node)
        memory->clearance = 0;
    memory->node = hit->node = node;
    if (node == 0 && upstream_of_inlet(lim, x)) {
        *hit = open_end(memory, node);
        return true;
    }
    double agree = lim->options.field == LIM_BLEND ? BLEND_AGREE * tree->radius[node] : 0;
    double bound = lim->model[node].clear - vec3_distance(x, tree->center[node]);
    if (memory->clearance > 0)
        bound = fmax(bound, memory->clearance - vec3_distance(x, memory->place));
    hit->gap = bound - agree;
    hit->flags = VESSEL_FAR;
    return hit->gap > reach;
}

// The hit from a projection. True where it may be blended.
static bool answer_from_foot(const LimVessel *lim, Projection *t, VesselMemory *memory, VesselHit *hit)
{
    bool section = t->node == 0 && upstream_of_inlet(lim, t->foot.place);
    if (section && !project_in_section(lim, t->node, t->x, lim->tree->direction[0], &t->foot)) {
        *hit = open_end(memory, t->node);
        return false;
    }
    memory->has_foot = t->foot.sure;
    memory->foot = t->foot.place;
    memory->clearance = t->foot.sure && !section ? t->foot.gap : 0;
    memory->place = t->x;
    *hit = (VesselHit){t->foot.gap, t->foot.normal, hessian_at_point(&t->foot), t->node, t->foot.sure ? 0 : VESSEL_UNSURE};
    return t->foot.sure && !section;
}

static void query_batch(const LimVessel *lim, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    Projection task[BATCH];
    VesselHit *mixed[BATCH];
    int index[BATCH], n = 0, blended = 0;
    for (int i = 0; i < count; i++) {
        if (answer_cheaply(lim, point[i], reach, &memory[i], &hit[i]))
            continue;
        index[n] = i;
        task[n] = new_projection(lim, hit[i].node, point[i]);
        if (memory[i].has_foot) {
            task[n].state = FOOT_PENDING;
            task[n].at_foot.x = memory[i].foot;
        }
        n++;
    }
    project_batch(lim, task, n);
    for (int i = 0; i < n; i++)
        if (answer_from_foot(lim, &task[i], &memory[index[i]], &hit[index[i]])) {
            mixed[blended] = &hit[index[i]];
            if (blended != i)
                task[blended] = task[i];
            blended++;
        }
    if (lim->options.field == LIM_BLEND)
        blend_batch(lim, task, mixed, blended);
}

static void lim_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i += BATCH) {
        int n = count - i < BATCH ? count - i : BATCH;
        query_batch((const LimVessel *)vessel, n, point + i, reach, memory + i, hit + i);
    }
}

static int lim_locate(const Vessel *vessel, Vec3 point, int from)
{
    const LimVessel *lim = (const LimVessel *)vessel;
    return power_walk(lim->tree, point, from, INT_MAX);
}

static bool lim_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const LimVessel *lim = (const LimVessel *)vessel;
    *point = lim->tree->center[0];
    *direction = lim->tree->direction[0];
    return true;
}

static void lim_destroy(Vessel *vessel)
{
    LimVessel *lim = (LimVessel *)vessel;
    if (!lim)
        return;
    free(lim->group);
    free(lim->model);
    free(lim);
}

// --- Making one ---

// A node without blobs answers with those of its nearest ancestor that has some, else of the first node that has.
static void choose_sources(const VesselTree *tree, NodeModel *model)
{
    int first = 0;
    while (tree->blob_offset[first + 1] == tree->blob_offset[first])
        first++;
    for (int i = 0; i < tree->node_count; i++) {
        bool own = tree->blob_offset[i + 1] > tree->blob_offset[i];
        model[i].source = own ? i : i > 0 ? model[tree->parent[i]].source : first;
    }
}

static bool is_open_end(const VesselTree *tree)
{
    for (int k = tree->neighbour_offset[0]; k < tree->neighbour_offset[1]; k++) {
        Vec3 to = vec3_sub(tree->center[tree->neighbour[k]], tree->center[0]);
        if (vec3_dot(to, tree->direction[0]) < -0.5 * vec3_norm(to))
            return false;   // the tree goes on upstream of its root
    }
    return true;
}

static void fill_models(LimVessel *lim)
{
    const VesselTree *tree = lim->tree;
    BlobGroup *group = lim->group;
    choose_sources(tree, lim->model);
    for (int i = 0; i < tree->node_count; i++) {
        NodeModel *m = &lim->model[i];
        Blobby blobs = blobs_of(lim, i);
        m->groups = blob_groups_needed(blobs.count);
        if (m->source == i) {
            m->group = group;
            blob_groups_fill(group, &blobs);
            group += m->groups;
        } else {
            m->group = NULL;   // below, when all are filled
        }
        // a twentieth off, should the projection have found another side's foot
        SurfacePoint s = blobby_project(&blobs, tree->center[i], tree->center[i]);
        m->clear = s.converged && s.distance > 0 ? 0.95 * s.distance : -HUGE_VAL;
    }
    for (int i = 0; i < tree->node_count; i++)
        lim->model[i].group = lim->model[lim->model[i].source].group;
}

LimVesselOptions lim_vessel_default_options(void) { return (LimVesselOptions){.field = LIM_BLEND, .hops = 4, .isa = 0}; }

Vessel *lim_vessel_create_with(const VesselTree *tree, const LimVesselOptions *options)
{
    if (!tree || !vessel_tree_is_model(tree))
        return NULL;
    size_t groups = 0;
    for (int i = 0; i < tree->node_count; i++)
        groups += (size_t)blob_groups_needed(tree->blob_offset[i + 1] - tree->blob_offset[i]);
    LimVessel *lim = calloc(1, sizeof *lim);
    if (!lim)
        return NULL;
    lim->vessel = (Vessel){"lim", lim_query, lim_locate, lim_inlet, lim_destroy};
    lim->tree = tree;
    lim->options = *options;
    lim->options.hops = options->hops > 0 ? options->hops : 1;
    lim->kernels = blob_kernels(options->isa);
    lim->group = aligned_alloc(BLOB_GROUP_ALIGNMENT, groups * sizeof *lim->group);
    lim->model = calloc((size_t)tree->node_count, sizeof *lim->model);
    if (!lim->group || !lim->model) {
        lim_destroy(&lim->vessel);
        return NULL;
    }
    fill_models(lim);
    lim->inlet_open = is_open_end(tree);
    return &lim->vessel;
}

Vessel *lim_vessel_create(const VesselTree *tree)
{
    LimVesselOptions options = lim_vessel_default_options();
    return lim_vessel_create_with(tree, &options);
}
