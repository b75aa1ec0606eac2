// Contact with a fitted tree: topological tracking by power distance (Kerrien et al. 2017, 6.2.1) and Newton projection onto the local model of the point's
// node (6.2.2, iterated: a single step is Taubin's distance, up to 2.3 times too long).
//
// A point goes through these stages:
//   1. the planes between its node's cell and the near cells (NearGroup); if another cell is better, power_walk;
//   2. bounds that need no field: the distance is 1-Lipschitz, so gap(X) >= gap(C) - |X - C| for the node's centre C, and
//      gap(X) >= clearance - |X - X_then| for the last point where the clearance was verified;
//   3. one value of the field at X: its sign, and an estimate that shows when another wall has come closer than the remembered one;
//   4. Newton (foot_lanes.h) from the predicted position of the remembered foot, p + (I + gap S)^-1 P (X - X_then); near focal points with bounded
//      steps of |I + gap S|^-1;
//   5. if that fails, a march from X along the gradient, then stage 4 again; if that fails, blobby_project (slow, robust);
//   6. near the wall, the partners: models of adjacent cells, evaluated at the own foot and blended in.
// The march works on W = (f + T)^(-1/2) - T^(-1/2), which for one blob is a paraboloid |X - C|^2 - r^2 up to scale: Newton on it from outside never overshoots
// and converges from any distance, where f itself is flat.
//
// The inlet. Blobs close upstream of the root, the vessel does not. With z the height over the root's plane along its direction d, models near it are evaluated
// at X + (zeta(z) - z) d instead of X: zeta = z downstream of h = r / 2, 0 upstream of -h, with a continuous second derivative between. So the section at the
// root continues upstream as a cylinder without end, and wall, normal and Hessian are smooth across the plane.
//
// Time per point (80 points creeping 0.05 mm a step, AVX-512, phantom to aneurism, ns): fields and Newton 44 to 65, of which second steps 14 to 35; evaluation
// at X where a foot is not trusted 3 to 6; cell test 18 to 26; loading and storing lanes 25; partners 37 to 66. None of these grows with the tree. Tried and
// rejected: blob terms with fewer products (2 % gain), second steps from value and gradient alone (3 %, and the Hessian is not that of the foot), a prediction
// that includes the change of the gap (no gain: the remaining error is the waviness of the wall itself), memories and hits transposed in registers (slower with
// AVX2), lanes ordered by model size, prefetched blobs, cell tests of a whole batch in one call (0 to 1 %), second steps side by side (1 %).
#include "geom/foot_lanes.h"
#include "base/base.h"
#include "geom/power_blocks.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"

#include <limits.h>
#include <stdlib.h>

typedef struct NodeModel {
    const BlobGroup *group;
    const NearGroup *near;
    int groups;
    int near_groups, all_near;   // number of groups of planes: those that matter within the node's ball, see fill_near, and all
    int source;              // the node whose blobs these are: itself, or the nearest relative if it has none
    bool carried;            // near the inlet: the wall continues upstream
    double radius, bend;     // [mm]; bend: its inverse
    Vec3 center;
    double unique;           // [mm] a foot in this cell at a smaller distance is the closest: see unique_distance
    double ball2;            // [mm^2] (1.2 r)^2: beyond it, power_walk also searches other nodes
    double least;            // [mm] blend_least; 0 if nothing is blended
    double clear;            // [mm] distance from the node's centre to the wall of this model, minus a margin; < 0: unknown
} NodeModel;

typedef struct LimVessel {
    Vessel vessel;           // first: a Vessel * points to its LimVessel
    const VesselTree *tree;
    LimVesselOptions options;
    const LaneKernels *kernels;
    BlobGroup *group;        // all nodes' groups
    NearGroup *near;
    NodeModel *model;        // (N)
    PowerBlocks blocks;      // to locate points without a node
    bool inlet_open;         // the root is an open end of the tree
} LimVessel;

// The points of a query are processed in batches, and each batch in stages (all fields at X, all first Newton steps, …), see foot_lanes.h. A point's result
// does not depend on its batch. Data per point that the lanes do not hold:
enum { PARTNERS_MAX = 7 };
typedef struct Lane {
    int point;               // index in the query
    int node;
    bool sure, again;
    bool at_home;            // still within the node's ball
    bool trusted;            // no other wall can be closer: the field at X is not evaluated
    bool checked;            // no other wall lies within 0.7 gap
    int partners;            // number of nodes whose models are blended in
    int partner[PARTNERS_MAX];
    float weight[PARTNERS_MAX];
} Lane;

// A batch's lanes, those with most partners first, so that the lanes with a k-th partner are consecutive.
typedef struct LaneBatch {
    int count;
    Lane *of[FOOT_BATCH];
    int untrusted_count, untrusted[FOOT_BATCH + 1]; // the lanes that are not trusted
    FootBatch foot;
    FootSample at_x;         // fields at X of these lanes, consecutively
    Lane lane[FOOT_BATCH];   // in the order of the points
} LaneBatch;

static Vec3 lane_point(const FootBatch *b, int i) { return vec3(b->xx[i], b->xy[i], b->xz[i]); }
static Vec3 lane_foot(const FootBatch *b, int i) { return vec3(b->at.x[i], b->at.y[i], b->at.z[i]); }
static Vec3 lane_normal(const FootBatch *b, int i) { return vec3(b->nx[i], b->ny[i], b->nz[i]); }
static Sym3 lane_hessian(const FootBatch *b, int i) { return (Sym3){b->axx[i], b->axy[i], b->axz[i], b->ayy[i], b->ayz[i], b->azz[i]}; }

static Blobby blobs_of(const LimVessel *lim, int node)
{
    SEL_ASSERT(node >= 0 && node < lim->tree->node_count, "models belong to nodes of the tree");
    return blobby_of(lim->tree, lim->model[node].source);
}

// --- The inlet ---

static double inlet_height(const LimVessel *lim, Vec3 x) { return vec3_dot(vec3_sub(x, lim->tree->center[0]), lim->tree->direction[0]); }
static double inlet_zone(const LimVessel *lim) { return 0.5 * lim->tree->radius[0]; }   // h

// zeta(z) and its first two derivatives.
static double carried_height(double z, double h, double *slope, double *bend)
{
    if (z >= h) {
        *slope = 1, *bend = 0;
        return z;
    }
    double u = fmax(0.5 * (z / h + 1), 0);
    *slope = u * u * (3 - 2 * u);
    *bend = 3 * u * (1 - u) / h;
    return h * u * u * u * (2 - u);
}

