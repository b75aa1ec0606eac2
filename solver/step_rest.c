// Rest. Without it a tool at rest is solved anew in each step and trembles by the error of the contact solve, 1e-13 to 1e-9 mm a step.
//
// A *quiet* step has no commands, no load that still grows, and a solution that converged and was followed to its end. With X = REST_MOTION:
//   1. A quiet step that moves no unknown by more than X leaves the tool without velocity.
//   2. A quiet step that starts without velocity and would move no unknown by more than X leaves the state exactly as it was: positions, forces, friction and
//      the memory of walls. Only the time goes on.
// The second makes rest a fixed point: the next quiet step starts from the same state, so it has the same result. That is known without a solve
// (step_stays_at_rest) until a command, a hand's hold, a tool or the state is changed. It is not part of the state: a restored stepper finds it out again.
//
// A body that starts without velocity moves by a h^2 in its first step. Rule 2 therefore stops a tool only where its forces are balanced within X m / h^2; an
// oscillation of angular frequency w is then within X / (w h)^2 of its equilibrium. Rule 1 stops a creep of time constant T within X T / h of its end. Below
// steps of 1 ms, X shrinks by (h / 1 ms)^2, so that the forces are balanced as well as at 1 ms.
//
// X was chosen by measurement: in 20 scenes (coils, slipping hands, one to three tools) the median of the trembling is 1e-14 to 9e-10 mm a step.
#include "base/base.h"
#include "solver/tools_internal.h"

#include <string.h>

static const double REST_MOTION = 1e-9;          // [mm], [rad] in a step of 1 ms, 1 nm/s
static const unsigned UNFINISHED = STEP_DIVERGED | STEP_NOT_CONVERGED | STEP_LIMITED;

static bool still_grows(const Stepper *s)
{
    for (int k = 0; k < s->rig.load_count; k++)
        if (s->rig.load[k].load.ramp > s->state.time)
            return true;
    return false;
}

static bool commands_nothing(const Stepper *s, const StepCommand *command)
{
    SEL_ASSERT(s->tools.count >= 1 && s->tools.count <= STEP_TOOLS_MAX, "a stepper has tools");
    for (int k = 0; k < s->tools.count; k++)
        if (command[k].advance != 0 || command[k].twist != 0)
            return false;
    return true;
}

static bool all_zero(const double *value, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (value[i] != 0)
            return false;
    return true;
}

static bool has_no_velocity(const Stepper *s)
{
    const WireState *w = &s->state;
    size_t nodes = (size_t)w->node_count, inner = nodes * (size_t)w->inner_count;
    return all_zero(&w->velocity[0].x, 3 * nodes) && all_zero(&w->spin[0].x, 3 * nodes) && all_zero(w->slide_velocity, inner) && all_zero(w->slide_spin, inner);
}

bool step_stays_at_rest(Stepper *s, const StepCommand *command, unsigned released)
{
    if (!s->rest.is_known || s->rest.released != released || !commands_nothing(s, command))
        return false;
    s->state.time += s->dt;
    return true;
}

void rest_feed(Stepper *s, const StepCommand *command, unsigned released)
{
    s->rest.is_known = false;
    s->rest.released = released;
    s->rest.is_quiet = commands_nothing(s, command) && !still_grows(s);
    s->rest.starts = s->rest.is_quiet && has_no_velocity(s);
    if (s->rest.starts)
        stepper_save(s, s->rest.start);
}

static void lose_velocity(Stepper *s)
{
    WireState *w = &s->state;
    size_t nodes = (size_t)w->node_count, inner = nodes * (size_t)w->inner_count * sizeof(double);
    memset(w->velocity, 0, nodes * sizeof *w->velocity);
    memset(w->spin, 0, nodes * sizeof *w->spin);
    memset(w->slide_velocity, 0, inner);
    memset(w->slide_spin, 0, inner);
}

// The forces stay those of the state; the rest of the report is about it, too. Nothing was solved for.
static StepReport at_rest(const StepReport *state, StepReport report)
{
    report.iterations = report.newton = 0;
    report.slipped = 0;
    report.proximal_force = state->proximal_force;
    report.proximal_torque = state->proximal_torque;
    memcpy(report.push, state->push, sizeof report.push);
    memcpy(report.torque, state->torque, sizeof report.torque);
    report.wall_force_max = state->wall_force_max;
    report.wall_force_sum = state->wall_force_sum;
    report.is_at_rest = true;
    return report;
}

void rest_judge(Stepper *s)
{
    if (!s->rest.is_quiet || s->progress.has_failed || (s->report.flags & UNFINISHED) != 0)
        return;
    double least = REST_MOTION * fmin(1, s->dt * s->dt);
    for (size_t i = 0; i < row_of(s, s->state.node_count); i++)
        if (!(fabs(s->iterate.moved[i]) <= least))
            return;
    if (!s->rest.starts) {
        lose_velocity(s);
        return;
    }
    StepReport solved = s->report;
    double time = s->state.time;
    stepper_restore(s, s->rest.start);
    s->state.time = time;
    s->report = at_rest(&s->report, solved);
    s->rest.is_known = true;
}
