// Contact candidates of one step: Signorini and Coulomb on gaps linearised at the start of the step, x_n.
//
// A candidate sits on the tool's axis, at node `node` or between nodes `node` and `node`+1 (weights w_i = 1-xi, w_j = xi of the caller's shape
// functions, so xi need not be a fraction of the length). Its displacement in the step is
//   d = sum over i, j of w u + theta x (lever + w a),  a = -tool_radius * normal (the touching point relative to the axis).
// Signorini:  0 <= gap + normal . d   perpendicular to   force_n >= 0.
// Coulomb:    |force_t| <= friction * force_n, opposite to the tangential part of d where there is slip.
// Forces in N act on the tool; `force` is the whole vector in space and is kept per material point from step to step as warm start.
//
// Where the wall bends away from the tool along it, the place where they touch stays in space while the tool slides through it: the touching point of the tool
// rolls back along its line by roll (lean . (u - slid)), which stiffens the wire by force_n roll lean lean' (`lean`: how the gap's slope along the tool changes
// with the unknowns, `slid` the motion along itself that gap and normal are already for). The wall's curvature acts on u - slid too.
//
// A slide is the friction between two coaxial tools at a node where they share the centreline: S and phi, a tool's material coordinate and its
// angle there, are two of the node's unknowns (against those of the tool around it: step_coaxial.c).
//   d = (S, radius phi) in the step;  |force| <= bound, opposite to d where there is slip.
// The force acts on the unknowns as (force[0], radius force[1]).
// The bound (mu times the force between the tools) is given and does not follow the solve. A slide gives before it slips, like a bristle:
// force = held - bound d / give, cut to the bound, `held` the force at x_n. It creeps no more than a rigid one.
// In an unknown that is constrained (a unit row), or with radius 0 in phi, a slide neither sees the motion nor acts.
//
// A pair is a contact of the tool with itself, between two places that may be anywhere on the chain: a point's laws, with
//   d = d of its first end - d of its second,  a = -radius * normal at the first, +radius * normal at the second
// and the opposite force on the second.
#ifndef SELDINGER_SOLVER_CONTACT_H
#define SELDINGER_SOLVER_CONTACT_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct ContactPoint {
    int node;
    bool is_between;         // nodes `node` and node + 1; false: at the node, the usual case
    double xi;               // [0, 1) share of node + 1
    Vec3 lever[2];           // [mm] how the axis at a point between nodes follows the turns of its two nodes (a cubic's slopes); 0 at a node
    Vec3 normal;             // unit, into the lumen
    double gap;              // [mm] at x_n, tool radius already taken off
    Sym3 hessian;            // of the gap [1/mm]; -force_n times it, clamped to its positive semi-definite tangential part, is stiffness
    double friction;         // mu >= 0
    double tool_radius;      // [mm]
    Vec3 force;              // [N] on the tool; in: warm start, out: solution
    double roll;             // [mm] >= 0, 0: the touching point is one of the tool's
    double lean[2][6];       // [1/mm], [1] of both nodes' unknowns; looked at where roll > 0
    double leant;            // lean . slid
    Vec3 slid;               // [mm] at the contact
} ContactPoint;

typedef struct ContactSlide {
    int node;
    int unknown;             // of the node: S, and phi behind it; 6 or more
    double radius;           // [mm] at which the tools touch
    double bound;            // [N] >= 0
    double give;             // [mm] > 0, by which it gives until it slips
    double held[2];          // [N] the force at x_n
    double slip[2];          // [mm] d; in: about what it will be, out: solution
    double force[2];         // [N]; in: warm start, out: solution
} ContactSlide;

typedef struct ContactEnd {
    int node;                // and the next, each with its share
    double weight[2];        // less than 1 in sum where the sheath has a share
    Vec3 lever[2];           // [mm]
    double radius;           // [mm] from the axis to the point that both ends push at
} ContactEnd;

typedef struct ContactPair {
    ContactEnd end[2];
    Vec3 normal;             // unit, from the second end to the first
    double gap;              // [mm] at x_n, both radii taken off
    double friction;         // mu >= 0
    Vec3 force;              // [N] on the first end; in: warm start, out: solution
} ContactPair;

typedef struct ContactSet {
    int count, capacity;
    ContactPoint *point;
    int pair_count;          // at most what contact_solver_reserve_pairs() was told
    ContactPair *pair;
    int slide_count;         // count + slide_count is at most the solver's capacity
    ContactSlide *slide;
} ContactSet;

// Adds the curvature and roll stiffness of the set (warm-start forces) to the first six unknowns of a node's diagonal block (and couplings where
// xi > 0), and to `b`, which may be NULL, what it does to `slid`. See docs/design.md, "Stability", 1.
struct BlockChain;
void contact_add_curvature(const ContactSet *set, struct BlockChain *chain, double *b);
// Is a degree of freedom of a node free? A constrained one is recognised by its unit row; contacts neither push nor stiffen it.
bool contact_is_free(const struct BlockChain *chain, int node, int dof);
unsigned contact_free_dofs(const struct BlockChain *chain, int node);        // of the first six

// --- what a solve (contact_solve.h) is asked, and says ---

typedef enum { CONTACT_BLOCK = 0, CONTACT_POINTWISE = 1 } ContactForm;

typedef struct ContactOptions {
    ContactForm form;        // default CONTACT_BLOCK
    int max_iterations;      // sweeps, default 200; a factorisation of the block form counts as eight of them, or down to four on a
                             // condensed chain (block_condense.h), so that a step's cost is bounded
    double tolerance;        // on the residual below, default 1e-6
} ContactOptions;

typedef struct ContactReport {
    int iterations;          // sweeps or factorisations used
    bool converged;
    double residual;         // natural residual: largest over contacts of |force - project_K(force - r * violation)| over the largest force (at
                             // least 1e-3 N). Forces have been cut to their cones by no more than this; also in a solve that stopped
                             // early no contact overlaps by more than residual * largest force / stiffness of its node
    double largest;          // [N] that largest force
    double cone_violation;   // largest (|force_t| - mu force_n)+ over force_n, or (|force| - bound)+ over a slide's bound
    int active;              // contacts with the wall that bear force
    int pairs;               // … and contacts of the tool with itself
    bool singular;           // the chain is not positive definite: nothing was solved
} ContactReport;

typedef struct ContactSolver ContactSolver;   // work space

#endif