// Sums of the fields; near the inlet, of the fields that continue upstream.
static void sample(const LimVessel *lim, FootSample *s, const int *lane, int count, bool hessian)
{
    SEL_ASSERT(count >= 0 && count <= FOOT_BATCH, "a batch has no more lanes than samples");
    void (*kernel)(FootSample *, const int *, int, double) = hessian ? lim->kernels->hessian : lim->kernels->gradient;
    if (!s->any_carried) {
        kernel(s, lane, count, lim->tree->iso_level);
        return;
    }
    Vec3 at[FOOT_BATCH], d = lim->tree->direction[0];
    double slope[FOOT_BATCH], bend[FOOT_BATCH];
    for (int k = 0; k < count; k++) {
        int i = lane[k];
        at[k] = vec3(s->x[i], s->y[i], s->z[i]);
        double z = inlet_height(lim, at[k]), to = s->carried[i] ? carried_height(z, inlet_zone(lim), &slope[k], &bend[k]) : z;
        if (to == z)
            slope[k] = 1, bend[k] = 0;
        s->x[i] += (to - z) * d.x, s->y[i] += (to - z) * d.y, s->z[i] += (to - z) * d.z;
    }
    kernel(s, lane, count, lim->tree->iso_level);
    for (int k = 0; k < count; k++) {
        int i = lane[k];
        s->x[i] = at[k].x, s->y[i] = at[k].y, s->z[i] = at[k].z;
        if (slope[k] == 1)
            continue;
        // with J = I + c d d': J g, J H J + (g.d) zeta'' d d'
        double c = slope[k] - 1, along = s->gx[i] * d.x + s->gy[i] * d.y + s->gz[i] * d.z;
        s->gx[i] += c * along * d.x, s->gy[i] += c * along * d.y, s->gz[i] += c * along * d.z;
        if (!hessian)
            continue;
        Vec3 v = {s->hxx[i] * d.x + s->hxy[i] * d.y + s->hxz[i] * d.z, s->hxy[i] * d.x + s->hyy[i] * d.y + s->hyz[i] * d.z,
                  s->hxz[i] * d.x + s->hyz[i] * d.y + s->hzz[i] * d.z};
        v = vec3_add_scaled(vec3_scale(v, c), 0.5 * (c * c * vec3_dot(v, d) + along * bend[k]), d);
        s->hxx[i] += 2 * d.x * v.x, s->hxy[i] += d.x * v.y + v.x * d.y, s->hxz[i] += d.x * v.z + v.x * d.z;
        s->hyy[i] += 2 * d.y * v.y, s->hyz[i] += d.y * v.z + v.y * d.z, s->hzz[i] += 2 * d.z * v.z;
    }
}

static void set_sample(const LimVessel *lim, FootSample *s, int i, int node, Vec3 x)
{
    SEL_ASSERT(node >= 0 && node < lim->tree->node_count, "a lane's node is one of the tree");
    SEL_ASSERT(i >= 0 && i < FOOT_BATCH, "a lane is one of the batch");
    const NodeModel *m = &lim->model[node];
    s->group[i] = m->group;
    s->groups[i] = m->groups;
    s->carried[i] = m->carried;
    s->any_carried |= m->carried;
    s->x[i] = x.x, s->y[i] = x.y, s->z[i] = x.z;
}

// --- Feet ---

// [mm] error that Newton may leave: for a foot that was followed, for one found from scratch.
static const double REST_FOLLOWED = 1e-8, REST_FRESH = 1e-9;

// Lanes are computed in whole blocks: fills the lanes after the last one in use with numbers.
static void fill_block(FootBatch *b, int count)
{
    SEL_ASSERT(count > 0 && count <= FOOT_BATCH, "a batch has no more lanes than its capacity");
    for (int i = count; i % FOOT_BLOCK != 0; i++) {
        FootSample *s = &b->at;
        s->x[i] = s->y[i] = s->z[i] = s->f[i] = s->gx[i] = s->gy[i] = s->gz[i] = 0;
        s->hxx[i] = s->hxy[i] = s->hxz[i] = s->hyy[i] = s->hyz[i] = s->hzz[i] = 0;
        b->xx[i] = b->xy[i] = b->xz[i] = b->unique[i] = b->nx[i] = b->ny[i] = b->nz[i] = b->half[i] = 0;
        b->sxx[i] = b->sxy[i] = b->sxz[i] = b->syy[i] = b->syz[i] = b->szz[i] = 0;
        b->axx[i] = b->axy[i] = b->axz[i] = b->ayy[i] = b->ayz[i] = b->azz[i] = 0;
        b->radius[i] = b->bend[i] = 1;
    }
}

// At most `rounds` Newton steps of the pending lanes; lanes not done after that are lost. Returns false if all are done.
static bool newton_rounds(const LimVessel *lim, FootBatch *b, int count, int rounds, bool careful)
{
    int lane[FOOT_BATCH];
    for (int round = 0; round < rounds; round++) {
        int n = 0;
        for (int i = 0; i < count; i++)
            if (b->state[i] == FOOT_PENDING)
                lane[n++] = i;
        if (n == 0)
            return true;
        sample(lim, &b->at, lane, n, true);
        if (!lim->kernels->newton(b, count, careful))
            return false;
    }
    for (int i = 0; i < count; i++)
        if (b->state[i] == FOOT_PENDING)
            b->state[i] = FOOT_LOST;
    return true;
}

// One step of the march towards the wall, from the sample at the current foot. Returns true if the step is shorter than a twentieth of the radius.
static bool march_step(const LimVessel *lim, FootBatch *b, int i, int node)
{
    const VesselTree *tree = lim->tree;
    Vec3 g = {b->at.gx[i], b->at.gy[i], b->at.gz[i]}, p = lane_foot(b, i);
    // inside a vessel the side wall is closer than the ends, though near the axis the field may fall faster towards the ends
    if (b->inside[i] > 0 && tree->kind[node] == NODE_VESSEL)
        g = vec3_add_scaled(g, -vec3_dot(g, tree->direction[node]), tree->direction[node]);
    double radius = tree->radius[node], level = 1 / sqrt(tree->iso_level), slope = vec3_norm(g), sum = b->at.f[i] + tree->iso_level, step = radius;
    if (slope > 1e-12 * sum) {
        double w = 1 / sqrt(sum);
        step = fmax(2 * (w - level) / (w * w * w * slope), -1.2 * radius);   // < 0 inside: outwards
        p = vec3_add_scaled(p, step / slope, g);
    } else {
        // on a symmetry axis or at the centre of a single blob any direction will do, but always the same one
        p = vec3_add_scaled(p, radius, vec3_normal_to(tree->direction[node]));
    }
    b->at.x[i] = p.x, b->at.y[i] = p.y, b->at.z[i] = p.z;
    return fabs(step) < 0.05 * radius;
}

