// Contact candidates at the iterate: contact points whose gap could close in this step. Contact point p is node p, or slot p - M if p >= M (slot.h). A point
// that is certainly further away is not queried again until it has travelled its clearance (docs/design.md, "Stability", 6).
//
// Nodes are queried first. A slot between two nodes is left out while its nodes keep it off the wall: guarded_for() computes from the gaps, normals and
// Hessians at the three points how far the slot may travel before the element could be nearer to the wall there than at its nodes. This holds for elements of
// any length. When only the nodes were checked, a ridge between nodes 1.5 mm apart let a stiff wire penetrate by 0.07 mm.
//
// Where a lumen is hardly wider than the tool, the linearisation of one wall sends the point through the opposite wall, the next linearisation sends it back,
// and this repeats for ever. Each point therefore stores the wall opposite to the one it currently sees, and gets a contact with both (WallMet).
#include "solver/self_contact.h"
#include "solver/tools_internal.h"

#include <string.h>

static const double REACH = 0.2;         // [mm] margin of candidates beyond the nodes' own travel: contact forces can move neighbours
static const double SHARED_TRAVEL = 0.3; // [mm] every node is assumed to move as far as the fastest one, up to this limit
static const double SLOT_REACH = 0.1;    // [mm] the same margin for slots, whose nodes become candidates long before
static const double REACH_MAX = 5;       // [mm]
static const double SLEEP_MAX = 1;       // [mm] of travel: the vessel can track the wall from a known foot over this distance, not over any distance
static const double STEP_OUT_MAX = 0.2;  // [mm] a deep point is pushed out by at most this much per step
static const double DEEP = 0.2;          // [mm] STEP_DEEP
static const double OVERSHOOT_TRAVEL = 0.05;   // [mm] a point that the solution moves by less is assumed to stay where its linearised wall is valid
static const double DIP_MIN = 0.002;     // [mm] a slot counts if the element may be nearer to the wall there than its nodes by this much …
static const double DIP_MAX = 0.01;      // … and is queried again before that reaches this much
static const double GUARD_MAX = 0.3;     // [mm] of travel after which the wall's shape between two nodes is no longer known
static const double LINGER = 0.9, LINGER_MAX = 0.006;     // as a share of the gap; [mm]
static const double MET_FAR = 0.2;       // [mm] distance over which an opposite wall is remembered: as far as a plane approximates it
static const double OVERLAP_MAX = 0.045; // [mm] most by which the gaps to two opposite walls may overlap; equals DEPTH_LAST of step_follow.c
static const double TOUCH_REACH = 0.05;  // [mm] of gap: beyond this, contact is placed at the point itself (step_touch.c)
static const double FORGOTTEN = -1;      // clearance of a point after forget(); a flag beside it would change the state hash

static Vec3 tangent_at(const Stepper *s, int node)
{
    Quat q = s->state.orientation[node];
    return vec3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y));
}

// Computes the position of slot k; false if it is in the sheath.
static bool place_slot(Stepper *s, int k)
{
    const Slot *slot = &s->points.slot[k];
    int i = slot->element;
    const Vec3 *x = s->state.position;
    double length = s->wire.length[i];
    if (i + 1 == s->first_free)
        return i + 2 < s->state.node_count && slot_place_at_mouth(slot, length, stepper_sheath_coordinate(s, i), s->entry.mouth, s->entry.axis[0], x[i + 1],
                                                                  tangent_at(s, i + 1), &s->points.slot_place[k]);
    if (s->tools.count > 1 && s->tools.carrier[i] != s->tools.carrier[i + 1])
        return slot_place_beyond(slot, length, length - tools_span_length(s, i), x[i], tangent_at(s, i), x[i + 1], tangent_at(s, i + 1),
                                 &s->points.slot_place[k]);
    s->points.slot_place[k] = slot_place(slot, length, x[i], tangent_at(s, i), x[i + 1], tangent_at(s, i + 1));
    return true;
}

// Displacement of a node from the iterate to the solution; `from` is 0 for translation, 3 for rotation.
static Vec3 change(const Stepper *s, int node, int from)
{
    const double *u = s->system.u + row_of(s, node) + from, *k = s->iterate.moved + row_of(s, node) + from;
    return vec3_sub(vec3(u[0], u[1], u[2]), vec3(k[0], k[1], k[2]));
}

static bool at_mouth(const Stepper *s, int element) { return element + 1 == s->first_free; }

// The displacement of slot k that results from its nodes' translations and rotations.
static Vec3 follow(const Stepper *s, int k, const Vec3 move[2], const Vec3 turn[2])
{
    const SlotPlace *p = &s->points.slot_place[k];
    Vec3 d = vec3_add(vec3_scale(move[1], p->weight), vec3_cross(turn[1], p->lever[1]));
    if (at_mouth(s, s->points.slot[k].element))
        return d;
    return vec3_add(d, vec3_add(vec3_scale(move[0], 1 - p->weight), vec3_cross(turn[0], p->lever[0])));
}

