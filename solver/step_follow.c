// Moves the iterate towards the solution, as far as the result is admissible (a line search).
#include "solver/node_turn.h"
#include "solver/self_contact.h"
#include "solver/tools_internal.h"

#include <string.h>

static const double TURN_MAX = 0.3;              // [rad]
static const double SWING_MOTION = 1e-5;         // [rad] below this, displaced and turned chords are the same
// When the step length is halved: [mm] of depth that may remain, and the depth accepted as a last resort; the maximum number of halvings, and how often the
// linear walls are moved before.
static const double DEPTH_MAX = 0.02, DEPTH_LAST = 0.045;
static const double ENERGY_LEAST = 1e-9;         // [mJ] rounding
enum { HALVES_MAX = 6, MEETINGS_MAX = 2 };
static const double JAMMED = 0.002;              // compression, as a share of the tool's length, above which the tool may be jammed
static const double LOST = 0.1;                  // residual above which a contact solve is meaningless
static const double MOUTH_TRAVEL = 1;            // of an element's length: most that the tool may spring through the mouth, beyond the advance

// The largest turn of an element's chord or of a node against the iterate [rad]; a node's turn about the tool's axis does not count.
double stepper_largest_turn(const Stepper *s)
{
    double largest = 0;
    Vec3 before = vec3(0, 0, 0);         // displacement of the node before
    for (int i = s->first_free; i < s->state.node_count; i++) {
        const double *u = s->system.u + row_of(s, i), *k = s->iterate.moved + row_of(s, i);
        Vec3 turn = vec3(u[3] - k[3], u[4] - k[4], u[5] - k[5]), moves = vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]);
        Quat q = s->state.orientation[i];
        Vec3 axis = vec3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y));
        double node = vec3_norm2(vec3_cross(turn, axis)), chord = 0;
        if (i > 0) {
            // at the mouth: relative to the whole element, however little of it is outside
            bool from_mouth = i == s->first_free;
            Vec3 c = vec3_sub(s->state.position[i], from_mouth ? s->entry.mouth : s->state.position[i - 1]);
            double length2 = vec3_norm2(c), over = from_mouth ? s->wire.length[i - 1] * s->wire.length[i - 1] : length2;
            chord = vec3_norm2(vec3_cross(c, vec3_sub(moves, before))) / (length2 * over);
        }
        before = moves;
        largest = largest > node ? largest : node;
        largest = largest > chord ? largest : chord;
    }
    return sqrt(largest);
}

// A wire without supports: its mass centre moves as in the linear solution, which conserves momentum.
static void keep_mass_centre(Stepper *s, double part)
{
    Vec3 away = vec3(0, 0, 0);
    double mass = 0;
    for (int i = 0; i < s->state.node_count; i++) {
        const double *u = s->system.u + row_of(s, i), *k = s->iterate.moved + row_of(s, i);
        Vec3 linear = vec3(k[0] + part * (u[0] - k[0]), k[1] + part * (u[1] - k[1]), k[2] + part * (u[2] - k[2]));
        Vec3 real = vec3_sub(s->state.position[i], s->start.position[i]);
        away = vec3_add_scaled(away, s->wire.mass[i], vec3_sub(linear, real));
        mass += s->wire.mass[i];
    }
    for (int i = 0; i < s->state.node_count; i++)
        s->state.position[i] = vec3_add_scaled(s->state.position[i], 1 / mass, away);
}

// Moves the free nodes' positions by `part` of the change, chord by chord from the proximal end: a chord c that the solution turns into s = c + change becomes
// s (c.s)/(|c||s|), the length that the linear solution assigns to it. With s itself, a turn of 0.005 rad would stretch the wire by 1e-5, which in steel is
// 0.1 N. Not used if the rig fixes the position of a later node.
static void swing(Stepper *s, double part)
{
    Vec3 from = s->entry.mouth, moved = s->entry.mouth, shift = vec3(0, 0, 0);
    for (int i = s->first_free; i < s->state.node_count; i++) {
        const double *u = s->system.u + row_of(s, i), *k = s->iterate.moved + row_of(s, i);
        Vec3 own = vec3_scale(vec3(u[0] - k[0], u[1] - k[1], u[2] - k[2]), part), here = s->state.position[i];
        if (i == 0) {
            moved = vec3_add(here, own);
        } else {
            Vec3 chord = vec3_sub(here, from), sum = vec3_add(chord, vec3_sub(own, shift));
            double product = vec3_dot(chord, sum);
            moved = vec3_add_scaled(moved, product > 0 ? product / sqrt(vec3_norm2(chord) * vec3_norm2(sum)) : 1, sum);
        }
        from = here;
        shift = own;
        s->state.position[i] = moved;
    }
    if (s->first_free == 0 && (s->rig.fixed[0] & DOF_POSITION) == 0)
        keep_mass_centre(s, part);
}