static void march_rounds(const LimVessel *lim, LaneBatch *batch, const int *lanes, int count)
{
    enum { STEPS = 13 };
    FootBatch *b = &batch->foot;
    int lane[FOOT_BATCH], trusted[FOOT_BATCH], n = 0;
    for (int k = 0; k < count; k++) {
        int i = lane[k] = lanes[k];
        b->at.x[i] = b->xx[i], b->at.y[i] = b->xy[i], b->at.z[i] = b->xz[i];
        if (batch->of[i]->trusted)
            trusted[n++] = i;
    }
    if (n > 0) {   // lanes that were trusted wrongly
        sample(lim, &b->at, trusted, n, false);
        for (int k = 0; k < n; k++)
            b->inside[trusted[k]] = b->at.f[trusted[k]] > 0;
    }
    for (int round = 0; round < STEPS && count > 0; round++) {
        sample(lim, &b->at, lane, count, false);
        int kept = 0;
        for (int k = 0; k < count; k++)
            if (!march_step(lim, b, lane[k], batch->of[lane[k]]->node))
                lane[kept++] = lane[k];
        count = kept;
    }
}

// The wall in the plane through X across the inlet's direction d: for feet near the inlet that are not found otherwise. Returns false if the section holds no
// wall.
static bool project_in_section(const LimVessel *lim, int node, Vec3 x, SurfacePoint *found)
{
    enum { STEPS = 30 };
    Blobby model = blobs_of(lim, node);
    Vec3 d = lim->tree->direction[0];
    double level = 1 / sqrt(lim->tree->iso_level), radius = lim->tree->radius[node], slope_of, bend_of, z = inlet_height(lim, x);
    double shift = carried_height(z, inlet_zone(lim), &slope_of, &bend_of) - z;
    x = vec3_add_scaled(x, shift, d);
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
        // Newton in the section, with one tangent
        Vec3 n = vec3_scale(g, 1 / slope), t = vec3_cross(d, n), away = vec3_sub(p, x);
        double gap = -vec3_dot(away, n), k = sym3_quadratic(&h, t) / slope, y = -vec3_dot(away, t) / fmax(fabs(1 + gap * k), 0.2);
        y = fmax(-0.5 * radius, fmin(0.5 * radius, y));
        double nu = -(f / slope + 0.5 * k * y * y);
        p = vec3_add_scaled(vec3_add_scaled(p, y, t), nu, n);
        if (fabs(y) + fabs(nu) > 1e-7)
            continue;
        gap = vec3_dot(vec3_sub(x, p), n);
        *found = (SurfacePoint){.foot = vec3_add_scaled(p, -shift, d),
                                .normal = n,
                                .distance = gap,
                                .converged = true,
                                .shape = {k * t.x * t.x, k * t.x * t.y, k * t.x * t.z, k * t.y * t.y, k * t.y * t.z, k * t.z * t.z}};
        return true;
    }
    return false;
}

static void project_slowly(const LimVessel *lim, FootBatch *b, int i, Lane *of)
{
    Blobby model = blobs_of(lim, of->node);
    Vec3 x = lane_point(b, i), g, normal;
    SurfacePoint s = blobby_project(&model, x, x);
    if (lim->model[of->node].carried && (inlet_height(lim, x) < inlet_zone(lim) || inlet_height(lim, s.foot) < inlet_zone(lim)))
        s.converged = project_in_section(lim, of->node, x, &s);
    double f = blobby_gradient(&model, x, &g), slope = vec3_norm(g);
    const Sym3 *h = &s.shape;
    of->sure = s.converged;
    normal = s.normal;
    if (!s.converged) {
        // Taubin's distance along the gradient, or the distance found, with a flat wall there
        double gap = slope > 1e-100 && fabs(f / slope) < fabs(s.distance) ? f / slope : s.distance;
        normal = vec3_unit_or(g, s.normal);
        s.foot = vec3_add_scaled(x, -gap, normal);
        s.shape = (Sym3){0, 0, 0, 0, 0, 0};
    }
    b->at.x[i] = s.foot.x, b->at.y[i] = s.foot.y, b->at.z[i] = s.foot.z;
    b->nx[i] = normal.x, b->ny[i] = normal.y, b->nz[i] = normal.z;
    b->half[i] = 0;
    b->sxx[i] = h->xx, b->sxy[i] = h->xy, b->sxz[i] = h->xz, b->syy[i] = h->yy, b->syz[i] = h->yz, b->szz[i] = h->zz;
    b->state[i] = FOOT_DONE;
}

static bool is_on_wrong_side(const FootBatch *b, int i) { return (b->gap[i] > 0) != (b->inside[i] > 0) && fabs(b->gap[i]) > 1e-6; }

// Newton's steps from the remembered feet. A point near the axis has many feet at nearly the same distance, and its foot moves around with it: careful steps
// from the last foot find it, whereas a march from X ends on an arbitrary side and takes long.
static void follow_feet(const LimVessel *lim, FootBatch *b, int count)
{
    bool deep = false;
    if (!newton_rounds(lim, b, count, 4, false))
        return;
    for (int i = 0; i < count; i++)
        if (b->state[i] == FOOT_DEEP) {
            b->state[i] = FOOT_PENDING;
            b->allowed[i] = REST_FRESH;
            deep = true;
        }
    if (deep)
        newton_rounds(lim, b, count, 12, true);
}

