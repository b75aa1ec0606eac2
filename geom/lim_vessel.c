// Contact with a fitted tree: topological tracking by power distance (Kerrien 2017, 6.2.1) and Newton projection onto the local model of the
// point's node (6.2.2, iterated: a single step is Taubin's distance, up to 2.3 times too long).
//
// A point goes through
//   1. power_walk from its last node;
//   2. bounds that cost no field: the distance is 1-Lipschitz, so gap(X) >= gap(C) - |X - C| for the node's centre C, and
//      gap(X) >= clearance - |X - X_then| for the place where that was last made sure of;
//   3. one value of the field at X: its sign, and an estimate that shows when another wall has come closer than the remembered one;
//   4. Newton (foot_lanes.h) from where the remembered foot should have moved to: p + (I + gap S)^-1 P (X - X_then);
//   5. where that fails, a march from X along the gradient, then again 4; where that fails, blobby_project (slow, robust).
// The march works on W = (f + T)^(-1/2) - T^(-1/2), which for one blob is a paraboloid |X - C|^2 - r^2 up to scale: Newton on it from outside never
// overshoots and arrives from any distance, where f itself is flat.
#include "geom/foot_lanes.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"

#include <limits.h>
#include <stdlib.h>

typedef struct NodeModel {
    const BlobGroup *group;
    int groups;
    int source;              // the node whose blobs these are: itself, or the nearest relative where it has none
    double band;             // [mm^2] width of the zone in which it is mixed, in power distance
    double clear;            // [mm] true distance from the node's centre to the wall of this model, less a margin; < 0: no bound
} NodeModel;

typedef struct LimVessel {
    Vessel vessel;           // first: a Vessel * to us is a LimVessel *
    const VesselTree *tree;
    LimVesselOptions options;
    const LaneKernels *kernels;
    BlobGroup *group;        // all nodes' groups
    NodeModel *model;        // (N)
    bool inlet_open;         // the root is an end of the tree
} LimVessel;

// Points of a query are taken in batches, and each batch in stages (all fields at X, all first Newton steps, …), see foot_lanes.h. A point's answer
// does not depend on its batch. What the lanes do not hold:
typedef struct Lane {
    int point;               // of the query
    int node;
    bool sure, again;
    bool checked;            // no other wall stands within 0.7 gap
    double weight;           // in a blend
} Lane;

static Vec3 lane_point(const FootBatch *b, int i) { return vec3(b->xx[i], b->xy[i], b->xz[i]); }
static Vec3 lane_foot(const FootBatch *b, int i) { return vec3(b->px[i], b->py[i], b->pz[i]); }
static Vec3 lane_normal(const FootBatch *b, int i) { return vec3(b->nx[i], b->ny[i], b->nz[i]); }
static Sym3 lane_hessian(const FootBatch *b, int i) { return (Sym3){b->axx[i], b->axy[i], b->axz[i], b->ayy[i], b->ayz[i], b->azz[i]}; }

static Blobby blobs_of(const LimVessel *lim, int node)
{
    const VesselTree *tree = lim->tree;
    int64_t first = tree->blob_offset[lim->model[node].source], end = tree->blob_offset[lim->model[node].source + 1];
    return (Blobby){(int)(end - first), tree->blob_center + first, tree->blob_width + first, tree->iso_level};
}

// Where Newton gives up at once the answer must still be numbers for the stages that run over whole blocks.
static void clear_answer(FootBatch *b, int i)
{
    b->nx[i] = b->ny[i] = b->nz[i] = b->gap[i] = b->k1[i] = b->k2[i] = 0;
    b->sxx[i] = b->sxy[i] = b->sxz[i] = b->syy[i] = b->syz[i] = b->szz[i] = 0;
}

// [mm] what Newton may leave: of a foot that was followed, of one found afresh, of a neighbour's that is mixed in with its weight.
static const double REST_FOLLOWED = 1e-8, REST_FRESH = 1e-9, REST_MIXED = 1e-5;

static void set_lane(const LimVessel *lim, FootBatch *b, int i, int node, Vec3 x, Vec3 start, double allowed)
{
    const NodeModel *m = &lim->model[node];
    b->group[i] = m->group;
    b->groups[i] = m->groups;
    b->xx[i] = x.x, b->xy[i] = x.y, b->xz[i] = x.z;
    b->px[i] = start.x, b->py[i] = start.y, b->pz[i] = start.z;
    b->radius[i] = lim->tree->radius[node];
    b->longest[i] = 0.5 * b->radius[i];
    b->careful[i] = 0;
    b->allowed[i] = allowed;
    b->state[i] = FOOT_PENDING;
    clear_answer(b, i);
}