// The displacement of a contact point from the iterate to the solution.
static Vec3 motion(const Stepper *s, int point)
{
    int nodes = s->state.node_count;
    if (point < nodes)
        return change(s, point, 0);
    int i = s->points.slot[point - nodes].element;
    Vec3 move[2] = {change(s, i, 0), change(s, i + 1, 0)}, turn[2] = {change(s, i, 3), change(s, i + 1, 3)};
    return follow(s, point - nodes, move, turn);
}

// The displacement of a node since the wall was last queried.
static Vec3 since(const Stepper *s, int node, int from)
{
    const double *k = s->iterate.moved + row_of(s, node) + from, *seen = s->iterate.seen + row_of(s, node) + from;
    return vec3(k[0] - seen[0], k[1] - seen[1], k[2] - seen[2]);
}

static Vec3 done(const Stepper *s, int node, int from)
{
    const double *k = s->iterate.moved + row_of(s, node) + from;
    return vec3(k[0], k[1], k[2]);
}

// [mm] An upper bound of a slot's displacement for these translations and rotations of its nodes.
static double slot_travel(const Slot *slot, Vec3 move1, Vec3 turn1, Vec3 move2, Vec3 turn2)
{
    return sqrt(fmax(vec3_norm2(move1), vec3_norm2(move2))) + slot->near * vec3_norm(turn1) - slot->far * vec3_norm(turn2);
}

// [mm] The distance a point moves (an upper bound for a slot), by `way`: from the iterate to the solution, or since the wall was last queried.
static double travel_of(const Stepper *s, int point, Vec3 (*way)(const Stepper *, int, int))
{
    if (point < s->state.node_count)
        return vec3_norm(way(s, point, 0));
    const Slot *slot = &s->points.slot[point - s->state.node_count];
    int i = slot->element;
    return slot_travel(slot, way(s, i, 0), way(s, i, 3), way(s, i + 1, 0), way(s, i + 1, 3));
}

static double travel(const Stepper *s, int point) { return travel_of(s, point, change); }
static double travelled(const Stepper *s, int point) { return travel_of(s, point, since); }

static Vec3 place_of(const Stepper *s, int point)
{
    int nodes = s->state.node_count;
    return point < nodes ? s->state.position[point] : s->points.slot_place[point - nodes].position;
}

static double radius_of(const Stepper *s, int point)
{
    int nodes = s->state.node_count;
    return point < nodes ? s->wire.radius[point] : s->points.slot[point - nodes].radius;
}

// The first slot that may be outside the sheath. Free contact points are the nodes from first_free on and the slots from the element at the mouth on.
static int first_slot(const Stepper *s) { return s->state.node_count + s->points.slot_start[s->first_free > 0 ? s->first_free - 1 : 0]; }

bool stepper_escapes(const Stepper *s)
{
    if (!s->vessel)
        return false;
    for (int p = s->first_free; p < s->state.node_count; p++)
        if (s->points.allowed[p] < HUGE_VAL && travel(s, p) > s->points.allowed[p])
            return true;
    for (int p = first_slot(s); p < s->points.count; p++)
        if (s->points.allowed[p] < HUGE_VAL && travel(s, p) > s->points.allowed[p])
            return true;
    return false;
}

// Adds a query for a point at its trial position x. A point that was not queried for some time may have left its stored part of the vessel, so it is located
// again.
static void queue_trial(Stepper *s, int point, Vec3 x, int *count)
{
    int nodes = s->state.node_count, from = s->points.place[point].node;
    s->query.which[*count] = point;
    s->query.point[*count] = x;
    s->query.place[*count] = s->points.tried[point] ? s->points.trial[point] : s->points.place[point];
    if (from < 0 && point >= nodes)
        from = s->points.place[s->points.slot[point - nodes].element + 1].node;
    if (!s->points.tried[point] && (s->points.place[point].node < 0 || s->points.clearance[point] > 0))
        s->query.place[*count] = (VesselMemory){.node = s->vessel->locate(s->vessel, x, from)};
    ++*count;
}

// Runs the queries and stores their results for the next trial.
static void run_trials(Stepper *s, int count)
{
    if (count > 0)
        vessel_query(s->vessel, count, s->query.point, 0.5, s->query.place, s->query.hit);
    for (int k = 0; k < count; k++) {
        s->points.trial[s->query.which[k]] = s->query.place[k];
        s->points.tried[s->query.which[k]] = true;
    }
}

// The iterate is now at the last trial position, so the trials' vessel memories become current.
static void take_trials(Stepper *s)
{
    for (int p = 0; p < s->points.count; p++)
        if (s->points.tried[p] && s->iterate.is_moved)
            s->points.place[p] = s->points.trial[p];
    memset(s->points.tried, 0, (size_t)s->points.count * sizeof *s->points.tried);
}

