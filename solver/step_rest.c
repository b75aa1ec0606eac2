// Rest. A tool that lies still would otherwise be solved anew in each step, and creep by the error that the contact solve is allowed (2e-8 mm in 0.5 s).
//
// A step is *quiet* if no hand moves, lets go or takes hold, no load still grows, and its solution converged and was followed to its end. The tool is at rest
// once it has stayed within X of one place for REST_TIME of quiet steps: it then loses its velocity and is not solved for again until a hand moves, lets go or
// takes hold, or a tool is exchanged. Positions and forces remain those of the last solution; only the time goes on.
//
// A period of time is judged, not a step, because slow motions look like rest in one step, and fast ones have ended after the period: a creep with time constant
// T stops within X / (exp(REST_TIME / T) - 1) of its end, an oscillation where its amplitude is X. Neither depends on the step; but a step longer than STEP_MOST
// is an iteration of statics and counts as STEP_MOST. X is the error of the solve: of contacts, which are solved iteratively, or of rounding.
#include "base/base.h"
#include "solver/tools_internal.h"

#include <string.h>

static const double REST_IN_CONTACT = 1e-7, REST_FREE = 1e-10;     // X [mm], [rad]
static const double REST_TIME = 500, STEP_MOST = 1;              // [ms]
static const unsigned UNFINISHED = STEP_DIVERGED | STEP_NOT_CONVERGED | STEP_LIMITED;

static bool still_grows(const Stepper *s)
{
    for (int k = 0; k < s->rig.load_count; k++)
        if (s->rig.load[k].load.ramp > s->state.time)
            return true;
    return false;
}

static bool hands_are_still(const Stepper *s, const StepCommand *command, unsigned released)
{
    SEL_ASSERT(s->tools.count >= 1 && s->tools.count <= STEP_TOOLS_MAX, "a stepper has tools");
    for (int k = 0; k < s->tools.count; k++)
        if (command[k].advance != 0 || command[k].twist != 0)
            return false;
    return released == s->rest.released;
}

bool step_rests(Stepper *s, const StepCommand *command, unsigned released)
{
    if (s->rest.time < REST_TIME || !hands_are_still(s, command, released))
        return false;
    s->state.time += s->dt;
    s->report.iterations = s->report.newton = 0;
    s->report.slipped = 0;
    s->report.is_at_rest = true;
    return true;
}

void rest_feed(Stepper *s, const StepCommand *command, unsigned released)
{
    s->rest.is_quiet = hands_are_still(s, command, released) && !still_grows(s);
    s->rest.released = released;
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

void rest_judge(Stepper *s)
{
    double farthest = 0, *moved = s->rest.moved;
    size_t rows = row_of(s, s->state.node_count);
    if (!s->rest.is_quiet || s->progress.has_failed || (s->report.flags & UNFINISHED) != 0) {
        s->rest.time = 0;
        return;
    }
    if (s->rest.time <= 0)
        memset(moved, 0, rows * sizeof *moved);
    for (size_t i = 0; i < rows; i++) {
        moved[i] += s->iterate.moved[i];
        farthest = fmax(farthest, fabs(moved[i]));
    }
    const ContactSet *set = &s->system.set;
    double least = set->count + set->pair_count + set->slide_count > 0 ? REST_IN_CONTACT : REST_FREE;
    s->rest.time = farthest <= least ? s->rest.time + fmin(s->dt, STEP_MOST) : 0;
    if (s->rest.time >= REST_TIME)
        lose_velocity(s);
}