static void displace(Stepper *s, double part)
{
    for (int i = s->first_free; i < s->state.node_count; i++) {
        const double *u = s->system.u + row_of(s, i), *k = s->iterate.moved + row_of(s, i);
        Vec3 d = part < 1 ? vec3(k[0] + part * (u[0] - k[0]), k[1] + part * (u[1] - k[1]), k[2] + part * (u[2] - k[2])) : vec3(u[0], u[1], u[2]);
        s->state.position[i] = vec3_add(s->start.position[i], d);
    }
}

// Moves the iterate by `part` of the difference to x_n + u, nodes in the sheath included: a tool that is held back is not fed.
static void move(Stepper *s, double part)
{
    WireState *w = &s->state;
    int nodes = w->node_count, held = s->first_free;
    double *rx = s->system.product, *ry = rx + nodes, *rz = ry + nodes;     // rotation vectors of the nodes, in an assembly's scratch
    if (s->progress.turn > SWING_MOTION && s->rig.can_swing)
        swing(s, part);
    else
        displace(s, part);
    for (int i = 0; i < held; i++) {
        // exactly on the line, regardless of rounding
        const double *u = s->system.u + row_of(s, i);
        double *k = s->iterate.moved + row_of(s, i), turn = part * (u[3] - k[3]);
        k[0] = part < 1 ? k[0] + part * (u[0] - k[0]) : u[0];
        k[3] += turn;
        double along = vec3_dot(vec3_sub(s->start.position[i], s->entry.mouth), s->entry.axis[0]) + k[0];
        w->position[i] = vec3_add_scaled(s->entry.mouth, along, s->entry.axis[0]);
        if (fabs(turn) > NODE_TURN_MAX) {    // an iterate of a tool that is let go may turn far
            w->orientation[i] = quat_unit(quat_mul(quat_from_rotation_vector(vec3_scale(s->entry.axis[0], turn)), w->orientation[i]));
            turn = 0;
        }
        rx[i] = turn * s->entry.axis[0].x, ry[i] = turn * s->entry.axis[0].y, rz[i] = turn * s->entry.axis[0].z;
    }
    for (int i = held; i < nodes; i++) {
        const double *u = s->system.u + row_of(s, i);
        double *k = s->iterate.moved + row_of(s, i);
        k[0] = w->position[i].x - s->start.position[i].x;
        k[1] = w->position[i].y - s->start.position[i].y;
        k[2] = w->position[i].z - s->start.position[i].z;
        Vec3 turn = vec3_scale(vec3(u[3] - k[3], u[4] - k[4], u[5] - k[5]), part);
        double angle2 = vec3_norm2(turn);
        if (angle2 > NODE_TURN_MAX * NODE_TURN_MAX)
            turn = vec3_scale(turn, NODE_TURN_MAX / sqrt(angle2));
        k[3] += turn.x, k[4] += turn.y, k[5] += turn.z;
        rx[i] = turn.x, ry[i] = turn.y, rz[i] = turn.z;
    }
    node_turn(nodes, rx, ry, rz, w->orientation);
    if (s->tools.count > 1)
        tools_move(s, part);
}

static double energy_bound(const Stepper *s)
{
    const Wire *w = &s->wire;
    double work = 0, bound = s->start.elastic + stepper_kinetic_energy(s);
    for (int i = s->first_free; i < w->node_count; i++)
        work += w->mass[i] * fabs(vec3_dot(s->rig.gravity, vec3(s->system.u[row_of(s, i)], s->system.u[row_of(s, i) + 1], s->system.u[row_of(s, i) + 2])));
    for (int k = 0; k < s->system.set.count; k++)
        work += fmax(0, -s->system.set.point[k].gap) * vec3_norm(s->system.set.point[k].force);
    for (int k = 0; k < s->system.set.pair_count; k++)
        work += fmax(0, -s->system.set.pair[k].gap) * vec3_norm(s->system.set.pair[k].force);
    work += hands_work_bound(s);
    return bound + 2 * work + 1e-6;
}