// Evaluates the field at X for the lanes that are not trusted.
static void estimate_untrusted(const LimVessel *lim, LaneBatch *batch)
{
    FootBatch *b = &batch->foot;
    FootSample *s = &batch->at_x;
    FootLane estimate;
    int n = batch->untrusted_count, lane[FOOT_BATCH];
    s->any_carried = false;
    for (int k = 0; k < n; k++) {
        int i = batch->untrusted[k];
        set_sample(lim, s, k, batch->of[i]->node, lane_point(b, i));
        lane[k] = k;
    }
    sample(lim, s, lane, n, false);
    for (int k = n; k % FOOT_BLOCK != 0; k++)
        s->f[k] = s->gx[k] = s->gy[k] = s->gz[k] = 0;
    lim->kernels->estimate(s, estimate, n, lim->tree->iso_level);
    for (int k = 0; k < n; k++) {
        int i = batch->untrusted[k];
        b->inside[i] = s->f[k] > 0;
        b->estimate[i] = estimate[k];
    }
}

// On the axis of a round vessel all feet around are equally near and Newton does not converge; any of them is correct to second order in the remaining
// tangential distance. Keeps the lanes for which this does not hold; returns their number.
static int settle_on_axis(const LimVessel *lim, FootBatch *b, int *lane, int count)
{
    static const double LEFT = 1e-4, OFF = 1e-5;     // relative to the radius: tangential and normal residual
    int kept = 0;
    sample(lim, &b->at, lane, count, false);
    for (int k = 0; k < count; k++) {
        int i = lane[k];
        Vec3 g = {b->at.gx[i], b->at.gy[i], b->at.gz[i]}, n = vec3_unit_or(g, vec3(0, 0, 0)), away = vec3_sub(lane_foot(b, i), lane_point(b, i));
        double gap = -vec3_dot(away, n), left = vec3_norm(vec3_add_scaled(away, gap, n)), slope = vec3_norm(g), radius = b->radius[i];
        if (!(slope > 1e-100 && gap > 0.5 * radius && left < LEFT * radius && fabs(b->at.f[i]) < OFF * radius * slope && b->inside[i] > 0)) {
            lane[kept++] = i;
            continue;
        }
        b->nx[i] = n.x, b->ny[i] = n.y, b->nz[i] = n.z;
        b->state[i] = FOOT_DONE;
    }
    return kept;
}

// Feet of a batch's lanes on the models of their nodes; `again` marks lanes without a start. A foot on the wrong side of the wall, or on a wall that is further
// away than another, is not the closest: these lanes start again from X.
static void project_batch(const LimVessel *lim, LaneBatch *batch)
{
    FootBatch *b = &batch->foot;
    int lane[FOOT_BATCH], n = 0, count = batch->count;
    if (batch->untrusted_count > 0)
        estimate_untrusted(lim, batch);
    follow_feet(lim, b, count);
    lim->kernels->finish(b, count);
    for (int k = 0; k < batch->untrusted_count; k++) {
        int i = batch->untrusted[k];
        batch->of[i]->again |= is_on_wrong_side(b, i) || !(b->estimate[i] > 0.8 * fabs(b->gap[i]));
    }
    for (int i = 0; i < count; i++) {
        batch->of[i]->again |= b->state[i] != FOOT_DONE;
        if (batch->of[i]->again)
            lane[n++] = i;
    }
    if (n == 0)
        return;
    march_rounds(lim, batch, lane, n);
    for (int k = 0; k < n; k++) {
        b->state[lane[k]] = FOOT_PENDING;
        b->allowed[lane[k]] = REST_FRESH;
        b->longest[lane[k]] = b->radius[lane[k]];
    }
    newton_rounds(lim, b, count, 12, true);
    lim->kernels->finish(b, count);
    int failed = 0;
    for (int k = 0; k < n; k++)
        if (b->state[lane[k]] != FOOT_DONE || is_on_wrong_side(b, lane[k]))
            lane[failed++] = lane[k];
    if (failed == 0)
        return;
    n = settle_on_axis(lim, b, lane, failed);
    for (int k = 0; k < n; k++)
        project_slowly(lim, b, lane[k], batch->of[lane[k]]);
    lim->kernels->finish(b, count);
}

enum { LOOKS = 14 };
#define C 0.57735026918962573   // 1 / sqrt 3
static const Vec3 look[LOOKS] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},   {0, -1, 0}, {0, 0, 1},   {0, 0, -1},  {C, C, C},
                                 {C, C, -C}, {C, -C, C}, {C, -C, -C}, {-C, C, C}, {-C, C, -C}, {-C, -C, C}, {-C, -C, -C}};
#undef C

// A distant foot is locally the closest, but another wall may be closer. Tests 14 directions, at most 36 degrees apart, on a sphere about X of 0.9 times the
// foot's distance: if all are inside, no (flat) wall is closer than 0.7 gap. A point that fails is projected again, slowly and thoroughly. Done only where the
// clearance of an earlier check has been used up; near the wall the estimate suffices.
static void check_batch(const LimVessel *lim, LaneBatch *batch, const VesselMemory *memory)
{
    FootBatch *b = &batch->foot;
    FootSample *at = &batch->at_x;
    int lane[FOOT_BATCH], n = 0;
    for (int k = 0; k < batch->untrusted_count; k++) {
        int i = batch->untrusted[k];
        Lane *of = batch->of[i];
        if (!of->sure || !(b->gap[i] > 0.3 * b->radius[i]))
            continue;
        const VesselMemory *m = &memory[of->point];
        const NodeModel *model = &lim->model[of->node];
        double known = model->clear - vec3_distance(lane_point(b, i), model->center);
        if (m->clearance > 0)
            known = fmax(known, m->clearance - vec3_distance(lane_point(b, i), m->clear_place));
        of->checked = known < 0.5 * b->gap[i];
        if (!of->checked)
            continue;
        set_sample(lim, at, i, of->node, lane_point(b, i));
        lane[n++] = i;
    }
    if (n == 0)
        return;
    bool slow = false, bad[FOOT_BATCH] = {false};
    for (int k = 0; k < LOOKS; k++) {
        for (int j = 0; j < n; j++) {
            int i = lane[j];
            double r = 0.9 * b->gap[i];
            at->x[i] = b->xx[i] + r * look[k].x, at->y[i] = b->xy[i] + r * look[k].y, at->z[i] = b->xz[i] + r * look[k].z;
        }
        sample(lim, at, lane, n, false);
        for (int j = 0; j < n; j++)
            bad[lane[j]] = bad[lane[j]] || !(at->f[lane[j]] > 0);
    }
    for (int j = 0; j < n; j++) {
        int i = lane[j];
        if (bad[i]) {
            project_slowly(lim, b, i, batch->of[i]);
            batch->of[i]->checked = batch->of[i]->sure;
            slow = true;
        }
    }
    if (slow)
        lim->kernels->finish(b, batch->count);
}

