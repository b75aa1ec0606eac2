// Decides when an implicit Euler step (step.h) is solved, and ends it. Kerrien 2017, section 6.1, with the additions of docs/design.md, "Stability".
//
// The system is first linearised about x_n. A step that turns an element by more than NEWTON_MOTION is linearised again about its solution. The unknown remains
// the whole displacement from x_n, so that inertia, damping, gaps and friction keep their meaning: this is Newton's method for the implicit step. In one
// iteration no element may turn by more than TURN_MAX: a wire that springs back moves faster than any step can follow (10 mJ move 0.02 g at 30 m/s), and a
// linear displacement of that size would stretch it.
//
// No iterate penetrates the wall or gains energy without a source: the motion to it is halved until it is admissible (step_follow.c). The whole wire is held
// back together, including the length that the hand feeds. The motion that is missing after the last iteration is flagged STEP_LIMITED and left to the next
// steps. An advance into a tool that is compressed by more than SQUEEZE_MAX is also left to them: the hand stalls.
#include "solver/self_contact.h"
#include "solver/tools_internal.h"

#include <string.h>

// In a linear step, a chord that turns by 0.02 rad stretches by 2e-4, which a free wire would keep as energy. Another linearisation costs 30 us.
static const double NEWTON_MOTION = 0.005, NEWTON_MOTION_AT_MOUTH = 0.002;      // [rad]
static const double QUIET_MOTION = 1e-3;         // [rad] a smaller turn creates no energy
static const double ENERGY_MADE = 3e-3;          // share of the energy exchanged in a step
// A tip that snaps from one wall to another ends far from the last linearisation. [mm] of true penetration beyond which the step is linearised again there,
// with up to twice the usual number of linearisations.
static const double OVERSHOOT = 0.015, SELF_OVERSHOOT = 0.005;
static const double TAKE_BACK = 0.002;           // of an element's length past the mouth: a free node that would end closer to the mouth than this is held
static const double BORDER_FORCE = 1e-3;         // tolerance, as a share of the straightening force at the mouth
static const double MOUTH_LENGTH = 0.1;          // share by which the final outside length may differ from the assumed one when the hand slips
enum { HAND_TRIES = 6, LOOKS_MAX = 2 };

// --- after a solve: is its solution acceptable? ---

// [rad] The turn of the chord from the mouth to the first node outside. A short chord stretches as much as a long one. Only where the hand holds the tool: a
// tool that springs through the mouth changes that chord's length by more.
static double turn_at_mouth(const Stepper *s)
{
    int i = s->first_free;
    if (!s->entry.has_sheath || i >= s->state.node_count || s->hands.hand[0].is_released || s->hands.hand[0].slips[0])
        return 0;
    const double *u = s->system.u + row_of(s, i), *k = s->iterate.moved + row_of(s, i);
    Vec3 moves = vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]), ends = vec3_add(vec3_sub(s->state.position[i], s->entry.mouth), moves);
    return vec3_norm(vec3_cross(moves, s->entry.axis[0])) / fmax(vec3_dot(ends, s->entry.axis[0]), sheath_border_share * s->wire.length[i - 1]);
}

// Where a border of the rest shape is at the mouth, the straightening force differs between its two sides, and the wire may come to rest with the border there.
// Does the force at the solution's border position differ from the force at the assumed position? If so, it is evaluated at the solution's position, or first
// with the border exactly at the mouth.
static bool misjudges_border(Stepper *s)
{
    int i = s->first_free - 1;
    if (s->tools.count > 1 || i < 0 || i + 1 >= s->state.node_count || s->progress.has_failed)
        return false;
    const BeamRest *rest = &s->beam.rest;
    double start = vec3_dot(vec3_sub(s->start.position[i], s->entry.mouth), s->entry.axis[0]), width = sheath_border_share * rest->length[i];
    double taken = start + s->iterate.mouth_ahead, ends = start + s->system.u[row_of(s, i)];
    // the tool has not moved as commanded, so the element's stiffness was that of another length
    double length = sheath_outside(rest->length[i], taken), real = sheath_outside(rest->length[i], ends);
    if (s->hands.hand[0].slips[0] && fabs(length - real) > MOUTH_LENGTH * fmin(length, real)) {
        s->iterate.mouth_ahead = ends - start;
        return true;
    }
    double there = sheath_straightening(rest, i, ends), linear = sheath_straightening(rest, i, taken) - s->system.mouth_element.border * (ends - taken);
    if (fabs(there - linear) < BORDER_FORCE * fmax(there, sheath_straightening(rest, i, taken)) + 1e-9)
        return false;
    bool crosses = fmin(taken, ends) < 0 && fmax(taken, ends) > 0, is_within = fabs(ends) <= 0.5 * width;
    s->iterate.mouth_ahead = (crosses && !is_within ? 0 : ends) - start;
    return true;
}