// The largest depth outside the true wall [mm] over the points that have moved, or would move with the solution, further than the known wall extends. Overlap
// of two opposite walls is not counted: no motion removes it.
static double deepest_there(Stepper *s, bool would_go)
{
    int count = 0;
    double deepest = 0;
    for (int p = s->first_free; p < s->points.count; p++) {
        if (p == s->state.node_count)
            p = first_slot(s);
        if (p == s->points.count)
            break;
        double far = would_go ? travel(s, p) : travelled(s, p);
        if (far < (s->points.allowed[p] < HUGE_VAL ? s->points.allowed[p]
                   : would_go                      ? OVERSHOOT_TRAVEL
                                                   : 0) ||
            (p >= s->state.node_count && !place_slot(s, p - s->state.node_count)))
            continue;
        queue_trial(s, p, would_go ? vec3_add(place_of(s, p), motion(s, p)) : place_of(s, p), &count);
    }
    run_trials(s, count);
    for (int k = 0; k < count; k++)
        if (!(s->query.hit[k].flags & (VESSEL_FAR | VESSEL_OPEN_END)))
            deepest = fmax(deepest, radius_of(s, s->query.which[k]) - s->query.hit[k].gap - s->points.overlap[s->query.which[k]]);
    return deepest;
}

double stepper_overshoot(Stepper *s) { return s->vessel ? deepest_there(s, true) : 0; }
double stepper_depth(Stepper *s) { return s->vessel ? deepest_there(s, false) : 0; }

// Estimates from the known motion how far each node may move in this step. A disturbance runs along the wire, so what one node does its neighbours may do next.
// (With this rule, a shorter reach leaves fewer points that travel beyond the searched range.)
static void estimate_ranges(Stepper *s)
{
    int first = s->first_free > 0 ? s->first_free - 1 : 0, nodes = s->state.node_count;
    double fastest = 0;
    for (int i = first; i < nodes; i++) {
        Vec3 v = s->iterate.knows_motion ? change(s, i, 0) : s->state.velocity[i];
        s->query.range[i] = sqrt(vec3_norm2(v));
        fastest = s->query.range[i] > fastest ? s->query.range[i] : fastest;
    }
    if (s->iterate.knows_motion)
        return;
    double shared = fmin(fastest, SHARED_TRAVEL / (2 * s->dt));
    for (int i = first; i < nodes; i++)
        s->query.range[i] = s->query.range[i] > shared ? s->query.range[i] : shared;
}

// The gap up to which a point is a candidate.
static double reach_of(const Stepper *s, int point)
{
    int nodes = s->state.node_count;
    double reach = REACH, range;
    if (point < nodes) {
        range = s->query.range[point];
    } else {
        int i = s->points.slot[point - nodes].element;
        range = fmax(s->query.range[i], s->query.range[i + 1]);
        reach = SLOT_REACH;
    }
    reach += s->iterate.knows_motion ? 1.5 * range : fabs(s->command.advance) + 2 * s->dt * range;
    return reach < REACH_MAX ? reach : REACH_MAX;
}

static void forget(Stepper *s, int point)
{
    s->points.place[point].node = -1;
    s->points.place[point].has_foot = false;
    s->points.clearance[point] = FORGOTTEN;
    s->points.force[point] = vec3(0, 0, 0);
    s->points.met[point] = (WallMet){0};
    s->points.touch[point] = s->points.touch_next[point] = 0;
}

void stepper_doubt(Stepper *s)
{
    for (int p = 0; p < s->points.count; p++)
        if (s->points.tried[p]) {
            s->points.place[p].has_foot = false;
            s->points.place[p].clearance = s->points.clearance[p] = 0;
        }
}

void stepper_forget(Stepper *s, int node)
{
    forget(s, node);
    for (int k = node > 0 ? s->points.slot_start[node - 1] : 0; k < s->points.slot_start[node]; k++)
        forget(s, s->state.node_count + k);
}

// A node without a known location starts from a neighbouring node's; a slot starts from a neighbouring node's knowledge of the wall.
static void locate(Stepper *s, int point)
{
    VesselMemory *place = s->points.place;
    int nodes = s->state.node_count, from = -1;
    if (point >= nodes) {
        int i = s->points.slot[point - nodes].element, known = s->query.answer_of[i + 1] >= 0 || place[i].node < 0 ? i + 1 : i;
        if (place[known].node >= 0) {
            place[point] = place[known];
            return;
        }
    } else if (point > s->first_free && place[point - 1].node >= 0) {
        from = place[point - 1].node;
    } else if (point + 1 < nodes && place[point + 1].node >= 0) {
        from = place[point + 1].node;
    }
    place[point] = (VesselMemory){.node = s->vessel->locate(s->vessel, place_of(s, point), from)};
}

// Is a point known to be too far away to touch the wall?
static bool sleeps(Stepper *s, int point)
{
    s->points.allowed[point] = HUGE_VAL;
    if (s->points.clearance[point] > 0 && s->iterate.knows_motion && travel(s, point) > s->points.clearance[point])
        s->points.clearance[point] = 0;
    if (!(s->points.clearance[point] > 0))
        return false;
    // its clearance was reduced by its reach when it was set
    s->points.allowed[point] = s->points.clearance[point] + (point < s->state.node_count ? REACH : SLOT_REACH);
    return true;
}

