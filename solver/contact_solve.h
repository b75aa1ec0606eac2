// The contact solve of a step. Find u and forces with   A u = b + sum_k J_k^T f_k,   Signorini and Coulomb, and slides between tools (contact.h).
//
// Two forms behind one call (docs/design.md, "Stability", 4); both reach the same solution.
//   pointwise: Gauss-Seidel over contacts (the paper's, and the reference), on the chain's semi-separable structure: W is never formed.
//   block:     both fields together by a semismooth Newton method with a line search, an iteration being one chain factorisation
//              (contact_newton.c), of the nodes that carry contacts where these are few: the others are eliminated once (block_condense.h).
// Warm start: ContactPoint.force of the same material point from the step before, as it is; zero for a new point. What presses in it is taken
// as active, so stale forces on points that have left the wall cost iterations: drop them with the candidate. Nothing else is remembered.
#ifndef SELDINGER_SOLVER_CONTACT_SOLVE_H
#define SELDINGER_SOLVER_CONTACT_SOLVE_H

#include "solver/block_chain.h"
#include "solver/contact.h"

// Of chains with blocks of `size`; the capacity is that of contacts with the wall and slides together.
ContactSolver *contact_solver_create(int node_count, int size, int contact_capacity);
void contact_solver_destroy(ContactSolver *solver);
// Room for so many pairs besides. False: no memory.
bool contact_solver_reserve_pairs(ContactSolver *solver, int pairs);

// What is solved: A u = b + J^T f. Rows of constrained degrees of freedom are unit rows in the chain with their value in b, and no contact acts on a fully
// constrained node.
typedef struct ContactProblem {
    ContactSolver *solver;
    const BlockChain *chain;     // A; while it is solved, slides are in its diagonal; afterwards it is as it was
    const BlockFactor *factor;   // of the chain; NULL: the chain is not positive definite
    const double *b;             // (M, n)
    ContactSet *set;             // may be empty
    const ContactOptions *options;
    double *u;                   // (M, n) the solution; with slides, in: an estimate of it
} ContactProblem;

// Solves for u and the forces of the set. Where the report says `singular`, nothing was solved.
ContactReport contact_solve(const ContactProblem *problem);
// False: contact_solve() does not read `factor`.
bool contact_needs_factor(const ContactSet *set, const ContactOptions *options);
ContactOptions contact_default_options(void);

#endif
