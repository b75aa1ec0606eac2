// Internal to solver: work space of a contact solve and functions of its two forms.
#ifndef SELDINGER_SOLVER_CONTACT_FORMS_H
#define SELDINGER_SOLVER_CONTACT_FORMS_H

#include "solver/block_condense.h"
#include "solver/block_lu.h"
#include "solver/contact_rows.h"

enum { CONTACT_SWEEPS_PER_FACTOR = 8 };
static const double LEAST_FORCE = 1e-3;  // [N] smallest reference force of the residual

// Linear law of a contact in one Newton iteration: f = force - C (further motion), C in space axes.
typedef struct ContactLaw {
    int state;
    bool touched;                // the matrix contains its C
    Vec3 force;                  // g, then the force after the full step
    Mat3 c;
    Vec3 along;                  // mu p of a slipping contact
    Vec3 step;                   // motion in the full step
    double own[4];               // of a slide: entries of its unknowns in the chain without it
    double lean[2][6];           // of a slipping contact: the vector used in the row operation on each of its nodes (straighten())
    bool leans[2];               // whether the rows of each node were modified
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
    double *best_u;              // … and its solution (M, n)
    bool *flag;                  // (capacity)
    int wall_count, *wall;       // (capacity) indices of the rows that are contacts with the wall
    int banded;                  // number of leading rows that are not pairs
    ContactPairs *pairs;         // NULL: no pairs were reserved
    int stalls;                  // stalls of the line search in this solve …
    double slope;                // … and the value of r over k chosen from them
    bool inexact;                // a factor of this solve may have lost digits
    bool knows_motion;           // `motion` is an estimate, better than the motion that balances the forces
    bool is_positive;            // the chain was found positive definite; later rounds differ only by the positive semi-definite laws of slides
    bool symmetric;              // true: `factor` holds the matrix, false: `lu`
    double *rhs, *delta;         // (M, n)
    BlockChain matrix;           // with the contacts' laws: diag and A(i, i+1) column-major (identical to the row-major lower of a symmetric chain)
    double *turned;              // (M, n, n) A(i+1, i), column-major …
    double *turned_chain;        // … and the same of the chain without contacts
    double *side;                // (M, n) right-hand side of the chain with slides …
    BlockFactor *braced_factor;  // … and its factor
    BlockLu *lu;
    BlockFactor *factor;
    BlockCondenser *condenser;
    const BlockChain *small;     // condensed chain of the last solve; NULL: it was not condensed …
    double *small_u;             // (M, n) … and its solution
    PointwiseWork *pointwise;
};

// Solves A u = b + J^T f for the present forces (the right-hand side remains in rhs) and computes the motion of every contact.
void contact_balance(ContactSolver *solver, const BlockFactor *factor, const double *b, int count, double *u);

// Returns the residual and writes residual, largest, cone_violation, active and pairs of the report.
double contact_residual(const ContactRow *row, int count, const Vec3 *motion, ContactReport *report);

// Work space for contacts of the tool with itself; NULL if out of memory.
ContactPairs *contact_pairs_create(int node_count, int size, int capacity);
void contact_pairs_destroy(ContactPairs *pairs);
// Rows of the pairs' second ends (capacity); NULL if pairs is NULL.
ContactRow *contact_pairs_far(ContactPairs *pairs);
// Solves x = A^-1 b with the present matrix of the chain; b and x must be different arrays.
typedef void (*ContactSolve)(const ContactSolver *solver, const BlockFactor *factor, double *b, double *x);
// Computes the compliance W between the pairs in `list` in 3x3 blocks: motion of each under unit forces of each.
void contact_pairs_compliance(ContactSolver *solver, const BlockFactor *factor, ContactSolve solve, const int *list, int count);
// Block of W for the k-th and l-th pairs of the list.
Mat3 contact_pairs_block(const ContactPairs *pairs, int k, int l);
// Updates s->delta, the step of the chain without the closed pairs, to the step with them. Returns false if the system is singular.
bool contact_pairs_step(ContactSolver *solver, int count, bool reuse, bool whole, ContactSolve solve);

// Solves the wall contacts and pairs [0, count) on a chain that is not factored yet. Returns false if the chain is not positive definite.
bool contact_walls(ContactSolver *solver, const BlockChain *chain, const double *b, int count, const ContactOptions *options, double *u, ContactReport *report);
// Updates the solution after b has changed by `change` (M, n), with the same matrix and states: fast, and accurate if the change is small. Returns false if
// this is not possible.
bool contact_walls_again(ContactSolver *solver, const BlockChain *chain, const double *change, int count, double *u, ContactReport *report);
// Solves the wall contacts and pairs together with the slides [from, to).
ContactReport contact_slides(ContactSolver *solver, const BlockChain *chain, const double *b, int from, int to, const ContactOptions *options, double *u);
ContactReport contact_pointwise(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                                const ContactOptions *options, double *u);
// Leaves the forces in balance with the motion: call contact_cut() afterwards.
ContactReport contact_newton(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                             const ContactOptions *options, double *u);
// One more step with the last factor and states, after b has changed by `change`; solver->delta is the resulting change of u. Returns false if the result is
// not finite.
bool contact_newton_again(ContactSolver *solver, const BlockChain *chain, const double *change, int count, double *u, ContactReport *report);
// Projects forces onto their cones and counts the loaded contacts.
void contact_cut(ContactSolver *solver, int count, ContactReport *report);

#endif