// Lanes are computed in whole blocks: those beyond the last in use get numbers, and nothing waits for them.
static void fill_block(FootBatch *b, int count)
{
    for (int i = count; i % FOOT_BLOCK != 0; i++) {
        b->xx[i] = b->xy[i] = b->xz[i] = b->px[i] = b->py[i] = b->pz[i] = b->careful[i] = 0;
        b->radius[i] = b->longest[i] = b->allowed[i] = 1;
        b->f[i] = b->gx[i] = b->gy[i] = b->gz[i] = 0;
        b->hxx[i] = b->hxy[i] = b->hxz[i] = b->hyy[i] = b->hyz[i] = b->hzz[i] = 0;
        clear_answer(b, i);
        b->state[i] = FOOT_LOST;
    }
}

// At most `rounds` Newton steps of the pending lanes; those that are not done then are lost.
static void newton_rounds(const LimVessel *lim, FootBatch *b, int count, int rounds)
{
    int lane[FOOT_BATCH];
    for (int round = 0; round < rounds; round++) {
        int n = 0;
        for (int i = 0; i < count; i++)
            if (b->state[i] == FOOT_PENDING)
                lane[n++] = i;
        if (n == 0)
            return;
        lim->kernels->hessian(b, lane, n, lim->tree->iso_level);
        lim->kernels->newton(b, count);
    }
    for (int i = 0; i < count; i++)
        if (b->state[i] == FOOT_PENDING)
            b->state[i] = FOOT_LOST;
}

// From the sample at the running foot one step of the march towards the wall; true where it is within a twentieth of the radius of it.
static bool march_step(const LimVessel *lim, FootBatch *b, int i, int node)
{
    const VesselTree *tree = lim->tree;
    Vec3 g = {b->gx[i], b->gy[i], b->gz[i]}, p = lane_foot(b, i);
    // inside a vessel the side wall is nearer than its ends, though near the axis the field may fall faster towards those
    if (b->inside[i] > 0 && tree->kind[node] == NODE_VESSEL)
        g = vec3_add_scaled(g, -vec3_dot(g, tree->direction[node]), tree->direction[node]);
    double radius = tree->radius[node], level = 1 / sqrt(tree->iso_level), slope = vec3_norm(g), sum = b->f[i] + tree->iso_level, step = radius;
    if (slope > 1e-12 * sum) {
        double w = 1 / sqrt(sum);
        step = fmax(2 * (w - level) / (w * w * w * slope), -1.2 * radius);   // < 0 inside: outwards
        p = vec3_add_scaled(p, step / slope, g);
    } else {
        // on a symmetric axis or at a lone blob's centre any way out is as good, the same one always
        p = vec3_add_scaled(p, radius, vec3_normal_to(tree->direction[node]));
    }
    b->px[i] = p.x, b->py[i] = p.y, b->pz[i] = p.z;
    return fabs(step) < 0.05 * radius;
}

static void march_rounds(const LimVessel *lim, FootBatch *b, const Lane *of, int *lane, int count)
{
    enum { STEPS = 13 };
    for (int k = 0; k < count; k++)
        b->px[lane[k]] = b->xx[lane[k]], b->py[lane[k]] = b->xy[lane[k]], b->pz[lane[k]] = b->xz[lane[k]];
    for (int round = 0; round < STEPS && count > 0; round++) {
        lim->kernels->gradient(b, lane, count, lim->tree->iso_level);
        int kept = 0;
        for (int k = 0; k < count; k++)
            if (!march_step(lim, b, lane[k], of[lane[k]].node))
                lane[kept++] = lane[k];
        count = kept;
    }
}

