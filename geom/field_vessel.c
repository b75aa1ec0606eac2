// Contact with a field of shared blobs: the closest point of f = 0 (the foot), by Newton from the predicted position of the remembered foot.
//
// A point's node is the one in whose power cell its foot lies. Within a margin around the cell the node sees all blobs that reach there (blob_flood.h), so the
// field evaluated at the foot is complete, and two near cells give the same bits where they meet. The blobs within a skin of the foot are held in the point's
// memory; only when the foot has moved by the skin are they and the cell searched for again.
//
// The closest wall. Let M bound the downward second derivative of f around a foot p with gap g > 0: f(p + s n + t) >= |grad f| s - M (s^2 + |t|^2) / 2. In the
// ball of radius g about X, s^2 + |t|^2 <= 2 g s. So if M g < |grad f|, the ball is all lumen and p is the closest point, without further evaluation. For
// points outside, the same holds with the upward second derivative. M is computed with the list of blobs: over a ball, a blob contributes at most 6 a u^2 / R^2
// (a > 0) or 6 |a| u (4 - 5u) / R^2 (a < 0). If this bound does not suffice, M is computed over the ball about X itself; otherwise the foot is compared with a
// projection from scratch, and then trusted for a fraction of the radius of travel.
//
// The inlet. Blobs close upstream of the root, the vessel does not. With z the height over the root's plane along its direction d, the field of nodes near it
// is evaluated at X + (zeta(z) - z) d instead of X: zeta = z downstream of h = r / 2, 0 upstream of -h, with a continuous second derivative between. So the
// section at the root continues upstream as a cylinder without end, and wall, normal and Hessian are smooth across the plane.
#include "geom/blob_flood.h"
#include "base/base.h"
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
    double radius, bend;     // [mm]; bend: its inverse
    double skin;             // [mm] distance from the foot within which blobs are held
    double clear;            // [mm] lower bound of the distance from the centre to the wall; < 0: unknown
    const int32_t *seen;     // blobs that the node sees
    int seen_count;
    bool carried;            // near the inlet: the wall continues upstream
} FieldNode;

enum { SEARCH_DIRECTIONS = 64 };
typedef struct FieldVessel {
    Vessel vessel;           // first: a Vessel * points to its FieldVessel
    const VesselTree *tree;
    const FieldKernels *kernels;
    FieldRow *row;           // (B+1) the last one has amplitude 0
    FieldNode *node;         // (N)
    PowerBlocks blocks;      // to locate points without a node
    bool inlet_open;         // the root is an open end of the tree
    Vec3 search_direction[SEARCH_DIRECTIONS]; // unit directions over the sphere
    ClearPoints clear_points, clear_rings;
} FieldVessel;

static const double SKIN = 0.2, SKIN_MOST = 0.3;    // relative to the radius, (1 + AHEAD) SKIN < BLOB_FLOOD_MARGIN; [mm]
static const double AHEAD = 0.45;            // relative to the skin
static const double BOUND = 0.1, BOUND_MOST = 0.15;  // by how much the ball of a bound is larger than the gap: relative to the radius; [mm]
static const double TRUST = 0.05;            // relative to the radius: a foot is followed over this travel with one rival; with more rivals over less, but at
                                             // least …
static const double TRUST_LEAST = 0.01;      // … this
static const double REST = 1e-8, REST_FRESH = 1e-10;     // [mm] error of the gap that Newton may leave: for a foot that is followed, for one found from scratch
// Feet on two nodes' walls are the same if they are closer together than this [mm].
static const double AGREE = 1e-3;
// Walls that are further apart than this [mm], which is less than any tool's radius, contradict each other.
static const double APART = 0.1;

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

// The point at which a node's field is evaluated for the wall at x.
static Vec3 transformed_point(const FieldVessel *field, const FieldNode *node, Vec3 x)
{
    if (!node->carried)
        return x;
    double slope, bend, z = inlet_height(field, x);
    return vec3_add_scaled(x, carried_height(z, inlet_zone(field), &slope, &bend) - z, field->tree->direction[0]);
}

// Returns whether part of a ball lies where the inlet changes the node's field.
static bool is_at_inlet(const FieldVessel *field, const FieldNode *node, Vec3 middle, double ball)
{
    return node->carried && inlet_height(field, middle) - ball < inlet_zone(field);
}

// The field at a block's current feet; near the inlet, the field that continues upstream.
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

