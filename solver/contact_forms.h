// Internal to solver: the work space of a contact solve and its two forms.
#ifndef SELDINGER_SOLVER_CONTACT_FORMS_H
#define SELDINGER_SOLVER_CONTACT_FORMS_H

#include "solver/block_lu.h"
#include "solver/contact_rows.h"
#include "solver/gauss_seidel.h"

enum { BLOCK_DOUBLES = 36 };

// What a contact does in one Newton iteration: f = force - C (further motion), C acting in space.
typedef struct ContactLaw {
    int state;
    bool touched;                // the matrix holds its C
    Vec3 force;
    Mat3 c;
    Vec3 step;                   // motion under the whole Newton step
    Vec3 multiplier;             // l of the augmented Lagrangian
    double bound;                // s, of Tresca's friction
} ContactLaw;

typedef struct PointwiseWork PointwiseWork;
PointwiseWork *pointwise_work_create(int node_count, int capacity);
void pointwise_work_destroy(PointwiseWork *work);

struct ContactSolver {
    int node_count, capacity;
    ContactRow *row;             // (capacity)
    Vec3 *motion;                // (capacity) d = J u
    ContactLaw *law;             // (capacity)
    Vec3 *best;                  // (capacity) forces of the best iterate
    bool *flag;                  // (capacity)
    bool symmetric;              // which of the two factors holds the matrix
    double *rhs, *delta;         // (M, 6)
    BlockChain matrix;           // with the contacts' laws: diag and A(i, i+1) by columns (which is the row-major lower of a symmetric chain)
    double *turned;              // (M, 6, 6) A(i+1, i) by columns
    BlockLu *lu;
    BlockFactor *factor;
    PointwiseWork *pointwise;
};

// A u = b + J^T f for the present forces (the right-hand side stays in rhs), and the motion of every contact.
void contact_balance(ContactSolver *solver, const BlockFactor *factor, const double *b, int count, double *u);

// Fills residual, cone_violation and active.
double contact_residual(const ContactRow *row, int count, const Vec3 *motion, ContactReport *report);
// Of the normal direction alone.
double contact_normal_residual(const ContactRow *row, int count, const Vec3 *motion);

ContactReport contact_pointwise(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                                const ContactOptions *options, double *u);
// solver->matrix = the chain with the laws' J^T C J. Call contact_assemble_reset once before the first of a solve.
void contact_assemble_reset(ContactSolver *solver, const BlockChain *chain, int count);
void contact_assemble(ContactSolver *solver, const BlockChain *chain, int count);
// From the rows' forces; at most `budget` factorisations. True where it converged.
bool contact_convex(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, double tolerance,
                    int budget, ContactReport *report, double *u);
// The last resort: nothing overlaps, no force leaves its cone, but friction may be less than Coulomb's.
void contact_feasible(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, double tolerance,
                      int budget, ContactReport *report, double *u);
ContactReport contact_newton(ContactSolver *solver, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                             const ContactOptions *options, double *u);

#endif
