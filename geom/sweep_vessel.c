// Contact with a swept model: the closest point of F = 0 (the foot), by Newton from the predicted position of the remembered foot.
//
// A foot that is followed is only a local minimum of the distance. At every query, the ring of the wall at the foot's t is compared with it: sixteen points of
// the same section. After some travel, the rings at five t around X are searched on all branches that are seen, for local minima of the distance; Newton from
// those gives the rivals of the foot. The nearest of all is the foot, and the distance of the second nearest says how far X may travel until the next search.
// Where ring points are nearer than the foot but Newton finds no nearer foot there, they lie in the mouth of another branch.
#include "geom/sweep_vessel.h"

#include "geom/power_blocks.h"
#include "geom/sweep_feet.h"

#include <stdlib.h>

// The nodes of the knots before and after a segment, and t between them.
typedef struct SegmentNodes {
    double middle;
    int before, after;
} SegmentNodes;

typedef struct SweepVessel {
    Vessel vessel;           // first: a Vessel * points to its SweepVessel
    const SweepModel *model;
    SweepField *field;
    SweepFeet feet;
    int node_count;          // one more than the highest node of a knot or of a sac
    SweepPlace *place;       // (nodes) branch -2: none
    SegmentNodes *nodes;     // (segments)
    int *first_child, *next_child;   // (branches) those that spring from a branch; -1: none
    VesselTree *knots;       // centres and radii of knots, then of the sacs' nodes, for the first location
    PowerBlocks blocks;
} SweepVessel;

_Static_assert((int)VESSEL_SEEN >= (int)SWEEP_CANDIDATES, "a memory holds t of all branches that are seen");

static const double REST = 1e-8;             // [mm] error of the gap that Newton may leave for a foot that is followed
static const double FOLLOWED = 1;            // relative to the radius: a point that has moved further has no foot to follow
static const double LOOK = 1;                // relative to the radius: how much further than the foot rivals are searched
static const double BESIDE = 0.25;           // relative to the radius: a rival that is no further than this behind the foot is followed
static const double LOOK_BESIDE = 0.25;      // relative to the radius: with a rival, a third foot may be this near
static const double TRUST_LEAST = 0.02, TRUST_MOST = 0.45;    // relative to the radius: travel between two searches …
static const double TRUST_AMONG = 0.25;      // … and at most this where several branches are seen

// --- Nodes and places ---