// The node in whose cell q lies, by descent from `node` over near nodes.
static int cell_of(const FieldVessel *field, Vec3 q, int node)
{
    const VesselTree *tree = field->tree;
    SEL_ASSERT(node >= 0 && node < tree->node_count, "a walk starts at a node of the tree");
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

// Returns whether the node sees all blobs that reach q. True within a margin of its cell.
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

// A list of blobs: all that a node sees, or those of them that reach a ball.
enum { NEAR_BLOBS = 64 };
typedef struct BlobList {
    const int32_t *blob;
    int count;
    int32_t own[NEAR_BLOBS];
} BlobList;

// Lists the blobs that reach to within `skin` of q. Returns their number, of which at most `most` are listed.
static int pick_blobs(const FieldVessel *field, const int32_t *seen_blob, int seen_count, Vec3 q, double skin, int most, int32_t *list)
{
    SEL_ASSERT(seen_count >= 0 && most > 0 && skin >= 0, "the list has a length, the output has capacity, and the skin is a distance");
    enum { PART = 512 };
    uint8_t bits[PART / FOOT_BLOCK];
    int count = 0;
    for (int part = 0; part < seen_count && count <= most; part += PART) {
        int n = seen_count - part < PART ? seen_count - part : PART;
        const int32_t *seen = seen_blob + part;
        field->kernels->pick(field->row, seen, n, q, skin, bits);
        for (int k = 0; k < n; k += FOOT_BLOCK) {
            unsigned in = bits[k / FOOT_BLOCK] & (n - k < FOOT_BLOCK ? (1u << (n - k)) - 1 : 0xff);
            for (; in != 0; in &= in - 1, count++)
                if (count < most)
                    list[count] = seen[k + __builtin_ctz(in)];
        }
    }
    return count;
}

// The same as a BlobList with its own array; if that has too little space, all of `seen`.
static void pick_list(const FieldVessel *field, const int32_t *seen, int seen_count, Vec3 q, double skin, BlobList *list)
{
    list->blob = list->own;
    list->count = seen_count <= FOOT_BLOCK ? NEAR_BLOBS + 1 : pick_blobs(field, seen, seen_count, q, skin, NEAR_BLOBS, list->own);
    if (list->count > NEAR_BLOBS)
        list->blob = seen, list->count = seen_count;
}

// A node's blobs that reach to within `far` of x. Near the inlet all of them, because the field is evaluated elsewhere there.
static void list_blobs(const FieldVessel *field, int node, Vec3 x, double far, BlobList *list)
{
    SEL_ASSERT(node >= 0 && node < field->tree->node_count, "lists belong to nodes of the tree");
    const FieldNode *n = &field->node[node];
    pick_list(field, n->seen, n->seen_count, x, n->carried ? HUGE_VAL : far, list);
}

// How far beyond the gap the search for the closest wall evaluates the field, in radii.
static const double LOOK = 0.5;

// Fills a memory's list with the blobs that reach feet around q, or rather a point slightly ahead of q in the direction of the last motion.
static void hold_blobs(const FieldVessel *field, VesselMemory *m, Vec3 q, const BlobList *list)
{
    SEL_ASSERT(m->node >= 0 && m->node < field->tree->node_count, "a memory that holds blobs has a node");
    double skin = field->node[m->node].skin;
    Vec3 heading = vec3_unit_or(m->step, vec3(0, 0, 0));
    int count = VESSEL_BLOBS + 1;
    for (int shrink = 0; shrink < 3 && count > VESSEL_BLOBS; shrink++, skin *= 0.4) {
        m->held_at = vec3_add_scaled(q, AHEAD * skin, heading);
        m->held_for2 = skin * skin;
        count = pick_blobs(field, list->blob, list->count, m->held_at, skin, VESSEL_BLOBS, m->blob);
    }
    m->blobs = count <= VESSEL_BLOBS ? count : -1;
    for (int k = count; k < VESSEL_BLOBS; k++)
        m->blob[k] = (int32_t)field->tree->blob_count;
}

// Computes the bounds of the second derivative of f in a ball slightly larger than the gap.
static void hold_bounds(const FieldVessel *field, VesselMemory *m, int node, Vec3 x, double gap, const BlobList *list)
{
    const FieldNode *n = &field->node[node];
    m->bound_at = x;
    m->bound_for = fabs(gap) + fmin(BOUND * n->radius, BOUND_MOST);
    field->kernels->bends(field->row, list->blob, list->count, transformed_point(field, n, x), m->bound_for, &m->down, &m->up);
    SEL_ASSERT(m->down >= 0 && m->up >= 0, "bounds of second derivatives are at least 0");
}

// The field of a list at q, and its gradient.
static double field_at(const FieldVessel *field, const BlobList *list, Vec3 q, Vec3 *gradient)
{
    double f = -1;
    Vec3 g = {0, 0, 0};
    for (int k = 0; k < list->count; k++) {
        const FieldRow *b = &field->row[list->blob[k]];
        Vec3 d = {q.x - b->cx, q.y - b->cy, q.z - b->cz};
        double u = fmax(0, 1 - vec3_norm2(d) * b->inverse);
        f += b->amplitude * u * u * u;
        g = vec3_add_scaled(g, -6 * b->amplitude * b->inverse * u * u, d);
    }
    *gradient = g;
    return f;
}

// [mm] distance between the walls of two nodes around a foot q; 0 if both see the same blobs there.
static double walls_apart(const FieldVessel *field, int a, int b, Vec3 q)
{
    BlobList list_a, list_b;
    list_blobs(field, a, q, 0, &list_a);
    list_blobs(field, b, q, 0, &list_b);
    if (list_a.count == list_b.count && !memcmp(list_a.blob, list_b.blob, (size_t)list_a.count * sizeof *list_a.blob))
        return 0;
    Vec3 g_a, g_b;
    double f_a = field_at(field, &list_a, q, &g_a), f_b = field_at(field, &list_b, q, &g_b), slope = fmax(vec3_norm(g_a), vec3_norm(g_b));
    return fabs(f_a - f_b) / fmax(slope, 1e-3 / field->node[a].radius);
}

// --- Feet ---

typedef struct Foot {
    Vec3 at, normal;
    Sym3 hessian;            // Hessian of the gap at X
    double gap, slope;       // slope: |grad f| at the foot or very close to it
    int node;
    bool sure;
} Foot;

static void set_lane(const FieldVessel *field, FieldBlock *b, int i, int node, bool carried)
{
    SEL_ASSERT(i >= 0 && i < FOOT_BLOCK, "a lane is one of the block");
    SEL_ASSERT(node >= 0 && node < field->tree->node_count, "a lane's node is one of the tree");
    const FieldNode *n = &field->node[node];
    b->foot.radius[i] = n->radius, b->foot.bend[i] = n->bend, b->foot.allowed[i] = REST;
    b->foot.at.carried[i] = carried, b->foot.at.any_carried |= carried;
}

static void set_whole_list(const FieldVessel *field, FieldBlock *b, int i, int node)
{
    b->list[i] = field->node[node].seen, b->count[i] = field->node[node].seen_count;
    b->slots = 0;
}

static Foot lane_foot(const FieldBlock *b, int i, int node)
{
    const FootBatch *f = &b->foot;
    return (Foot){.at = vec3(f->at.x[i], f->at.y[i], f->at.z[i]),
                  .normal = vec3(f->nx[i], f->ny[i], f->nz[i]),
                  .gap = f->gap[i],
                  .node = node,
                  .slope = sqrt(f->at.gx[i] * f->at.gx[i] + f->at.gy[i] * f->at.gy[i] + f->at.gz[i] * f->at.gz[i]),
                  .hessian = {f->axx[i], f->axy[i], f->axz[i], f->ayy[i], f->ayz[i], f->azz[i]}};
}

// The blobs near each lane's current foot, valid within a skin of the point where they were picked.
typedef struct NearLists {
    Vec3 at[FOOT_BLOCK];
    BlobList list[FOOT_BLOCK];
} NearLists;

static void list_near(const FieldVessel *field, FieldBlock *b, int i, int node, NearLists *lists, bool fresh)
{
    static const double SETTLE_SKIN = 0.25;      // relative to the radius
    const FieldNode *n = &field->node[node];
    Vec3 q = transformed_point(field, n, vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]));
    double skin = SETTLE_SKIN * n->radius;
    if (!fresh && vec3_norm2(vec3_sub(q, lists->at[i])) <= skin * skin)
        return;
    lists->at[i] = q;
    pick_list(field, n->seen, n->seen_count, q, skin, &lists->list[i]);
    b->list[i] = lists->list[i].blob, b->count[i] = lists->list[i].count;
}