// Does the solution return to where the iterate came from? At an edge of the wall, each of two linearisations may send a tip to the other's position for ever;
// the solution lies between them.
static bool turns_back(const Stepper *s)
{
    const double *before = s->iterate.kept + 7 * (size_t)s->state.node_count;
    double along = 0, came = 0;
    for (int i = s->first_free; i < s->state.node_count; i++)
        for (size_t k = row_of(s, i); k < row_of(s, i) + 3; k++) {
            double d = s->iterate.moved[k] - before[k];
            along += d * (s->system.u[k] - s->iterate.moved[k]);
            came += d * d;
        }
    return along < -0.5 * came;
}

// Checks the assumptions about the hand and the mouth against the solution.
static unsigned judge_hand(Stepper *s)
{
    if (s->progress.hand_tries >= HAND_TRIES || !(misjudges_border(s) || hands_misjudge(s)))
        return 0;
    s->progress.hand_tries++;
    return STEP_NEEDS_SYSTEM | STEP_NEEDS_CONTACT;
}

// A wire that springs back moves beyond the searched range: extends the search to that range, for another solve.
static unsigned judge_reach(Stepper *s)
{
    if (s->progress.looks >= LOOKS_MAX || s->progress.has_failed || stepper_is_spent(s))
        return 0;
    bool escapes = stepper_escapes(s), misses = self_contact_misses(s);
    if (!misses && !escapes)
        return 0;
    s->progress.looks++;
    s->progress.hand_tries = 0;
    s->iterate.knows_motion = escapes;
    return (escapes ? STEP_NEEDS_WALLS : 0) | STEP_NEEDS_CONTACT;
}

// The length of the element at the mouth has no sign, so the first free node must not end behind the mouth. If the solution places it there, the sheath holds
// this node from the step's start on.
static unsigned judge_mouth(Stepper *s)
{
    if (s->tools.count > 1 && !s->progress.is_held_back && (tools_leave_back(s) || tools_come_out(s))) {
        stepper_begin(s);
        return STEP_NEEDS_ALL;
    }
    int node = s->first_free;
    if (!s->entry.has_sheath || s->progress.has_failed || node >= s->state.node_count)
        return 0;
    const double *u = s->system.u + row_of(s, node);
    double ends = vec3_dot(vec3_sub(vec3_add(s->start.position[node], vec3(u[0], u[1], u[2])), s->entry.mouth), s->entry.axis[0]);
    double began = vec3_dot(vec3_sub(s->start.position[node], s->entry.mouth), s->entry.axis[0]);
    if (ends >= TAKE_BACK * s->wire.length[node - 1] || began > s->wire.length[node - 1] + fabs(s->command.advance))
        return 0;
    stepper_go_back(s);
    stepper_hold(s, node);
    stepper_forget(s, node);
    s->first_free++;
    s->progress.is_held_back = true;
    stepper_begin(s);
    return STEP_NEEDS_ALL;
}

// Does the solution give the tool energy that no force supplies? In contact, even a small turn may do so if the tool is stiff or its elements are short.
static bool makes_energy(Stepper *s)
{
    return s->entry.has_sheath && s->rig.load_count == 0 && s->progress.turn > QUIET_MOTION && stepper_energy_made(s) > ENERGY_MADE;
}

