// Coaxial tools of a stepper. Internal to solver; see step_tools.c and step_coaxial.c.
#ifndef SELDINGER_SOLVER_TOOLS_INTERNAL_H
#define SELDINGER_SOLVER_TOOLS_INTERNAL_H

#include "base/base.h"
#include "solver/step_internal.h"

#include <stdio.h>

// Creates the tools and computes the maximum number of nodes and slots of their chain (tools.capacity, points.slot_count). Returns false with a message in
// `why`, of `capacity` bytes, which is empty if out of memory.
bool tools_create(Stepper *s, const StepperOptions *options, char *why, int capacity);
void tools_destroy(Stepper *s);
// Places all tools straight on the line, each with its inserted length beyond the mouth.
void tools_place(Stepper *s);
// Rebuilds the chain after a tool's `first` has changed.
void tools_chain(Stepper *s);
// For tool k >= 1 at node c: whether it lies inside another tool there, its material coordinate [mm], its angle [rad], and the index of its first unknown.
static inline bool is_inside(const Stepper *s, int c, int k)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count && k >= 0 && k < s->tools.count, "the node and the tool exist");
    return k > s->tools.carrier[c] && c < s->tools.tool[k].inside;
}
static inline double slide_at(const Stepper *s, int c, int k)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count && k > 0 && k <= s->state.inner_count, "the node and the inner tool exist");
    return s->state.slide[c * s->state.inner_count + k - 1];
}
static inline double angle_at(const Stepper *s, int c, int k)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count && k > 0 && k <= s->state.inner_count, "the node and the inner tool exist");
    return s->state.angle[c * s->state.inner_count + k - 1];
}
static inline bool is_at_tip(const Stepper *s, int c) { return s->tools.carrier[c] != s->tools.carrier[c + 1]; }    // the next node has a different carrier
static inline int unknown_of(int k) { return 6 + 2 * (k - 1); }
static inline bool tools_carries(const Tool *t)
{
    SEL_ASSERT(t->first >= 0 && t->first <= t->wire.node_count, "a tool carries the chain from one of its nodes on, or nowhere");
    return t->first < t->wire.node_count;
}

// The next tool around tool k at node c that is also an unknown there; 0: none.
int tools_around(const Stepper *s, int c, int k);

// Rest length of element c [mm], its stretched length [mm], its twist [rad].
double tools_span_length(const Stepper *s, int c);
double tools_strained_length(const Stepper *s, int c);
double tools_twist(const Stepper *s, int c);
// Position and frame on the line d [mm] beyond node c, or beyond the mouth if c is the last node in the sheath, with the bending, shear, stretch and twist of
// the element there; the frame is transported along. Without `strains` only bending and shear count: a node of the sheath already has its strain.
ToolNode tools_further(const Stepper *s, int c, double d, bool strains);

// Smallest radial clearance [mm], at least a thousandth of the inner tool's diameter.
double tools_clearance(const Tool *around, const Tool *inner);
// Selects the tools that a checkpoint has fitted; the caller must rebuild the chain.
void tools_refit(Stepper *s, const int *fitted);
// Replaces the nodes of the outermost tool, all of which are in the sheath, by those of another tool with its tip at the same position.
void tools_exchange_outermost(Stepper *s, const Tool *next);

// Takes the commands of the step, limited to the available travel, and adds and removes the nodes that this requires.
void tools_feed(Stepper *s);
// Largest share of the solution that can be followed before a tip retracts by more than an element.
double tools_largest_part(const Stepper *s);
void tools_move(Stepper *s, double part);
void tools_set_velocities(Stepper *s);
double tools_stiffness_damping(const Stepper *s);

// Friction between tools: bounds from the state at the start of the step; conversion of the system's unknowns to slips relative to the surrounding tool, and
// back.
void tools_slides(Stepper *s);
void tools_to_slips(Stepper *s);
void tools_from_slips(Stepper *s);
// Displacement of tool k at node c, where it is inside, relative to the surrounding tool up to the iterate: along [mm], or about [rad].
double tools_slipped(const Stepper *s, int c, int k, int about);
void tools_keep_slides(Stepper *s);                // stores the forces of this step's solution for the next step
double tools_friction_work(const Stepper *s);      // [mJ] dissipated in this step …
double tools_friction_start_work(const Stepper *s); // … or by the forces of the step's start

// If the solution moves a node back behind the tip from which it emerged, removes the node from the chain and restarts the step. Returns whether it did.
bool tools_leave_back(Stepper *s);
// If a tip has come out so far that it needs its own node for contact with the wall, adds that node at the state where the step began and restarts the step.
// Returns whether it did: at most once per step and tool, and not for a node that has just been removed.
bool tools_come_out(Stepper *s);
// Writes unit rows where a tool has no unknowns.
void tools_leave_out(Stepper *s);
// Assembles the linear system of coaxial tools without contacts, loads and constraints.
void tools_assemble(Stepper *s, double scale, double inertia);
double tools_elastic_energy(const Stepper *s);
double tools_tip_straightening(const Stepper *s);
Vec3 tools_tip_curvature(const Stepper *s);
double tools_kinetic_energy(const Stepper *s);
#endif