enum { ROUNDS = 16, FEW_ROUNDS = 8 };
// Careful Newton steps of one point from up to eight starts; collects the feet that converge. On the axis of a round vessel all feet around are equally near
// and Newton does not converge: any of them is correct to second order in the remaining tangential distance.
static int settle(const FieldVessel *field, Vec3 x, int node, const Vec3 *start, int count, int rounds, Foot *foot)
{
    SEL_ASSERT(count > 0 && count <= FOOT_BLOCK, "starts fit into a block");
    static const double LEFT = 1e-4, OFF = 1e-5;     // relative to the radius: tangential and normal residual
    static const double LONGEST = 0.25;              // relative to the start's distance: longer steps would leave a near ridge for a farther wall
    FieldBlock b;
    NearLists lists;
    FootBatch *f = &b.foot;
    unsigned done = 0;
    int found = 0;
    b.row = field->row;
    b.slots = 0;
    b.foot.at.any_carried = false;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        const Vec3 *from = &start[i < count ? i : 0];
        set_lane(field, &b, i, node, field->node[node].carried);
        f->xx[i] = x.x, f->xy[i] = x.y, f->xz[i] = x.z;
        f->at.x[i] = from->x, f->at.y[i] = from->y, f->at.z[i] = from->z;
        f->longest[i] = fmin(0.5 * f->radius[i], fmax(0.05 * f->radius[i], LONGEST * vec3_distance(x, *from)));
        f->allowed[i] = REST_FRESH;
        f->state[i] = FOOT_PENDING;
        if (i < count)
            list_near(field, &b, i, node, &lists, true);
        else
            b.list[i] = b.list[0], b.count[i] = 0;   // idle
    }
    unsigned all = (1u << count) - 1;
    for (int round = 0; round <= rounds; round++) {
        for (int i = 0; i < count && round > 0; i++)
            if (!(done >> i & 1))
                list_near(field, &b, i, node, &lists, false);
        sample(field, &b);
        if (round == rounds)
            break;
        done = field->kernels->newton(&b, true);
        if ((done & all) == all)
            break;
    }
    field->kernels->finish(&b);
    for (int i = 0; i < count; i++)
        if (done >> i & 1) {
            foot[found] = lane_foot(&b, i, node);
            foot[found++].sure = true;
        }
    for (int i = 0; i < count && found == 0; i++) {
        foot[0] = lane_foot(&b, i, node);
        Vec3 g = {f->at.gx[i], f->at.gy[i], f->at.gz[i]}, n = vec3_unit_or(g, vec3(0, 0, 0)), away = vec3_sub(foot[0].at, x);
        double gap = -vec3_dot(away, n), left = vec3_norm(vec3_add_scaled(away, gap, n)), slope = vec3_norm(g), radius = f->radius[i];
        if (!(slope > 1e-100 && gap > 0.5 * radius && left < LEFT * radius && fabs(f->at.f[i]) < OFF * radius * slope))
            continue;
        foot[0].normal = n, foot[0].gap = gap - f->at.f[i] / slope, foot[0].sure = true;
        found = 1;
    }
    return found;
}

// --- Search in all directions ---

static int walk(const FieldVessel *field, Vec3 x, int from, int hops)
{
    bool known = from >= 0 && from < field->tree->node_count;
    return known ? power_walk(field->tree, x, from, hops) : power_blocks_nearest(&field->blocks, x);
}

static double field_here(const FieldVessel *field, int node, Vec3 x)
{
    const FieldNode *n = &field->node[node];
    FieldLane at_x, at_y, at_z, f;
    Vec3 q = transformed_point(field, n, x);
    for (int i = 0; i < FOOT_BLOCK; i++)
        at_x[i] = q.x, at_y[i] = q.y, at_z[i] = q.z;
    field->kernels->look(field->row, n->seen, n->seen_count, at_x, at_y, at_z, f);
    return f[0];
}

// f at eight places; `list`: the node's blobs that reach there.
static void look(const FieldVessel *field, int node, const BlobList *list, const Vec3 *place, double *f)
{
    FieldLane at_x, at_y, at_z;
    for (int i = 0; i < FOOT_BLOCK; i++) {
        Vec3 q = transformed_point(field, &field->node[node], place[i]);
        at_x[i] = q.x, at_y[i] = q.y, at_z[i] = q.z;
    }
    field->kernels->look(field->row, list->blob, list->count, at_x, at_y, at_z, f);
}

// Near the foot, where the ball touches the wall, the points of the spheres do not detect a wall that is inclined by less than 50 degrees: there, points on
// rings of the ball itself are tested.
static bool is_clear(const FieldVessel *field, const BlobList *list, Vec3 middle, double ball, double side, Vec3 to_foot)
{
    BlobList in;
    ClearPoints rings;
    pick_list(field, list->blob, list->count, middle, ball, &in);
    if (!field->kernels->is_clear(&field->clear_points, field->row, in.blob, in.count, middle, ball, side))
        return false;
    field_turn_points(&field->clear_rings, to_foot, &rings);
    return field->kernels->is_clear(&rings, field->row, in.blob, in.count, middle, ball, side);
}

// [mm] A sharply bent wall has other feet close by: the foot is not trusted over more travel than this.
static double bend_radius(const Foot *foot) { return 0.15 / fmax(sqrt(sym3_norm2(&foot->hessian)), 1e-3); }

// Returns whether the wall at a foot bends no more than that of a round vessel. Only then are the few points of clear_radius enough to test its surroundings. In
// the lumen, h is the curvature of the wall's offset surface through X, and h / (1 - g h) that of the wall.
static bool bends_gently(const Foot *foot, double radius)
{
    static const double HOLLOW = 1.3, BULGE = 0.3;       // relative to the inverse radius
    const Sym3 *h = &foot->hessian;
    double half = 0.5 * sym3_trace(h), apart = sqrt(fmax(0, 0.5 * sym3_norm2(h) - half * half)), most = half + apart, least = half - apart;
    if (!(foot->gap * most < 1) || !(foot->gap * least < 1))
        return false;
    return least / (1 - foot->gap * least) > -HOLLOW / radius && most / (1 - foot->gap * most) < BULGE / radius;
}

// Tests whether a ball that touches the wall at the foot, larger than the gap by up to half a radius, lies all on x's side, at points on two spheres in it: a
// flat wall that comes closer to the centre than 0.92 of the ball's radius is detected by one of 80 points. Returns how far x may move [mm] until a wall other
// than the foot's could be the closest; 0: there is no such ball.
static double clear_radius(const FieldVessel *field, double side, const Foot *foot, const BlobList *list)
{
    static const double wider[] = {0.25, 0.1};
    enum { TRIES = sizeof wider / sizeof wider[0] };
    const FieldNode *node = &field->node[foot->node];
    double size = fabs(foot->gap);
    if (!bends_gently(foot, node->radius))
        return 0;
    for (int t = 0; t < TRIES; t++) {
        double ball = size + wider[t] * node->radius, slack = 0.55 * (0.92 * ball - size);
        Vec3 middle = vec3_add_scaled(foot->at, side * ball, foot->normal);
        if (is_at_inlet(field, node, middle, ball))
            continue;
        if (slack > 0.01 * node->radius && is_clear(field, list, middle, ball, side, vec3_scale(foot->normal, -side)))
            return fmin(slack, bend_radius(foot));
    }
    return 0;
}

// The feet found for a point, on different sheets of the wall.
enum { SHEETS = 3 };
typedef struct Sheets {
    int count;
    Foot foot[SHEETS];       // closest first
} Sheets;

static void add_sheet(Sheets *s, const Foot *foot)
{
    SEL_ASSERT(isfinite(foot->gap), "a foot that was found has a distance");
    static const double SAME = 1e-4;         // [mm] feet closer together are the same
    int at = 0;
    for (int i = 0; i < s->count; i++) {
        if (vec3_distance(foot->at, s->foot[i].at) <= SAME)
            return;
        at += fabs(s->foot[i].gap) <= fabs(foot->gap);
    }
    if (at == SHEETS)
        return;
    s->count = s->count < SHEETS ? s->count + 1 : SHEETS;
    memmove(s->foot + at + 1, s->foot + at, (size_t)(s->count - 1 - at) * sizeof *s->foot);
    s->foot[at] = *foot;
}

