// The hands of coaxial tools: what they prescribe at node 0, the hub of the outermost tool, what they feel, and how they slip. A hand k that moves by a_k makes
// S at the hub grow by a_0 - a_k, so its push is -dE/dS; the outermost tool's hand feels the total less the others'.
#include "solver/step_tools.h"

// [mm] displacement of S of tool k at the hub in this step that the commands ask for.
static double wanted_slide(const Stepper *s, int k)
{
    const Tool *t = &s->tool[k];
    double hub = s->state.inserted + s->command.advance - s->tool[0].wire.total_length;
    return t->wire.total_length - t->inserted - s->tool_command[k].advance + hub - s->start_slide[k - 1];
}

void tools_constrain(Stepper *s)
{
    for (int c = 0; c < s->chain.count; c++)
        for (int k = 1; k < s->tool_count; k++)
            for (int i = 0; !is_inside(s, c, k) && i < 2; i++)
                stepper_prescribe(s, c, unknown_of(k) + i, 0);
    for (int k = 1; k < s->tool_count; k++) {
        const Tool *t = &s->tool[k];
        if (!is_inside(s, 0, k))
            continue;
        double angle = t->twist + s->tool_command[k].twist - (s->state.twist + s->command.twist);
        if (s->tool_slips[k])
            s->b[unknown_of(k)] -= s->tool_slips[k] * t->hand_limit;
        else
            stepper_prescribe(s, 0, unknown_of(k), wanted_slide(s, k));
        stepper_prescribe(s, 0, unknown_of(k) + 1, angle - s->start_angle[k - 1]);
    }
}

void tools_report(Stepper *s)
{
    StepReport *r = &s->report;
    r->push[0] = r->proximal_force;
    r->torque[0] = r->proximal_torque;
    for (int k = 1; k < s->tool_count; k++) {
        if (!is_inside(s, 0, k))
            continue;
        // S falls as the hand pushes; the outermost tool's node 0 carries them along
        r->push[k] = -stepper_reaction(s, unknown_of(k));
        r->torque[k] = stepper_reaction(s, unknown_of(k) + 1);
        r->push[0] -= r->push[k];
        r->torque[0] -= r->torque[k];
    }
    r->proximal_force = r->push[0];
    r->proximal_torque = r->torque[0];
}

bool tools_misjudges_grip(Stepper *s, int k)
{
    Tool *t = &s->tool[k];
    int was = s->tool_slips[k], at = unknown_of(k);
    if (t->hand_limit == 0 || !is_inside(s, 0, k))
        return false;
    double push = -stepper_reaction(s, at);
    if (was == 0 && fabs(push) > t->hand_limit)
        s->tool_slips[k] = push > 0 ? 1 : -1;
    else if (was != 0 && was * (wanted_slide(s, k) - s->u[at]) > 0)
        s->tool_slips[k] = 0;
    return s->tool_slips[k] != was;
}

void tools_feed(Stepper *s)
{
    for (int k = 1; k < s->tool_count; k++) {
        Tool *t = &s->tool[k];
        StepCommand *command = &s->tool_command[k];
        if (!isfinite(command->advance) || !isfinite(command->twist))
            *command = (StepCommand){0};
        s->tool_slips[k] = 0;
        // its proximal end stays behind the hub, its tip beyond it
        const Tool *out = &s->tool[0];
        double hub = s->state.inserted + s->command.advance - out->wire.total_length;
        double most = t->wire.total_length + hub - t->inserted, least = hub - t->inserted;
        if (command->advance > most || command->advance < least)
            s->report.flags |= command->advance > most ? STEP_FULLY_INSERTED : STEP_FULLY_WITHDRAWN;
        command->advance = fmin(most, fmax(least, command->advance));
    }
    tools_pass(s);
}

void tools_move(Stepper *s, double part)
{
    for (int c = 0; c < s->state.node_count; c++)
        for (int k = 1; k < s->tool_count; k++) {
            if (!is_inside(s, c, k))
                continue;
            int at = unknown_of(k), i = c * s->state.inner_count + k - 1;
            const double *u = s->u + row_of(s, c) + at;
            double *done = s->linearised + row_of(s, c) + at;
            done[0] = part < 1 ? done[0] + part * (u[0] - done[0]) : u[0];
            done[1] = part < 1 ? done[1] + part * (u[1] - done[1]) : u[1];
            s->state.slide[i] = s->start_slide[i] + done[0];
            s->state.angle[i] = s->start_angle[i] + done[1];
        }
}

void tools_set_velocities(Stepper *s)
{
    WireState *w = &s->state;
    for (int c = 0; c < w->node_count; c++) {
        Vec3 t = c < s->first_free ? s->axis[0] : quat_rotate(s->start_orientation[c], vec3(1, 0, 0));
        for (int k = 1; k < s->tool_count; k++) {
            if (!is_inside(s, c, k))
                continue;
            const double *u = s->linearised + row_of(s, c) + unknown_of(k);
            int i = c * w->inner_count + k - 1;
            w->slide_velocity[i] = vec3_dot(w->velocity[c], t) - u[0] / s->dt;
            w->slide_spin[i] = vec3_dot(w->spin[c], t) + u[1] / s->dt;
        }
    }
}

// What tool k's hand has moved by in this step, along (0) and about (1) the line.
static double hand_moved(const Stepper *s, int k, int which)
{
    const double *u = s->linearised;
    return which == 0 ? u[0] - u[unknown_of(k)] : u[3] + u[unknown_of(k) + 1];
}

double tools_hand_work(const Stepper *s, int k)
{
    if (!is_inside(s, 0, k))
        return 0;
    return s->report.push[k] * hand_moved(s, k, 0) + s->report.torque[k] * hand_moved(s, k, 1);
}

void tools_count_commands(Stepper *s)
{
    for (int k = 1; k < s->tool_count; k++) {
        Tool *t = &s->tool[k];
        t->inserted += s->tool_command[k].advance;
        t->twist += s->tool_command[k].twist;
        if (!is_inside(s, 0, k))
            continue;
        // where it is in fact, cut or slipped
        double hub = s->state.inserted - s->tool[0].wire.total_length, actual = t->wire.total_length + hub - slide_at(s, 0, k);
        if (s->tool_slips[k])
            s->report.flags |= STEP_HAND_SLIPS;
        if (s->tool_slips[k] || (s->report.flags & STEP_LIMITED)) {
            t->inserted = actual;
            t->twist = s->state.twist + angle_at(s, 0, k);
        }
    }
}