// --- The blended field ---

// Models that differ by less than this are blended, with a weight that falls with the difference: half the radius, and so little that the blended wall stays
// within 0.15 mm of the own model's (0.18 of the limit, for one partner). A model that differs more is spurious and is ignored. On the angiogram's model,
// neighbours differ by up to 0.3 mm in sharp bends; a limit of 0.25 mm left steps in the wall that threw the wire 0.3 mm out, where this limit leaves 0.09 mm.
static double blend_agree(double radius) { return fmin(FOOT_AGREE_RADII * radius, FOOT_AGREE); }
// The blended gap is less than the own model's by at most this: sum w q / (1 + sum w) < 1/2 of the above for a few partners, w = (1 - q^2)^2.
static double blend_least(double radius) { return 0.5 * blend_agree(radius); }
// Half width of the blending zone: a node counts where its power distance exceeds the best by less than this fraction of the squared node spacing; the excess
// is 0 at the cell's border and 1 at its middle.
static const double BLEND_BAND = 2;

static double spacing2(const VesselTree *tree, int node)
{
    double sum = 0;
    int first = tree->neighbour_offset[node], end = tree->neighbour_offset[node + 1];
    for (int k = first; k < end; k++)
        sum += vec3_norm2(vec3_sub(tree->center[node], tree->center[tree->neighbour[k]]));
    return end > first ? sum / (end - first) : 0;
}

// Evaluates a partner for the lanes [lane, lane + n) of a batch of `count`; lanes whose walls differ much are evaluated a second time.
static void sample_partners(const LimVessel *lim, const FootBatch *b, FootPartner *partner, int *lane, int n, int count)
{
    int again = 0;
    sample(lim, &partner->at, lane, n, false);
    lim->kernels->partner(b, partner, count, false);
    for (int k = 0; k < n; k++) {
        int i = lane[k];
        if (partner->move[i] == 0)
            continue;
        partner->at.x[i] = partner->tox[i], partner->at.y[i] = partner->toy[i], partner->at.z[i] = partner->toz[i];
        lane[again++] = i;
    }
    if (again == 0)
        return;
    sample(lim, &partner->at, lane, again, false);
    lim->kernels->partner(b, partner, count, true);
}

// Blends the partners' walls into the hits of a batch, partner by partner.
static void blend_batch(const LimVessel *lim, const LaneBatch *batch, double reach, VesselHit *hit)
{
    const FootBatch *b = &batch->foot;
    FootPartner partner;
    FootMixture mixture;
    int count = batch->count, with = 0, partners[FOOT_BATCH];
    for (int i = 0; i < count; i++) {
        const Lane *of = batch->of[i];
        partners[i] = of->sure && b->gap[i] - lim->model[of->node].least <= reach ? of->partners : 0;
        with = partners[i] > 0 ? i + 1 : with;
    }
    if (with == 0)
        return;
    for (int i = 0; i < (count + FOOT_BLOCK - 1) / FOOT_BLOCK * FOOT_BLOCK; i++) {
        mixture.total[i] = mixture.gap[i] = mixture.nx[i] = mixture.ny[i] = mixture.nz[i] = 0;
        partner.at.f[i] = partner.at.gx[i] = partner.at.gy[i] = partner.at.gz[i] = partner.move[i] = 0;
    }
    for (int k = 0; with > 0; k++) {
        int lane[FOOT_BATCH], n = 0, last = 0;
        int filled = (with + FOOT_BLOCK - 1) / FOOT_BLOCK * FOOT_BLOCK;
        partner.at.any_carried = false;
        for (int i = 0; i < filled; i++) {
            partner.weight[i] = 0;
            partner.at.x[i] = b->at.x[i], partner.at.y[i] = b->at.y[i], partner.at.z[i] = b->at.z[i];
        }
        for (int i = 0; i < with; i++) {
            if (partners[i] <= k)
                continue;
            const NodeModel *m = &lim->model[batch->of[i]->partner[k]];
            partner.weight[i] = (double)batch->of[i]->weight[k];
            partner.at.group[i] = m->group, partner.at.groups[i] = m->groups;
            partner.at.carried[i] = m->carried, partner.at.any_carried |= m->carried;
            lane[n++] = i;
            last = partners[i] > k + 1 ? i + 1 : last;
        }
        sample_partners(lim, b, &partner, lane, n, with);
        lim->kernels->mix(b, &partner, &mixture, with);
        with = last;
    }
    lim->kernels->settle(b, &mixture, count);
    for (int i = 0; i < count; i++) {
        VesselHit *h = &hit[batch->of[i]->point];
        if (mixture.total[i] > 0) {
            h->gap = mixture.gap[i];
            h->normal = vec3(mixture.nx[i], mixture.ny[i], mixture.nz[i]);
        }
    }
}

// --- Queries ---

static VesselHit open_end(VesselMemory *memory, int node)
{
    memory->has_foot = false;
    memory->clearance = 0;
    return (VesselHit){.gap = HUGE_VAL, .node = node, .flags = VESSEL_OPEN_END};
}

// Collects the partners of `node` at y from its centre, among the first `groups` near groups. Returns false if X is in another node's cell.
static bool collect_partners(const LimVessel *lim, const NodeModel *m, int groups, Vec3 y, Lane *of)
{
    float at[3] = {(float)y.x, (float)y.y, (float)y.z}, weight[NEAR_GROUP];
    bool own = true, mixed = lim->options.field == LIM_BLEND;
    int found = 0;
    for (int g = 0; g < groups; g++) {
        unsigned better = 0, in = lim->kernels->near(m->near + g, at, weight, &better);
        own &= better == 0;
        for (in = mixed ? in : 0; in != 0 && found < PARTNERS_MAX; in &= in - 1) {
            int k = __builtin_ctz(in);
            SEL_ASSERT(m->near[g].node[k] >= 0, "an empty plane has no blending zone");
            of->partner[found] = m->near[g].node[k];
            of->weight[found++] = better >> k & 1 ? 1 : weight[k];
        }
    }
    of->partners = found;
    SEL_ASSERT(found <= PARTNERS_MAX, "a lane has room for its partners");
    return own;
}

static int walk(const LimVessel *lim, Vec3 x, int from, int hops)
{
    bool known = from >= 0 && from < lim->tree->node_count;
    return known ? power_walk(lim->tree, x, from, hops) : power_blocks_nearest(&lim->blocks, x);
}