// Returns whether the foot lies on the vessel's wall. Far from its cell a node does not see all of the lumen, so its field may end where there is no wall.
static bool is_known_there(const FieldVessel *field, const Foot *foot)
{
    Vec3 q = transformed_point(field, &field->node[foot->node], foot->at);
    int cell = cell_of(field, q, foot->node);
    return cell == foot->node || sees_all(field, q, foot->node) || walls_apart(field, foot->node, cell, q) <= AGREE;
}

// For each direction from a point, where the wall may be.
typedef struct Looks {
    double at[SEARCH_DIRECTIONS]; // [mm] distance from the point at which the direction crosses the wall or comes nearest to it
    double order[SEARCH_DIRECTIONS]; // [mm] estimated distance of the wall; +HUGE_VAL: none
    double before[SEARCH_DIRECTIONS]; // f at the last distance …
    double far;              // … and that distance [mm]
} Looks;

static void start_looks(Looks *looks, double here)
{
    looks->far = 0;
    for (int k = 0; k < SEARCH_DIRECTIONS; k++)
        looks->before[k] = here, looks->order[k] = looks->at[k] = HUGE_VAL;
}

// Evaluates f in all directions at distance `far`. Where the sign changed since the last distance, the wall is crossed; where f is below LOW far slope, a ridge
// or septum may lie between two directions. slope: |grad f| at a wall; 0: crossings only.
static void look_farther(const FieldVessel *field, Vec3 x, int node, const BlobList *list, double side, double far, double slope, Looks *looks)
{
    static const double LOW = 0.3;           // more than half the angle between directions
    double f[SEARCH_DIRECTIONS], near = looks->far;
    for (int k = 0; k < SEARCH_DIRECTIONS; k += FOOT_BLOCK) {
        Vec3 to[FOOT_BLOCK];
        for (int i = 0; i < FOOT_BLOCK; i++)
            to[i] = vec3_add_scaled(x, far, field->search_direction[k + i]);
        look(field, node, list, to, f + k);
    }
    for (int k = 0; k < SEARCH_DIRECTIONS; k++) {
        double h = side * f[k], before = side * looks->before[k], at = far, order = HUGE_VAL;
        if (h <= 0 && before > 0)
            order = at = near + (far - near) * before / (before - h);
        else if (h > 0 && h < LOW * far * slope)
            order = far + h / slope;
        if (order < looks->order[k])
            looks->order[k] = order, looks->at[k] = at;
        looks->before[k] = f[k];
    }
    looks->far = far;
}

// Finds feet from the directions, the nearest starts first, skipping starts next to one already used.
static void settle_looks(const FieldVessel *field, Vec3 x, int node, double side, Looks *looks, Sheets *sheets)
{
    static const double ASIDE = 0.9;         // cosine of the angle between two starts
    Vec3 start[FOOT_BLOCK];
    Foot foot[FOOT_BLOCK];
    int count = 0;
    while (count < FOOT_BLOCK) {
        int best = 0;
        for (int k = 1; k < SEARCH_DIRECTIONS; k++)
            best = looks->order[k] < looks->order[best] ? k : best;
        if (looks->order[best] == HUGE_VAL)
            break;
        Vec3 chosen = field->search_direction[best];
        start[count++] = vec3_add_scaled(x, looks->at[best], chosen);
        for (int k = 0; k < SEARCH_DIRECTIONS; k++)
            if (vec3_dot(field->search_direction[k], chosen) > ASIDE)
                looks->order[k] = HUGE_VAL;
    }
    int found = count > 0 ? settle(field, x, node, start, count, ROUNDS, foot) : 0;
    for (int i = 0; i < found; i++)
        if (foot[i].gap * side > -1e-9 && is_known_there(field, &foot[i]))
            add_sheet(sheets, &foot[i]);
}

// Searches one node's wall for feet closer than `gap`, or only slightly farther.
static void look_on_node(const FieldVessel *field, Vec3 x, int node, double side, double gap, Sheets *sheets)
{
    const double all[] = {0.5 * gap, gap, gap + 2 * TRUST * field->node[node].radius};
    enum { DISTANCES = sizeof all / sizeof all[0] };
    BlobList list;
    Looks looks;
    list_blobs(field, node, x, all[DISTANCES - 1], &list);
    start_looks(&looks, side);
    for (int p = 0; p < DISTANCES; p++)
        look_farther(field, x, node, &list, side, all[p], sheets->foot[0].slope, &looks);
    settle_looks(field, x, node, side, &looks, sheets);
}

// Searches for walls closer than the foot, or only slightly farther: those that the foot's node sees, and those that the node of x sees.
static void look_for_rivals(const FieldVessel *field, Vec3 x, double side, Sheets *sheets)
{
    int node = sheets->foot[0].node, own = walk(field, x, node, 4);
    double gap = fabs(sheets->foot[0].gap);
    look_on_node(field, x, node, side, gap, sheets);
    if (own != node)
        look_on_node(field, x, own, side, gap, sheets);
}

// Feet of x on the wall of one node, from scratch.
static Sheets find_sheets(const FieldVessel *field, Vec3 x, int node)
{
    const FieldNode *n = &field->node[node];
    const BlobList list = {.blob = n->seen, .count = n->seen_count};
    Sheets sheets = {0};
    Looks looks;
    Foot foot;
    double here = field_here(field, node, x), side = here > 0 ? 1 : -1;
    start_looks(&looks, here);
    for (double far = 0.3 * n->radius; far < 60 * n->radius && sheets.count == 0; far *= far < n->radius ? 1.7 : 1.4) {
        look_farther(field, x, node, &list, side, far, 0, &looks);
        settle_looks(field, x, node, side, &looks, &sheets);
    }
    if (sheets.count == 0) {
        Blobby blobs = blobby_of(field->tree, node);
        SurfacePoint s = blobby_project(&blobs, x, x);
        if (s.converged && settle(field, x, node, &s.foot, 1, ROUNDS, &foot) > 0)
            add_sheet(&sheets, &foot);
    }
    return sheets;
}

// A foot belongs to the wall of the cell in which it lies: moves it to that wall, unless the field of the cell's node contradicts its own there.
static void move_to_cell(const FieldVessel *field, Vec3 x, Foot *foot)
{
    enum { CELLS = 4 };
    for (int k = 0; k < CELLS; k++) {
        Vec3 q = transformed_point(field, &field->node[foot->node], foot->at);
        int cell = cell_of(field, q, foot->node);
        Foot next;
        if (cell == foot->node || (sees_all(field, q, foot->node) && walls_apart(field, foot->node, cell, q) > AGREE) ||
            settle(field, x, cell, &foot->at, 1, ROUNDS, &next) == 0)
            break;
        *foot = next;
    }
}