static void copy_iterate(Stepper *s, bool back)
{
    size_t m = (size_t)s->state.node_count, rows = row_of(s, (int)m), inner = m * (size_t)s->state.inner_count;
    size_t size[5] = {m * sizeof(Vec3), m * sizeof(Quat), rows * sizeof(double), inner * sizeof(double), inner * sizeof(double)};
    void *live[5] = {s->state.position, s->state.orientation, s->iterate.moved, s->state.slide, s->state.angle};
    void *kept[5] = {s->iterate.kept, s->iterate.kept + 3 * m, s->iterate.kept + 7 * m, s->iterate.kept + 7 * m + rows, s->iterate.kept + 7 * m + rows + inner};
    for (int i = 0; i < 5; i++)
        memcpy(back ? live[i] : kept[i], back ? kept[i] : live[i], size[i]);
}

// The share of the motion to a displacement `to`, starting at `from`, at which the magnitude `most` is reached.
static double part_until(double from, double to, double most)
{
    if (fabs(to) <= most)
        return 1;
    return fmax(0, fmin(1, ((to > 0 ? most : -most) - from) / (to - from)));
}

// The largest step length at which no element turns by more than TURN_MAX and no more of the tool springs through the mouth than one element can describe.
static double largest_part(const Stepper *s)
{
    double part = s->progress.turn > TURN_MAX ? TURN_MAX / s->progress.turn : 1;
    if (s->tools.count > 1)
        part = fmin(part, tools_largest_part(s));
    int i = s->first_free - 1;
    if (i < 0 || i + 1 >= s->state.node_count)
        return part;
    size_t k = row_of(s, i);
    return fmin(part, part_until(s->iterate.moved[k], s->system.u[k], fabs(s->command.advance) + MOUTH_TRAVEL * s->wire.length[i]));
}

static double elastic_at_start(Stepper *s)
{
    if (!s->start.knows_energy) {           // of x_n, or of an iterate close to it
        s->start.elastic = stepper_elastic_energy(s);
        s->start.knows_energy = true;
    }
    return s->start.elastic;
}

double stepper_energy_made(Stepper *s)
{
    double before = elastic_at_start(s);
    copy_iterate(s, false);
    move(s, 1);
    hands_report(s);
    double grown = stepper_elastic_energy(s) - before, hand = hands_work(s), load = stepper_load_work(s), wall, friction;
    stepper_wall_work(s, &wall, &friction);
    friction += hands_valve_work(s);
    copy_iterate(s, true);
    double given = hand + load - friction + fmax(0, wall);     // a rigid wall takes no energy
    return (grown - given) / (fabs(grown) + fabs(hand) + fabs(load) + fabs(friction) + ENERGY_LEAST);
}

// Returns the share of the solution that was followed. A quiet step is followed completely, and so is a wire without walls, up to TURN_MAX. Otherwise the
// iterate moves only so far that no node penetrates the wall and the wire gains no energy without a source. If the wall is not where its linearisation has it,
// the linearised wall is first moved there and the contacts are solved again (a second-order correction); after that the step length is halved until the result
// is admissible.
double stepper_follow(Stepper *s, bool halfway)
{
    double part = halfway ? fmin(0.5, largest_part(s)) : largest_part(s);
    bool is_trusted = !s->progress.was_held && s->report.residual < LOST;
    bool is_quiet = s->progress.turn <= NEWTON_MOTION_IN_CONTACT && !s->progress.overshoots && is_trusted;
    if ((!s->vessel && !self_contact_is_near(s)) || (is_quiet && !s->progress.makes_energy)) {
        move(s, part);
        return part;
    }
    elastic_at_start(s);
    double bound = s->entry.has_sheath && s->rig.load_count == 0 ? energy_bound(s) : HUGE_VAL;
    copy_iterate(s, false);
    double most = fmax(DEPTH_MAX, s->iterate.depth);
    int tries = stepper_squeeze(s, s->start.position) < JAMMED ? 2 * HALVES_MAX : HALVES_MAX;
    for (int k = 0; k < tries; k++) {
        if (k == HALVES_MAX) {        // not jammed: accept a little more depth rather than be stuck for ever where neighbouring models disagree about the wall
            part = largest_part(s);
            most = fmax(most, DEPTH_LAST);
        }
        move(s, part);
        bool contained = is_quiet || fmax(stepper_depth(s), self_contact_depth(s, false)) <= most;
        if (contained && stepper_elastic_energy(s) <= bound)
            return part;
        bool meets = !contained && k < MEETINGS_MAX && !stepper_is_spent(s) && stepper_meet_walls(s, part) + self_contact_meet(s, part) > 0;
        copy_iterate(s, true);
        part /= 2;
        if (meets) {
            ContactReport solved;
            do {
                ContactProblem problem = step_contacts(s);
                solved = contact_solve(&problem);
            } while (!stepper_take_contacts(s, &solved));
            if (s->progress.has_failed)
                return 0;
            s->progress.turn = stepper_largest_turn(s);
            part = largest_part(s);
        }
    }
    return 0;
}
