// Contact with a field of shared blobs: the closest point of f = 0, by Newton from where the remembered foot should have moved to.
//
// A point's node is that in whose power cell its foot lies. Within a margin about the cell the node sees all blobs that reach there (blob_flood.h), so
// what is asked at the foot is the whole field, and two near cells give the same bits where they meet. Its blobs within a skin of the foot are held in the
// point's memory; when the foot has moved by the skin, and only then, they are looked for anew, and the cell with them.
//
// The closest wall. Let f bend down by no more than M about a foot p with gap g > 0: f(p + s n + t) >= |grad f| s - M (s^2 + |t|^2) / 2. In the ball of
// radius g about X s^2 + |t|^2 <= 2 g s, so that with M g < |grad f| it is all lumen and p the closest: nothing else needs to be asked. The same with the
// bend up for points outside. M comes with the list: over a ball, a blob bends down by at most 6 a u^2 / R^2 (a > 0) or 6 |a| u (4 - 5u) / R^2 (a < 0).
// Where that does not tell, M is taken over the ball about X itself; else the foot is compared with a projection from scratch, and then trusted for
// a part of the radius of travel.
//
// The inlet. Blobs close upstream of the root, the vessel does not. With z the height over the root's plane along its direction d, nodes near it are
// asked at X + (zeta(z) - z) d instead of at X: zeta = z downstream of h = r / 2, 0 upstream of -h, with a continuous second derivative between. So the
// section at the root goes on upstream as a cylinder for ever, and wall, normal and Hessian are smooth across the plane.
#include "geom/blob_flood.h"
#include "geom/blobby.h"
#include "geom/field_lanes.h"
#include "geom/power_blocks.h"
#include "geom/power_walk.h"
#include "geom/vessel.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

typedef struct FieldNode {
    Vec3 center;
    double radius, bend;     // [mm], and its inverse
    double skin;             // [mm] about the foot in which blobs are held
    double clear;            // [mm] the wall is certainly at least this far from the centre; < 0: not known
    const int32_t *seen;     // its blobs
    int seen_count;
    bool carried;            // near the inlet: goes on upstream
} FieldNode;

typedef struct FieldVessel {
    Vessel vessel;           // first: a Vessel * to us is a FieldVessel *
    const VesselTree *tree;
    const FieldKernels *kernels;
    FieldRow *row;           // (B+1) the last one without weight
    double *reach;           // (B+1) R
    FieldNode *node;         // (N)
    PowerBlocks blocks;      // for points without a node
    bool inlet_open;         // the root is an end of the tree
} FieldVessel;

static const double SKIN = 0.15;             // of the radius, < BLOB_FLOOD_MARGIN
static const double TRUST = 0.05;            // of the radius
static const double REST = 1e-8;             // [mm] what Newton may leave of the gap
// Feet on two nodes' walls that are closer together than this [mm] are the same.
static const double AGREE = 1e-3;

// --- The inlet ---

static double inlet_height(const FieldVessel *field, Vec3 x) { return vec3_dot(vec3_sub(x, field->tree->center[0]), field->tree->direction[0]); }
static double inlet_zone(const FieldVessel *field) { return 0.5 * field->tree->radius[0]; }   // h

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

// Where a node's field is asked for the wall at x.
static Vec3 asked_at(const FieldVessel *field, const FieldNode *node, Vec3 x)
{
    if (!node->carried)
        return x;
    double slope, bend, z = inlet_height(field, x);
    return vec3_add_scaled(x, carried_height(z, inlet_zone(field), &slope, &bend) - z, field->tree->direction[0]);
}

