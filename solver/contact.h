// Contact candidates of one step: Signorini and Coulomb conditions on gaps linearised at x_n, the start of the step.
//
// A candidate lies on the tool's axis, at node `node` or between nodes `node` and `node`+1 (weights w_i = 1-xi, w_j = xi of the caller's shape
// functions, so that xi need not be a fraction of the length). Its displacement in the step is
//   d = sum over i, j of w u + theta x (lever + w a),  a = -tool_radius * normal (the touching point relative to the axis).
// Signorini:  0 <= gap + normal . d   perpendicular to   force_n >= 0.
// Coulomb:    |force_t| <= friction * force_n, opposite to the tangential part of d where the contact slips.
// Forces in N act on the tool. `force` is the whole vector in space; it is kept per material point from step to step for the warm start.
//
// Where the wall curves away from the tool along the tool's length, the touching point stays fixed in space while the tool slides through it: relative to the
// material it rolls back by roll (lean . (u - slid)), which stiffens the wire by force_n roll lean lean'. `lean` is the derivative of the gap's slope along the
// tool with respect to the unknowns, `slid` the motion along itself that gap and normal already include. The wall's curvature acts on u - slid as well.
//
// A slide is the friction between two coaxial tools at a node where they share the centreline: a tool's material coordinate S and angle phi there are two of
// the node's unknowns (relative to those of the surrounding tool: step_coaxial.c).
//   d = (S, radius phi) in the step;  |force| <= bound, opposite to d where there is slip.
// The force acts on the unknowns as (force[0], radius force[1]).
// The bound (mu times the force between the tools) is prescribed and does not follow the solution. A slide yields elastically before it slips, like a bristle:
// force = held - bound d / give, projected onto the disc of radius bound; `held` is the force at x_n. It creeps no more than a rigid slide.
// In a constrained unknown (a unit row), or in phi where radius is 0, a slide has neither motion nor force.
//
// A pair is a contact of the tool with itself, between any two places of the chain: the conditions are those of a point, with
//   d = d of its first end - d of its second,  a = -radius * normal at the first, +radius * normal at the second
// and the opposite force on the second end.
#ifndef SELDINGER_SOLVER_CONTACT_H
#define SELDINGER_SOLVER_CONTACT_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct ContactPoint {
    int node;
    bool is_between;         // false: at the node, which is the usual case; true: between nodes `node` and node + 1
    double xi;               // [0, 1) weight of node + 1
    Vec3 lever[2];           // [mm] displacement of the axis per rotation of each of the two nodes (from the cubic's slopes); 0 at a node
    Vec3 normal;             // unit vector into the lumen
    double gap;              // [mm] at x_n, tool radius subtracted
    Sym3 hessian;            // [1/mm] of the gap; the positive semi-definite tangential part of -force_n times it is added as stiffness
    double friction;         // mu >= 0
    double tool_radius;      // [mm]
    Vec3 force;              // [N] on the tool; input: warm start, output: solution
    double roll;             // [mm] >= 0; 0: the touching point is fixed to the tool's material
    double lean[2][6];       // [1/mm], [1] for the unknowns of both nodes; used only if roll > 0
    double leant;            // lean . slid
    Vec3 slid;               // [mm] at the contact point
} ContactPoint;

typedef struct ContactSlide {
    int node;
    int unknown;             // index of S among the node's unknowns, at least 6; phi follows it
    double radius;           // [mm] radius at which the tools touch
    double bound;            // [N] >= 0
    double give;             // [mm] > 0, elastic displacement before slip
    double held[2];          // [N] force at x_n
    double slip[2];          // [mm] d; input: estimate, output: solution
    double force[2];         // [N] input: warm start, output: solution
} ContactSlide;

typedef struct ContactEnd {
    int node;                // this node and the next, each with its weight
    double weight[2];        // weights; their sum is less than 1 where the sheath takes a share
    Vec3 lever[2];           // [mm]
    double radius;           // [mm] from the axis to the common point at which both ends are loaded
} ContactEnd;

typedef struct ContactPair {
    ContactEnd end[2];
    Vec3 normal;             // unit vector from the second end to the first
    double gap;              // [mm] at x_n, both radii subtracted
    double friction;         // mu >= 0
    Vec3 force;              // [N] on the first end; input: warm start, output: solution
} ContactPair;

typedef struct ContactSet {
    int count, capacity;
    ContactPoint *point;
    int pair_count;          // at most the number reserved by contact_solver_reserve_pairs()
    ContactPair *pair;
    int slide_count;         // count + slide_count must not exceed the solver's capacity
    ContactSlide *slide;
} ContactSet;

// Adds to the first six unknowns of each node's diagonal block (and to the off-diagonal blocks where xi > 0) the curvature and roll stiffness of the set, for
// the warm-start forces, and to `b`, which may be NULL, the effect of this stiffness on `slid`. See docs/design.md, "Stability", 1.
struct BlockChain;
void contact_add_curvature(const ContactSet *set, struct BlockChain *chain, double *b);
// Whether a degree of freedom of a node is free. A constrained one is recognised by its unit row; contacts neither load nor stiffen it.
bool contact_is_free(const struct BlockChain *chain, int node, int dof);
unsigned contact_free_dofs(const struct BlockChain *chain, int node);        // mask of the first six

// --- options and report of a contact solve (contact_solve.h) ---

typedef enum { CONTACT_BLOCK = 0, CONTACT_POINTWISE = 1 } ContactForm;

typedef struct ContactOptions {
    ContactForm form;        // default CONTACT_BLOCK
    int max_iterations;      // sweeps, default 200. A factorisation of the block form counts as eight sweeps, or down to four on a condensed chain
                             // (block_condense.h), so that the cost of a step is bounded
    double tolerance;        // limit of the residual below, default 1e-6
} ContactOptions;

typedef struct ContactReport {
    int iterations;          // sweeps or factorisations used
    bool converged;
    double residual;         // natural residual: maximum over contacts of |force - project_K(force - r * violation)|, relative to the largest force (at least
                             // 1e-3 N). The projection of the forces onto their cones changed them by no more than this; also in a solve that stopped early no
                             // contact overlaps by more than residual * largest force / stiffness of its node
    double largest;          // [N] the largest force in this ratio
    double cone_violation;   // largest (|force_t| - mu force_n)+ over force_n, or (|force| - bound)+ over a slide's bound
    int active;              // loaded contacts with the wall
    int pairs;               // loaded contacts of the tool with itself
    bool singular;           // the chain is not positive definite: there is no solution
} ContactReport;

typedef struct ContactSolver ContactSolver;   // work space

#endif