// The foot of x from scratch: the closest of those found around the vessel's axis; if these lead to no foot on the right side, a search in all directions from
// x.
static Sheets project(const FieldVessel *field, Vec3 x, int node, double side)
{
    enum { AROUND = 6 };
    const FieldNode *n = &field->node[node];
    Vec3 d = field->tree->direction[node], away = vec3_sub(x, n->center), start[FOOT_BLOCK], out, across, g;
    Vec3 axis = vec3_add_scaled(n->center, vec3_dot(away, d), d);
    Blobby blobs = blobby_of(field->tree, node);
    Sheets sheets = {0};
    Foot foot[FOOT_BLOCK];
    if (field->tree->kind[node] == NODE_VESSEL) {
        out = vec3_unit_or(vec3_sub(x, axis), vec3_normal_to(d));
        across = vec3_cross(d, out);
        for (int k = 0; k < AROUND; k++)
            start[k] = vec3_add_scaled(vec3_add_scaled(axis, n->radius * same_cos(PI * k / 3), out), n->radius * same_sin(PI * k / 3), across);
        double f = blobby_gradient(&blobs, transformed_point(field, n, x), &g), slope = vec3_norm(g);
        double step = slope > 1e-100 ? fmax(-n->radius, fmin(n->radius, f / slope)) : 0;
        start[AROUND] = vec3_add_scaled(x, slope > 0 ? -step / slope : 0, g);
        int found = settle(field, x, node, start, AROUND + 1, side > 0 ? FEW_ROUNDS : ROUNDS, foot);
        for (int i = 0; i < found; i++)
            if (foot[i].gap * side > 0)
                add_sheet(&sheets, &foot[i]);
    }
    if (sheets.count == 0)
        sheets = find_sheets(field, x, node);
    if (sheets.count > 0) {
        sheets.count = 1;
        move_to_cell(field, x, &sheets.foot[0]);
    }
    return sheets;
}

// --- Queries ---

// Radius, at most `most`, of a ball about x that is certainly lumen, f(x + v) >= f(x) - |grad f| |v| - M |v|^2 / 2 > 0; 0: none. Also 0 where the inlet changes
// the field.
static double clear_ball(const FieldVessel *field, const FieldNode *node, Vec3 x, double most, const BlobList *list)
{
    static const double part[] = {0.9, 0.65, 0.4};
    enum { PARTS = sizeof part / sizeof part[0] };
    if (!(most > 0.5 * node->radius) || is_at_inlet(field, node, x, most))
        return 0;
    Vec3 g;
    double down, up, f = field_at(field, list, x, &g), slope = vec3_norm(g);
    for (int k = 0; k < PARTS; k++) {
        double ball = part[k] * most;
        field->kernels->bends(field->row, list->blob, list->count, x, ball, &down, &up);
        if (f - ball * (slope + 0.5 * ball * down) > 0)
            return ball;
    }
    return 0;
}

static void set_clearance(VesselMemory *m, Vec3 x, double clearance)
{
    m->clearance = clearance > 0 ? 0.999 * clearance : 0;
    m->clear_place = x;
}

// Returns whether the bounds prove that the foot is the closest.
static bool is_closest(const FieldVessel *field, Vec3 x, const Foot *foot, const VesselMemory *m)
{
    double size = fabs(foot->gap);
    const FieldNode *node = &field->node[foot->node];
    if (is_at_inlet(field, node, x, size))
        return false;
    return vec3_distance(x, m->bound_at) + size <= m->bound_for && (foot->gap > 0 ? m->down : m->up) * size < 0.97 * foot->slope;
}

// Lists the blobs needed to verify that a foot is the closest.
static void list_about(const FieldVessel *field, Vec3 x, const Foot *foot, BlobList *list)
{
    list_blobs(field, foot->node, x, fabs(foot->gap) + LOOK * field->node[foot->node].radius, list);
}

// Fills memory and hit outside the lanes; `list`: from list_about, or NULL if the foot is not sure.
static void answer(const FieldVessel *field, Vec3 x, const Foot *foot, const BlobList *list, VesselMemory *m, VesselHit *hit)
{
    const FieldNode *node = &field->node[foot->node];
    *hit = (VesselHit){.gap = foot->gap, .normal = foot->normal, .hessian = foot->hessian, .node = foot->node, .flags = foot->sure ? 0 : VESSEL_UNSURE};
    Vec3 q = transformed_point(field, node, foot->at);
    bool held = m->has_foot && m->node == foot->node && vec3_norm2(vec3_sub(q, m->held_at)) <= m->held_for2;
    m->node = foot->node;
    m->has_foot = foot->sure;
    m->foot = foot->at;
    m->place = x;
    m->normal = foot->normal;
    m->hessian = foot->hessian;
    m->miss = m->step = vec3(0, 0, 0);
    if (!foot->sure)
        return;
    if (!held)
        hold_blobs(field, m, q, list);
    hold_bounds(field, m, foot->node, x, foot->gap, list);
}

// A gap is the length of the shortest line to the wall: it changes by no more than x moves, or it belongs to another wall. `before`: the gap at the last place.
static void compare_gaps(VesselMemory *m, double before, double travel, VesselHit *hit)
{
    SEL_ASSERT(travel >= 0, "the travel is a length");
    static const double APPROACH = 0.2;      // change of the returned gap per mm of travel
    if (m->contradicted) {
        m->credible -= APPROACH * travel;
    } else if (fabs(hit->gap - before) > travel + APART) {
        hit->flags |= VESSEL_DISAGREE;
        m->contradicted = true;
        m->credible = before - travel;
    }
    m->contradicted = m->contradicted && hit->gap < m->credible;
    if (m->contradicted) {
        hit->gap = m->credible;
        hit->flags |= VESSEL_DISAGREE;
    }
}

static void set_flags(const FieldVessel *field, Vec3 x, int node, VesselHit *hit)
{
    if (field->node[node].carried && inlet_height(field, x) < 0)
        hit->flags |= VESSEL_BEYOND;
}

// If no foot is found: Taubin's distance along the gradient, or the distance to the nearest node's wall as if that were round.
static Foot guess_foot(const FieldVessel *field, Vec3 x, int node)
{
    const FieldNode *n = &field->node[node];
    Vec3 g, q = transformed_point(field, n, x), out = vec3_sub(x, n->center);
    Blobby blobs = blobby_of(field->tree, node);
    double f = blobby_gradient(&blobs, q, &g), slope = vec3_norm(g), gap = n->radius - vec3_norm(out);
    Vec3 normal = vec3_negate(vec3_unit_or(out, vec3_normal_to(field->tree->direction[node])));
    if (slope > 1e-100 && fabs(f / slope) < fabs(gap)) {
        gap = f / slope;
        normal = vec3_unit_or(g, normal);
    }
    return (Foot){.at = vec3_add_scaled(x, -gap, normal), .normal = normal, .gap = gap, .node = node};
}