// The field at the running feet of a block, near the inlet as it goes on upstream.
static void sample(const FieldVessel *field, FieldBlock *b)
{
    FootSample *s = &b->foot.at;
    if (!s->any_carried) {
        field->kernels->sample(b);
        return;
    }
    Vec3 at[FOOT_BLOCK], d = field->tree->direction[0];
    double slope[FOOT_BLOCK], bend[FOOT_BLOCK];
    for (int i = 0; i < FOOT_BLOCK; i++) {
        at[i] = vec3(s->x[i], s->y[i], s->z[i]);
        double z = inlet_height(field, at[i]), to = z;
        slope[i] = 1, bend[i] = 0;
        if (s->carried[i])
            to = carried_height(z, inlet_zone(field), &slope[i], &bend[i]);
        if (to != z)
            s->x[i] += (to - z) * d.x, s->y[i] += (to - z) * d.y, s->z[i] += (to - z) * d.z;
    }
    field->kernels->sample(b);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        s->x[i] = at[i].x, s->y[i] = at[i].y, s->z[i] = at[i].z;
        if (slope[i] == 1)
            continue;
        // with J = I + c d d': J g, J H J + (g.d) zeta'' d d'
        double c = slope[i] - 1, along = s->gx[i] * d.x + s->gy[i] * d.y + s->gz[i] * d.z;
        s->gx[i] += c * along * d.x, s->gy[i] += c * along * d.y, s->gz[i] += c * along * d.z;
        Vec3 v = {s->hxx[i] * d.x + s->hxy[i] * d.y + s->hxz[i] * d.z, s->hxy[i] * d.x + s->hyy[i] * d.y + s->hyz[i] * d.z,
                  s->hxz[i] * d.x + s->hyz[i] * d.y + s->hzz[i] * d.z};
        v = vec3_add_scaled(vec3_scale(v, c), 0.5 * (c * c * vec3_dot(v, d) + along * bend[i]), d);
        s->hxx[i] += 2 * d.x * v.x, s->hxy[i] += d.x * v.y + v.x * d.y, s->hxz[i] += d.x * v.z + v.x * d.z;
        s->hyy[i] += 2 * d.y * v.y, s->hyz[i] += d.y * v.z + v.y * d.z, s->hzz[i] += 2 * d.z * v.z;
    }
}

// --- Cells and lists ---

// The node in whose cell q lies, from `node` downhill over near nodes.
static int cell_of(const FieldVessel *field, Vec3 q, int node)
{
    const VesselTree *tree = field->tree;
    double best = power_distance(q, tree->center[node], tree->radius[node]);
    for (int from = -1; from != node;) {
        from = node;
        for (int k = tree->near_offset[from]; k < tree->near_offset[from + 1]; k++) {
            double d = power_distance(q, tree->center[tree->near[k]], tree->radius[tree->near[k]]);
            if (d < best) {
                best = d;
                node = tree->near[k];
            }
        }
    }
    return node;
}

// Does the node see all blobs that reach q? That holds to within a margin of its cell.
static bool sees_all(const FieldVessel *field, Vec3 q, int node)
{
    const VesselTree *tree = field->tree;
    double own = power_distance(q, tree->center[node], tree->radius[node]), far = 2 * BLOB_FLOOD_MARGIN * tree->radius[node];
    for (int k = tree->near_offset[node]; k < tree->near_offset[node + 1]; k++) {
        int other = tree->near[k];
        double beyond = own - power_distance(q, tree->center[other], tree->radius[other]);
        if (beyond > 0 && beyond * beyond > far * far * vec3_norm2(vec3_sub(tree->center[other], tree->center[node])))
            return false;
    }
    return true;
}

// Over a ball in which |X - C| is from `least` to `most`, a blob bends down by no more than *down and up by no more than *up.
static void blob_bends(const FieldRow *row, double least, double most, double *down, double *up)
{
    double high = 1 - least * least * row->inverse, low = fmax(1 - most * most * row->inverse, 0), six = 6 * fabs(row->amplitude) * row->inverse;
    if (!(high > 0))
        return;
    // across the blob's radius 6 a u^2 / R^2 downwards, along it 6 a u (4 - 5 u) / R^2 upwards, which is most at u = 0.4
    double across = six * high * high, u = high < 0.4 ? high : low > 0.4 ? low : 0.4, along = six * fmax(u * (4 - 5 * u), 0);
    *down += row->amplitude > 0 ? across : along;
    *up += row->amplitude > 0 ? along : across;
}

// No more than what f bends by within `within` of q.
static void field_bends(const FieldVessel *field, const FieldNode *node, Vec3 q, double within, double *down, double *up)
{
    *down = *up = 0;
    for (int k = 0; k < node->seen_count; k++) {
        const FieldRow *row = &field->row[node->seen[k]];
        double far2 = vec3_norm2(vec3_sub(q, vec3(row->cx, row->cy, row->cz))), reach = field->reach[node->seen[k]] + within;
        if (far2 < reach * reach) {
            double far = sqrt(far2);
            blob_bends(row, fmax(far - within, 0), far + within, down, up);
        }
    }
}