// Newton's method: the step is linearised again about the solution if that turns or moves further than a linear step may.
static unsigned judge_motion(Stepper *s)
{
    if (s->progress.linearisations > 0) {
        s->report.newton = s->progress.linearisations;
        s->progress.overshoots = true;
    }
    int next = ++s->progress.linearisations;
    if (next >= 2 * s->newton_max || s->progress.has_failed || stepper_is_spent(s))
        return 0;
    bool touches = s->report.active > 0, is_back = next > 1 && s->vessel && turns_back(s);    // before the kept iterate is overwritten
    bool turns = s->progress.turn > (touches ? NEWTON_MOTION_IN_CONTACT : NEWTON_MOTION) || (!touches && turn_at_mouth(s) > NEWTON_MOTION_AT_MOUTH);
    s->progress.makes_energy = makes_energy(s);
    s->progress.overshoots = stepper_overshoot(s) > OVERSHOOT || self_contact_depth(s, true) > SELF_OVERSHOOT;
    if (!((turns || s->progress.makes_energy) && next < s->newton_max) && !s->progress.overshoots)
        return 0;
    if (stepper_follow(s, is_back) == 0) {
        s->progress.is_blocked = true;
        stepper_doubt(s);
        return 0;
    }
    stepper_use_clearance(s);
    s->iterate.is_moved = true;
    s->progress.is_held_back = false;
    s->progress.hand_tries = s->progress.looks = 0;
    return STEP_NEEDS_ALL;
}

unsigned step_judge(Stepper *s, const ContactReport *solved)
{
    if (!stepper_take_contacts(s, solved))
        return STEP_NEEDS_CONTACT;
    unsigned needs = judge_hand(s);
    if (needs == 0)
        needs = judge_reach(s);
    if (needs != 0)
        return needs;
    s->progress.turn = s->progress.has_failed ? 0 : stepper_largest_turn(s);
    needs = judge_mouth(s);
    if (needs == 0)
        needs = judge_motion(s);
    if (needs == 0)
        s->progress.overshoots |= stepper_is_spent(s);        // not checked
    return needs;
}

void step_solve(Stepper *s)
{
    for (unsigned needs = STEP_NEEDS_ALL; needs != 0;) {
        if (needs & STEP_NEEDS_WALLS)
            step_detect(s);
        if (needs & STEP_NEEDS_SYSTEM) {
            step_assemble(s);
            step_factor(s);
        }
        ContactProblem problem = step_contacts(s);
        ContactReport solved = contact_solve(&problem);
        needs = step_judge(s, &solved);
    }
    step_correct(s);
}

// --- the end of a step ---

static void keep_last_state(Stepper *s)
{
    size_t nodes = (size_t)s->state.node_count, inner = nodes * (size_t)s->state.inner_count * sizeof(double);
    stepper_go_back(s);
    memset(s->state.velocity, 0, nodes * sizeof *s->state.velocity);
    memset(s->state.spin, 0, nodes * sizeof *s->state.spin);
    memset(s->points.force, 0, (size_t)s->points.count * sizeof *s->points.force);
    memset(s->points.clearance, 0, (size_t)s->points.count * sizeof *s->points.clearance);
    memset(s->points.touch, 0, (size_t)s->points.count * sizeof *s->points.touch);
    self_contact_forget(s);
    memset(s->state.slide_velocity, 0, inner);
    memset(s->state.slide_spin, 0, inner);
    s->report.flags |= STEP_DIVERGED;
}

static void set_velocities(Stepper *s)
{
    WireState *w = &s->state;
    double rate = 1 / s->dt;
    for (int i = 0; i < w->node_count; i++) {
        const double *u = s->iterate.moved + row_of(s, i);      // the displacement actually made, cut or not
        if (i < s->first_free) {
            w->velocity[i] = vec3_scale(s->entry.axis[0], u[0] * rate);
            w->spin[i] = vec3_scale(s->entry.axis[0], u[3] * rate);
            continue;
        }
        w->velocity[i] = vec3(u[0] * rate, u[1] * rate, u[2] * rate);
        w->spin[i] = vec3(u[3] * rate, u[4] * rate, u[5] * rate);
    }
    if (s->tools.count > 1) {
        tools_set_velocities(s);
        tools_keep_slides(s);
    }
    stepper_use_clearance(s);
    touch_keep(s);
}