// Returns the point's node and collects its partners.
static int follow(const LimVessel *lim, Vec3 x, int node, Lane *of)
{
    const VesselTree *tree = lim->tree;
    if (node >= 0 && node < tree->node_count) {
        const NodeModel *m = &lim->model[node];
        Vec3 y = vec3_sub(x, m->center);
        bool at_home = !(vec3_norm2(y) > m->ball2);
        if (collect_partners(lim, m, at_home ? m->near_groups : m->all_near, y, of) && at_home)
            return node;
    }
    int next = walk(lim, x, node, lim->options.hops);
    SEL_ASSERT(next >= 0 && next < tree->node_count, "a walk ends at a node of the tree");
    if (next != node)
        collect_partners(lim, &lim->model[next], lim->model[next].all_near, vec3_sub(x, lim->model[next].center), of);
    return next;
}

// Returns true if the hit can be filled without evaluating the field.
static bool answer_cheaply(const LimVessel *lim, Vec3 x, double reach, VesselMemory *memory, Lane *of, VesselHit *hit)
{
    if (!(vec3_norm2(x) < 1e100)) {
        *hit = (VesselHit){.node = memory->node, .flags = VESSEL_UNSURE};
        return true;
    }
    int node = follow(lim, x, memory->node, of);
    const NodeModel *m = &lim->model[node];
    if (node != memory->node)
        memory->clearance = 0;
    double away2 = vec3_norm2(vec3_sub(x, m->center));
    of->at_home = node == memory->node && away2 < m->ball2;
    memory->node = of->node = node;
    if (node == 0 && lim->inlet_open && !m->carried && inlet_height(lim, x) < 0) {
        *hit = open_end(memory, node);
        return true;
    }
    double least = reach + m->least, clear = 0, away = m->clear - least;
    if (away > 0 && away2 < away * away)
        clear = m->clear - sqrt(away2);
    away = memory->clearance - least;
    if (away > 0 && vec3_norm2(vec3_sub(x, memory->clear_place)) < away * away)
        clear = fmax(clear, memory->clearance - vec3_distance(x, memory->clear_place));
    if (!(clear > least))
        return false;
    *hit = (VesselHit){.gap = clear - (least - reach), .node = node, .flags = VESSEL_FAR};
    return true;
}

// Loads a lane with its point, its model and the remembered foot; kernels->predict computes its start from these.
static void set_lane(const LimVessel *lim, FootBatch *b, int i, int node, Vec3 x, const VesselMemory *memory)
{
    SEL_ASSERT(i >= 0 && i < FOOT_BATCH && node >= 0 && node < lim->tree->node_count, "the lane is one of the batch and its node one of the tree");
    const NodeModel *m = &lim->model[node];
    b->at.group[i] = m->group, b->at.groups[i] = m->groups;
    b->at.carried[i] = m->carried, b->at.any_carried |= m->carried;
    b->radius[i] = m->radius, b->bend[i] = m->bend, b->unique[i] = m->unique;
    b->xx[i] = x.x, b->xy[i] = x.y, b->xz[i] = x.z;
    if (memory->has_foot) {
        b->at.x[i] = memory->foot.x, b->at.y[i] = memory->foot.y, b->at.z[i] = memory->foot.z;
        b->at.gx[i] = memory->place.x, b->at.gy[i] = memory->place.y, b->at.gz[i] = memory->place.z;
        b->nx[i] = memory->normal.x, b->ny[i] = memory->normal.y, b->nz[i] = memory->normal.z;
        const Sym3 *h = &memory->hessian;
        b->axx[i] = h->xx, b->axy[i] = h->xy, b->axz[i] = h->xz, b->ayy[i] = h->yy, b->ayz[i] = h->yz, b->azz[i] = h->zz;
    } else {
        b->at.x[i] = b->at.gx[i] = x.x, b->at.y[i] = b->at.gy[i] = x.y, b->at.z[i] = b->at.gz[i] = x.z;
        b->nx[i] = b->ny[i] = b->nz[i] = b->axx[i] = b->axy[i] = b->axz[i] = b->ayy[i] = b->ayz[i] = b->azz[i] = 0;
    }
}

enum { TRUST = 16 };         // number of queries for which a trusted foot is not checked at X

static void answer_from_foot(const FootBatch *b, int i, const Lane *of, VesselMemory *memory, VesselHit *hit)
{
    // copied as values: reading back what was just written in parts causes a stall
    Vec3 x = lane_point(b, i), foot = lane_foot(b, i), normal = lane_normal(b, i);
    Sym3 hessian = lane_hessian(b, i);
    double gap = b->gap[i];
    *hit = (VesselHit){gap, normal, hessian, of->node, of->sure ? 0 : VESSEL_UNSURE};
    memory->has_foot = of->sure;
    memory->trusted = of->sure ? of->trusted ? memory->trusted - 1 : TRUST : 0;
    if (of->checked) {
        memory->clearance = fmax(0.7 * gap, 0);
        memory->clear_place = x;
    }
    memory->place = x;
    memory->foot = foot;
    memory->normal = normal;
    memory->hessian = hessian;
}

// Orders the lanes by number of partners, most first.
static void order_lanes(LaneBatch *batch, const int *with)
{
    int place[PARTNERS_MAX + 1], at = 0;
    for (int k = PARTNERS_MAX; k >= 0; k--) {
        place[k] = at;
        at += with[k];
    }
    SEL_REQUIRE(at == batch->count, "the counts by number of partners include each lane once");
    for (int i = 0; i < batch->count; i++)
        batch->of[place[batch->lane[i].partners]++] = &batch->lane[i];
}