static int find_node(const SweepVessel *v, int segment, double t)
{
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

static int node_of(const SweepVessel *v, int segment, int sac, double t)
{
    if (segment < 0)
        return v->model->sac_node[sac];
    SEL_ASSERT(segment < v->field->first_segment[v->model->branch_count], "a foot lies on a segment of the model");
    const SegmentNodes *nodes = &v->nodes[segment];
    return t < nodes->middle ? nodes->before : nodes->after;
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
    SEL_ASSERT(isfinite(foot->gap) && vec3_is_finite(foot->at), "a foot that was found has a distance and a place");
    *hit = (VesselHit){.gap = foot->gap, .normal = foot->normal, .hessian = foot->hessian, .flags = foot->sure ? 0 : VESSEL_UNSURE};
    m->node = hit->node = node_of(v, foot->segment, foot->sac, foot->t);
    m->has_foot = foot->sure;
    m->foot = foot->at, m->place = x, m->normal = foot->normal, m->hessian = foot->hessian;
    m->clearance = foot->sure && foot->gap > 0 ? 0.999 * foot->gap : 0;
    m->clear_place = x;
    m->miss = m->step = vec3(0, 0, 0);
    m->sweep.segment = foot->segment, m->sweep.sac = foot->sac, m->sweep.own_t = foot->t, m->sweep.is_known = 0, m->sweep.apart = 0;
    set_flags(v, x, foot, hit);
}

// Trusts a foot for half the distance to its nearest rival.
static void trust(const SweepVessel *v, Vec3 x, const SweepFoot *foot, double rival, VesselMemory *m)
{
    SEL_ASSERT(!isnan(rival), "the distance of a rival is a number, or infinite");
    double radius = sweep_place_radius(&v->feet, foot->segment, foot->sac);
    bool alone = foot->segment >= 0 && v->field->view[foot->segment].count == 1 && v->field->view[foot->segment].sac < 0;
    m->bound_at = x;
    m->trust = fmax(TRUST_LEAST * radius, fmin((alone ? TRUST_MOST : TRUST_AMONG) * radius, 0.45 * (rival - fabs(foot->gap))));
}

// Remembers the second nearest foot if it is nearer than `most`: it is followed, too.
static void hold_rival(const SweepFoot *second, double most, VesselMemory *m)
{
    m->has_rival = fabs(second->gap) < most;
    if (!m->has_rival)
        return;
    SEL_ASSERT(second->segment >= 0 || second->sac >= 0, "a rival has a place");
    m->rival = second->at;
    m->sweep.rival_segment = second->segment, m->sweep.rival_sac = second->sac, m->sweep.rival_t = second->t;
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

// --- Checks ---

// A foot that may not be the nearest: its rivals' starts, and the feet that Newton finds from them.
enum { CHECK_STARTS = SWEEP_FEET, CHECK_ROUNDS = 14 };
typedef struct Check {
    int point, count;        // index in the query; number of starts
    bool nearer;             // a ring has a point nearer than the foot
    SweepFoot foot, found[CHECK_STARTS];
    SweepStart start[CHECK_STARTS];
    unsigned sound;          // bits of the feet that were found
    double radius, rival, beyond;    // [mm] rival: about the distance of the nearest wall without a start; beyond: see SweepSearch
} Check;

// Keeps the starts that may lead to a foot nearer than `most`.
static void keep_starts(double most, const SweepStart *start, int count, Check *check)
{
    check->count = 0;
    for (int i = 0; i < count; i++) {
        if (start[i].least < most && check->count < CHECK_STARTS)
            check->start[check->count++] = start[i];
        else
            check->rival = fmin(check->rival, start[i].least);
    }
}

// Searches for rivals of check->foot. A ball that lies inside one branch is lumen, whatever the other branches are: a foot on the wall of one branch alone is
// compared only with the rest of that wall, and with other walls if that does not suffice.
static void begin_check(const SweepVessel *v, Vec3 x, Check *check)
{
    const SweepFoot *foot = &check->foot;
    bool single = foot->segment >= 0 && v->field->view[foot->segment].count == 1 && v->field->view[foot->segment].sac < 0;
    double radius = sweep_place_radius(&v->feet, foot->segment, foot->sac), limit = fabs(foot->gap) + LOOK * radius;
    SweepStart start[SWEEP_FEET];
    SweepPlace place = place_of_foot(v, foot);
    SweepSearch search = {.most = SWEEP_FEET, .limit = limit, .from = foot->at, .nearest_beyond = &check->beyond};
    // a start closer to the foot than this leads to it, and a wall closer than `zone` belongs to it; outside, in the groove between two tubes, feet on both sides
    // are as near to each other as to x
    search.own = foot->gap > 0 ? 0.33 * radius : fmin(0.33 * radius, -0.6 * foot->gap);
    search.zone = foot->gap > 0 ? 0.9 * radius : fmin(0.9 * radius, -1.2 * foot->gap);
    check->radius = radius, check->rival = check->beyond = limit, check->count = 0, check->sound = 0;
    search.alone = single || (foot->pure && foot->gap > 0 && !check->nearer);
    if (search.alone) {
        int count = sweep_starts(&v->feet, x, place, foot->segment, &search, start);
        keep_starts(fabs(foot->gap), start, count, check);
    }
    if (!single && (!search.alone || check->count > 0)) {
        check->rival = check->beyond = search.limit = limit;
        search.alone = false;
        int count = sweep_starts(&v->feet, x, place, foot->segment, &search, start);
        keep_starts(fabs(foot->gap) + BESIDE * radius, start, count, check);
    }
}

// Finds feet from the starts of several checks, eight at a time.
static void run_checks(const SweepVessel *v, const Vec3 *point, Check *check, int count)
{
    Vec3 x[SWEEP_FEET], known[SWEEP_FEET];
    SweepStart start[SWEEP_FEET];
    SweepFoot found[SWEEP_FEET];
    int which[SWEEP_FEET], index[SWEEP_FEET], filled = 0;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < check[i].count; k++) {
            x[filled] = point[check[i].point], known[filled] = check[i].foot.at, start[filled] = check[i].start[k];
            which[filled] = i, index[filled++] = k;
            bool last = true;
            for (int j = i + (k + 1 == check[i].count); j < count && last; j++)
                last = check[j].count == 0;
            if (filled < SWEEP_FEET && !last)
                continue;
            unsigned sound = sweep_follow(&v->feet, x, start, known, filled, CHECK_ROUNDS, found);
            for (int j = 0; j < filled; j++)
                if (sound >> j & 1) {
                    check[which[j]].found[index[j]] = found[j];
                    check[which[j]].sound |= 1u << index[j];
                }
            filled = 0;
        }
}

// Answers with the nearest foot of a check.
static void end_check(const SweepVessel *v, Vec3 x, const Check *check, VesselMemory *m, VesselHit *hit)
{
    static const double SAME = 1e-4;         // [mm] feet closer together are one
    SweepFoot foot = check->foot, second = {.gap = HUGE_VAL};
    double rival = check->rival;
    bool nearer = check->nearer;
    for (int i = 0; i < check->count; i++) {
        SweepFoot other = check->found[i];
        if (!(check->sound >> i & 1) || other.doubtful || vec3_distance(other.at, foot.at) < SAME ||
            (isfinite(second.gap) && vec3_distance(other.at, second.at) < SAME))
            continue;
        if (fabs(other.gap) < fabs(foot.gap)) {
            other = foot, foot = check->found[i];
            nearer = false;
        }
        if (fabs(other.gap) < fabs(second.gap)) {
            SweepFoot third = second;
            second = other, other = third;
        }
        rival = fmin(rival, fabs(other.gap));
    }
    answer(v, x, &foot, m, hit);
    hold_rival(&second, fabs(foot.gap) + BESIDE * check->radius, m);
    if (!m->has_rival)
        rival = fmin(rival, fmin(check->beyond, fabs(second.gap)));
    else
        rival = fmin(rival, fabs(foot.gap) + LOOK_BESIDE * check->radius);
    trust(v, x, &foot, rival, m);
    m->sweep.open = nearer;
}

static void answer_afresh(const SweepVessel *v, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    double f, side, beyond = HUGE_VAL;
    Vec3 g;
    SweepPlace place = sweep_descend(&v->feet, x, v->place[m->node], &f, &g);
    SweepStart start[SWEEP_FEET];
    SweepFoot found[SWEEP_FEET], foot;
    side = f > 0 ? 1 : -1;
    const SweepSearch search = {.most = SWEEP_FEET - 1, .limit = HUGE_VAL, .from = x, .own = 0, .nearest_beyond = &beyond};
    int segment = place.branch >= 0 ? sweep_field_segment(v->field, place.branch, place.t) : -1;
    int count = sweep_starts(&v->feet, x, place, segment, &search, start), best = -1;
    // where F would be 0 if it were linear
    start[count] = (SweepStart){.at = vec3_add_scaled(x, -f / fmax(vec3_norm2(g), 0.25), g), .far = fabs(f), .sac = place.sac, .t = place.t};
    start[count++].segment = segment;
    count = sweep_settle(&v->feet, x, start, count, found);
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
        m->has_rival = false;
        trust(v, x, &foot, 0, m);
        m->sweep.open = 1;
        return;
    }
    // rings about a foot that is known are closer to each other than those of the first search
    Check check = {.foot = found[best], .nearer = true};
    begin_check(v, x, &check);
    run_checks(v, &x, &check, 1);
    end_check(v, x, &check, m, hit);
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

// A foot that one step does not reach: where Newton continues.
typedef struct Follow {
    bool alone;              // the own branch is evaluated alone
    Vec3 straight, first;    // the predicted foot, and that with the correction by the last prediction's miss
    Vec3 at;
    int segment, sac;        // the place, as in VesselSweepMemory
    double own_t, t[VESSEL_SEEN];
} Follow;

static Vec3 lane_at(const FootBatch *f, int i) { return vec3(f->at.x[i], f->at.y[i], f->at.z[i]); }

static void set_lane_at(FootBatch *f, int i, Vec3 at) { f->at.x[i] = at.x, f->at.y[i] = at.y, f->at.z[i] = at.z; }

static void load_lane(const SweepVessel *v, SweepBlock *b, int i, Vec3 x, const VesselMemory *m, bool alone)
{
    FootBatch *f = &b->foot;
    SEL_ASSERT(m->has_foot && m->sweep.segment < v->field->first_segment[v->model->branch_count], "a foot that is followed lies on the model");
    b->alone[i] = alone;
    sweep_block_place(&v->feet, b, i, m->sweep.segment, m->sweep.sac, m->sweep.own_t);
    sweep_block_set_point(&v->feet, b, i, x);
    set_lane_at(f, i, m->foot);
    f->at.gx[i] = m->place.x, f->at.gy[i] = m->place.y, f->at.gz[i] = m->place.z;
    f->nx[i] = m->normal.x, f->ny[i] = m->normal.y, f->nz[i] = m->normal.z;
    f->axx[i] = m->hessian.xx, f->axy[i] = m->hessian.xy, f->axz[i] = m->hessian.xz;
    f->ayy[i] = m->hessian.yy, f->ayz[i] = m->hessian.yz, f->azz[i] = m->hessian.zz;
    f->unique[i] = 0;
    b->keeps_t[i] = m->sweep.is_known != 0 && !alone;
    for (int k = 0; b->keeps_t[i] && k < b->view[i]->count; k++)
        b->part[k].t[i] = m->sweep.t[k];
}

// Corrects a predicted foot by the miss of the last prediction, scaled to a motion along the same line.
static Vec3 correct_start(const VesselMemory *m, Vec3 x, Vec3 straight)
{
    Vec3 motion = vec3_sub(x, m->place);
    double step2 = vec3_norm2(m->step), motion2 = vec3_norm2(motion), both = vec3_dot(m->step, motion);
    bool same = both * both > 0.8 * (step2 * motion2) && motion2 < 4 * step2;
    return same ? vec3_add_scaled(straight, motion2 / step2, m->miss) : straight;
}

static void pause_lane(const SweepBlock *b, int i, Vec3 straight, Vec3 first, Follow *w)
{
    *w = (Follow){.alone = b->alone[i], .straight = straight, .first = first, .at = lane_at(&b->foot, i)};
    w->segment = b->segment[i], w->sac = b->sac[i], w->own_t = b->own_t[i];
    for (int k = 0; k < b->view[i]->count; k++)
        w->t[k] = b->part[k].t[i];
}

static void resume_lane(const SweepVessel *v, SweepBlock *b, int i, Vec3 x, const Follow *w)
{
    FootBatch *f = &b->foot;
    b->alone[i] = w->alone;
    sweep_block_place(&v->feet, b, i, w->segment, w->sac, w->own_t);
    sweep_block_set_point(&v->feet, b, i, x);
    set_lane_at(f, i, w->at);
    f->longest[i] = 0.5 * f->radius[i], f->allowed[i] = REST, f->state[i] = FOOT_PENDING;
    b->keeps_t[i] = true;
    for (int k = 0; k < b->view[i]->count; k++)
        b->part[k].t[i] = w->t[k];
}

static void store_lane(const SweepVessel *v, const SweepBlock *b, int i, Vec3 x, VesselMemory *m, VesselHit *hit)
{
    SweepFoot foot = sweep_block_foot(&v->feet, b, i);
    double moved = vec3_distance(foot.at, m->foot), apart = b->alone[i] ? m->sweep.apart - moved : b->apart[i];
    bool known = m->sweep.is_known && m->sweep.segment == foot.segment;
    answer(v, x, &foot, m, hit);
    m->sweep.apart = fmax(0, apart);
    if (b->alone[i]) {       // t of the others are those of the last full evaluation
        m->sweep.is_known = known;
        return;
    }
    bool same = b->owner[i] == b->own[i] && foot.segment == b->segment[i];
    m->sweep.is_known = same;
    for (int k = 0; same && k < b->view[i]->count; k++)
        m->sweep.t[k] = b->part[k].t[i];
}

// Points of a batch that wait for the same treatment.
typedef struct Queue {
    int count, point[FOOT_BATCH];
} Queue;

typedef struct Batch {
    const Vec3 *point;
    VesselMemory *memory;
    VesselHit *hit;
    Queue alone, among;      // feet that are followed: those that see one branch, or near which no other matters; and the rest
    Queue again;             // feet that one step does not reach
    Queue sought;            // feet that are not reached by several steps: careful steps from where they were
    Queue beside;            // feet whose rivals are followed, too
    Follow follow[FOOT_BATCH];
    int checks;              // feet that may not be the nearest
    Check check[FOOT_BATCH];
} Batch;

static void put(Queue *queue, int point)
{
    SEL_REQUIRE(queue->count < FOOT_BATCH, "a point is in a queue at most once");
    queue->point[queue->count++] = point;
}

static void put_check(const SweepVessel *v, Batch *batch, int point, const SweepFoot *foot, bool nearer)
{
    SEL_REQUIRE(batch->checks < FOOT_BATCH, "a point is checked at most once");
    Check *check = &batch->check[batch->checks++];
    check->point = point, check->foot = *foot, check->nearer = nearer;
    begin_check(v, batch->point[point], check);
}

// Returns whether the memory's foot lies where one branch is seen and nothing else.
static bool is_single(const SweepVessel *v, const VesselMemory *m)
{
    return m->sweep.segment >= 0 && v->field->view[m->sweep.segment].count == 1 && v->field->view[m->sweep.segment].sac < 0;
}

// One step of up to eight points; the few that it does not bring to their feet fill other blocks, which take up to two more (`again`).
static void follow_block(const SweepVessel *v, Batch *batch, const int *which, int count, bool alone, bool again)
{
    enum { ROUNDS_AGAIN = 2 };
    static const double NEARER = 1e-6;       // [mm]
    SEL_ASSERT(count > 0 && count <= FOOT_BLOCK, "a block has a point, and no more than lanes");
    SweepBlock b;
    FootBatch *f = &b.foot;
    Vec3 straight[FOOT_BLOCK], first[FOOT_BLOCK];
    unsigned all = (1u << count) - 1, done = 0, usual = 0;
    sweep_block_begin(&b);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        int p = which[i < count ? i : 0];
        if (again)
            resume_lane(v, &b, i, batch->point[p], &batch->follow[p]);
        else
            load_lane(v, &b, i, batch->point[p], &batch->memory[p], alone);
    }
    if (!again)
        v->feet.kernels->predict(f, REST);
    for (int i = 0; i < FOOT_BLOCK; i++) {
        int p = which[i < count ? i : 0];
        straight[i] = again ? batch->follow[p].straight : lane_at(f, i);
        first[i] = again ? batch->follow[p].first : correct_start(&batch->memory[p], batch->point[p], straight[i]);
        if (!again)
            set_lane_at(f, i, first[i]);
    }
    for (int round = 0; round < (again ? ROUNDS_AGAIN : 1) && (done & all) != all; round++) {
        sweep_block_sample(&v->feet, &b, round == 0 ? FOOT_ALL : all & ~done);
        done = v->feet.kernels->newton(f, false);
        usual = round == 0 ? done : usual;
    }
    v->feet.kernels->finish(f);
    v->feet.kernels->ring(&b.ring, f, b.ring_x, b.ring_y, b.ring_z, b.harmonics);
    for (int i = 0; i < count; i++) {
        int p = which[i];
        VesselMemory *m = &batch->memory[p];
        Vec3 last = lane_at(f, i), motion = vec3_sub(batch->point[p], m->place);
        if (b.alone[i] && !is_single(v, m) && !(vec3_distance(first[i], m->foot) + vec3_distance(first[i], last) < m->sweep.apart)) {
            put(again ? &batch->sought : &batch->among, p);
            continue;
        }
        if (!(done >> i & 1)) {
            if (!again && f->state[i] == FOOT_PENDING) {
                pause_lane(&b, i, straight[i], first[i], &batch->follow[p]);
                put(&batch->again, p);
            } else {
                put(&batch->sought, p);
            }
            continue;
        }
        double size = fabs(f->gap[i]) - NEARER, travel = m->trust;
        bool nearer = b.own[i] >= 0 && b.is_flat[i] > 0 && size > 0 && b.ring.near2[i] < size * size;
        // a foot that moved further than was predicted may have a rival
        if (!(usual >> i & 1) || (nearer && !m->sweep.open) || !(vec3_norm2(vec3_sub(batch->point[p], m->bound_at)) < travel * travel)) {
            SweepFoot foot = sweep_block_foot(&v->feet, &b, i);
            put_check(v, batch, p, &foot, nearer);
            continue;
        }
        store_lane(v, &b, i, batch->point[p], m, &batch->hit[p]);
        m->miss = vec3_sub(last, straight[i]), m->step = motion;
        if (m->has_rival)
            put(&batch->beside, p);
    }
}