static void project_slowly(const LimVessel *lim, FootBatch *b, int i, Lane *of)
{
    Blobby model = blobs_of(lim, of->node);
    Vec3 x = lane_point(b, i), g, normal;
    SurfacePoint s = blobby_project(&model, x, x);
    double f = blobby_gradient(&model, x, &g), slope = vec3_norm(g), mean = 0.5 * sym3_trace(&s.shape);
    const Sym3 *h = &s.shape;
    of->sure = s.converged;
    normal = s.normal;
    if (!s.converged) {
        // Taubin's distance along the gradient, or what little is known: a flat wall there
        double gap = slope > 1e-100 && fabs(f / slope) < fabs(s.distance) ? f / slope : s.distance;
        normal = vec3_unit_or(g, s.normal);
        s.foot = vec3_add_scaled(x, -gap, normal);
        s.shape = (Sym3){0, 0, 0, 0, 0, 0};
        mean = 0;
    }
    double frobenius2 = h->xx * h->xx + h->yy * h->yy + h->zz * h->zz + 2 * (h->xy * h->xy + h->xz * h->xz + h->yz * h->yz);
    double spread = sqrt(fmax(0.5 * frobenius2 - mean * mean, 0));
    b->px[i] = s.foot.x, b->py[i] = s.foot.y, b->pz[i] = s.foot.z;
    b->nx[i] = normal.x, b->ny[i] = normal.y, b->nz[i] = normal.z;
    b->k1[i] = mean + spread, b->k2[i] = mean - spread;
    b->sxx[i] = h->xx, b->sxy[i] = h->xy, b->sxz[i] = h->xz, b->syy[i] = h->yy, b->syz[i] = h->yz, b->szz[i] = h->zz;
    b->state[i] = FOOT_DONE;
}

static bool is_on_wrong_side(const FootBatch *b, int i) { return (b->gap[i] > 0) != (b->inside[i] > 0) && fabs(b->gap[i]) > 1e-6; }

// Feet of `count` lanes on the models of their nodes; `again` marks those without a start. A foot on the wrong side of the wall, or on a wall that
// stands further off than another, is not the closest: those start once more from X.
static void project_batch(const LimVessel *lim, FootBatch *b, Lane *of, int count)
{
    FootLane start[3];
    int lane[FOOT_BATCH], n = 0;
    for (int i = 0; i < count; i++) {
        start[0][i] = b->px[i], start[1][i] = b->py[i], start[2][i] = b->pz[i];
        b->px[i] = b->xx[i], b->py[i] = b->xy[i], b->pz[i] = b->xz[i];
        lane[i] = i;
        of[i].sure = true;
        if (of[i].again)
            b->state[i] = FOOT_LOST;
    }
    fill_block(b, count);
    lim->kernels->gradient(b, lane, count, lim->tree->iso_level);
    lim->kernels->estimate(b, count, lim->tree->iso_level);
    for (int i = 0; i < count; i++)
        b->px[i] = start[0][i], b->py[i] = start[1][i], b->pz[i] = start[2][i];
    newton_rounds(lim, b, count, 4);
    lim->kernels->finish(b, count);
    for (int i = 0; i < count; i++) {
        of[i].again = b->state[i] != FOOT_DONE || is_on_wrong_side(b, i) || !(b->estimate[i] > 0.8 * fabs(b->gap[i]));
        if (of[i].again)
            lane[n++] = i;
    }
    if (n == 0)
        return;
    march_rounds(lim, b, of, lane, n);
    for (int i = 0; i < count; i++)
        if (of[i].again) {
            b->state[i] = FOOT_PENDING;
            b->careful[i] = 1;
            b->allowed[i] = REST_FRESH;
            b->longest[i] = b->radius[i];
        }
    newton_rounds(lim, b, count, 12);
    lim->kernels->finish(b, count);
    bool slow = false;
    for (int i = 0; i < count; i++)
        if (of[i].again && (b->state[i] != FOOT_DONE || is_on_wrong_side(b, i))) {
            project_slowly(lim, b, i, &of[i]);
            slow = true;
        }
    if (slow)
        lim->kernels->finish(b, count);
}