static void queue_point(Stepper *s, int point, int *count)
{
    if (s->points.place[point].node < 0)
        locate(s, point);
    s->points.clearance[point] = 0;
    s->query.which[*count] = point;
    Touch touch;
    s->query.point[*count] = touch_of(s, point, &touch) ? touch.place.position : place_of(s, point);
    s->query.place[(*count)++] = s->points.place[point];
}

// The norm of the difference of two wall Hessians [1/mm].
static double unlike(const Sym3 *a, const Sym3 *b)
{
    Sym3 d = {a->xx - b->xx, a->xy - b->xy, a->xz - b->xz, a->yy - b->yy, a->yz - b->yz, a->zz - b->zz};
    return sqrt(sym3_norm2(&d));
}

// [mm] The travel after which a difference of slopes and a difference of curvatures have used up the margin `has`, at most GUARD_MAX.
static double until_used(double has, double slope, double bend)
{
    double root = slope + sqrt(slope * slope + 2 * bend * has);
    return root * GUARD_MAX > 2 * has ? 2 * has / root : GUARD_MAX;
}

// [mm] How far a slot may travel until its element may be nearer to the wall there than its nodes are, by DIP_MAX. Negative if it already is nearer by DIP_MIN,
// or if the nodes' queries do not say. Along the travel, the margin over the nodes' gaps shrinks by the difference between the wall's slope here and at the
// nodes, and by the difference of the curvatures.
static double guarded_for(const Stepper *s, int k, const VesselHit *hit, double *sleep)
{
    const Slot *slot = &s->points.slot[k];
    int i = slot->element, a = s->query.answer_of[i], b = s->query.answer_of[i + 1];
    if (i + 1 == s->first_free || a < 0 || b < 0 || (s->query.hit[a].flags | s->query.hit[b].flags | hit->flags) != 0)
        return -1;
    VesselHit first = touch_back(s, i, &s->query.hit[a]), second = touch_back(s, i + 1, &s->query.hit[b]);
    const VesselHit *near = &first, *far = &second;
    double w = slot->weight, over = hit->gap - near->gap - w * (far->gap - near->gap);
    if (!(over > -DIP_MIN))
        return -1;
    double slope = (1 - w) * vec3_distance(hit->normal, near->normal) + w * vec3_distance(hit->normal, far->normal);
    double bend = (1 - w) * unlike(&hit->hessian, &near->hessian) + w * unlike(&hit->hessian, &far->hessian);
    *sleep = until_used(over + DIP_MIN, slope, bend);
    return until_used(over + DIP_MAX, slope, bend);
}

// [mm] By how much the gaps of a point to the wall it sees and to the opposite wall it saw before overlap. The opposite wall is forgotten once it no longer
// faces this one.
static double meet_across(Stepper *s, int point, Vec3 x, const VesselHit *hit)
{
    WallMet *met = &s->points.met[point];
    double radius = radius_of(s, point), gap = hit->gap - radius;
    if (vec3_dot(met->normal, hit->normal) < 0) {
        met->across = met->normal;
        met->beyond = met->offset;
        met->where = x;
    }
    met->normal = hit->normal;
    met->offset = vec3_dot(hit->normal, x) - gap;
    // a point that is behind the other wall by more than its radius has passed over an edge instead
    double other = vec3_dot(met->across, x) - met->beyond;
    bool faces = vec3_dot(met->across, hit->normal) < 0 && other > -radius && vec3_distance(x, met->where) < MET_FAR;
    if (!faces)
        met->across = vec3(0, 0, 0);
    return s->points.overlap[point] = faces ? fmin(OVERLAP_MAX, fmax(0, -other - gap)) : 0;
}

// A point that is no candidate is queried at its own position again. That may be nearer to the wall than the touch position by the distance between them, so
// the clearance shrinks by it.
static void leave_touch(Stepper *s, int point)
{
    s->points.clearance[point] = fmax(0, s->points.clearance[point] - fabs(s->points.touch_next[point]));
    s->points.touch_next[point] = 0;
}

// Has a projection that started from a foot point known from elsewhere ended on a wall much further away than that foot point? The true wall is at most as far
// away as the foot point.
static bool has_strayed(const VesselMemory *before, Vec3 x, const VesselHit *hit)
{
    return before->node >= 0 && vec3_norm2(before->foot) > 0 && fabs(hit->gap) > 2 * vec3_distance(x, before->foot) + 1;
}

