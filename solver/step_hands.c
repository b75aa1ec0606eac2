// The hands. Hand k moves tool k by a_k along and t_k about the line at node 0, the hub of the outermost tool. S of an inner tool therefore grows there by
// a_0 - a_k, and its angle by t_k - t_0. The system's unknowns at node 0 are transformed to those of the hands. Then the row of a hand that holds its tool is a
// unit row, a hand that slips is a force in its own row, and the force that a hand feels is the reaction of its row.
//
// A tool that no hand holds is held by the friction of the valve that it passes through, at the hub of the tool around it or at the sheath. Its unknown is then
// its slip through the valve, and the hand at that hub feels the friction of the valve.
#include "solver/tools_internal.h"

#include <string.h>

static bool has_hand(const Stepper *s, int k) { return k == 0 ? s->entry.has_sheath : is_inside(s, 0, k); }
static int row_of_hand(int k, int about) { return k == 0 ? 3 * about : unknown_of(k) + about; }
static bool rides(const Stepper *s, int k) { return k > 0 && s->hands.hand[k].is_released; }

// The largest force or torque that a hand, or a valve, can hold [N] or [N mm].
static double holds(const Stepper *s, int k, int about)
{
    const Hand *hand = &s->hands.hand[k];
    double radius = s->tools.count > 1 ? s->tools.tool[k].wire.radius[0] : s->wire.radius[0];
    if (hand->is_released)
        return about ? hand->valve * radius : hand->valve;
    return about || hand->limit == 0 ? HUGE_VAL : hand->limit;
}

// A tool's displacement at the hub, from node 0's unknowns. The hub of a rig does not move.
static double tool_moves(const Stepper *s, int k, int about, const double *u)
{
    double hub = s->entry.has_sheath ? u[3 * about] : 0;
    return k == 0 ? hub : about ? hub + u[unknown_of(k) + 1] : hub - u[unknown_of(k)];
}

// [mm] The displacement of the hub around a tool's hub; the sheath does not move.
static double around_moves(const Stepper *s, int k) { return k > 0 ? tool_moves(s, tools_around(s, 0, k), 0, s->system.u) : 0; }

// [mm] The distance that a tool's hub can advance before it meets the hub around it, or the sheath.
static double hub_distance(const Stepper *s, int k)
{
    if (k == 0)
        return s->entry.has_sheath ? vec3_dot(vec3_sub(s->entry.mouth, s->start.position[0]), s->entry.axis[0]) : HUGE_VAL;
    int around = tools_around(s, 0, k);
    return s->start.slide[k - 1] - (around > 0 ? s->start.slide[around - 1] : 0);
}

// The displacement of the hand's unknown in this step if the hand holds.
static double wanted(const Stepper *s, int k, int about)
{
    const Hand *hand = &s->hands.hand[k];
    if (!about && hand->is_stopped)
        return hub_distance(s, k) + (rides(s, k) ? 0 : around_moves(s, k));
    if (hand->is_released)
        return 0;
    if (k == 0)
        return about ? s->command.twist : stepper_wanted(s);
    // to the position that the commands give, so that rounding errors of earlier steps do not accumulate
    const Tool *t = &s->tools.tool[k];
    if (about)
        return t->twist + s->hands.command[k].twist - s->state.twist - s->start.angle[k - 1];
    double hub = s->entry.has_sheath ? vec3_dot(vec3_sub(s->start.position[0], s->entry.mouth), s->entry.axis[0]) : 0;
    return t->inserted + s->hands.command[k].advance - (t->wire.total_length + hub - s->start.slide[k - 1]);
}

// The hand's unknown: the tool's displacement, or for a released inner tool its slip through the valve.
static double hand_moves(const Stepper *s, int k, int about, const double *u)
{
    double own = tool_moves(s, k, about, u);
    return rides(s, k) ? own - tool_moves(s, tools_around(s, 0, k), about, u) : own;
}

double hand_moved(const Stepper *s, int k, int about) { return hand_moves(s, k, about, s->iterate.moved); }

// Computes `basis`: node 0's unknowns are `basis` times the hands' unknowns.
static void make_basis(Stepper *s)
{
    int n = s->system.chain.size;
    double motion[STEP_TOOLS_MAX][2][BLOCK_LARGEST] = {{{0}}};       // of each tool, in the unknowns of its hand and the others
    memset(s->hands.basis, 0, sizeof s->hands.basis);
    for (int i = 0; i < n; i++)
        s->hands.basis[n * i + i] = 1;
    for (int about = 0; about < 2; about++) {
        if (s->entry.has_sheath)
            motion[0][about][3 * about] = 1;
        for (int k = 1; k < s->tools.count; k++) {
            if (!has_hand(s, k))
                continue;
            int at = row_of_hand(k, about), out = tools_around(s, 0, k);
            double *own = motion[k][about], *slide = s->hands.basis + n * at;
            for (int i = 0; i < n; i++)
                own[i] = (i == at) + (rides(s, k) ? motion[out][about][i] : 0);
            for (int i = 0; i < n; i++)
                slide[i] = about ? own[i] - motion[0][about][i] : motion[0][about][i] - own[i];
        }
    }
}