// Makes the list of a memory for feet about q, as its node sees them; `gap`: how far from there X is.
static void hold_blobs(const FieldVessel *field, VesselMemory *m, Vec3 q, double gap)
{
    const FieldNode *node = &field->node[m->node];
    double skin = node->skin;
    int count = VESSEL_BLOBS + 1;
    for (int shrink = 0; shrink < 3 && count > VESSEL_BLOBS; shrink++) {
        skin = shrink ? 0.4 * skin : skin;
        count = 0;
        for (int k = 0; k < node->seen_count && count <= VESSEL_BLOBS; k++) {
            const FieldRow *row = &field->row[node->seen[k]];
            double reach = field->reach[node->seen[k]] + skin;
            if (!(vec3_norm2(vec3_sub(q, vec3(row->cx, row->cy, row->cz))) < reach * reach))
                continue;
            if (count < VESSEL_BLOBS)
                m->blob[count] = node->seen[k];
            count++;
        }
    }
    m->blobs = count <= VESSEL_BLOBS ? count : -1;
    for (int k = count; k < VESSEL_BLOBS; k++)
        m->blob[k] = (int32_t)field->tree->blob_count;
    m->held_at = q;
    m->held_for2 = skin * skin;
    double within = 2 * fabs(gap) + 3 * skin;
    field_bends(field, node, q, within, &m->bound[0], &m->bound[1]);
    m->bound[2] = within - skin;
    m->bound[3] = 0;
}

// The field of a node at q, and the size of its slope.
static double field_at(const FieldVessel *field, int node, Vec3 q, double *slope)
{
    Blobby blobs = blobby_of(field->tree, node);
    Vec3 g;
    double f = blobby_gradient(&blobs, q, &g);
    *slope = vec3_norm(g);
    return f;
}

// [mm] by which the walls of two nodes about a foot q differ.
static double walls_apart(const FieldVessel *field, int a, int b, Vec3 q)
{
    double slope_a, slope_b, f_a = field_at(field, a, q, &slope_a), f_b = field_at(field, b, q, &slope_b), slope = fmax(slope_a, slope_b);
    return fabs(f_a - f_b) / fmax(slope, 1e-3 / field->node[a].radius);
}

// --- Feet ---

typedef struct Foot {
    Vec3 at, normal;
    Sym3 hessian;            // of the gap at X
    double gap;
    int node;
    bool sure;
} Foot;

static void set_lane(const FieldVessel *field, FieldBlock *b, int i, int node)
{
    const FieldNode *n = &field->node[node];
    b->foot.radius[i] = n->radius, b->foot.bend[i] = n->bend, b->foot.allowed[i] = REST;
    b->foot.at.carried[i] = n->carried, b->foot.at.any_carried |= n->carried;
}

static void set_whole_list(const FieldVessel *field, FieldBlock *b, int i, int node)
{
    b->list[i] = field->node[node].seen, b->count[i] = field->node[node].seen_count;
    b->slots = 0;
}

static Foot lane_foot(const FieldBlock *b, int i, int node)
{
    const FootBatch *f = &b->foot;
    return (Foot){.at = vec3(f->at.x[i], f->at.y[i], f->at.z[i]), .normal = vec3(f->nx[i], f->ny[i], f->nz[i]), .gap = f->gap[i], .node = node,
                  .hessian = {f->axx[i], f->axy[i], f->axz[i], f->ayy[i], f->ayz[i], f->azz[i]}};
}

// Careful Newton steps from a start, of one point, on all that its node sees. False where they do not arrive.
static bool settle(const FieldVessel *field, Vec3 x, int node, Vec3 start, Foot *foot)
{
    enum { ROUNDS = 16 };
    FieldBlock b = {.row = field->row};
    for (int i = 0; i < FOOT_BLOCK; i++) {
        set_lane(field, &b, i, node);
        set_whole_list(field, &b, i, node);
        b.count[i] = i == 0 ? b.count[i] : 0;
        b.foot.xx[i] = x.x, b.foot.xy[i] = x.y, b.foot.xz[i] = x.z;
        b.foot.at.x[i] = start.x, b.foot.at.y[i] = start.y, b.foot.at.z[i] = start.z;
        b.foot.longest[i] = 0.5 * b.foot.radius[i];
        b.foot.state[i] = i == 0 ? FOOT_PENDING : FOOT_DONE;
    }
    for (int round = 0; round < ROUNDS && b.foot.state[0] == FOOT_PENDING; round++) {
        sample(field, &b);
        field->kernels->newton(&b, true);
    }
    if (b.foot.state[0] != FOOT_DONE)
        return false;
    field->kernels->finish(&b);
    *foot = lane_foot(&b, 0, node);
    return true;
}