static void seek_block(const SweepVessel *v, Batch *batch, const int *which, int count)
{
    SweepStart start[SWEEP_FEET] = {0};
    SweepFoot found[SWEEP_FEET];
    Vec3 x[SWEEP_FEET] = {{0, 0, 0}};
    SEL_ASSERT(count > 0 && count <= SWEEP_FEET, "points come in blocks");
    for (int i = 0; i < count; i++) {
        const VesselMemory *m = &batch->memory[which[i]];
        x[i] = batch->point[which[i]];
        start[i] = (SweepStart){.at = m->foot, .far = vec3_distance(x[i], m->foot), .segment = m->sweep.segment, .sac = m->sweep.sac, .t = m->sweep.own_t};
    }
    unsigned sound = sweep_follow(&v->feet, x, start, NULL, count, SWEEP_ROUNDS, found);
    for (int i = 0; i < count; i++) {
        if (sound >> i & 1)
            put_check(v, batch, which[i], &found[i], false);
        else
            answer_afresh(v, x[i], &batch->memory[which[i]], &batch->hit[which[i]]);
    }
}

// Follows the rivals of feet that were found. A rival that has become nearer is the foot, and the foot its rival.
static void follow_rivals(const SweepVessel *v, Batch *batch, const int *which, int count)
{
    enum { ROUNDS = 6 };
    SweepStart start[SWEEP_FEET];
    SweepFoot rival[SWEEP_FEET];
    Vec3 x[SWEEP_FEET];
    SEL_ASSERT(count > 0 && count <= SWEEP_FEET, "rivals come in blocks");
    for (int i = 0; i < count; i++) {
        const VesselMemory *m = &batch->memory[which[i]];
        x[i] = batch->point[which[i]];
        start[i] = (SweepStart){
            .at = m->rival, .far = vec3_distance(x[i], m->rival), .segment = m->sweep.rival_segment, .sac = m->sweep.rival_sac, .t = m->sweep.rival_t};
    }
    unsigned done = sweep_follow(&v->feet, x, start, NULL, count, ROUNDS, rival);
    for (int i = 0; i < count; i++) {
        VesselMemory *m = &batch->memory[which[i]];
        VesselHit *h = &batch->hit[which[i]];
        SweepFoot foot = {.at = m->foot, .normal = m->normal, .hessian = m->hessian, .gap = h->gap, .sure = true};
        foot.segment = m->sweep.segment, foot.sac = m->sweep.sac, foot.t = m->sweep.own_t;
        if (!(done >> i & 1) || rival[i].doubtful || vec3_distance(rival[i].at, foot.at) < 1e-4) {
            put_check(v, batch, which[i], &foot, m->sweep.open != 0);
            continue;
        }
        if (fabs(rival[i].gap) < fabs(foot.gap)) {
            answer(v, x[i], &rival[i], m, h);
            hold_rival(&foot, HUGE_VAL, m);
        } else {
            hold_rival(&rival[i], HUGE_VAL, m);
        }
    }
}