// A foot far off is the locally closest, but is it the closest? Looks on a sphere of 0.9 times its distance about X in 14 directions, at most 36 degrees
// apart from any other: all inside means that no (flat) wall is nearer than 0.7 gap. What fails is projected anew, slowly and thoroughly. Asked only
// where the clearance of an earlier check has been used up; near the wall the estimate serves.
static void check_batch(const LimVessel *lim, FootBatch *b, Lane *of, int count, const VesselMemory *memory)
{
    static const double c = 0.57735026918962573;   // 1 / sqrt 3
    const double way[14][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {c, c, c},
                               {c, c, -c}, {c, -c, c}, {c, -c, -c}, {-c, c, c}, {-c, c, -c}, {-c, -c, c}, {-c, -c, -c}};
    int lane[FOOT_BATCH], n = 0;
    FootLane foot[3];
    for (int i = 0; i < count; i++) {
        const VesselMemory *m = &memory[of[i].point];
        double known = m->clearance > 0 ? m->clearance - vec3_distance(lane_point(b, i), m->clear_place) : 0;
        of[i].checked = of[i].sure && b->gap[i] > 0.3 * b->radius[i] && known < 0.5 * b->gap[i];
        if (!of[i].checked)
            continue;
        foot[0][i] = b->px[i], foot[1][i] = b->py[i], foot[2][i] = b->pz[i];
        lane[n++] = i;
    }
    bool slow = false, bad[FOOT_BATCH] = {false};
    for (int k = 0; k < 14 && n > 0; k++) {
        for (int j = 0; j < n; j++) {
            int i = lane[j];
            double r = 0.9 * b->gap[i];
            b->px[i] = b->xx[i] + r * way[k][0], b->py[i] = b->xy[i] + r * way[k][1], b->pz[i] = b->xz[i] + r * way[k][2];
        }
        lim->kernels->gradient(b, lane, n, lim->tree->iso_level);
        for (int j = 0; j < n; j++)
            bad[lane[j]] = bad[lane[j]] || !(b->f[lane[j]] > 0);
    }
    for (int j = 0; j < n; j++) {
        int i = lane[j];
        b->px[i] = foot[0][i], b->py[i] = foot[1][i], b->pz[i] = foot[2][i];
        if (bad[i]) {
            project_slowly(lim, b, i, &of[i]);
            of[i].checked = of[i].sure;
            slow = true;
        }
    }
    if (slow)
        lim->kernels->finish(b, count);
}

// --- The inlet ---

// The wall in the plane through X across the inlet's direction d. Used where the foot lies upstream of the inlet: the blobs close there, the vessel
// does not. False where that section holds no wall.
static bool project_in_section(const LimVessel *lim, int node, Vec3 x, Vec3 d, VesselHit *hit, Vec3 *foot)
{
    enum { STEPS = 30 };
    Blobby model = blobs_of(lim, node);
    double level = 1 / sqrt(lim->tree->iso_level), radius = lim->tree->radius[node];
    Vec3 p = x;
    for (int i = 0; i < STEPS; i++) {
        Vec3 g;
        Sym3 h;
        double f = blobby_hessian(&model, p, &g, &h);
        g = vec3_add_scaled(g, -vec3_dot(g, d), d);
        double slope = vec3_norm(g), sum = f + lim->tree->iso_level, w = 1 / sqrt(sum);
        if (!(slope > 1e-9 * sum)) {
            p = vec3_add_scaled(p, radius, vec3_normal_to(d));
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
        double gap = -vec3_dot(away, n), k = sym3_quadratic(&h, t) / slope, y = -vec3_dot(away, t) / fmax(fabs(1 + gap * k), 0.2);
        y = fmax(-0.5 * radius, fmin(0.5 * radius, y));
        double nu = -(f / slope + 0.5 * k * y * y);
        p = vec3_add_scaled(vec3_add_scaled(p, y, t), nu, n);
        if (fabs(y) + fabs(nu) > 1e-7)
            continue;
        k /= fmax(1 + gap * k, 0.1);
        hit->gap = vec3_dot(vec3_sub(x, p), n);
        hit->normal = n;
        hit->hessian = (Sym3){k * t.x * t.x, k * t.x * t.y, k * t.x * t.z, k * t.y * t.y, k * t.y * t.z, k * t.z * t.z};
        *foot = p;
        return true;
    }
    return false;
}

static bool upstream_of_inlet(const LimVessel *lim, Vec3 x)
{
    return lim->inlet_open && vec3_dot(vec3_sub(x, lim->tree->center[0]), lim->tree->direction[0]) < 0;
}

// --- The blended field ---

enum { BLEND_MAX = 8 };   // the own node and the first seven of those near it
// Models that differ by less than this are mixed, ever less the more they differ: half the radius, and never so much that the mixed wall
// leaves the own model's by more than 0.15 mm (0.18 of it, for one neighbour). One that says something else altogether is a ghost and left out.
// On the angiogram's model neighbours differ by up to 0.3 mm in sharp bends; mixing up to 0.25 mm only left steps in the wall that threw the
// wire 0.3 mm out, where this leaves 0.09 mm.
static double blend_agree(double radius) { return fmin(0.5 * radius, 0.8); }
// The mixed gap is less than the own model's by no more than this: sum w q / (1 + sum w) < 1/2 of the above for a few neighbours, w = (1 - q^2)^2.
static double blend_least(double radius) { return 0.5 * blend_agree(radius); }
// Half width of the mixed zone: a neighbour counts where its power distance exceeds the best by less than this part of the node spacing squared,
// which is 0 at the cell's border and 1 at its middle.
static const double BLEND_BAND = 2;

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

static void blend_add(const LimVessel *lim, Vec3 x, double best, int node, Blend *blend)
{
    double behind = power_distance(x, lim->tree->center[node], lim->tree->radius[node]) - best, band = lim->model[node].band;
    if (blend->count == BLEND_MAX || !(behind < band))
        return;
    double q = behind / band, w = 1 - q * q;
    blend->node[blend->count] = node;
    blend->weight[blend->count++] = behind <= 0 ? 1 : w * w;
}

// The node and those near it in the tree whose cells are close: at a mouth or a carina the cell across the border may be several links away.
static void blend_collect(const LimVessel *lim, Vec3 x, int node, Blend *blend)
{
    const VesselTree *tree = lim->tree;
    double best = power_distance(x, tree->center[node], tree->radius[node]);
    *blend = (Blend){.count = 1, .node = {node}, .weight = {1}};
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++)
        blend_add(lim, x, best, tree->near[k], blend);
}