static double field_here(const FieldVessel *field, int node, Vec3 x)
{
    Blobby blobs = blobby_of(field->tree, node);
    return blobby_field(&blobs, asked_at(field, &field->node[node], x));
}

// The wall in the plane through x across the inlet's direction: for points upstream, of which nothing else finds it.
static bool project_in_section(const FieldVessel *field, Vec3 x, int node, Foot *foot)
{
    enum { AROUND = 24, OUT = 24, HALVINGS = 30 };
    Vec3 d = field->tree->direction[0], e1 = vec3_normal_to(d), e2 = vec3_cross(d, e1);
    Vec3 axis = vec3_add_scaled(field->tree->center[0], inlet_height(field, x), d);
    double radius = field->tree->radius[0], best = HUGE_VAL;
    Vec3 from = field_here(field, node, x) > 0 ? x : axis, start = x;
    for (int k = 0; k < AROUND; k++) {
        double angle = 2 * PI * k / AROUND, in = 0, out = 0;
        Vec3 way = vec3_add(vec3_scale(e1, cos(angle)), vec3_scale(e2, sin(angle)));
        for (int step = 1; step <= OUT && out == 0; step++)
            if (field_here(field, node, vec3_add_scaled(from, 0.15 * radius * step, way)) > 0)
                in = 0.15 * radius * step;
            else
                out = 0.15 * radius * step;
        if (out == 0)
            continue;
        for (int half = 0; half < HALVINGS; half++) {
            double middle = 0.5 * (in + out);
            *(field_here(field, node, vec3_add_scaled(from, middle, way)) > 0 ? &in : &out) = middle;
        }
        Vec3 p = vec3_add_scaled(from, in, way);
        double far = vec3_norm2(vec3_sub(p, x));
        if (far < best) {
            best = far;
            start = p;
        }
    }
    return best < HUGE_VAL && settle(field, x, node, start, foot);
}

// The foot of x on the wall of one node, from scratch.
static Foot project_on(const FieldVessel *field, Vec3 x, int node)
{
    Blobby blobs = blobby_of(field->tree, node);
    Foot foot;
    bool carried = field->node[node].carried;
    if (carried && inlet_height(field, x) < inlet_zone(field) && project_in_section(field, x, node, &foot)) {
        foot.sure = true;
        return foot;
    }
    SurfacePoint s = blobby_project(&blobs, x, x);
    if (s.converged && settle(field, x, node, s.foot, &foot) && fabs(foot.gap) < fabs(s.distance) + 1e-6) {
        foot.sure = true;
        return foot;
    }
    foot = (Foot){.at = s.foot, .normal = s.normal, .gap = s.distance, .node = node, .sure = s.converged};
    return foot;
}

// The foot of x from scratch: on the wall of its own node, then on that of the cell in which the foot lies.
static Foot project(const FieldVessel *field, Vec3 x, int node)
{
    enum { CELLS = 4 };
    Foot foot = project_on(field, x, node);
    for (int k = 0; k < CELLS && foot.sure; k++) {
        Vec3 q = asked_at(field, &field->node[foot.node], foot.at);
        int cell = cell_of(field, q, foot.node);
        Foot next;
        if (cell == foot.node || (sees_all(field, q, foot.node) && walls_apart(field, foot.node, cell, q) > AGREE) ||
            !settle(field, x, cell, foot.at, &next))
            break;
        next.sure = true;
        foot = next;
    }
    return foot;
}

// --- Queries ---

static int walk(const FieldVessel *field, Vec3 x, int from, int hops)
{
    bool known = from >= 0 && from < field->tree->node_count;
    return known ? power_walk(field->tree, x, from, hops) : power_blocks_nearest(&field->blocks, x);
}

