// Contact with a swept model: the closest point of F = 0 (the foot), by Newton from the predicted position of the remembered foot.
//
// A foot that is followed is only a local minimum of the distance. At every query, the ring of the wall at the foot's t is compared with it: sixteen points of
// the same section. After some travel, the rings at five t around X are searched on all branches that are seen, for local minima of the distance; Newton from
// those gives the rivals of the foot. The nearest of all is the foot, and the distance of the second nearest says how far X may travel until the next search.
// Where ring points are nearer than the foot but Newton finds no nearer foot there, they lie in the mouth of another branch.
#include "geom/sweep_vessel.h"

#include "geom/power_blocks.h"
#include "geom/sweep_feet.h"
#include "geom/sweep_views.h"

#include <stdlib.h>
#include <string.h>

typedef struct SweepVessel {
    Vessel vessel;           // first: a Vessel * points to its SweepVessel
    const SweepModel *model;
    SweepField *field;
    SweepFeet feet;
    int node_count;          // one more than the highest node of a knot or of a sac
    SweepPlace *place;       // (nodes) branch -2: none
    int *first_child, *next_child;   // (branches) those that spring from a branch; -1: none
    VesselTree *knots;       // centres and radii of knots, then of the sacs' nodes, for the first location
    PowerBlocks blocks;
} SweepVessel;

_Static_assert((int)VESSEL_SEEN >= (int)SWEEP_CANDIDATES, "a memory holds t of all branches that are seen");

static const double REST = 1e-8;             // [mm] error of the gap that Newton may leave for a foot that is followed
static const double FOLLOWED = 1;            // relative to the radius: a point that has moved further has no foot to follow
static const double LOOK = 1;                // relative to the radius: how much further than the foot rivals are searched
static const double TRUST_LEAST = 0.02, TRUST_MOST = 0.45;   // relative to the radius: travel between two searches

// --- Nodes and places ---

static int node_of(const SweepVessel *v, int segment, int sac, double t)
{
    if (segment < 0)
        return v->model->sac_node[sac];
    int branch = 0, high = v->model->branch_count - 1;
    while (branch < high) {
        int middle = (branch + high + 1) / 2;
        if (v->field->first_segment[middle] <= segment)
            branch = middle;
        else
            high = middle - 1;
    }
    const SweepCurve *curve = v->field->curve[branch];
    int after = sweep_curve_interval(curve, t), knot = after - 1;
    if (after <= 0)
        knot = 0;
    else if (after < curve->knot_count && curve->knot_t[after] - t < t - curve->knot_t[after - 1])
        knot = after;
    return v->model->knot_node[v->model->branch[branch].first_knot + knot];
}

static bool has_place(const SweepVessel *v, int node) { return node >= 0 && node < v->node_count && v->place[node].branch != -2; }

static int nearest_node(const SweepVessel *v, Vec3 x)
{
    int at = power_blocks_nearest(&v->blocks, x);
    return at < v->model->knot_count ? v->model->knot_node[at] : v->model->sac_node[at - v->model->knot_count];
}

// --- Answers ---

static void set_flags(const SweepVessel *v, Vec3 x, const SweepFoot *foot, VesselHit *hit)
{
    const SweepBranch *root = &v->model->branch[0];
    if (!root->open_start || foot->segment < 0 || foot->segment >= v->field->first_segment[1] || foot->t > 2 * root->radius)
        return;
    const SweepInterval *line = &v->field->curve[0]->interval[0];
    if (vec3_dot(vec3_sub(x, line->s[0]), line->s[1]) < 0)
        hit->flags |= VESSEL_BEYOND;
}