// Evaluates queries first to count-1: points that are too far away get a clearance and are skipped; for candidates the number of the query is stored.
static int answer(Stepper *s, int first, int count, int *candidate)
{
    double reach = 0;
    int candidates = 0, nodes = s->state.node_count;
    for (int k = first; k < count; k++) {
        double own = reach_of(s, s->query.which[k]) + radius_of(s, s->query.which[k]);
        reach = own > reach ? own : reach;
    }
    // the gap returned for a far point is a lower bound that grows with the search range: twice the reach lets most far points be skipped for a while
    if (count > first)
        vessel_query(s->vessel, count - first, s->query.point + first, 2 * reach, s->query.place + first, s->query.hit + first);
    for (int k = first; k < count; k++) {
        int point = s->query.which[k];
        const VesselHit *hit = &s->query.hit[k];
        if (has_strayed(&s->points.place[point], s->query.point[k], hit)) {
            s->query.place[k] = (VesselMemory){.node = s->vessel->locate(s->vessel, s->query.point[k], s->points.place[point].node)};
            vessel_query(s->vessel, 1, &s->query.point[k], 2 * reach, &s->query.place[k], &s->query.hit[k]);
        }
        double gap = hit->gap - radius_of(s, point), own_reach = reach_of(s, point);
        s->points.place[point] = s->query.place[k];
        if (!(hit->flags & (VESSEL_FAR | VESSEL_OPEN_END)))
            s->iterate.depth = fmax(s->iterate.depth, -gap - meet_across(s, point, s->query.point[k], hit));
        double sleep = 0, guarded = point < nodes || stepper_presses(s, point) ? -1 : guarded_for(s, point - nodes, hit, &sleep);
        if (guarded > own_reach - SLOT_REACH) {
            s->points.allowed[point] = guarded;
            s->points.clearance[point] = sleep;
            leave_touch(s, point);
            continue;
        }
        if (!(hit->flags & (VESSEL_FAR | VESSEL_OPEN_END)) && gap < own_reach && vec3_is_finite(hit->normal)) {
            candidate[candidates++] = k;
            continue;
        }
        s->points.force[point] = vec3(0, 0, 0);
        if (hit->flags & VESSEL_OPEN_END) {
            leave_touch(s, point);
            continue;
        }
        s->points.allowed[point] = gap;
        if (gap > own_reach)
            s->points.clearance[point] = fmin(gap - own_reach, SLEEP_MAX);
        leave_touch(s, point);
    }
    return candidates;
}

static int queue_nodes(Stepper *s)
{
    int count = 0;
    for (int i = s->first_free; i < s->state.node_count; i++) {
        s->query.answer_of[i] = -1;
        if (sleeps(s, i) || (s->rig.fixed[i] & DOF_POSITION) == DOF_POSITION)
            continue;
        s->query.answer_of[i] = count;
        queue_point(s, i, &count);
    }
    return count;
}

// [mm] A lower bound, from its nodes' clearances, of how far a slot is from where it could touch. An arc is longer than its chord; 5 % cover that.
static double clearance_by_nodes(const Stepper *s, const Slot *slot)
{
    int i = slot->element;
    double length = 1.05 * s->wire.length[i], near = s->points.clearance[i] - slot->xi * length, far = s->points.clearance[i + 1] - (1 - slot->xi) * length;
    return near > far ? near : far;
}

static int queue_slots(Stepper *s, int count)
{
    int nodes = s->state.node_count;
    for (int p = first_slot(s); p < s->points.count; p++) {
        int k = p - nodes;
        if (sleeps(s, p))
            continue;
        double bound = clearance_by_nodes(s, &s->points.slot[k]);
        if (bound > 0) {
            s->points.allowed[p] = bound + REACH;
            s->points.place[p].node = -1;      // may travel far before it is queried again
        }
        if (bound <= 0 && place_slot(s, k))
            queue_point(s, p, &count);
        else if (s->points.clearance[p] != FORGOTTEN)
            forget(s, p);    // its stored data become outdated; its neighbours' do not
    }
    return count;
}

// --- candidates ---

// The part of the motion from x_n that the iterate has already made, at the touching point. The unknowns are displacements from x_n.
static Vec3 done_at(const Stepper *s, int point, Vec3 arm)
{
    int nodes = s->state.node_count;
    Touch touch;
    if (s->points.touch_next[point] != 0 && touch_at(s, point, s->points.touch_next[point], &touch))
        return touch_done(s, &touch, arm);
    if (point < nodes)
        return vec3_add(done(s, point, 0), vec3_cross(done(s, point, 3), arm));
    int k = point - nodes, i = s->points.slot[k].element;
    Vec3 move[2] = {done(s, i, 0), done(s, i + 1, 0)}, turn[2] = {done(s, i, 3), done(s, i + 1, 3)};
    double w = s->points.slot_place[k].weight;
    Vec3 spin = vec3_scale(turn[1], w);
    if (!at_mouth(s, i))
        spin = vec3_add_scaled(spin, 1 - w, turn[0]);
    return vec3_add(follow(s, k, move, turn), vec3_cross(spin, arm));
}

