// Internal to solver: the work space of a contact solve and its two forms.
#ifndef SELDINGER_SOLVER_CONTACT_FORMS_H
#define SELDINGER_SOLVER_CONTACT_FORMS_H

#include "solver/block_condense.h"
#include "solver/block_lu.h"
#include "solver/contact_rows.h"

enum { CONTACT_SWEEPS_PER_FACTOR = 8 };
static const double LEAST_FORCE = 1e-3;  // [N] that errors are measured against

// What a contact does in one Newton iteration: f = force - C (further motion), C acting in space.
typedef struct ContactLaw {
    int state;
    bool touched;                // the matrix holds its C
    Vec3 force;                  // g, then what the whole step makes of the force
    Mat3 c;
    Vec3 along;                  // mu p of a sliding contact
    Vec3 step;                   // motion under the whole step
    double own[4];               // of a slide: what the chain has without it in its unknowns
    double lean[2][6];           // of a sliding contact, by which the rows of its nodes are straightened …
    bool leans[2];               // … which they are
} ContactLaw;

typedef struct ContactPairs ContactPairs;      // see contact_pairs.c
typedef struct PointwiseWork PointwiseWork;
PointwiseWork *pointwise_work_create(int node_count, int size, int capacity);
void pointwise_work_destroy(PointwiseWork *work);

struct ContactSolver {
    int node_count, capacity;
    ContactRow *row, *spare;     // (capacity)
    Vec3 *motion;                // (capacity) d = J u
    ContactLaw *law;             // (capacity)
    Vec3 *best;                  // (capacity) forces of the best iterate …
    double *best_u;              // … and its motion (M, n)
    bool *flag;                  // (capacity)
    int wall_count, *wall;       // (capacity) which rows are contacts with the wall
    int banded;                  // rows that are no pairs: the first ones
    ContactPairs *pairs;         // NULL: room for none
    int stalls;                  // of the line search in this solve …
    double slope;                // … and what they make of r over k
    bool inexact;                // a factor of this solve may have lost digits
    bool knows_motion;           // `motion` is a guess that is better than what the forces would give …
    bool is_positive;            // … and the chain was looked at: without slides' laws it is what it was, and these only add to it
    bool symmetric;              // which of the two factors holds the matrix
    double *rhs, *delta;         // (M, n)
    BlockChain matrix;           // with the contacts' laws: diag and A(i, i+1) by columns (which is the row-major lower of a symmetric chain)
    double *turned;              // (M, n, n) A(i+1, i) by columns …
    double *turned_chain;        // … and that of the chain
    double *side;                // (M, n) the right-hand side of the chain with slides …
    BlockFactor *braced_factor;  // … and its factor
    BlockLu *lu;
    BlockFactor *factor;
    BlockCondenser *condenser;
    const BlockChain *small;     // the condensed chain of the last solve; NULL: it was not condensed …
    double *small_u;             // (M, n) … and its solution
    PointwiseWork *pointwise;
};

// A u = b + J^T f for the present forces (the right-hand side stays in rhs), and the motion of every contact.
void contact_balance(ContactSolver *solver, const BlockFactor *factor, const double *b, int count, double *u);

// Fills residual, cone_violation and active.
double contact_residual(const ContactRow *row, int count, const Vec3 *motion, ContactReport *report);

// The contacts of the tool with itself.
ContactPairs *contact_pairs_create(int node_count, int size, int capacity);
void contact_pairs_destroy(ContactPairs *pairs);
ContactRow *contact_pairs_far(ContactPairs *pairs);
// Solves with the chain's present matrix: x = A^-1 b, not the same.
typedef void (*ContactSolve)(const ContactSolver *solver, const BlockFactor *factor, double *b, double *x);
// W between the pairs in `list`, 3x3 blocks: their motion under each other's forces.
void contact_pairs_compliance(ContactSolver *solver, const BlockFactor *factor, ContactSolve solve, const int *list, int count);
// Of the k-th and the l-th in the list.
Mat3 contact_pairs_block(const ContactPairs *pairs, int k, int l);
// s->delta, which is what the rows of the chain give without the pairs that are not open, becomes that with them. False: singular.
bool contact_pairs_step(ContactSolver *solver, int count, bool reuse, bool whole, ContactSolve solve);

// The block form on the chain of the contacts' nodes. False where these are not few, or the chain is not positive definite.
bool contact_condensed(ContactSolver *solver, const BlockChain *chain, const double *b, int count, const ContactOptions *options, double *u,
                       ContactReport *report);
// The contacts [0, count) with the wall on a chain that is not factored yet. False where it is not positive definite.
bool contact_walls(ContactSolver *solver, const BlockChain *chain, const double *b, int count, const ContactOptions *options, double *u, ContactReport *report);
// The same after b has changed by `change` (M, n), with the same matrix and states, which is quick and good where little changes. False where it cannot.
bool contact_walls_again(ContactSolver *solver, const BlockChain *chain, const double *change, int count, double *u, ContactReport *report);
// These, and the slides [from, to).
ContactReport contact_slides(ContactSolver *solver, const BlockChain *chain, const double *b, int from, int to, const ContactOptions *options, double *u);
ContactReport contact_pointwise(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                                const ContactOptions *options, double *u);
// Forces are left as they balance the motion: contact_cut() follows.
ContactReport contact_newton(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                             const ContactOptions *options, double *u);
// One more step with the last factor and states, after b has changed by `change`; solver->delta: by how much u. False: it is not finite.
bool contact_newton_again(ContactSolver *solver, const BlockChain *chain, const double *change, int count, double *u, ContactReport *report);
// Cuts forces to their cones, and counts those that press.
void contact_cut(ContactSolver *solver, int count, ContactReport *report);

#endif