// Verifies that a foot is the closest, or finds the closest, and fills memory and hit; `list`: from list_about for that foot, overwritten.
static void answer_surely(const FieldVessel *field, Vec3 x, double side, Sheets sheets, BlobList *list, VesselMemory *m, VesselHit *hit)
{
    double radius = field->node[sheets.foot[0].node].radius;
    answer(field, x, &sheets.foot[0], list, m, hit);
    m->has_rival = false;
    m->trust = 0;
    if (is_closest(field, x, &sheets.foot[0], m)) {
        set_clearance(m, x, sheets.foot[0].gap);
    } else {
        set_clearance(m, x, clear_ball(field, &field->node[sheets.foot[0].node], x, sheets.foot[0].gap, list));
        m->trust = clear_radius(field, side, &sheets.foot[0], list);
        if (m->trust == 0) {
            Vec3 before = sheets.foot[0].at;
            look_for_rivals(field, x, side, &sheets);
            if (vec3_distance(sheets.foot[0].at, before) > 1e-4) {
                move_to_cell(field, x, &sheets.foot[0]);
                list_about(field, x, &sheets.foot[0], list);
                answer(field, x, &sheets.foot[0], list, m, hit);
            }
            double size = fabs(sheets.foot[0].gap), trust = TRUST * radius;
            if (sheets.count == SHEETS)
                trust = fmax(TRUST_LEAST * radius, fmin(trust, 0.5 * (fabs(sheets.foot[SHEETS - 1].gap) - size)));
            m->has_rival = sheets.count > 1 && fabs(sheets.foot[1].gap) < size + 2 * trust;
            m->rival = sheets.foot[1].at;
            m->trust = fmin(trust, bend_radius(&sheets.foot[0]));
        }
    }
    set_flags(field, x, m->node, hit);
}

static void find_from_scratch(const FieldVessel *field, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    int node = walk(field, x, m->node, 4);
    double side = field_here(field, node, x) > 0 ? 1 : -1;
    Sheets sheets = project(field, x, node, side);
    if (m->has_foot && m->node != node) {
        // a foot follows its wall even where the cell of X is another node's: the remembered node's wall may be the closer one
        double other_side = field_here(field, m->node, x) > 0 ? 1 : -1;
        Sheets other = project(field, x, m->node, other_side);
        if (other.count > 0 && (sheets.count == 0 || fabs(other.foot[0].gap) < fabs(sheets.foot[0].gap))) {
            sheets = other;
            side = other_side;
        }
    }
    if (sheets.count > 0) {
        BlobList list;
        list_about(field, x, &sheets.foot[0], &list);
        answer_surely(field, x, side, sheets, &list, m, hit);
        return;
    }
    Foot foot = guess_foot(field, x, node);
    answer(field, x, &foot, NULL, m, hit);
    set_clearance(m, x, 0);
    set_flags(field, x, node, hit);
}

static void answer_from_scratch(const FieldVessel *field, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    bool known = m->has_foot;
    int from = m->node;
    double before = vec3_dot(vec3_sub(m->place, m->foot), m->normal), travel = vec3_distance(x, m->place);
    find_from_scratch(field, x, m, hit);
    if (!known || hit->flags & VESSEL_UNSURE)
        return;
    // a gap that changes because a foot was followed badly is no defect of the model: only if the former node has no wall here is it one
    bool other = hit->node != from && travel < BLOB_FLOOD_MARGIN * field->node[from].radius &&
                 walls_apart(field, from, hit->node, transformed_point(field, &field->node[hit->node], m->foot)) > APART;
    if (other || m->contradicted)
        compare_gaps(m, before, travel, hit);
}

// A foot that was followed, but may no longer be the closest.
static void answer_around(const FieldVessel *field, Vec3 x, const Foot *foot, VesselMemory *m, VesselHit *hit)
{
    BlobList list;
    list_about(field, x, foot, &list);
    Vec3 g;
    double travel = vec3_distance(x, m->place), side = field_at(field, &list, transformed_point(field, &field->node[foot->node], x), &g) > 0 ? 1 : -1;
    if (side * foot->gap < -1e-9) {
        answer_from_scratch(field, x, m, hit);
        return;
    }
    answer_surely(field, x, side, (Sheets){.count = 1, .foot = {*foot}}, &list, m, hit);
    if (m->contradicted)
        compare_gaps(m, 0, travel, hit);
}

// A foot that is trusted, with a rival, which has moved too.
static void answer_beside_rival(const FieldVessel *field, Vec3 x, Foot foot, VesselMemory *m, VesselHit *hit)
{
    Foot rival;
    double trust = m->trust, travel = vec3_distance(x, m->place);
    if (settle(field, x, foot.node, &m->rival, 1, ROUNDS, &rival) == 0 || rival.gap * foot.gap < 0 || vec3_distance(rival.at, foot.at) < 1e-4) {
        answer_around(field, x, &foot, m, hit);
        return;
    }
    bool other = fabs(rival.gap) < fabs(foot.gap);
    if (other)
        move_to_cell(field, x, &rival);
    BlobList list;
    list_about(field, x, other ? &rival : &foot, &list);
    answer(field, x, other ? &rival : &foot, &list, m, hit);
    m->rival = other ? foot.at : rival.at;
    m->trust = trust;
    set_clearance(m, x, clear_ball(field, &field->node[m->node], x, hit->gap, &list));
    set_flags(field, x, m->node, hit);
    if (m->contradicted)
        compare_gaps(m, 0, travel, hit);
}

// Returns true if the hit can be filled without evaluating the field.
static bool answer_cheaply(const FieldVessel *field, Vec3 x, double reach, VesselMemory *m, VesselHit *hit)
{
    if (!(vec3_norm2(x) < 1e100)) {
        *hit = (VesselHit){.node = m->node, .flags = VESSEL_UNSURE};
        return true;
    }
    if (m->node < 0 || m->node >= field->tree->node_count)
        *m = (VesselMemory){.node = walk(field, x, -1, 0)};
    if (m->node == 0 && field->inlet_open && !field->node[0].carried && inlet_height(field, x) < 0) {
        m->has_foot = false;
        m->clearance = 0;
        *hit = (VesselHit){.gap = HUGE_VAL, .node = m->node, .flags = VESSEL_OPEN_END};
        return true;
    }
    const FieldNode *node = &field->node[m->node];
    double away = m->clearance - reach, gap;
    if (away > 0 && vec3_norm2(vec3_sub(x, m->clear_place)) < away * away) {
        gap = m->clearance - vec3_distance(x, m->clear_place);
    } else {
        away = node->clear - reach;
        if (!(away > 0 && vec3_norm2(vec3_sub(x, node->center)) < away * away))
            return false;
        gap = node->clear - vec3_distance(x, node->center);
    }
    *hit = (VesselHit){.gap = gap, .node = m->node, .flags = VESSEL_FAR};
    return true;
}

// The foot has left the region of its held blobs: determines the cell and the list around q. Returns false if q is too far from the cell. A node whose field
// contradicts the own one there is not adopted.
static bool renew_list(const FieldVessel *field, VesselMemory *m, Vec3 q)
{
    int cell = cell_of(field, q, m->node);
    if (cell != m->node) {
        if (!sees_all(field, q, m->node))
            return false;
        if (!(walls_apart(field, m->node, cell, q) > AGREE))
            m->node = cell, m->clearance = 0;
    }
    const FieldNode *node = &field->node[m->node];
    hold_blobs(field, m, q, &(BlobList){.blob = node->seen, .count = node->seen_count});
    return true;
}