// A contact between the sheath and the first free node moves by w u + theta x (lever + w a), plus its share of the advance. Dividing this motion, the gap and
// the curvature by w turns it into a contact of the node alone, whose force is w times the real one.
static void lean_on_sheath(const Stepper *s, int k, ContactPoint *c)
{
    const SlotPlace *p = &s->points.slot_place[k];
    double w = p->weight, ahead = s->command.advance - (s->iterate.is_moved ? s->iterate.moved[row_of(s, s->points.slot[k].element)] : 0);
    c->node = s->first_free;
    c->xi = 0;
    c->gap = (c->gap + (1 - w) * ahead * vec3_dot(p->tangent, c->normal)) / w;
    c->lever[0] = vec3_scale(p->lever[1], 1 / w);
    c->lever[1] = vec3(0, 0, 0);
    c->force = vec3_scale(c->force, w);
    Sym3 *h = &c->hessian;
    h->xx *= w, h->xy *= w, h->xz *= w, h->yy *= w, h->yz *= w, h->zz *= w;
}

// A wire that slides along a convex wall has turned round it by h v / R at the step's end. That curvature is not in the matrix (contact.c), and a force along
// the normal of the step's start would act like friction with coefficient h v / R: 50 mm/s in a bend of 15 mm radius cost 0.5 % per quarter turn. The wall is
// therefore linearised about the position that sliding leads to: normal n + H d, gap g - d'Hd / 2, with d = h v along the tool only, because that velocity is
// steady (with the transverse velocity included, a settling wire would oscillate).
static void look_ahead(double dt, Vec3 axis, Vec3 velocity, ContactPoint *c)
{
    static const double TURN_AHEAD = 0.1;        // [rad] no tool slides further round a smooth wall in a step
    Vec3 d = vec3_scale(axis, dt * vec3_dot(axis, velocity));
    d = vec3_add_scaled(d, -vec3_dot(d, c->normal), c->normal);
    Vec3 turn = sym3_mul_vec(&c->hessian, d);
    double rise = vec3_dot(d, turn);
    if (!(rise > 0 && vec3_norm2(turn) < TURN_AHEAD * TURN_AHEAD))
        return;
    c->normal = vec3_unit(vec3_add(c->normal, turn));
    c->gap -= 0.5 * rise;
}

// [mm] By how much the wall of a point is assumed to be nearer in this step. Where the query of a point passes from one local model of the wall to the next,
// the wall may jump back by some um; a wire that followed at once would jerk the hand. A point that pressed in the last step instead follows by a part of the
// gap per step.
static double linger(Stepper *s, int point, double gap)
{
    if (!s->iterate.is_moved && !s->iterate.knows_motion && stepper_presses(s, point) && gap > 0)
        s->points.linger[point] = LINGER * fmin(gap, LINGER_MAX);
    return s->points.linger[point];
}

// The current position of a point's contact.
static Vec3 touched(const Stepper *s, int point)
{
    Touch touch;
    return s->points.touch_next[point] != 0 && touch_at(s, point, s->points.touch_next[point], &touch) ? touch.place.position : place_of(s, point);
}

static void add_candidate(Stepper *s, int point, const VesselHit *hit)
{
    int nodes = s->state.node_count;
    const SlotPlace *p = point < nodes ? NULL : &s->points.slot_place[point - nodes];
    double radius = radius_of(s, point), friction = p ? s->points.slot[point - nodes].friction : s->wire.friction[point], gap = hit->gap - radius;
    ContactPoint *c = &s->system.set.point[s->system.set.count];
    s->points.candidate[s->system.set.count++] = point;
    c->node = p ? s->points.slot[point - nodes].element : point;
    c->is_between = p != NULL;
    c->xi = p ? p->weight : 0;
    c->lever[0] = p ? p->lever[0] : vec3(0, 0, 0);
    c->lever[1] = p ? p->lever[1] : vec3(0, 0, 0);
    c->normal = hit->normal;
    c->gap = gap > -STEP_OUT_MAX ? gap : -STEP_OUT_MAX;
    c->gap -= linger(s, point, gap);
    c->hessian = hit->hessian;
    c->friction = friction >= 0 ? friction : s->wall_friction;
    c->tool_radius = radius;
    c->force = s->points.force[point];
    c->roll = 0;
    c->slid = vec3(0, 0, 0);
    Touch touch;
    const WallMet *met = &s->points.met[point];
    double offset = s->iterate.is_moved ? s->points.touch_next[point] : s->points.touch[point];
    bool touches = (offset != 0 || (gap < TOUCH_REACH && !s->iterate.is_moved && s->iterate.slides != 0)) && touch_at(s, point, offset, &touch);
    if (touches)
        touch_contact(s, point, hit, c->gap, &touch, c);
    else if (s->iterate.is_moved)
        c->gap -= vec3_dot(done_at(s, point, vec3_scale(hit->normal, -radius)), hit->normal);
    if (!s->iterate.is_moved && !touches) {
        int node = c->node;
        bool is_between = p || touches;
        look_ahead(
            s->dt,
            touches ? touch.place.tangent
            : p     ? p->tangent
                    : tangent_at(s, point),
            is_between ? vec3_mix(s->state.velocity[node], s->state.velocity[node + 1], touches ? touch.place.weight : p->weight) : s->state.velocity[node], c);
    }
    if (p && at_mouth(s, c->node)) {
        lean_on_sheath(s, point - nodes, c);
        return;
    }
    if (vec3_norm2(met->across) == 0)
        return;
    // between two opposite walls: both move back by half of the missing room
    ContactPoint *across = &s->system.set.point[s->system.set.count];
    s->points.candidate[s->system.set.count++] = point;
    *across = *c;
    c->gap += 0.5 * s->points.overlap[point];
    across->normal = met->across;
    across->hessian = (Sym3){0};
    across->gap = vec3_dot(met->across, touched(s, point)) - met->beyond + 0.5 * s->points.overlap[point];
    across->roll = 0;
    across->slid = vec3(0, 0, 0);
    if (s->iterate.is_moved)
        across->gap -= vec3_dot(done_at(s, point, vec3_scale(met->across, -radius)), met->across);
}

