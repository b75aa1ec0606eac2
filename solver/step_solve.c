// The linear system of a step and its contact problem.
#include "solver/self_contact.h"
#include "solver/tools_internal.h"

static const double FIRMEST = 1e5;               // largest share of its stiffness by which an unknown is held to the iterate
// Contact iterations after which a step neither searches further for walls nor linearises again: a jammed stiff tool would use hundreds per step without
// progress. Its solution so far is followed as far as it is admissible. The limit does not apply to a tool in contact with itself, where undetected contacts
// would overlap, nor to several tools, which snap over more rounds and ended up to 1.3 mm outside the wall.
enum { ITERATIONS_ENOUGH = 60 };

void step_detect(Stepper *s)
{
    stepper_detect(s);
    if (!s->iterate.knows_motion)
        self_contact_detect(s);
    s->iterate.knows_motion = false;
}

// The iterate in the unknowns of the solve: those of the hands at node 0, slips elsewhere.
static double solved_for(const Stepper *s, int c, int unknown)
{
    SEL_ASSERT(unknown >= 0 && unknown < s->system.chain.size, "an unknown is one of its node's");
    int k = unknown < 6 ? 0 : 1 + (unknown - 6) / 2;
    if (k == 0 || !is_inside(s, c, k))
        return s->iterate.moved[row_of(s, c) + (size_t)unknown];
    return c == 0 ? hand_moved(s, k, unknown % 2) : tools_slipped(s, c, k, unknown % 2);
}

static bool is_unit_row(const double *row, int n, int unknown)
{
    for (int i = 0; i < n; i++)
        if (row[i] != (i == unknown))
            return false;
    return true;
}

// Holds the solution to the iterate, with a share of each unknown's own stiffness.
static void hold_to_iterate(Stepper *s, double share)
{
    SEL_ASSERT(share > 0, "the added stiffness is positive");
    int n = s->system.chain.size;
    for (int c = 0; c < s->system.chain.count; c++)
        for (int i = 0; i < n; i++) {
            double *row = s->system.chain.diag + block_of(s, c) + n * i, more = share * fabs(row[i]);
            if (is_unit_row(row, n, i))
                continue;
            row[i] += more;
            s->system.b[row_of(s, c) + (size_t)i] += more * solved_for(s, c, i);
        }
}

// Makes a matrix positive definite that is not (a tool snaps, and nothing holds it), by ever larger shares of its diagonal, starting from 0.
static bool firmer(Stepper *s, double *share)
{
    *share = *share > 0 ? 10 * *share : 0.01;
    if (!(*share < FIRMEST))
        return false;
    hold_to_iterate(s, *share);
    return s->progress.was_held = true;
}

void step_factor(Stepper *s)
{
    if (!contact_needs_factor(&s->system.set, &s->contact))
        return;
    double share = 0;
    s->system.is_factored = true;
    while (!s->progress.has_failed && !block_chain_factor(&s->system.chain, s->system.factor))
        s->progress.has_failed = !firmer(s, &share);
}

ContactProblem step_contacts(Stepper *s)
{
    SEL_ASSERT(s->system.set.count <= s->system.set.capacity, "detection found no more contacts than there is room for");
    if (!s->system.is_factored)      // where no contact is left
        step_factor(s);
    return (ContactProblem){.solver = s->system.solver,
                            .chain = &s->system.chain,
                            .factor = s->progress.has_failed ? NULL : s->system.factor,
                            .b = s->system.b,
                            .set = &s->system.set,
                            .options = &s->contact,
                            .u = s->system.u};
}

static const double IMPLAUSIBLE = 1e100;     // [mm], [rad]: squares stay finite

bool stepper_take_contacts(Stepper *s, const ContactReport *solved)
{
    if (s->progress.has_failed)
        return true;
    if (solved->singular) {
        if (firmer(s, &s->progress.firmness))
            return false;
        s->progress.has_failed = true;
        return true;
    }
    s->progress.firmness = 0;
    if (s->tools.count > 1)
        tools_from_slips(s);
    hands_solved(s);
    s->report.iterations += solved->iterations;
    s->report.residual = solved->residual;
    s->report.cone_violation = solved->cone_violation;
    s->report.active = solved->active;
    s->report.self_contacts = solved->pairs;
    s->report.flags &= ~(unsigned)STEP_NOT_CONVERGED;
    if (!solved->converged)
        s->report.flags |= STEP_NOT_CONVERGED;
    stepper_keep_forces(s);
    self_contact_keep_forces(s);
    bool is_plausible = true;    // false for NaN, too
    for (size_t i = 0; i < row_of(s, s->state.node_count); i++)
        is_plausible &= fabs(s->system.u[i]) < IMPLAUSIBLE;
    s->progress.has_failed |= !is_plausible;
    return true;
}

bool stepper_is_spent(const Stepper *s) { return s->tools.count == 1 && s->report.iterations >= ITERATIONS_ENOUGH && s->system.set.pair_count == 0; }