static void report_forces(Stepper *s)
{
    if (!s->entry.has_sheath) {
        Vec3 force = vec3(0, 0, 0), torque = vec3(0, 0, 0);
        double *f[] = {&force.x, &force.y, &force.z, &torque.x, &torque.y, &torque.z};
        for (int k = 0; k < 6; k++)
            if (s->rig.fixed[0] >> k & 1)
                *f[k] = stepper_reaction(s, k);
        s->report.proximal_force = vec3_dot(force, s->entry.axis[0]);
        s->report.proximal_torque = vec3_dot(torque, s->entry.axis[0]);
    }
    hands_report(s);
    for (int k = 0; k < s->system.set.count; k++) {
        double force = vec3_norm(s->points.force[s->points.candidate[k]]);
        s->report.wall_force_max = fmax(s->report.wall_force_max, force);
        s->report.wall_force_sum += force;
    }
}

// A motion that was cut short has not produced the forces of the whole one: the hand feels the strain that is present, and the wall's forces are taken in
// proportion to the motion.
static void report_cut_forces(Stepper *s, double part)
{
    s->report.flags |= STEP_LIMITED;
    s->report.wall_force_max = s->start.wall_force_max + part * (s->report.wall_force_max - s->start.wall_force_max);
    s->report.wall_force_sum = s->start.wall_force_sum + part * (s->report.wall_force_sum - s->start.wall_force_sum);
    if (!s->entry.has_sheath)
        return;
    double force = stepper_strain_force(s), most = s->hands.hand[0].limit > 0 ? s->hands.hand[0].limit : HUGE_VAL;
    s->report.proximal_force = fmax(-most, fmin(most, force));
}

// Where a position is rounded by more than 1e-7 mm, lengths and strains of elements mean nothing.
static const double FARTHEST = 1e9;          // [mm]

static bool is_within_reach(const Stepper *s)
{
    bool is_near = true;         // false for NaN, too
    for (int i = 0; i < s->state.node_count; i++)
        is_near &= fabs(s->state.position[i].x) < FARTHEST && fabs(s->state.position[i].y) < FARTHEST && fabs(s->state.position[i].z) < FARTHEST;
    return is_near;
}

void step_correct(Stepper *s)
{
    s->state.time += s->dt;
    if (!s->progress.has_failed) {
        report_forces(s);
        if (s->progress.was_held)
            s->report.flags |= STEP_NOT_CONVERGED;
        double part = s->progress.is_blocked ? 0 : stepper_follow(s, false);
        s->progress.has_failed |= !is_within_reach(s);
        if (part < 1)
            report_cut_forces(s, part);
        set_velocities(s);
        hands_count(s);
    }
    if (s->progress.has_failed)
        keep_last_state(s);
    rest_judge(s);
}

const StepReport *step_report(const Stepper *s) { return &s->report; }
const WireState *stepper_state(const Stepper *s) { return &s->state; }

// --- reports ---

void stepper_node_report(Stepper *s, NodeReport *node)
{
    int nodes = s->state.node_count, held = stepper_count_held(s, 0);
    for (int i = 0; i < nodes; i++) {
        node[i] = (NodeReport){.s = s->wire.s[i], .radius = s->wire.radius[i], .gap = HUGE_VAL, .vessel_node = -1};
        if (i < held || !s->vessel)
            continue;
        // a copy of the memory: a report must not change the next step
        VesselMemory place = s->points.place[i];
        if (place.node < 0)
            place = (VesselMemory){.node = s->vessel->locate(s->vessel, s->state.position[i], i > held ? node[i - 1].vessel_node : -1)};
        VesselHit hit;
        vessel_query(s->vessel, 1, &s->state.position[i], HUGE_VAL, &place, &hit);   // without a range: the gap itself is wanted
        node[i].force = s->points.force[i];
        node[i].vessel_node = hit.node;
        if (!(hit.flags & (VESSEL_FAR | VESSEL_OPEN_END)))
            node[i].gap = hit.gap - s->wire.radius[i];
    }
    stepper_share_forces(s, node);
}
