// Unsymmetric block-tridiagonal systems with blocks of 6, 8, 10 or 12 unknowns: at a sliding contact the tangential force depends on the normal force, but
// not vice versa. Two-ended order and layout as in block_chain.h, at 1.5 times the cost.
#ifndef SELDINGER_SOLVER_BLOCK_LU_H
#define SELDINGER_SOLVER_BLOCK_LU_H

#include "solver/block_chain.h"

typedef struct BlockLu BlockLu;

// For chains of up to `count` nodes. Returns NULL if out of memory, count < 1 or the size is unknown. block_lu_destroy() accepts NULL.
BlockLu *block_lu_create(int count, int size);
void block_lu_destroy(BlockLu *lu);
// Blocks are column-major: diag[i][c][r] of A(i, i), lower[i] of A(i+1, i), upper[i] of A(i, i+1), (M, n, n), block_doubles() each. (The diag of a
// symmetric chain, and its row-major lower taken as upper, have this layout already.) x = A^-1 b, both (M, n), must be different arrays.
// M = `count` is at most the number of nodes the factor was created for. `live` (M) is the number of leading unknowns of each node that are coupled; the
// others have unit rows and columns and cost nothing in blocks of 10 and 12. NULL: all are coupled.
// There is no pivoting. Returns false if a pivot vanishes or is not finite. A negative pivot may cost digits: the solution is then refined once and
// `exact` becomes false.
bool block_lu_factor_solve(BlockLu *lu, int count, const double *diag, const double *lower, const double *upper, const double *b, double *x,
                           const unsigned char *live, bool *exact);
// Solves for another right-hand side with the same factor.
void block_lu_solve(const BlockLu *lu, const double *b, double *x);
// to[i] = from[i]^T for `count` blocks.
void block_lu_transpose(int count, int size, const double *from, double *to);

#endif
