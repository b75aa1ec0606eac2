// Block-tridiagonal systems with 6x6 blocks that are not symmetric: a sliding contact makes the tangential force follow the normal
// one, but not the other way round. Same two-ended order and layout as block_chain.h; half as dear again.
#ifndef SELDINGER_SOLVER_BLOCK_LU_H
#define SELDINGER_SOLVER_BLOCK_LU_H

#include "solver/block_chain.h"

typedef struct BlockLu BlockLu;

BlockLu *block_lu_create(int count);
void block_lu_destroy(BlockLu *lu);
// A of `chain`, but for its upper half: upper[i] = A(i, i+1)^T (row-major; chain->lower for a symmetric one). Diagonal blocks in full.
// x = A^-1 b; both (M, 6), not the same. No pivoting: false where a pivot is not positive.
bool block_lu_factor_solve(const BlockChain *chain, const double *upper, BlockLu *lu, const double *b, double *x);
// Another right-hand side with the same factor.
void block_lu_solve(const BlockLu *lu, const double *b, double *x);

#endif