// Fills memory and hit outside the lanes.
static void answer(const SweepVessel *v, Vec3 x, const SweepFoot *foot, VesselMemory *m, VesselHit *hit)
{
    *hit = (VesselHit){.gap = foot->gap, .normal = foot->normal, .hessian = foot->hessian, .flags = foot->sure ? 0 : VESSEL_UNSURE};
    m->node = hit->node = node_of(v, foot->segment, foot->sac, foot->t);
    m->has_foot = foot->sure;
    m->foot = foot->at, m->place = x, m->normal = foot->normal, m->hessian = foot->hessian;
    m->clearance = foot->sure && foot->gap > 0 ? 0.999 * foot->gap : 0;
    m->clear_place = x;
    m->sweep.segment = foot->segment, m->sweep.sac = foot->sac, m->sweep.own_t = foot->t, m->sweep.is_known = 0;
    set_flags(v, x, foot, hit);
}

// Trusts a foot for half the distance to its nearest rival.
static void trust(const SweepVessel *v, Vec3 x, const SweepFoot *foot, double rival, VesselMemory *m)
{
    double radius = sweep_place_radius(&v->feet, foot->segment, foot->sac);
    m->bound_at = x;
    m->trust = fmax(TRUST_LEAST * radius, fmin(TRUST_MOST * radius, 0.45 * (rival - fabs(foot->gap))));
}

static SweepPlace place_of_foot(const SweepVessel *v, const SweepFoot *foot)
{
    if (foot->segment < 0)
        return (SweepPlace){.branch = -1, .sac = foot->sac};
    int branch = 0;
    const SweepView *view = &v->field->view[foot->segment];
    for (int k = 0; k < view->count; k++)
        if (foot->segment >= v->field->first_segment[view->of[k].branch] && foot->segment < v->field->first_segment[view->of[k].branch + 1])
            branch = view->of[k].branch;
    return (SweepPlace){.branch = branch, .t = foot->t};
}

// Divides starts into those that may lead to a foot nearer than `foot`, kept, and the others. Returns the number kept; `rival`: about the distance of the
// nearest foot among the others.
static int keep_starts(const SweepFoot *foot, double radius, SweepStart *start, int count, double *rival)
{
    static const double OWN = 0.45;          // relative to the radius: a start closer to the foot leads to it
    int kept = 0;
    for (int i = 0; i < count; i++) {
        if (vec3_distance(start[i].at, foot->at) <= OWN * radius)
            continue;
        if (start[i].least < fabs(foot->gap))
            start[kept++] = start[i];
        else
            *rival = fmin(*rival, start[i].least);
    }
    return kept;
}

// Searches for rivals of a foot, and answers with the nearest. A ball that lies inside one branch is lumen, whatever the other branches are: a foot on the wall
// of one branch alone is compared only with the rest of that wall, and with other walls if that does not suffice. `nearer`: a ring has a point nearer than the
// foot.
static void answer_surely(const SweepVessel *v, Vec3 x, SweepFoot foot, bool nearer, VesselMemory *m, VesselHit *hit)
{
    double radius = sweep_place_radius(&v->feet, foot.segment, foot.sac), limit = fabs(foot.gap) + LOOK * radius, rival = limit;
    SweepStart start[SWEEP_FEET];
    SweepFoot found[SWEEP_FEET];
    SweepPlace place = place_of_foot(v, &foot);
    int count = 0;
    bool alone = foot.pure && foot.gap > 0 && !nearer;
    if (alone) {
        count = sweep_starts(&v->feet, x, place, true, limit, start, SWEEP_FEET);
        count = keep_starts(&foot, radius, start, count, &rival);
    }
    if (!alone || (count > 0 && (v->field->view[foot.segment].count > 1 || v->field->view[foot.segment].sac >= 0))) {
        rival = limit;
        count = sweep_starts(&v->feet, x, place, false, limit, start, SWEEP_FEET);
        count = keep_starts(&foot, radius, start, count, &rival);
    }
    count = count > 0 ? sweep_settle(&v->feet, x, start, count, found) : 0;
    for (int i = 0; i < count; i++) {
        if (vec3_distance(found[i].at, foot.at) < 1e-4)
            continue;
        if (fabs(found[i].gap) < fabs(foot.gap)) {
            rival = fmin(rival, fabs(foot.gap));
            foot = found[i];
            nearer = false;
        } else {
            rival = fmin(rival, fabs(found[i].gap));
        }
    }
    answer(v, x, &foot, m, hit);
    trust(v, x, &foot, rival, m);
    m->sweep.open = nearer;
}