static void set_clearance(VesselMemory *m, Vec3 x, double clearance)
{
    m->clearance = clearance > 0 ? 0.999 * clearance : 0;
    m->clear_place = x;
}

// Is the ball about x with radius |gap| certainly all on x's side of the wall of which `foot` is the foot?
static bool is_closest(const FieldVessel *field, Vec3 x, const Foot *foot)
{
    const FieldNode *node = &field->node[foot->node];
    double down, up, slope, size = fabs(foot->gap);
    if (node->carried && inlet_height(field, x) - size < inlet_zone(field))
        return false;
    field_bends(field, node, x, size, &down, &up);
    field_at(field, foot->node, foot->at, &slope);
    return (foot->gap > 0 ? down : up) * size < 0.99 * slope;
}

// What is remembered and answered where lanes do not say it.
static void answer(const FieldVessel *field, Vec3 x, const Foot *foot, VesselMemory *m, VesselHit *hit)
{
    const FieldNode *node = &field->node[foot->node];
    *hit = (VesselHit){.gap = foot->gap, .normal = foot->normal, .hessian = foot->hessian, .node = foot->node, .flags = foot->sure ? 0 : VESSEL_UNSURE};
    m->node = foot->node;
    m->has_foot = foot->sure;
    m->foot = foot->at;
    m->place = x;
    m->normal = foot->normal;
    m->hessian = foot->hessian;
    m->miss = m->step = vec3(0, 0, 0);
    if (foot->sure)
        hold_blobs(field, m, asked_at(field, node, foot->at), foot->gap);
}

static void set_flags(const FieldVessel *field, Vec3 x, int node, VesselHit *hit)
{
    if (field->node[node].carried && inlet_height(field, x) < 0)
        hit->flags |= VESSEL_BEYOND;
}

// A foot from scratch. The certainly clear ball about x, where it is wider than the foot is sure, is left to later.
static void answer_afresh(const FieldVessel *field, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    int node = walk(field, x, m->node, 4);
    Foot foot = project(field, x, node);
    if (m->has_foot && m->node != foot.node) {
        // the remembered node's wall may be the closer one: a foot follows its wall where the cell of X is another's
        Foot other = project(field, x, m->node);
        if (other.sure && (!foot.sure || fabs(other.gap) < fabs(foot.gap)))
            foot = other;
    }
    answer(field, x, &foot, m, hit);
    m->trust = foot.sure ? TRUST * field->node[foot.node].radius : 0;
    set_clearance(m, x, foot.sure && is_closest(field, x, &foot) ? foot.gap : 0);
    set_flags(field, x, foot.node, hit);
}

// Answers where no field is needed; false where one is.
static bool answer_cheaply(const FieldVessel *field, Vec3 x, double reach, VesselMemory *m, VesselHit *hit)
{
    if (!(vec3_norm2(x) < 1e100)) {
        *hit = (VesselHit){.node = m->node, .flags = VESSEL_UNSURE};
        return true;
    }
    if (m->node < 0 || m->node >= field->tree->node_count) {
        *m = (VesselMemory){.node = walk(field, x, -1, 0)};
        double clear = field->node[m->node].clear - vec3_distance(x, field->node[m->node].center);
        set_clearance(m, x, clear);
    }
    if (m->node == 0 && field->inlet_open && !field->node[0].carried && inlet_height(field, x) < 0) {
        m->has_foot = false;
        m->clearance = 0;
        *hit = (VesselHit){.gap = HUGE_VAL, .node = m->node, .flags = VESSEL_OPEN_END};
        return true;
    }
    double away = m->clearance - reach;
    if (!(away > 0 && vec3_norm2(vec3_sub(x, m->clear_place)) < away * away))
        return false;
    *hit = (VesselHit){.gap = m->clearance - vec3_distance(x, m->clear_place), .node = m->node, .flags = VESSEL_FAR};
    return true;
}

// The foot has left what its memory holds: the cell and the list about q. False where q is too far from the cell for that. A node whose field there
// contradicts the own one is not taken.
static bool hold_anew(const FieldVessel *field, VesselMemory *m, Vec3 q, double gap)
{
    int cell = cell_of(field, q, m->node);
    if (cell != m->node) {
        if (!sees_all(field, q, m->node))
            return false;
        if (!(walls_apart(field, m->node, cell, q) > AGREE))
            m->node = cell;
    }
    hold_blobs(field, m, q, gap);
    return true;
}