// Points of a batch that wait for the same treatment, and the starts of their feet.
typedef struct Queue {
    int count, point[FOOT_BATCH];
    Vec3 start[FOOT_BATCH];
} Queue;

typedef struct Batch {
    const Vec3 *point;
    VesselMemory *memory;
    VesselHit *hit;
    Queue followed;          // feet that are followed by one or two steps …
    Queue sought;            // … then searched by careful steps from where those stopped …
    Queue afresh;            // … and finally from scratch
} Batch;

static void put(Queue *queue, int point, Vec3 start)
{
    SEL_REQUIRE(queue->count < FOOT_BATCH, "a point is in a queue at most once");
    queue->start[queue->count] = start;
    queue->point[queue->count++] = point;
}

// Steps that follow a foot, and careful steps that search for it; the latter are no longer [of the radius] than the held blobs allow.
enum { FOLLOW_ROUNDS = 2, SEEK_ROUNDS = 8 };
static const double LONGEST_SOUGHT = 0.25;
static const double FOLLOWED = 1;            // relative to the radius: a point that has moved further has no foot to follow

// A followed foot moves no further than the prediction and its steps: if it is far enough from the inlet, it needs no evaluation near the inlet.
static void fill_lane(const FieldVessel *field, FieldBlock *b, int i, const Batch *batch, int point, bool seek)
{
    static const double REACH = 1.25;        // relative to the radius: 0.2 for the prediction and two steps of 0.5
    VesselMemory *m = &batch->memory[point];
    const FieldNode *n = &field->node[m->node];
    SEL_ASSERT(m->blobs <= VESSEL_BLOBS, "a memory holds no more blobs than its capacity");
    set_lane(field, b, i, m->node, n->carried && (seek || inlet_height(field, m->foot) < inlet_zone(field) + REACH * n->radius));
    b->point[i] = &batch->point[point].x;
    b->memory[i] = &m->foot.x;
    b->list[i] = m->blob, b->count[i] = m->blobs;
    if (m->blobs < 0)
        set_whole_list(field, b, i, m->node);
}

// Renews the lists of lanes that have left the region of their held blobs; a lane that has moved too far for that is lost.
static void lanes_renew_lists(const FieldVessel *field, FieldBlock *b, unsigned lanes, const Batch *batch, const int *point, bool seek)
{
    for (; lanes != 0; lanes &= lanes - 1) {
        int i = __builtin_ctz(lanes);
        VesselMemory *m = &batch->memory[point[i]];
        Vec3 p = vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]), q = transformed_point(field, &field->node[m->node], p);
        if (!renew_list(field, m, q)) {
            b->foot.state[i] = FOOT_LOST;
            continue;
        }
        fill_lane(field, b, i, batch, point[i], seek);
        b->held_x[i] = m->held_at.x, b->held_y[i] = m->held_at.y, b->held_z[i] = m->held_at.z, b->held_for2[i] = m->held_for2;
    }
}

// Near the inlet, a list is centred on the point at which the field is evaluated for the foot.
static unsigned moved_lanes(const FieldVessel *field, const FieldBlock *b, unsigned moved, const Batch *batch, const int *point, int count, bool all)
{
    for (int i = 0; i < count; i++) {
        if (!b->foot.at.carried[i] && !all)
            continue;
        Vec3 q = transformed_point(field, &field->node[batch->memory[point[i]].node], vec3(b->foot.at.x[i], b->foot.at.y[i], b->foot.at.z[i]));
        double far2 = vec3_norm2(vec3_sub(q, vec3(b->held_x[i], b->held_y[i], b->held_z[i])));
        moved = (moved & ~(1u << i)) | (far2 <= b->held_for2[i] ? 0u : 1u << i);
    }
    return moved;
}

// Near the inlet the bounds apply to the field at the transformed point; the transformation adds (g.d) zeta'' to the second derivative, zeta'' <= 0.75 / h.
static unsigned sure_near_inlet(const FieldVessel *field, const FieldBlock *b, unsigned sure, int count)
{
    Vec3 d = field->tree->direction[0];
    double more = 0.75 / inlet_zone(field);
    for (int i = 0; i < count; i++) {
        double size = fabs(b->foot.gap[i]), bend = fmax(b->down[i], b->up[i]);
        Vec3 x = {b->foot.xx[i], b->foot.xy[i], b->foot.xz[i]}, at = {b->bound_x[i], b->bound_y[i], b->bound_z[i]};
        if (!b->foot.at.carried[i] || inlet_height(field, x) - size >= inlet_zone(field))
            continue;
        Vec3 g = {b->foot.at.gx[i], b->foot.at.gy[i], b->foot.at.gz[i]};
        double along = fabs(vec3_dot(g, d)) + 2 * bend * size;
        if (!((bend + more * along) * size < 0.95 * vec3_norm(g) && vec3_distance(x, at) + size <= b->bound_for[i]))
            sure &= ~(1u << i);
    }
    return sure;
}

// Follows the feet of up to eight points of a queue; for the queue `sought`, from its starts.
static void follow_block(const FieldVessel *field, Batch *batch, const Queue *queue, int first)
{
    FieldBlock b;
    double spare[MEMORY_WRITTEN], no_hit[HIT_ROW];
    const int *point = queue->point + first, count = queue->count - first < FOOT_BLOCK ? queue->count - first : FOOT_BLOCK;
    const bool seek = queue == &batch->sought;
    SEL_ASSERT(count > 0, "a block has a point");
    unsigned all = (1u << count) - 1, done = 0;
    b.row = field->row;
    b.slots = VESSEL_BLOBS;
    b.foot.at.any_carried = false;
    for (int i = 0; i < FOOT_BLOCK; i++)
        fill_lane(field, &b, i, batch, point[i < count ? i : 0], seek);
    unsigned moved = field->kernels->load(&b) & all;
    if (seek)
        for (int i = 0; i < FOOT_BLOCK; i++) {
            const Vec3 *p = &queue->start[first + (i < count ? i : 0)];
            b.foot.at.x[i] = p->x, b.foot.at.y[i] = p->y, b.foot.at.z[i] = p->z;
            b.foot.longest[i] = LONGEST_SOUGHT * b.foot.radius[i];
        }
    if (seek || b.foot.at.any_carried)
        moved = moved_lanes(field, &b, moved, batch, point, count, seek);
    lanes_renew_lists(field, &b, moved, batch, point, seek);
    for (int round = 0; round < (seek ? SEEK_ROUNDS : FOLLOW_ROUNDS) && (done & all) != all; round++) {
        if (round > 0)
            lanes_renew_lists(field, &b, moved_lanes(field, &b, 0, batch, point, count, true) & ~done & all, batch, point, seek);
        sample(field, &b);
        done = field->kernels->newton(&b, seek);
    }
    unsigned sure = field->kernels->finish(&b), contradicted = 0;
    if (b.foot.at.any_carried)
        sure = sure_near_inlet(field, &b, sure, count);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        bool is_sure = sure & done & all & 1u << i, use = is_sure;
        int p = point[i < count ? i : 0];
        VesselMemory *m = &batch->memory[p];
        VesselHit *hit = &batch->hit[p];
        if (i < count && !is_sure) {
            Foot foot = lane_foot(&b, i, m->node);
            foot.sure = true;
            if (!(done >> i & 1))
                put(seek ? &batch->afresh : &batch->sought, p, b.foot.state[i] == FOOT_PENDING ? foot.at : m->foot);
            else if (!(b.trust[i] > 0))
                answer_around(field, batch->point[p], &foot, m, hit);
            else if (m->has_rival)
                m->trust = b.trust[i], answer_beside_rival(field, batch->point[p], foot, m, hit);
            else
                use = true;
        }
        b.keep[i] = use ? &m->foot.x : spare;
        b.hit[i] = use ? &hit->gap : no_hit;
        if (use) {
            hit->node = m->node;
            hit->flags = 0;
            if (is_sure)
                set_clearance(m, batch->point[p], b.foot.gap[i]);
            set_flags(field, batch->point[p], m->node, hit);
            contradicted |= m->contradicted ? 1u << i : 0;
        }
    }
    field->kernels->store(&b);
    for (; contradicted != 0; contradicted &= contradicted - 1) {
        int i = __builtin_ctz(contradicted);
        compare_gaps(&batch->memory[point[i]], 0, sqrt(b.dx[i] * b.dx[i] + b.dy[i] * b.dy[i] + b.dz[i] * b.dz[i]), &batch->hit[point[i]]);
    }
}