static void query_batch(const LimVessel *lim, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    SEL_ASSERT(count <= FOOT_BATCH, "queries come in batches");
    LaneBatch batch;
    FootBatch *b = &batch.foot;
    int n = 0, with[PARTNERS_MAX + 1] = {0};
    for (int i = 0; i < count; i++) {
        Lane *of = &batch.lane[n];
        if (answer_cheaply(lim, point[i], reach, &memory[i], of, &hit[i]))
            continue;
        of->point = i;
        with[of->partners]++;
        n++;
    }
    if (n == 0)
        return;
    batch.count = n;
    order_lanes(&batch, with);
    batch.untrusted_count = 0;
    b->at.any_carried = false;
    for (int i = 0; i < n; i++)
        set_lane(lim, b, i, batch.of[i]->node, point[batch.of[i]->point], &memory[batch.of[i]->point]);
    fill_block(b, n);
    lim->kernels->predict(b, n, REST_FOLLOWED);
    for (int i = 0; i < n; i++) {
        Lane *of = batch.of[i];
        const VesselMemory *m = &memory[of->point];
        of->sure = true;
        of->checked = false;
        of->again = !m->has_foot;
        of->trusted = m->has_foot & (m->trusted > 0) & of->at_home & (b->inside[i] > 0);
        batch.untrusted[batch.untrusted_count] = i;
        batch.untrusted_count += !of->trusted;
    }
    project_batch(lim, &batch);
    check_batch(lim, &batch, memory);
    for (int i = 0; i < n; i++) {
        Lane *of = batch.of[i];
        answer_from_foot(b, i, of, &memory[of->point], &hit[of->point]);
        if (b->at.carried[i] && inlet_height(lim, lane_point(b, i)) < 0)
            hit[of->point].flags |= VESSEL_BEYOND;
    }
    if (lim->options.field == LIM_BLEND)
        blend_batch(lim, &batch, reach, hit);
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
    return walk(lim, point, from, INT_MAX);
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
    free(lim->near);
    free(lim->model);
    power_blocks_free(&lim->blocks);
    free(lim);
}

// --- Creation ---

// A node without blobs uses those of its nearest ancestor that has some, else those of the first node that has some.
static void choose_sources(const VesselTree *tree, NodeModel *model)
{
    SEL_ASSERT(tree->blob_count == tree->blob_offset[tree->node_count] && tree->blob_count > 0, "some node has blobs");
    int first = 0;
    while (tree->blob_offset[first + 1] == tree->blob_offset[first])
        first++;
    for (int i = 0; i < tree->node_count; i++) {
        bool own = tree->blob_offset[i + 1] > tree->blob_offset[i];
        SEL_ASSERT(tree->parent[i] < i, "parents come before children");
        model[i].source = own ? i : i > 0 ? model[tree->parent[i]].source : first;
    }
}

static int near_groups_of(const VesselTree *tree, int node) { return (tree->near_offset[node + 1] - tree->near_offset[node] + NEAR_GROUP - 1) / NEAR_GROUP; }

// A near node's plane, see NearGroup: y lies within the blending zone or beyond it if base - e.y <= width.
typedef struct NearPlane {
    int node;
    double base, width;
    Vec3 e;
} NearPlane;

// The blending zone has the width of the narrower of the two nodes' zones.
static NearPlane near_plane(const VesselTree *tree, int i, int j)
{
    Vec3 e = vec3_sub(tree->center[j], tree->center[i]);
    double base = vec3_norm2(e) + tree->radius[i] * tree->radius[i] - tree->radius[j] * tree->radius[j];
    return (NearPlane){j, base, fmax(BLEND_BAND * fmin(spacing2(tree, i), spacing2(tree, j)), 1e-12), vec3_scale(e, 2)};
}

// Returns whether, within the ball |y| < ball, a's cell covers all of the region in which b counts. The plane of a cuts the ball to y.e_a <= base_a; the test
// is how far that part extends along e_b.
static bool covers(const NearPlane *a, const NearPlane *b, double ball)
{
    double size_a = vec3_norm(a->e), size_b = vec3_norm(b->e), most = ball * size_b;
    if (!(size_a > 0))
        return false;
    double at = a->base / size_a, along = vec3_dot(b->e, a->e) / size_a, aside = sqrt(fmax(size_b * size_b - along * along, 0));
    if (at <= -ball)
        return true;
    if (along * ball > at * size_b)   // the furthest point of the ball is cut off
        most = along * at + aside * sqrt(fmax(ball * ball - at * at, 0));
    return b->base - most > b->width + 1e-4 * (ball * size_b + fabs(b->base));   // single precision
}

// Fills the planes to the near nodes, first those that matter for points in the ball of 1.2 r; returns the number of groups of these. Along a vessel, the two
// adjacent nodes on either side remain of nine or more.
static int fill_near(const VesselTree *tree, int i, double ball, NearGroup *group)
{
    int first = tree->near_offset[i], count = tree->near_offset[i + 1] - first, kept = 0;
    for (int pass = 0, at = 0; pass < 2; pass++) {
        for (int k = 0; k < count; k++) {
            NearPlane p = near_plane(tree, i, tree->near[first + k]);
            bool covered = false;
            for (int l = 0; l < count && !covered; l++) {
                NearPlane other = near_plane(tree, i, tree->near[first + l]);
                covered = l != k && covers(&other, &p, ball);
            }
            if (covered != (pass == 1))
                continue;
            NearGroup *g = &group[at / NEAR_GROUP];
            SEL_ASSERT(at < count, "a near node has one plane");
            int lane = at++ % NEAR_GROUP;
            g->node[lane] = p.node;
            g->base[lane] = (float)p.base;
            g->ex[lane] = (float)p.e.x, g->ey[lane] = (float)p.e.y, g->ez[lane] = (float)p.e.z;
            g->band[lane] = (float)(1 / p.width);
        }
        kept = pass == 0 ? at : kept;
    }
    for (int k = count; k < NEAR_GROUP * near_groups_of(tree, i); k++) {
        NearGroup *g = &group[k / NEAR_GROUP];
        int lane = k % NEAR_GROUP;
        g->node[lane] = -1;
        g->base[lane] = 1, g->ex[lane] = g->ey[lane] = g->ez[lane] = 0, g->band[lane] = 2;   // never within its band
    }
    SEL_ASSERT(kept <= count, "the planes that matter are a subset of all");
    return (kept + NEAR_GROUP - 1) / NEAR_GROUP;
}

// Makes the root's section continue upstream in the models near it that hold the root's centre.
static void carry_inlet(LimVessel *lim)
{
    const VesselTree *tree = lim->tree;
    for (int k = tree->near_offset[0] - 1; k < tree->near_offset[1] && lim->inlet_open; k++) {
        int node = k < tree->near_offset[0] ? 0 : tree->near[k];
        Blobby blobs = blobs_of(lim, node);
        lim->model[node].carried = blobby_field(&blobs, tree->center[0]) > 0;
    }
}