static void answer_afresh(const SweepVessel *v, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    double f, side;
    SweepPlace place = sweep_descend(&v->feet, x, v->place[m->node], &f);
    SweepStart start[SWEEP_FEET];
    SweepFoot found[SWEEP_FEET], foot;
    side = f > 0 ? 1 : -1;
    int count = sweep_starts(&v->feet, x, place, false, HUGE_VAL, start, SWEEP_FEET), best = -1;
    count = count > 0 ? sweep_settle(&v->feet, x, start, count, found) : 0;
    for (int i = count - 1; i >= 0; i--)
        best = found[i].gap * side > -1e-9 ? i : best;
    if (best < 0) {
        foot = sweep_bisect(&v->feet, x, place);
        start[0] = (SweepStart){.at = foot.at, .far = fabs(foot.gap), .segment = foot.segment, .sac = foot.sac, .t = foot.t};
        count = sweep_settle(&v->feet, x, start, 1, found);
        if (count > 0 && found[0].gap * side > -1e-9)
            foot = found[0];
        else
            foot.gap = side * fabs(foot.gap);
        answer(v, x, &foot, m, hit);
        trust(v, x, &foot, 0, m);
        m->sweep.open = 1;
        return;
    }
    foot = found[best];
    double rival = HUGE_VAL;
    for (int i = best + 1; i < count; i++)
        rival = fmin(rival, fabs(found[i].gap));
    answer(v, x, &foot, m, hit);
    trust(v, x, &foot, fmin(rival, fabs(foot.gap) + 0.2 * sweep_place_radius(&v->feet, foot.segment, foot.sac)), m);
    m->sweep.open = start[0].far < fabs(foot.gap);
}

// Returns true if the hit can be filled without evaluating the field.
static bool answer_cheaply(const SweepVessel *v, Vec3 x, double reach, VesselMemory *m, VesselHit *hit)
{
    if (!(vec3_norm2(x) < 1e100)) {
        *hit = (VesselHit){.node = m->node, .flags = VESSEL_UNSURE};
        return true;
    }
    if (!has_place(v, m->node))
        *m = (VesselMemory){.node = nearest_node(v, x)};
    double away = m->clearance - reach;
    if (!(away > 0 && vec3_norm2(vec3_sub(x, m->clear_place)) < away * away))
        return false;
    *hit = (VesselHit){.gap = m->clearance - vec3_distance(x, m->clear_place), .node = m->node, .flags = VESSEL_FAR};
    return true;
}

// --- Feet that are followed ---

static void load_lane(const SweepVessel *v, SweepBlock *b, int i, Vec3 x, const VesselMemory *m)
{
    FootBatch *f = &b->foot;
    sweep_block_place(&v->feet, b, i, m->sweep.segment, m->sweep.sac, m->sweep.own_t);
    sweep_block_set_point(&v->feet, b, i, x);
    f->at.x[i] = m->foot.x, f->at.y[i] = m->foot.y, f->at.z[i] = m->foot.z;
    f->at.gx[i] = m->place.x, f->at.gy[i] = m->place.y, f->at.gz[i] = m->place.z;
    f->nx[i] = m->normal.x, f->ny[i] = m->normal.y, f->nz[i] = m->normal.z;
    f->axx[i] = m->hessian.xx, f->axy[i] = m->hessian.xy, f->axz[i] = m->hessian.xz;
    f->ayy[i] = m->hessian.yy, f->ayz[i] = m->hessian.yz, f->azz[i] = m->hessian.zz;
    f->room[i] = 0;
    b->keeps_t[i] = m->sweep.is_known != 0;
    for (int k = 0; b->keeps_t[i] && k < b->view[i]->count; k++)
        b->part[k].t[i] = m->sweep.t[k];
}

static void store_lane(const SweepVessel *v, const SweepBlock *b, int i, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    SweepFoot foot = sweep_block_foot(&v->feet, b, i);
    answer(v, x, &foot, m, hit);
    bool same = b->owner[i] == b->own[i] && foot.segment == b->segment[i];
    m->sweep.is_known = same;
    for (int k = 0; same && k < b->view[i]->count; k++)
        m->sweep.t[k] = b->part[k].t[i];
}