static void sym3_accumulate(Sym3 *sum, double s, const Sym3 *a)
{
    sum->xx += s * a->xx, sum->xy += s * a->xy, sum->xz += s * a->xz;
    sum->yy += s * a->yy, sum->yz += s * a->yz, sum->zz += s * a->zz;
}

// A hit of the batch to be mixed with its neighbours' answers.
typedef struct Mixture {
    VesselHit *hit;
    double gap, total;       // weighted sums
    Vec3 normal;
    Sym3 hessian;
} Mixture;

static void mix_in(const LimVessel *lim, Mixture *mix, const FootBatch *b, int i, const Lane *of)
{
    double q = (b->gap[i] - mix->hit->gap) / blend_agree(lim->tree->radius[mix->hit->node]);
    if (b->state[i] != FOOT_DONE || !(fabs(q) < 1) || vec3_dot(lane_normal(b, i), mix->hit->normal) < 0.5 ||
        (of->node == 0 && upstream_of_inlet(lim, lane_foot(b, i))))
        return;
    double w = of->weight * (1 - q * q) * (1 - q * q);
    Sym3 h = lane_hessian(b, i);
    mix->total += w;
    mix->gap += w * b->gap[i];
    mix->normal = vec3_add_scaled(mix->normal, w, lane_normal(b, i));
    sym3_accumulate(&mix->hessian, w, &h);
}

// Projects the queued neighbours from the own feet of their points, and mixes them in, in order. of[].point is the mixture.
static void mix_queue(const LimVessel *lim, FootBatch *b, const Lane *of, int count, Mixture *mixture)
{
    fill_block(b, count);
    newton_rounds(lim, b, count, 4);
    lim->kernels->finish(b, count);
    for (int i = 0; i < count; i++)
        mix_in(lim, &mixture[of[i].point], b, i, &of[i]);
}

static void blend_batch(const LimVessel *lim, const FootBatch *own, const Lane *own_of, int count, double reach, VesselHit *hit)
{
    Mixture mixture[FOOT_BATCH];
    FootBatch queue;
    Lane of[FOOT_BATCH];
    int queued = 0;
    for (int i = 0; i < count; i++) {
        Blend blend;
        VesselHit *h = &hit[own_of[i].point];
        mixture[i] = (Mixture){h, h->gap, 1, h->normal, h->hessian};
        if (!own_of[i].sure || h->gap - blend_least(own->radius[i]) > reach)
            continue;
        Vec3 x = lane_point(own, i);
        blend_collect(lim, x, own_of[i].node, &blend);
        for (int k = 1; k < blend.count; k++) {
            if (queued == FOOT_BATCH) {
                mix_queue(lim, &queue, of, queued, mixture);
                queued = 0;
            }
            of[queued] = (Lane){.point = i, .node = blend.node[k], .weight = blend.weight[k]};
            set_lane(lim, &queue, queued++, blend.node[k], x, lane_foot(own, i), REST_MIXED);
        }
    }
    mix_queue(lim, &queue, of, queued, mixture);
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
    double mixed = lim->options.field == LIM_BLEND ? blend_least(tree->radius[node]) : 0;
    double bound = lim->model[node].clear - vec3_distance(x, tree->center[node]);
    if (memory->clearance > 0)
        bound = fmax(bound, memory->clearance - vec3_distance(x, memory->clear_place));
    hit->gap = bound - mixed;
    hit->flags = VESSEL_FAR;
    return hit->gap > reach;
}