static void query_batch(const FieldVessel *field, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    SEL_ASSERT(count <= FOOT_BATCH, "queries come in batches");
    Batch batch;
    batch.point = point, batch.memory = memory, batch.hit = hit;
    batch.followed.count = batch.sought.count = batch.afresh.count = 0;
    for (int i = 0; i < count; i++) {
        VesselMemory *m = &memory[i];
        if (answer_cheaply(field, point[i], reach, m, &hit[i]))
            continue;
        double far = FOLLOWED * field->node[m->node].radius;
        m->has_foot = m->has_foot && vec3_norm2(vec3_sub(point[i], m->place)) < far * far;
        put(m->has_foot ? &batch.followed : &batch.afresh, i, m->foot);
    }
    for (int i = 0; i < batch.followed.count; i += FOOT_BLOCK)
        follow_block(field, &batch, &batch.followed, i);
    for (int i = 0; i < batch.sought.count; i += FOOT_BLOCK)
        follow_block(field, &batch, &batch.sought, i);
    for (int i = 0; i < batch.afresh.count; i++)
        answer_from_scratch(field, point[batch.afresh.point[i]], &memory[batch.afresh.point[i]], &hit[batch.afresh.point[i]]);
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
    free(field->node);
    power_blocks_free(&field->blocks);
    free(field);
}

// --- Creation ---

static void fill_rows(FieldVessel *field)
{
    const VesselTree *tree = field->tree;
    for (int64_t j = 0; j < tree->blob_count; j++) {
        Vec3 c = tree->blob_center[j];
        double width = tree->blob_width[j];
        SEL_ASSERT(width > 0, "a shared blob has a radius of support");
        field->row[j] = (FieldRow){c.x, c.y, c.z, 1 / (width * width), tree->blob_amplitude[j], width, {0}};
    }
    field->row[tree->blob_count] = (FieldRow){0};
}

// Lower bound of the distance of any wall from the node's centre.
static double clear_about_center(const FieldVessel *field, int i)
{
    const FieldNode *n = &field->node[i];
    double clear = clear_ball(field, n, n->center, n->radius, &(BlobList){.blob = n->seen, .count = n->seen_count});
    if (n->carried)
        clear = fmin(clear, inlet_height(field, n->center) - inlet_zone(field));
    return clear > 0 ? clear : -HUGE_VAL;
}

static void fill_nodes(FieldVessel *field)
{
    const VesselTree *tree = field->tree;
    for (int i = 0; i < tree->node_count; i++) {
        FieldNode *n = &field->node[i];
        n->center = tree->center[i];
        n->radius = tree->radius[i];
        SEL_ASSERT(n->radius > 0, "nodes have a radius");
        n->bend = 1 / n->radius;
        n->skin = fmin(SKIN * n->radius, SKIN_MOST);
        n->seen = tree->seen + tree->seen_offset[i];
        n->seen_count = (int)(tree->seen_offset[i + 1] - tree->seen_offset[i]);
        SEL_ASSERT(n->seen_count >= 0, "offsets do not decrease");
    }
    for (int k = tree->near_offset[0] - 1; k < tree->near_offset[1] && field->inlet_open; k++) {
        int node = k < tree->near_offset[0] ? 0 : tree->near[k];
        Blobby blobs = blobby_of(tree, node);
        field->node[node].carried = blobby_field(&blobs, tree->center[0]) > 0;
    }
    for (int i = 0; i < tree->node_count; i++)
        field->node[i].clear = clear_about_center(field, i);
}

Vessel *field_vessel_create_with(const VesselTree *tree, int isa)
{
    FieldVessel *field = tree && vessel_tree_is_shared(tree) && vessel_tree_is_model(tree) ? calloc(1, sizeof *field) : NULL;
    if (!field)
        return NULL;
    SEL_ASSERT(tree->near_offset && tree->near && tree->seen_offset, "the tree is linked (vessel_tree_link)");
    SEL_ASSERT(tree->blob_count < INT32_MAX, "memories index blobs by 32 bits, including the one of amplitude 0");
    field->vessel =
        (Vessel){.kind = "field", .query = field_query, .locate = field_locate, .inlet = field_inlet, .destroy = field_destroy, .primitives = tree->blob_count};
    field->tree = tree;
    field->kernels = field_kernels(isa);
    size_t rows = (size_t)tree->blob_count + 1, nodes = (size_t)tree->node_count;
    field->row = aligned_alloc(64, rows * sizeof *field->row);
    field->node = calloc(nodes, sizeof *field->node);
    if (!power_blocks_create(&field->blocks, tree) || !field->row || !field->node) {
        field_destroy(&field->vessel);
        return NULL;
    }
    size_t links = (size_t)tree->near_offset[nodes];
    field->vessel.bytes = sizeof *field + rows * sizeof *field->row + (size_t)tree->seen_offset[nodes] * sizeof *tree->seen +
                          nodes * (sizeof *field->node + sizeof(Vec3) + sizeof(double) + sizeof(int)) + links * sizeof *tree->near;
    for (int level = 0; level < field->blocks.levels; level++)
        field->vessel.bytes += (size_t)field->blocks.count[level] * sizeof(PowerBox);
    field->inlet_open = vessel_tree_root_is_open(tree);
    field_directions(field->search_direction, SEARCH_DIRECTIONS);
    field_clear_points(&field->clear_points);
    field_clear_rings(&field->clear_rings);
    fill_rows(field);
    fill_nodes(field);
    return &field->vessel;
}

Vessel *field_vessel_create(const VesselTree *tree) { return field_vessel_create_with(tree, 0); }

Vessel *model_vessel_create(const VesselTree *tree) { return tree && vessel_tree_is_shared(tree) ? field_vessel_create(tree) : lim_vessel_create(tree); }