bool stepper_meet_walls(Stepper *s, double part)
{
    int count = 0;
    bool any = false;
    for (int k = 0; k < s->system.set.count; k++)
        queue_trial(s, s->points.candidate[k], touched(s, s->points.candidate[k]), &count);
    run_trials(s, count);
    for (int k = 0; k < count; k++) {
        ContactPoint *c = &s->system.set.point[k];
        double radius = radius_of(s, s->points.candidate[k]), gap = s->query.hit[k].gap - radius;
        double linear = c->gap + vec3_dot(done_at(s, s->points.candidate[k], vec3_scale(c->normal, -radius)), c->normal);
        // not if a different, opposite wall was found: moving this one would push the point into that
        if ((s->query.hit[k].flags & (VESSEL_FAR | VESSEL_OPEN_END)) || !(gap < 0 && gap < linear) || vec3_dot(s->query.hit[k].normal, c->normal) < 0)
            continue;
        c->gap += fmax((gap - linear) / part, -STEP_OUT_MAX);
        any = true;
    }
    return any;
}

void stepper_keep_forces(Stepper *s)
{
    int nodes = s->state.node_count;
    for (int k = 0; k < s->system.set.count; k++)
        s->points.force[s->points.candidate[k]] = vec3(0, 0, 0);
    for (int k = 0; k < s->system.set.count; k++) {
        int point = s->points.candidate[k];
        bool leans = point >= nodes && at_mouth(s, s->points.slot[point - nodes].element);
        s->points.force[point] =
            vec3_add_scaled(s->points.force[point], leans ? 1 / s->points.slot_place[point - nodes].weight : 1, s->system.set.point[k].force);
    }
}

void stepper_wall_work(const Stepper *s, double *wall, double *friction)
{
    *wall = *friction = 0;
    int nodes = s->state.node_count;
    for (int k = 0; k < s->system.set.count; k++) {
        const ContactPoint *c = &s->system.set.point[k];
        int point = s->points.candidate[k];
        bool leans = point >= nodes && at_mouth(s, s->points.slot[point - nodes].element);
        Vec3 force = c->force, moved = done_at(s, point, vec3_scale(c->normal, -radius_of(s, point)));
        if (leans) {
            const SlotPlace *p = &s->points.slot_place[point - nodes];
            force = vec3_scale(force, 1 / p->weight);
            moved = vec3_add_scaled(moved, (1 - p->weight) * s->iterate.moved[row_of(s, s->points.slot[point - nodes].element)], p->tangent);
        }
        double pressure = vec3_dot(force, c->normal) * vec3_dot(moved, c->normal);
        *wall += pressure;
        *friction += pressure - vec3_dot(force, moved);
    }
    *friction += tools_friction_work(s);
    self_contact_work(s, wall, friction);
}

double stepper_start_work(const Stepper *s)
{
    double work = 0;
    for (int p = s->first_free; p < s->points.count; p++) {
        if (p == s->state.node_count)
            p = first_slot(s);
        if (p == s->points.count)
            break;
        Vec3 force = s->points.start_force[p], normal = s->points.met[p].normal;
        if (vec3_norm2(force) == 0)
            continue;
        if (vec3_norm2(normal) == 0)
            normal = vec3_unit(force);
        Vec3 moved = done_at(s, p, vec3_scale(normal, -radius_of(s, p)));
        if (p >= s->state.node_count && at_mouth(s, s->points.slot[p - s->state.node_count].element)) {
            const SlotPlace *place = &s->points.slot_place[p - s->state.node_count];
            moved = vec3_add_scaled(moved, (1 - place->weight) * s->iterate.moved[row_of(s, s->points.slot[p - s->state.node_count].element)], place->tangent);
        }
        work += vec3_dot(force, moved);
    }
    return work;
}

// Adds contacts in the order of the chain: a node, the slots after it, the next node.
static void collect(Stepper *s, const int *candidate, int node_count, int slot_count)
{
    const int *slot = candidate + node_count, *end = slot + slot_count;
    for (const int *node = candidate; node < candidate + node_count || slot < end;) {
        int next = node < candidate + node_count ? s->query.which[*node] : s->state.node_count;
        while (slot < end && s->points.slot[s->query.which[*slot] - s->state.node_count].element < next) {
            add_candidate(s, s->query.which[*slot], &s->query.hit[*slot]);
            slot++;
        }
        if (node < candidate + node_count) {
            add_candidate(s, next, &s->query.hit[*node]);
            node++;
        }
    }
}