// Where the foot should be now: t = (I + gap S)^-1 P dx = P dx - gap H dx along the wall, H the gap's Hessian then; and t'S t / 2 = t'H dx / 2 down with it.
static Vec3 predicted_foot(const VesselMemory *memory, Vec3 x, double radius)
{
    Vec3 move = vec3_sub(x, memory->place), n = memory->normal, bend = sym3_mul_vec(&memory->hessian, move);
    double gap = vec3_dot(vec3_sub(memory->place, memory->foot), n);
    Vec3 shift = vec3_add_scaled(vec3_add_scaled(move, -vec3_dot(move, n), n), -gap, bend);
    if (!(vec3_norm2(shift) < 0.04 * radius * radius))
        return memory->foot;
    return vec3_add_scaled(vec3_add(memory->foot, shift), -0.5 * vec3_dot(shift, bend), n);
}

// The hit of a lane. False where the inlet decided, and there is nothing to blend.
static bool answer_from_foot(const LimVessel *lim, const FootBatch *b, int i, const Lane *of, VesselMemory *memory, VesselHit *hit)
{
    Vec3 x = lane_point(b, i), foot = lane_foot(b, i);
    *hit = (VesselHit){b->gap[i], lane_normal(b, i), lane_hessian(b, i), of->node, of->sure ? 0 : VESSEL_UNSURE};
    bool section = of->node == 0 && upstream_of_inlet(lim, foot);
    if (section && !project_in_section(lim, of->node, x, lim->tree->direction[0], hit, &foot)) {
        *hit = open_end(memory, of->node);
        return false;
    }
    if (section)
        hit->flags = 0;
    memory->has_foot = of->sure || section;
    if (of->checked && !section) {
        memory->clearance = fmax(0.7 * hit->gap, 0);
        memory->clear_place = x;
    }
    memory->foot = foot;
    memory->place = x;
    memory->normal = hit->normal;
    memory->hessian = hit->hessian;
    return !section;
}

static void query_batch(const LimVessel *lim, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    FootBatch batch;
    Lane of[FOOT_BATCH];
    int n = 0;
    for (int i = 0; i < count; i++) {
        if (answer_cheaply(lim, point[i], reach, &memory[i], &hit[i]))
            continue;
        int node = hit[i].node;
        of[n] = (Lane){.point = i, .node = node, .again = !memory[i].has_foot};
        set_lane(lim, &batch, n++, node, point[i],
                 memory[i].has_foot ? predicted_foot(&memory[i], point[i], lim->tree->radius[node]) : point[i], REST_FOLLOWED);
    }
    if (n == 0)
        return;
    project_batch(lim, &batch, of, n);
    check_batch(lim, &batch, of, n, memory);
    for (int i = 0; i < n; i++)
        of[i].sure = answer_from_foot(lim, &batch, i, &of[i], &memory[of[i].point], &hit[of[i].point]) && of[i].sure;
    if (lim->options.field == LIM_BLEND)
        blend_batch(lim, &batch, of, n, reach, hit);
}

static void lim_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i += FOOT_BATCH) {
        int n = count - i < FOOT_BATCH ? count - i : FOOT_BATCH;
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
        m->band = BLEND_BAND * spacing2(tree, i);
        // less than what was found, should that be another side's foot
        SurfacePoint s = blobby_project(&blobs, tree->center[i], tree->center[i]);
        m->clear = s.converged && s.distance > 0 ? fmin(0.95 * s.distance, tree->radius[i]) : -HUGE_VAL;
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
    lim->kernels = lane_kernels(options->isa);
    lim->group = aligned_alloc(BLOB_GROUP_ALIGNMENT, groups * sizeof *lim->group);
    lim->model = calloc((size_t)tree->node_count, sizeof *lim->model);
    if (!lim->group || !lim->model) {
        lim_destroy(&lim->vessel);
        return NULL;
    }
    fill_models(lim);
    lim->inlet_open = vessel_tree_root_is_open(tree);
    return &lim->vessel;
}

Vessel *lim_vessel_create(const VesselTree *tree)
{
    LimVesselOptions options = lim_vessel_default_options();
    return lim_vessel_create_with(tree, &options);
}
