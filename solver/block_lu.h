// Block-tridiagonal systems with blocks of 6, 8, 10 or 12 that are not symmetric: a sliding contact makes the tangential force follow the normal
// one, but not the other way round. Same two-ended order and layout as block_chain.h; half as dear again.
#ifndef SELDINGER_SOLVER_BLOCK_LU_H
#define SELDINGER_SOLVER_BLOCK_LU_H

#include "solver/block_chain.h"

typedef struct BlockLu BlockLu;

BlockLu *block_lu_create(int count, int size);
void block_lu_destroy(BlockLu *lu);
// Blocks by columns: diag[i][c][r] of A(i, i), lower[i] of A(i+1, i), upper[i] of A(i, i+1), (M, n, n), block_doubles() each.
// (A symmetric chain's diag and its row-major lower, taken as upper, are that already.) x = A^-1 b, both (M, n), not the same.
// M = `count` is at most what the factor was made for. `live` (M), NULL: all: so many of a node's unknowns come first, the others have unit rows and columns
// and cost nothing in blocks of 10 and 12.
// No pivoting: false where a pivot vanishes or is not finite. Where one is negative digits may be lost: such a solution is refined once,
// and `exact` says false.
bool block_lu_factor_solve(BlockLu *lu, int count, const double *diag, const double *lower, const double *upper, const double *b, double *x,
                           const unsigned char *live, bool *exact);
// Another right-hand side with the same factor.
void block_lu_solve(const BlockLu *lu, const double *b, double *x);
// to[i] = from[i]^T of `count` blocks.
void block_lu_transpose(int count, int size, const double *from, double *to);

#endif