typedef struct Batch {
    const Vec3 *point;
    VesselMemory *memory;
    VesselHit *hit;
    int count, lane[FOOT_BATCH];             // points whose feet are followed …
    int later_count, later[FOOT_BATCH];      // … those for which one step did not do, from …
    Vec3 start[FOOT_BATCH];
    int afresh_count, afresh[FOOT_BATCH];    // … and those that start from scratch
} Batch;

static void fill_lane(const FieldVessel *field, FieldBlock *b, int i, const Batch *batch, int point)
{
    VesselMemory *m = &batch->memory[point];
    set_lane(field, b, i, m->node);
    b->point[i] = &batch->point[point].x;
    b->memory[i] = &m->foot.x;
    b->list[i] = m->blob, b->count[i] = m->blobs;
    if (m->blobs < 0)
        set_whole_list(field, b, i, m->node);
}

// Lanes that have left what they hold; those of which that is no small step are lost.
static void lanes_hold_anew(const FieldVessel *field, FieldBlock *b, unsigned lanes, const Batch *batch, const int *point)
{
    for (; lanes != 0; lanes &= lanes - 1) {
        int i = __builtin_ctz(lanes);
        VesselMemory *m = &batch->memory[point[i]];
        Vec3 p = vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]), q = asked_at(field, &field->node[m->node], p);
        if (!hold_anew(field, m, q, vec3_distance(p, batch->point[point[i]]))) {
            b->foot.state[i] = FOOT_LOST;
            continue;
        }
        fill_lane(field, b, i, batch, point[i]);
        b->held_x[i] = m->held_at.x, b->held_y[i] = m->held_at.y, b->held_z[i] = m->held_at.z, b->held_for2[i] = m->held_for2;
        b->down[i] = m->bound[0], b->up[i] = m->bound[1], b->within[i] = m->bound[2];
    }
}

// Near the inlet lists are about where the field is asked for the foot.
static unsigned moved_lanes(const FieldVessel *field, const FieldBlock *b, unsigned moved, const Batch *batch, const int *point, int count, bool all)
{
    for (int i = 0; i < count; i++) {
        if (!b->foot.at.carried[i] && !all)
            continue;
        Vec3 q = asked_at(field, &field->node[batch->memory[point[i]].node], vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]));
        double far2 = vec3_norm2(vec3_sub(q, vec3(b->held_x[i], b->held_y[i], b->held_z[i])));
        moved = (moved & ~(1u << i)) | (far2 <= b->held_for2[i] ? 0u : 1u << i);
    }
    return moved;
}

// Near the inlet the bounds are those of the field as it is asked, which the change of place bends further: (g.d) zeta'', zeta'' <= 0.75 / h.
static unsigned sure_near_inlet(const FieldVessel *field, const FieldBlock *b, unsigned sure, int count)
{
    Vec3 d = field->tree->direction[0];
    double more = 0.75 / inlet_zone(field);
    for (int i = 0; i < count; i++) {
        if (!b->foot.at.carried[i])
            continue;
        double size = fabs(b->foot.gap[i]), bend = fmax(b->down[i], b->up[i]);
        Vec3 g = {b->foot.at.gx[i], b->foot.at.gy[i], b->foot.at.gz[i]};
        double along = fabs(vec3_dot(g, d)) + 2 * bend * size;
        if (!((bend + more * along) * size < 0.95 * vec3_norm(g) && 2 * size <= b->within[i]))
            sure &= ~(1u << i);
    }
    return sure;
}

enum { AFTER_START = 5 };