static bool is_lumen_within(const Blobby *blobs, Vec3 middle, double radius)
{
    bool lumen = true;
    for (int w = 0; w < LOOKS && lumen; w++)
        lumen = blobby_field(blobs, vec3_add_scaled(middle, radius, look[w])) > 0;
    return lumen;
}

// Computes `unique`: whether the model's wall around the node is a single sheet with free lumen in front of it. For feet around the node, over the length of its
// cell, the function tests 14 directions from the centre of a ball that touches the wall there: if all are lumen, a foot closer than 0.6 times the ball's
// radius is the closest. The ball has a radius of 0.8 r, or less, down to 0.3 r, where there is not enough room, as next to a branch.
static double unique_distance(const LimVessel *lim, int node)
{
    enum { AROUND = 8 };
    const VesselTree *tree = lim->tree;
    Blobby blobs = blobs_of(lim, node);
    double r = tree->radius[node], ball = 0.8 * r, reach = fmax(0.5 * sqrt(spacing2(tree, node)), 0.3 * r);
    Vec3 d = tree->direction[node], e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
    if (tree->kind[node] != NODE_VESSEL)
        return 0;
    for (int k = 0; k < 3 * AROUND; k++) {
        double angle = 2 * PI * k / AROUND, step = 0.5 * r;
        Vec3 out = vec3_add(vec3_scale(e1, same_cos(angle)), vec3_scale(e2, same_sin(angle)));
        Vec3 foot = vec3_add_scaled(tree->center[node], (k / AROUND - 1) * reach, d), g;
        if (!(blobby_field(&blobs, foot) > 0))
            return 0;
        for (int i = 0; i<12; i++, step *= i> 4 ? 0.5 : 1) // outwards, then in smaller steps to the wall
            if (i < 5 ? blobby_field(&blobs, vec3_add_scaled(foot, step, out)) > 0 : true) {
                Vec3 next = vec3_add_scaled(foot, step, out);
                foot = blobby_field(&blobs, next) > 0 ? next : foot;
            }
        blobby_gradient(&blobs, foot, &g);
        g = vec3_unit(g);
        while (!is_lumen_within(&blobs, vec3_add_scaled(foot, ball, g), 0.9 * ball)) {
            ball *= 0.8;
            if (ball < 0.3 * r)
                return 0;
        }
    }
    return 0.6 * ball;
}

static void fill_models(LimVessel *lim, size_t groups, size_t nears)
{
    const VesselTree *tree = lim->tree;
    BlobGroup *group = lim->group;
    NearGroup *near = lim->near;
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
            m->group = NULL;   // set below, when all are filled
        }
        m->center = tree->center[i];
        m->radius = tree->radius[i];
        SEL_ASSERT(m->radius > 0, "nodes have a radius");
        m->bend = 1 / m->radius;
        m->ball2 = 1.44 * m->radius * m->radius;
        m->least = lim->options.field == LIM_BLEND ? blend_least(m->radius) : 0;
        // less than the distance found, in case that foot is on another side
        SurfacePoint s = blobby_project(&blobs, tree->center[i], tree->center[i]);
        m->clear = s.converged && s.distance > 0 ? fmin(0.95 * s.distance, tree->radius[i]) : -HUGE_VAL;
        m->unique = unique_distance(lim, i);
        m->near = near;
        m->all_near = near_groups_of(tree, i);
        m->near_groups = fill_near(tree, i, sqrt(m->ball2), near);
        near += m->all_near;
    }
    SEL_REQUIRE((size_t)(near - lim->near) == nears && (size_t)(group - lim->group) <= groups, "groups and planes fill what was allocated for them");
    for (int i = 0; i < tree->node_count; i++)
        lim->model[i].group = lim->model[lim->model[i].source].group;
}

LimVesselOptions lim_vessel_default_options(void) { return (LimVesselOptions){.field = LIM_BLEND, .hops = 4, .isa = 0}; }

Vessel *lim_vessel_create_with(const VesselTree *tree, const LimVesselOptions *options)
{
    if (!tree || !vessel_tree_is_model(tree) || vessel_tree_is_shared(tree))
        return NULL;
    size_t groups = 0, near = 0;
    SEL_ASSERT(tree->near_offset && tree->near, "the tree is linked (vessel_tree_link)");
    for (int i = 0; i < tree->node_count; i++) {
        groups += (size_t)blob_groups_needed(tree->blob_offset[i + 1] - tree->blob_offset[i]);
        near += (size_t)near_groups_of(tree, i);
    }
    LimVessel *lim = calloc(1, sizeof *lim);
    if (!lim)
        return NULL;
    lim->vessel = (Vessel){.kind = "lim", .query = lim_query, .locate = lim_locate, .inlet = lim_inlet, .destroy = lim_destroy, .primitives = tree->blob_count};
    lim->tree = tree;
    lim->options = *options;
    SEL_ASSERT(options->field == LIM_SWITCH || options->field == LIM_BLEND, "the field is one of the two kinds");
    lim->options.hops = options->hops > 0 ? options->hops : 1;
    lim->kernels = lane_kernels(options->isa);
    lim->group = aligned_alloc(BLOB_GROUP_ALIGNMENT, groups * sizeof *lim->group);
    lim->near = aligned_alloc(BLOB_GROUP_ALIGNMENT, (near + 1) * sizeof *lim->near);
    lim->model = calloc((size_t)tree->node_count, sizeof *lim->model);
    if (!power_blocks_create(&lim->blocks, tree) || !lim->group || !lim->near || !lim->model) {
        lim_destroy(&lim->vessel);
        return NULL;
    }
    size_t of_node = sizeof *lim->model + 2 * sizeof(Vec3) + sizeof(double) + sizeof(uint8_t) + 2 * sizeof(int);
    size_t links = (size_t)tree->near_offset[tree->node_count];
    for (int level = 0; level < lim->blocks.levels; level++)
        lim->vessel.bytes += (size_t)lim->blocks.count[level] * sizeof(PowerBox);
    lim->vessel.bytes += sizeof *lim + groups * sizeof *lim->group + near * sizeof *lim->near + (size_t)tree->node_count * of_node + links * sizeof *tree->near;
    fill_models(lim, groups, near);
    lim->inlet_open = vessel_tree_root_is_open(tree);
    carry_inlet(lim);
    return &lim->vessel;
}

Vessel *lim_vessel_create(const VesselTree *tree)
{
    LimVesselOptions options = lim_vessel_default_options();
    return lim_vessel_create_with(tree, &options);
}