// Reports what the queries say about the state at the step's start.
static void report_wall(Stepper *s, int nodes, int count)
{
    int next = s->first_free;
    bool was_inside = false;
    unsigned flags = 0;
    double deepest = s->report.penetration;
    for (int k = 0; k < count; k++) {
        const VesselHit *hit = &s->query.hit[k];
        if (k < nodes) {
            was_inside |= next < s->query.which[k];
            next = s->query.which[k] + 1;
        }
        if (hit->flags & VESSEL_OPEN_END) {
            flags |= k < nodes && was_inside ? STEP_OUT_OF_VESSEL : 0;
            continue;
        }
        was_inside |= k < nodes;
        flags |= hit->flags & VESSEL_UNSURE ? STEP_DETECTION_UNSURE : 0;
        flags |= hit->flags & VESSEL_DISAGREE ? STEP_MODEL_DISAGREES : 0;
        s->report.disagreements += (hit->flags & VESSEL_DISAGREE) != 0;
        double outside = radius_of(s, s->query.which[k]) - hit->gap;
        deepest = outside > deepest ? outside : deepest;
    }
    s->report.penetration = deepest;
    s->report.flags |= flags | (deepest > DEEP ? STEP_DEEP : 0);
}

void stepper_detect(Stepper *s)
{
    s->system.set.count = 0;
    s->iterate.depth = 0;
    if (!s->vessel)
        return;
    if (!s->iterate.is_moved && !s->iterate.knows_motion)
        memset(s->points.linger, 0, (size_t)s->points.count * sizeof *s->points.linger);
    memset(s->points.overlap, 0, (size_t)s->points.count * sizeof *s->points.overlap);
    if (!s->iterate.is_moved)
        memcpy(s->points.touch_next, s->points.touch, (size_t)s->points.count * sizeof *s->points.touch);
    take_trials(s);
    estimate_ranges(s);
    int *candidate = s->query.near, nodes = queue_nodes(s);
    int node_candidates = answer(s, 0, nodes, candidate);
    int count = queue_slots(s, nodes);
    int slot_candidates = answer(s, nodes, count, candidate + node_candidates);
    collect(s, candidate, node_candidates, slot_candidates);
    s->report.candidates = s->system.set.count;
    if (!s->iterate.is_moved)      // not for a moved iterate, which may be anywhere
        report_wall(s, nodes, count);
}

// --- between steps ---

void stepper_use_clearance(Stepper *s)
{
    int nodes = s->state.node_count;
    self_contact_use_clearance(s);
    for (int i = s->first_free; i < nodes; i++)
        if (s->points.clearance[i] > 0)
            s->points.clearance[i] = fmax(0, s->points.clearance[i] - travelled(s, i));
    for (int p = first_slot(s); p < s->points.count; p++)
        if (s->points.clearance[p] > 0)
            s->points.clearance[p] = fmax(0, s->points.clearance[p] - travelled(s, p));
    memcpy(s->iterate.seen, s->iterate.moved, row_of(s, nodes) * sizeof *s->iterate.seen);
}

// Distributes the forces of nodes whose contact is beside them.
static void share_touches(const Stepper *s, NodeReport *node)
{
    Touch t;
    for (int i = s->first_free; i < s->state.node_count; i++) {
        if (s->points.touch[i] == 0 || !touch_at(s, i, s->points.touch[i], &t))
            continue;
        node[i].force = vec3_sub(node[i].force, s->points.force[i]);
        node[t.element].force = vec3_add_scaled(node[t.element].force, 1 - t.xi, s->points.force[i]);
        node[t.element + 1].force = vec3_add_scaled(node[t.element + 1].force, t.xi, s->points.force[i]);
    }
}

void stepper_share_forces(const Stepper *s, NodeReport *node)
{
    Touch touch;
    share_touches(s, node);
    for (int k = 0; k < s->points.slot_count; k++) {
        Vec3 force = s->points.force[s->state.node_count + k], x2 = s->state.position[s->points.slot[k].element + 1];
        int i = s->points.slot[k].element;
        double w = s->points.slot[k].weight;
        SlotPlace place;
        if (at_mouth(s, i) && slot_place_at_mouth(&s->points.slot[k], s->wire.length[i], stepper_sheath_coordinate(s, i), s->entry.mouth, s->entry.axis[0], x2,
                                                  s->entry.axis[0], &place))
            w = place.weight;
        if (s->points.touch[s->state.node_count + k] != 0 && touch_at(s, s->state.node_count + k, s->points.touch[s->state.node_count + k], &touch))
            i = touch.element, w = touch.xi;
        node[i].force = vec3_add_scaled(node[i].force, 1 - w, force);
        node[i + 1].force = vec3_add_scaled(node[i + 1].force, w, force);
    }
}