// Follows the feet of up to eight points; with `start` from there, by several steps.
static void follow_block(const FieldVessel *field, Batch *batch, const int *point, int count, const Vec3 *start)
{
    FieldBlock b;
    double spare[MEMORY_WRITTEN], no_hit[HIT_ROW];
    unsigned all = (1u << count) - 1;
    b.row = field->row;
    b.slots = VESSEL_BLOBS;
    b.foot.at.any_carried = false;
    for (int i = 0; i < FOOT_BLOCK; i++)
        fill_lane(field, &b, i, batch, point[i < count ? i : 0]);
    unsigned moved = field->kernels->load(&b) & all;
    if (start)
        for (int i = 0; i < FOOT_BLOCK; i++) {
            const Vec3 *p = &start[i < count ? i : 0];
            b.foot.at.x[i] = p->x, b.foot.at.y[i] = p->y, b.foot.at.z[i] = p->z;
        }
    if (start || b.foot.at.any_carried)
        moved = moved_lanes(field, &b, moved, batch, point, count, start != NULL);
    lanes_hold_anew(field, &b, moved, batch, point);
    unsigned done = 0;
    for (int round = 0; round < (start ? AFTER_START : 1) && (done & all) != all; round++) {
        if (round > 0)
            lanes_hold_anew(field, &b, moved_lanes(field, &b, 0, batch, point, count, true) & ~done & all, batch, point);
        sample(field, &b);
        done = field->kernels->newton(&b, false);
    }
    unsigned sure = field->kernels->finish(&b);
    if (b.foot.at.any_carried)
        sure = sure_near_inlet(field, &b, sure, count);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        bool use = false;
        int p = point[i < count ? i : 0];
        if (i < count && done >> i & 1) {
            use = sure >> i & 1;
            if (!use) {
                b.trust[i] -= sqrt(b.dx[i] * b.dx[i] + b.dy[i] * b.dy[i] + b.dz[i] * b.dz[i]);
                Foot foot = lane_foot(&b, i, batch->memory[p].node);
                use = b.trust[i] > 0 || is_closest(field, batch->point[p], &foot);
            }
        }
        if (i < count && !use) {
            if (!start && b.foot.state[i] == FOOT_PENDING) {
                batch->start[batch->later_count] = vec3(b.foot.at.x[i], b.foot.at.y[i], b.foot.at.z[i]);
                batch->later[batch->later_count++] = p;
            } else {
                batch->afresh[batch->afresh_count++] = p;
            }
        }
        b.keep[i] = use ? &batch->memory[p].foot.x : spare;
        b.hit[i] = use ? &batch->hit[p].gap : no_hit;
        if (use) {
            VesselHit *hit = &batch->hit[p];
            VesselMemory *m = &batch->memory[p];
            hit->node = m->node;
            hit->flags = 0;
            set_clearance(m, batch->point[p], sure >> i & 1 ? b.foot.gap[i] : 0);
            set_flags(field, batch->point[p], m->node, hit);
        }
    }
    field->kernels->store(&b);
}

static void query_batch(const FieldVessel *field, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    Batch batch = {.point = point, .memory = memory, .hit = hit};
    for (int i = 0; i < count; i++) {
        if (answer_cheaply(field, point[i], reach, &memory[i], &hit[i]))
            continue;
        if (memory[i].has_foot)
            batch.lane[batch.count++] = i;
        else
            batch.afresh[batch.afresh_count++] = i;
    }
    for (int i = 0; i < batch.count; i += FOOT_BLOCK)
        follow_block(field, &batch, batch.lane + i, batch.count - i < FOOT_BLOCK ? batch.count - i : FOOT_BLOCK, NULL);
    for (int i = 0; i < batch.later_count; i += FOOT_BLOCK)
        follow_block(field, &batch, batch.later + i, batch.later_count - i < FOOT_BLOCK ? batch.later_count - i : FOOT_BLOCK, batch.start + i);
    for (int i = 0; i < batch.afresh_count; i++)
        answer_afresh(field, point[batch.afresh[i]], &memory[batch.afresh[i]], &hit[batch.afresh[i]]);
}

static void field_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i += FOOT_BATCH) {
        int n = count - i < FOOT_BATCH ? count - i : FOOT_BATCH;
        query_batch((const FieldVessel *)vessel, n, point + i, reach, memory + i, hit + i);
    }
}

static int field_locate(const Vessel *vessel, Vec3 point, int from) { return walk((const FieldVessel *)vessel, point, from, INT_MAX); }

static bool field_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const FieldVessel *field = (const FieldVessel *)vessel;
    *point = field->tree->center[0];
    *direction = field->tree->direction[0];
    return true;
}

static void field_destroy(Vessel *vessel)
{
    FieldVessel *field = (FieldVessel *)vessel;
    if (!field)
        return;
    free(field->row);
    free(field->reach);
    free(field->node);
    power_blocks_free(&field->blocks);
    free(field);
}