// Multiplies rows (n, n) by the basis.
static void columns_to_hands(const Stepper *s, double *rows)
{
    int n = s->system.chain.size;
    for (int r = 0; r < n; r++) {
        double old[BLOCK_LARGEST];
        memcpy(old, rows + n * r, (size_t)n * sizeof *old);
        for (int c = 0; c < n; c++) {
            double sum = 0;
            for (int k = 0; k < n; k++)
                sum += old[k] * s->hands.basis[n * k + c];
            rows[n * r + c] = sum;
        }
    }
}

static void transpose(double *a, int n)
{
    for (int r = 0; r < n; r++)
        for (int c = 0; c < r; c++) {
            double x = a[n * r + c];
            a[n * r + c] = a[n * c + r];
            a[n * c + r] = x;
        }
}

static void to_hands(Stepper *s)
{
    int n = s->system.chain.size;
    double old[BLOCK_LARGEST];
    make_basis(s);
    columns_to_hands(s, s->system.chain.diag);
    transpose(s->system.chain.diag, n);
    columns_to_hands(s, s->system.chain.diag);
    if (s->system.chain.count > 1)
        columns_to_hands(s, s->system.chain.lower);
    memcpy(old, s->system.b, (size_t)n * sizeof *old);
    for (int c = 0; c < n; c++) {
        s->system.b[c] = 0;
        for (int k = 0; k < n; k++)
            s->system.b[c] += s->hands.basis[n * k + c] * old[k];
    }
}

void hands_solved(Stepper *s)
{
    int n = s->system.chain.size;
    double moved[BLOCK_LARGEST];
    if (s->tools.count == 1)
        return;
    memcpy(moved, s->system.u, (size_t)n * sizeof *moved);
    for (int r = 0; r < n; r++) {
        s->system.u[r] = 0;
        for (int c = 0; c < n; c++)
            s->system.u[r] += s->hands.basis[n * r + c] * moved[c];
    }
}

void hands_constrain(Stepper *s)
{
    if (s->tools.count > 1)
        to_hands(s);
    for (int k = 0; k < s->tools.count; k++)
        for (int about = 0; has_hand(s, k) && about < 2; about++) {
            int slips = s->hands.hand[k].slips[about], at = row_of_hand(k, about);
            if (slips)
                s->system.b[at] += slips * holds(s, k, about);
            else
                stepper_prescribe(s, 0, at, wanted(s, k, about));
        }
}

// [N] or [N mm] The force along the line, or torque about it, that tool k's hand, or the valve that holds it, applies.
static double hand_force(const Stepper *s, int k, int about)
{
    int n = s->system.chain.size, at = row_of_hand(k, about);
    double force = 0;
    if (s->tools.count == 1)
        return stepper_reaction(s, at);
    for (int r = 0; r < n; r++)
        if (s->hands.basis[n * r + at] != 0)
            force += s->hands.basis[n * r + at] * stepper_reaction(s, r);
    return force;
}

// Does a slipping tool reach the hub around it? If it is further away than an element's length, it does not get there in one step, whatever the linear system
// says.
static bool reaches_hub(const Stepper *s, int k)
{
    double allowed = hub_distance(s, k);
    return allowed < s->wire.length[0] && tool_moves(s, k, 0, s->system.u) - around_moves(s, k) > allowed;
}

static bool misjudges(Stepper *s, int k, int about)
{
    Hand *hand = &s->hands.hand[k];
    int *slips = &hand->slips[about], was = *slips;
    if (!about && hand->is_stopped)
        return false;
    if (!about && was != 0 && reaches_hub(s, k)) {
        hand->is_stopped = true;
        *slips = 0;
        return true;
    }
    double most = holds(s, k, about), force = hand_force(s, k, about);
    if (!(most < HUGE_VAL))
        *slips = 0;
    else if (was == 0 && fabs(force) > most)
        *slips = force > 0 ? 1 : -1;
    else if (was != 0 && most > 0 && was * (hand_moves(s, k, about, s->system.u) - wanted(s, k, about)) > 0)
        *slips = 0;
    return *slips != was;
}

bool hands_misjudge(Stepper *s)
{
    bool changes = false;
    for (int k = 0; k < s->tools.count && !s->progress.has_failed; k++)
        for (int about = 0; has_hand(s, k) && about < 2; about++)
            changes |= misjudges(s, k, about);
    return changes;
}