// Points of a batch whose feet are followed, and those that are found by other means.
typedef struct Queue {
    int count, point[FOOT_BATCH];
} Queue;

// A foot that was followed but not reached in a few steps: careful steps from where it was.
static void answer_sought(const SweepVessel *v, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    SweepStart start = {.at = m->foot, .far = vec3_distance(x, m->foot), .segment = m->sweep.segment, .sac = m->sweep.sac, .t = m->sweep.own_t};
    SweepFoot found[SWEEP_FEET];
    if (sweep_settle(&v->feet, x, &start, 1, found) > 0)
        answer_surely(v, x, found[0], false, m, hit);
    else
        answer_afresh(v, x, m, hit);
}

static void follow_block(const SweepVessel *v, const Vec3 *point, VesselMemory *memory, VesselHit *hit, const int *which, int count)
{
    enum { ROUNDS = 2 };
    static const double NEARER = 1e-6;       // [mm]
    SEL_ASSERT(count > 0 && count <= FOOT_BLOCK, "a block has a point, and no more than lanes");
    SweepBlock b;
    FootBatch *f = &b.foot;
    unsigned all = (1u << count) - 1, done = 0;
    memset(&b.ring, 0, sizeof b.ring);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        int p = which[i < count ? i : 0];
        load_lane(v, &b, i, point[p], &memory[p]);
    }
    v->feet.kernels->predict(f, REST);
    for (int round = 0; round < ROUNDS && (done & all) != all; round++) {
        sweep_block_sample(&v->feet, &b, round == 0 ? FOOT_ALL : all & ~done);
        done = v->feet.kernels->newton(f, false);
    }
    v->feet.kernels->finish(f);
    v->feet.kernels->ring(&b.ring, f, b.ring_x, b.ring_y, b.ring_z, v->feet.harmonics);
    for (int i = 0; i < count; i++) {
        int p = which[i];
        VesselMemory *m = &memory[p];
        if (!(done >> i & 1)) {
            answer_sought(v, point[p], m, &hit[p]);
            continue;
        }
        double size = fabs(f->gap[i]) - NEARER, travel = m->trust;
        bool nearer = b.own[i] >= 0 && b.is_flat[i] > 0 && size > 0 && b.ring.near2[i] < size * size;
        if ((nearer && !m->sweep.open) || !(vec3_norm2(vec3_sub(point[p], m->bound_at)) < travel * travel)) {
            SweepFoot foot = sweep_block_foot(&v->feet, &b, i);
            answer_surely(v, point[p], foot, nearer, m, &hit[p]);
            continue;
        }
        store_lane(v, &b, i, point[p], m, &hit[p]);
    }
}

static void query_batch(const SweepVessel *v, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    Queue alone = {0}, among = {0};          // feet that see one branch, and those that see several
    for (int i = 0; i < count; i++) {
        VesselMemory *m = &memory[i];
        if (answer_cheaply(v, point[i], reach, m, &hit[i]))
            continue;
        double far = m->has_foot ? FOLLOWED * sweep_place_radius(&v->feet, m->sweep.segment, m->sweep.sac) : 0;
        if (!(vec3_norm2(vec3_sub(point[i], m->place)) < far * far)) {
            answer_afresh(v, point[i], m, &hit[i]);
            continue;
        }
        Queue *queue = m->sweep.segment >= 0 && v->field->view[m->sweep.segment].count == 1 && v->field->view[m->sweep.segment].sac < 0 ? &alone : &among;
        queue->point[queue->count++] = i;
    }
    for (int i = 0; i < alone.count; i += FOOT_BLOCK)
        follow_block(v, point, memory, hit, alone.point + i, alone.count - i < FOOT_BLOCK ? alone.count - i : FOOT_BLOCK);
    for (int i = 0; i < among.count; i += FOOT_BLOCK)
        follow_block(v, point, memory, hit, among.point + i, among.count - i < FOOT_BLOCK ? among.count - i : FOOT_BLOCK);
}