static void follow_alone(const SweepVessel *v, Batch *batch, const int *which, int count) { follow_block(v, batch, which, count, true, false); }
static void follow_among(const SweepVessel *v, Batch *batch, const int *which, int count) { follow_block(v, batch, which, count, false, false); }
static void follow_again(const SweepVessel *v, Batch *batch, const int *which, int count) { follow_block(v, batch, which, count, false, true); }

static void in_blocks(const SweepVessel *v, Batch *batch, const Queue *queue, void (*treat)(const SweepVessel *v, Batch *batch, const int *which, int count))
{
    for (int i = 0; i < queue->count; i += FOOT_BLOCK)
        treat(v, batch, queue->point + i, queue->count - i < FOOT_BLOCK ? queue->count - i : FOOT_BLOCK);
}

// Neighbours on a branch see the same branches: in one block, these are evaluated together.
static void put_in_order(const VesselMemory *memory, Queue *queue, int point)
{
    put(queue, point);
    for (int i = queue->count - 1; i > 0 && memory[queue->point[i - 1]].sweep.segment > memory[point].sweep.segment; i--)
        queue->point[i] = queue->point[i - 1], queue->point[i - 1] = point;
}

static void query_batch(const SweepVessel *v, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    SEL_ASSERT(count <= FOOT_BATCH, "queries come in batches");
    Batch batch;
    batch.point = point, batch.memory = memory, batch.hit = hit;
    batch.alone.count = batch.among.count = batch.again.count = batch.sought.count = batch.beside.count = batch.checks = 0;
    for (int i = 0; i < count; i++) {
        VesselMemory *m = &memory[i];
        if (answer_cheaply(v, point[i], reach, m, &hit[i]))
            continue;
        double far = m->has_foot ? FOLLOWED * sweep_place_radius(&v->feet, m->sweep.segment, m->sweep.sac) : 0;
        if (!(vec3_norm2(vec3_sub(point[i], m->place)) < far * far))
            answer_afresh(v, point[i], m, &hit[i]);
        else if (is_single(v, m) || m->sweep.apart > vec3_distance(point[i], m->place))
            put(&batch.alone, i);
        else
            put_in_order(memory, &batch.among, i);
    }
    in_blocks(v, &batch, &batch.alone, follow_alone);
    in_blocks(v, &batch, &batch.among, follow_among);
    in_blocks(v, &batch, &batch.again, follow_again);
    in_blocks(v, &batch, &batch.sought, seek_block);
    in_blocks(v, &batch, &batch.beside, follow_rivals);
    run_checks(v, point, batch.check, batch.checks);
    for (int i = 0; i < batch.checks; i++) {
        int p = batch.check[i].point;
        end_check(v, point[p], &batch.check[i], &memory[p], &hit[p]);
    }
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
    SEL_ASSERT(branch >= 0 && branch < v->model->branch_count && far >= 0, "a walk goes along branches of the model, forwards");
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
        if (child != except && way < far && w->steps > 0)
            walk_branch(w, child, 0, far - way, branch);
    }
    if (b->parent >= 0 && b->parent != except && t < far && w->steps > 0)
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
    if (sac < 0)
        return walk.best;
    // balls are too coarse where a vessel touches a sac: the fields decide
    SweepPart inside;
    SweepPlace place = v->place[walk.best];
    double deepest = -HUGE_VAL;
    if (place.branch >= 0) {
        sweep_field_branch(v->field, place.branch, x, place.t, &inside);
        deepest = inside.f;
    }
    sweep_field_sac(v->field, sac, x, &inside);
    return inside.f > deepest ? v->model->sac_node[inside.sac] : walk.best;
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
    sweep_sac_points_free(&v->feet.sacs);
    power_blocks_free(&v->blocks);
    vessel_tree_free(v->knots);
    free(v->place);
    free(v->nodes);
    free(v->first_child);
    free(v->next_child);
    free(v->feet.alone);
    free(v);
}