// --- Making one ---

static void fill_rows(FieldVessel *field)
{
    const VesselTree *tree = field->tree;
    for (int64_t j = 0; j < tree->blob_count; j++) {
        Vec3 c = tree->blob_center[j];
        double width = tree->blob_width[j];
        field->row[j] = (FieldRow){c.x, c.y, c.z, 1 / (width * width), tree->blob_amplitude[j], {0}};
        field->reach[j] = width;
    }
    field->row[tree->blob_count] = (FieldRow){0};
    field->reach[tree->blob_count] = 0;
}

// A ball about the node's centre that is certainly lumen: f(C + v) >= f(C) - |grad f| |v| - M |v|^2 / 2.
static double clear_ball(const FieldVessel *field, int i)
{
    double slope, down, up, f = field_at(field, i, field->node[i].center, &slope);
    for (double part = 0.95; part > 0.2; part -= 0.15) {
        double ball = part * field->node[i].radius;
        field_bends(field, &field->node[i], field->node[i].center, ball, &down, &up);
        if (f - ball * (slope + 0.5 * ball * down) > 0)
            return ball;
    }
    return -HUGE_VAL;
}

static void fill_nodes(FieldVessel *field)
{
    const VesselTree *tree = field->tree;
    for (int i = 0; i < tree->node_count; i++) {
        FieldNode *n = &field->node[i];
        n->center = tree->center[i];
        n->radius = tree->radius[i];
        n->bend = 1 / n->radius;
        n->skin = SKIN * n->radius;
        n->seen = tree->seen + tree->seen_offset[i];
        n->seen_count = (int)(tree->seen_offset[i + 1] - tree->seen_offset[i]);
        n->clear = clear_ball(field, i);
    }
    for (int k = tree->near_offset[0] - 1; k < tree->near_offset[1] && field->inlet_open; k++) {
        int node = k < tree->near_offset[0] ? 0 : tree->near[k];
        Blobby blobs = blobby_of(tree, node);
        field->node[node].carried = blobby_field(&blobs, tree->center[0]) > 0;
        if (field->node[node].carried)
            field->node[node].clear = fmin(field->node[node].clear, inlet_height(field, tree->center[node]) - inlet_zone(field));
    }
}

Vessel *field_vessel_create_with(const VesselTree *tree, int isa)
{
    FieldVessel *field = tree && vessel_tree_is_shared(tree) && vessel_tree_is_model(tree) ? calloc(1, sizeof *field) : NULL;
    if (!field)
        return NULL;
    field->vessel = (Vessel){.kind = "field", .query = field_query, .locate = field_locate, .inlet = field_inlet, .destroy = field_destroy,
                             .primitives = tree->blob_count};
    field->tree = tree;
    field->kernels = field_kernels(isa);
    size_t rows = (size_t)tree->blob_count + 1, nodes = (size_t)tree->node_count;
    field->row = aligned_alloc(64, rows * sizeof *field->row);
    field->reach = calloc(rows, sizeof *field->reach);
    field->node = calloc(nodes, sizeof *field->node);
    if (!power_blocks_create(&field->blocks, tree) || !field->row || !field->reach || !field->node) {
        field_destroy(&field->vessel);
        return NULL;
    }
    size_t links = (size_t)tree->near_offset[nodes];
    field->vessel.bytes = sizeof *field + rows * (sizeof *field->row + sizeof *field->reach) + (size_t)tree->seen_offset[nodes] * sizeof *tree->seen +
                          nodes * (sizeof *field->node + sizeof(Vec3) + sizeof(double) + sizeof(int)) + links * sizeof *tree->near;
    for (int level = 0; level < field->blocks.levels; level++)
        field->vessel.bytes += (size_t)field->blocks.count[level] * sizeof(PowerBox);
    field->inlet_open = vessel_tree_root_is_open(tree);
    fill_rows(field);
    fill_nodes(field);
    return &field->vessel;
}

Vessel *field_vessel_create(const VesselTree *tree) { return field_vessel_create_with(tree, 0); }

Vessel *model_vessel_create(const VesselTree *tree)
{
    return tree && vessel_tree_is_shared(tree) ? field_vessel_create(tree) : lim_vessel_create(tree);
}
