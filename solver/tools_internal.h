// Coaxial tools of a stepper: internal to solver. See step_tools.c and step_coaxial.c.
#ifndef SELDINGER_SOLVER_TOOLS_INTERNAL_H
#define SELDINGER_SOLVER_TOOLS_INTERNAL_H

#include "base/base.h"
#include "solver/step_internal.h"

#include <stdio.h>

// Makes the tools, and says how many nodes and slots a chain of them has at most (capacity, slot_count).
bool tools_create(Stepper *s, const StepperOptions *options, char *why, int capacity);
void tools_destroy(Stepper *s);
// All straight on the line, each as far in as it is inserted.
void tools_place(Stepper *s);
// The chain anew, after a tool's `first` has changed.
void tools_chain(Stepper *s);
// Tool k >= 1 at node c: does it lie inside another there, and then where [mm], how it is turned [rad], and its two unknowns' place among the node's.
static inline bool is_inside(const Stepper *s, int c, int k)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count && k >= 0 && k < s->tools.count, "a tool of the chain is looked for at one of its nodes");
    return k > s->tools.carrier[c] && c < s->tools.tool[k].inside;
}
static inline double slide_at(const Stepper *s, int c, int k)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count && k > 0 && k <= s->state.inner_count, "an inner tool has its place at each node");
    return s->state.slide[c * s->state.inner_count + k - 1];
}
static inline double angle_at(const Stepper *s, int c, int k)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count && k > 0 && k <= s->state.inner_count, "an inner tool has its place at each node");
    return s->state.angle[c * s->state.inner_count + k - 1];
}
static inline bool is_at_tip(const Stepper *s, int c) { return s->tools.carrier[c] != s->tools.carrier[c + 1]; }    // another tool carries the next node
static inline int unknown_of(int k) { return 6 + 2 * (k - 1); }
static inline bool tools_carries(const Tool *t)
{
    SEL_ASSERT(t->first >= 0 && t->first <= t->wire.node_count, "a tool carries the chain from one of its nodes on, or nowhere");
    return t->first < t->wire.node_count;
}

// The tool that is next around tool k at node c and is an unknown there too; 0: none.
int tools_around(const Stepper *s, int c, int k);

// [mm] rest length of the chain's element c, and as long as it is stretched; [rad] its twist.
double tools_span_length(const Stepper *s, int c);
double tools_strained_length(const Stepper *s, int c);
double tools_twist(const Stepper *s, int c);
// Where the line is d [mm] from node c, or from the mouth where that is the last node in the sheath, as its element is bent, slanted by shear, stretched and
// twisted there: position, and the node's frame carried along. Without `strains` it is only bent and slanted: a node of the sheath has its strain already.
ToolNode tools_further(const Stepper *s, int c, double d, bool strains);

// [mm] radial, the least there is; at least a thousandth of the inner tool's diameter.
double tools_clearance(const Tool *around, const Tool *inner);
// Fits the tools of a checkpoint; the chain is to be made anew.
void tools_refit(Stepper *s, const int *fitted);
// The chain's nodes of the outermost tool, all of them in the sheath, become those of another one with its tip in the same place.
void tools_exchange_outermost(Stepper *s, const Tool *next);

// A step's commands, clamped to what is there, and the nodes that come and go by them.
void tools_feed(Stepper *s);
// The part of the solution that can be followed before a tip goes back by more than an element.
double tools_largest_part(const Stepper *s);
void tools_move(Stepper *s, double part);
void tools_set_velocities(Stepper *s);
double tools_stiffness_damping(const Stepper *s);

// Friction between the tools: bounds from the state at the step's start, and the system's unknowns turned into slips against the tool around, and back.
void tools_slides(Stepper *s);
void tools_to_slips(Stepper *s);
void tools_from_slips(Stepper *s);
// How far the iterate has moved tool k at node c, where it is inside, against the tool around it: along [mm], or about [rad].
double tools_slipped(const Stepper *s, int c, int k, int about);
void tools_keep_slides(Stepper *s);                // the forces of this step's solution, for the next step
double tools_friction_work(const Stepper *s);      // [mJ] that it took in this step …
double tools_friction_start_work(const Stepper *s); // … or would have with the forces of its start

// Does a node of the solution come to lie behind the tip that it came out of? Then it leaves the chain, and the step begins anew. Whether one did.
bool tools_leave_back(Stepper *s);
// Has a tip come out so far that it needs a node of its own, which meets the wall? Then that joins the chain where the step began, and the step begins anew.
// Whether one did; once in a step for each tool, and not for one that has just left.
bool tools_come_out(Stepper *s);
// Unit rows where a tool is no unknown.
void tools_leave_out(Stepper *s);
// The linear system of coaxial tools, all but what contacts, loads and constraints add.
void tools_assemble(Stepper *s, double scale, double inertia);
double tools_elastic_energy(const Stepper *s);
double tools_tip_straightening(const Stepper *s);
Vec3 tools_tip_curvature(const Stepper *s);
double tools_kinetic_energy(const Stepper *s);
#endif