void hands_feed(Stepper *s, unsigned released)
{
    for (int k = 0; k < s->tools.count; k++) {
        Hand *hand = &s->hands.hand[k];
        StepCommand *command = &s->hands.command[k];
        hand->is_released = released >> k & 1;
        hand->slips[0] = hand->slips[1] = 0;
        hand->is_stopped = false;
        memcpy(hand->start, hand->force, sizeof hand->start);
        if (hand->is_released && k > 0)  // moves with its valve, or nearly
            *command = s->hands.command[tools_around(s, 0, k)];
        else if (hand->is_released || !isfinite(command->advance) || !isfinite(command->twist))
            command->advance = command->twist = 0;
    }
}

void hands_report(Stepper *s)
{
    StepReport *r = &s->report;
    for (int k = 0; k < s->tools.count; k++) {
        Hand *hand = &s->hands.hand[k];
        bool feels = has_hand(s, k) && !hand->is_released;
        for (int about = 0; about < 2; about++)
            hand->force[about] = has_hand(s, k) ? hand_force(s, k, about) : 0;
        r->push[k] = feels ? hand->force[0] : 0;
        r->torque[k] = feels ? hand->force[1] : 0;
    }
    if (!s->entry.has_sheath) {        // the rig holds the hub: its reaction minus the hands' forces
        r->push[0] = r->proximal_force;
        r->torque[0] = r->proximal_torque;
        for (int k = 1; k < s->tools.count; k++)
            r->push[0] -= r->push[k], r->torque[0] -= r->torque[k];
    }
    r->proximal_force = r->push[0];
    r->proximal_torque = r->torque[0];
}

double hands_work_bound(const Stepper *s)
{
    double work = 0, length = vec3_distance(s->start.position[1], s->start.position[0]);
    for (int k = 0; k < s->tools.count; k++) {
        if (!has_hand(s, k))
            continue;
        double rest = s->beam.rest.length[0], stiffness = s->beam.rest.axial[0], total = s->wire.total_length, advance = fabs(hand_moves(s, k, 0, s->system.u));
        if (k > 0) {
            const Tool *t = &s->tools.tool[k];
            const double *slide = s->start.slide + k - 1;
            rest = is_inside(s, 1, k) ? slide[s->state.inner_count] - slide[0] : length;
            stiffness = t->section[0].axial / fmax(rest, 1e-3 * length);
            total = t->wire.total_length;
        }
        work += stiffness * advance * (fabs(length - rest) + advance * rest / total) + fabs(hand_moves(s, k, 1, s->system.u) * hand_force(s, k, 1));
    }
    return work;
}

double hands_work(const Stepper *s)
{
    double work = 0;
    for (int k = 0; k < s->tools.count; k++)
        if (has_hand(s, k) && !s->hands.hand[k].is_released)
            work += s->report.push[k] * hand_moved(s, k, 0) + s->report.torque[k] * hand_moved(s, k, 1);
    return work;
}

double hands_valve_work(const Stepper *s)
{
    double work = 0;
    for (int k = 0; k < s->tools.count; k++)
        for (int about = 0; has_hand(s, k) && s->hands.hand[k].is_released && about < 2; about++)
            work -= hand_force(s, k, about) * hand_moved(s, k, about);
    return work;
}

double hands_start_work(const Stepper *s, bool valves)
{
    double work = 0;
    for (int k = 0; k < s->tools.count; k++)
        for (int about = 0; has_hand(s, k) && s->hands.hand[k].is_released == valves && about < 2; about++)
            work += s->hands.hand[k].start[about] * hand_moved(s, k, about);
    return work;
}

// The actual insertion of tool k: [mm] beyond the mouth.
static double actual_inserted(const Stepper *s, int k)
{
    double hub = s->entry.has_sheath ? stepper_sheath_coordinate(s, 0) : 0;
    return k == 0 ? s->wire.total_length + hub : s->tools.tool[k].wire.total_length + hub - slide_at(s, 0, k);
}

void hands_count(Stepper *s)
{
    bool was_cut = (s->report.flags & STEP_LIMITED) != 0;
    for (int k = 0; k < s->tools.count; k++) {
        double *inserted = k == 0 ? &s->state.inserted : &s->tools.tool[k].inserted, *twist = k == 0 ? &s->state.twist : &s->tools.tool[k].twist;
        const Hand *hand = &s->hands.hand[k];
        if (!has_hand(s, k))
            continue;
        *inserted += s->hands.command[k].advance;
        *twist += s->hands.command[k].twist;
        double actual = actual_inserted(s, k);
        if (hand->slips[0] && !hand->is_released) {
            s->report.flags |= STEP_HAND_SLIPS;
            s->report.slipped += *inserted - actual;
        }
        if (hand->slips[0] || hand->is_released || (was_cut && k > 0))
            *inserted = actual;
        if (was_cut && k == 0)       // the part of an advance that was not made is owed
            *inserted = actual + fmax(-HAND_LAG_MAX, fmin(HAND_LAG_MAX, *inserted - actual));
        if (!was_cut && !hand->is_released)
            continue;
        if (k == 0)
            *twist += s->iterate.moved[3] - s->hands.command[0].twist;
        else
            *twist = s->state.twist + angle_at(s, 0, k);
    }
}