// --- Creation ---

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
    for (int i = 0; i < m->branch_count; i++)
        for (int s = v->field->first_segment[i]; s < v->field->first_segment[i + 1]; s++) {
            const SweepInterval *interval = &v->field->curve[i]->interval[0];
            double from = v->field->segment[s].from, to = v->field->segment[s].to, t = from < 0 ? 0 : isfinite(to) ? 0.5 * (from + to) : from;
            interval += sweep_curve_interval(v->field->curve[i], t);
            double low = fmax(interval->from, 0), high = fmin(interval->to, v->field->curve[i]->length);
            v->nodes[s] = (SegmentNodes){0.5 * (low + high), find_node(v, s, low), find_node(v, s, high)};
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
    v->nodes = v->field ? calloc((size_t)v->field->first_segment[m->branch_count], sizeof *v->nodes) : NULL;
    return v->field && v->nodes && v->place && v->first_child && v->next_child && v->knots;
}

Vessel *sweep_vessel_create_with(const SweepModel *model, int isa)
{
    SEL_ASSERT(model->branch_count > 0 && model->branch[0].parent == -1, "the model is valid (sweep_model_validate)");
    SweepVessel *v = calloc(1, sizeof *v);
    if (!v)
        return NULL;
    v->model = model;
    if (!allocate(v)) {
        sweep_destroy(&v->vessel);
        return NULL;
    }
    v->feet = (SweepFeet){.field = v->field, .kernels = sweep_kernels(isa), .harmonics = sweep_model_harmonics(model)};
    v->feet.alone = calloc((size_t)model->branch_count, sizeof *v->feet.alone);
    if (!v->feet.alone) {
        sweep_destroy(&v->vessel);
        return NULL;
    }
    for (int i = 0; i < model->branch_count; i++)
        v->feet.alone[i] = (SweepView){.count = 1, .sac = -1, .of[0] = {i, v->field->first_segment[i], 0, 1}};
    fill_places(v);
    if (!power_blocks_create(&v->blocks, v->knots) || !sweep_sac_points_create(v->field, &v->feet.sacs)) {
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
