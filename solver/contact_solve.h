// Contact solve of a step: finds u and forces with   A u = b + sum_k J_k^T f_k,   Signorini and Coulomb conditions, and slides between tools (contact.h).
//
// Two forms behind one call (docs/design.md, "Stability", 4) reach the same solution.
//   pointwise: Gauss-Seidel over contacts (the paper's form, and the reference), using the semi-separable structure of the chain; W is never formed.
//   block:     normal and friction forces together by a semismooth Newton method with a line search; an iteration is one factorisation of the chain
//              (contact_newton.c), condensed to the nodes with contacts where these are few: the others are eliminated once (block_condense.h).
// Warm start: ContactPoint.force of the same material point in the preceding step, unchanged; zero for a new point. Points with a compressive warm-start force
// begin as active, so stale forces on points that have left the wall cost iterations: discard them with the candidate. Nothing else is remembered.
#ifndef SELDINGER_SOLVER_CONTACT_SOLVE_H
#define SELDINGER_SOLVER_CONTACT_SOLVE_H

#include "solver/block_chain.h"
#include "solver/contact.h"

// For chains with blocks of `size`. The capacity covers wall contacts and slides together. Returns NULL if out of memory or if an argument is invalid.
ContactSolver *contact_solver_create(int node_count, int size, int contact_capacity);
void contact_solver_destroy(ContactSolver *solver);
// Reserves space for this number of pairs in addition. Returns false if out of memory.
bool contact_solver_reserve_pairs(ContactSolver *solver, int pairs);

// The problem A u = b + J^T f. Constrained degrees of freedom have unit rows in the chain and their values in b; contacts do not load a fully constrained
// node.
typedef struct ContactProblem {
    ContactSolver *solver;
    const BlockChain *chain;     // A; its diagonal contains the slides during the solve and is restored afterwards
    const BlockFactor *factor;   // of the chain; NULL: the chain is not positive definite
    const double *b;             // (M, n)
    ContactSet *set;             // may be empty
    const ContactOptions *options;
    double *u;                   // (M, n) output: solution; with slides also input: estimate of it
} ContactProblem;

// Solves for u and the forces of the set. If the report has `singular` set, there is no solution.
ContactReport contact_solve(const ContactProblem *problem);
// Whether contact_solve() uses the values of `factor`; if false, it only needs a non-NULL pointer.
bool contact_needs_factor(const ContactSet *set, const ContactOptions *options);
ContactOptions contact_default_options(void);

#endif