static void sweep_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i += FOOT_BATCH) {
        int n = count - i < FOOT_BATCH ? count - i : FOOT_BATCH;
        query_batch((const SweepVessel *)vessel, n, point + i, reach, memory + i, hit + i);
    }
}

// --- Location ---

// The best place found on a walk along branches.
typedef struct Walk {
    const SweepVessel *vessel;
    Vec3 x;
    int best, steps;         // node of the tree; knots that may still be visited
    double least;            // its power distance [mm^2]
} Walk;

// Visits the knots of a branch around t, up to `far` mm along it, and those of the branches that spring from there or from which it springs; not `except`.
static void walk_branch(Walk *w, int branch, double t, double far, int except)
{
    const SweepVessel *v = w->vessel;
    const SweepCurve *curve = v->field->curve[branch];
    const SweepBranch *b = &v->model->branch[branch];
    for (int k = 0; k < curve->knot_count && w->steps > 0; k++) {
        if (fabs(curve->knot_t[k] - t) > far)
            continue;
        w->steps--;
        int knot = b->first_knot + k;
        double radius = v->knots->radius[knot], power = vec3_norm2(vec3_sub(w->x, v->model->knot[knot])) - radius * radius;
        if (power < w->least)
            w->least = power, w->best = v->model->knot_node[knot];
    }
    for (int child = v->first_child[branch]; child >= 0; child = v->next_child[child]) {
        double way = fabs(v->model->branch[child].parent_t - t);
        if (child != except && way < far)
            walk_branch(w, child, 0, far - way, branch);
    }
    if (b->parent >= 0 && b->parent != except && t < far)
        walk_branch(w, b->parent, b->parent_t, far - t, branch);
}

static int sweep_locate(const Vessel *vessel, Vec3 x, int from)
{
    const SweepVessel *v = (const SweepVessel *)vessel;
    if (!has_place(v, from) || !(vec3_norm2(x) < 1e100))
        return vec3_norm2(x) < 1e100 ? nearest_node(v, x) : 0;
    SweepPlace start = v->place[from];
    Walk walk = {.vessel = v, .x = x, .best = from, .steps = 4000, .least = HUGE_VAL};
    int sac = start.branch < 0 ? start.sac : v->field->view[sweep_field_segment(v->field, start.branch, start.t)].sac;
    if (start.branch < 0) {
        if (v->field->sac[start.sac].view.count == 0)
            return from;
        const SweepCandidate *c = &v->field->sac[start.sac].view.of[0];
        start = (SweepPlace){.branch = c->branch, .t = c->t};
    }
    double t = fmax(0, fmin(v->field->curve[start.branch]->length, start.t)), radius = v->model->branch[start.branch].radius;
    walk_branch(&walk, start.branch, t, 2 * vec3_distance(x, sweep_curve_at(v->field->curve[start.branch], t).s) + 4 * radius, -1);
    for (int i = 0; sac >= 0 && i < v->model->sac->node_count; i++) {
        if (v->field->sac_group[i] != v->field->sac_group[sac] || v->model->sac->kind[i] != NODE_ANEURYSM)
            continue;
        double r = v->model->sac->radius[i], power = vec3_norm2(vec3_sub(x, v->model->sac->center[i])) - r * r;
        if (power < walk.least)
            walk.least = power, walk.best = v->model->sac_node[i];
    }
    return walk.best;
}

static bool sweep_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    const SweepVessel *v = (const SweepVessel *)vessel;
    const SweepInterval *line = &v->field->curve[0]->interval[0];
    *point = line->s[0];
    *direction = vec3_unit(line->s[1]);
    return true;
}

static void sweep_destroy(Vessel *vessel)
{
    SweepVessel *v = (SweepVessel *)vessel;
    if (!v)
        return;
    sweep_field_free(v->field);
    power_blocks_free(&v->blocks);
    vessel_tree_free(v->knots);
    free(v->place);
    free(v->first_child);
    free(v->next_child);
    free(v);
}

// --- Creation ---

static int highest_harmonic(const SweepModel *m)
{
    int highest = 1;
    for (int i = 0; i < m->row_count; i++)
        for (int k = 1; k < SWEEP_TERMS; k++)
            if (m->row[i * SWEEP_TERMS + k] != 0 && (k + 1) / 2 > highest)
                highest = (k + 1) / 2;
    return highest;
}

static void fill_places(SweepVessel *v)
{
    const SweepModel *m = v->model;
    for (int i = 0; i < v->node_count; i++)
        v->place[i].branch = -2;
    // a fork's node is a knot of two branches: the parent's comes first
    for (int i = 0; i < m->branch_count; i++) {
        v->first_child[i] = v->next_child[i] = -1;
        for (int k = 0; k < m->branch[i].knot_count; k++) {
            int knot = m->branch[i].first_knot + k, node = m->knot_node[knot];
            double t = v->field->curve[i]->knot_t[k];
            v->knots->center[knot] = m->knot[knot];
            v->knots->radius[knot] = fmax(sweep_field_mean(v->field, i, t), 1e-3 * m->branch[i].radius);
            if (v->place[node].branch == -2)
                v->place[node] = (SweepPlace){.branch = i, .t = t};
        }
    }
    for (int i = m->branch_count - 1; i > 0; i--) {
        int parent = m->branch[i].parent;
        v->next_child[i] = v->first_child[parent];
        v->first_child[parent] = i;
    }
    for (int i = 0; m->sac && i < m->sac->node_count; i++) {
        v->knots->center[m->knot_count + i] = m->sac->center[i];
        v->knots->radius[m->knot_count + i] = m->sac->radius[i];
        if (m->sac->kind[i] == NODE_ANEURYSM || v->place[m->sac_node[i]].branch == -2)
            v->place[m->sac_node[i]] = (SweepPlace){.branch = -1, .sac = i};
    }
}

static bool allocate(SweepVessel *v)
{
    const SweepModel *m = v->model;
    int sacs = m->sac ? m->sac->node_count : 0;
    for (int i = 0; i < m->knot_count; i++)
        v->node_count = m->knot_node[i] >= v->node_count ? m->knot_node[i] + 1 : v->node_count;
    for (int i = 0; i < sacs; i++)
        v->node_count = m->sac_node[i] >= v->node_count ? m->sac_node[i] + 1 : v->node_count;
    v->field = sweep_field_create(m);
    v->place = calloc((size_t)v->node_count, sizeof *v->place);
    v->first_child = calloc((size_t)m->branch_count, sizeof *v->first_child);
    v->next_child = calloc((size_t)m->branch_count, sizeof *v->next_child);
    v->knots = vessel_tree_create(m->knot_count + sacs, 0, 0);
    return v->field && v->place && v->first_child && v->next_child && v->knots;
}

Vessel *sweep_vessel_create_with(const SweepModel *model, int isa)
{
    SweepVessel *v = calloc(1, sizeof *v);
    if (!v)
        return NULL;
    v->model = model;
    if (!allocate(v)) {
        sweep_destroy(&v->vessel);
        return NULL;
    }
    v->feet = (SweepFeet){v->field, sweep_kernels(isa), highest_harmonic(model)};
    fill_places(v);
    if (!power_blocks_create(&v->blocks, v->knots)) {
        sweep_destroy(&v->vessel);
        return NULL;
    }
    size_t segments = (size_t)v->field->first_segment[model->branch_count];
    v->vessel = (Vessel){.kind = "sweep",
                         .query = sweep_query,
                         .locate = sweep_locate,
                         .inlet = sweep_inlet,
                         .destroy = sweep_destroy,
                         .primitives = (int64_t)segments,
                         .bytes = sizeof *v + segments * (sizeof(SweepSegment) + sizeof(SweepView)) + (size_t)v->node_count * sizeof(SweepPlace)};
    return &v->vessel;
}

Vessel *sweep_vessel_create(const SweepModel *model) { return sweep_vessel_create_with(model, 0); }
