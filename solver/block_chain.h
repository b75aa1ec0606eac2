// Symmetric positive definite block-tridiagonal systems with 6x6 blocks: the matrix of a chain of beams.
//
//   A = [ D0  L0' ...       ]   diag[i] = D_i (symmetric, stored in full), lower[i] = L_i = A(i+1, i)
//       [ L0  D1  L1' ...   ]
// Blocks are row-major, 36 doubles, 64-byte aligned; vectors are 6 doubles a node: translation xyz [mm], rotation xyz [rad].
// Nothing allocates but create.
#ifndef SELDINGER_SOLVER_BLOCK_CHAIN_H
#define SELDINGER_SOLVER_BLOCK_CHAIN_H

#include <stdbool.h>

typedef struct BlockChain {
    int count;               // M nodes
    double *diag;            // (M, 6, 6)
    double *lower;           // (M-1, 6, 6)
} BlockChain;

typedef struct BlockFactor BlockFactor;   // (two-ended) LDL^T of a chain

bool block_chain_create(BlockChain *chain, int count);
void block_chain_destroy(BlockChain *chain);
BlockFactor *block_factor_create(int count);
void block_factor_destroy(BlockFactor *factor);

// Of a chain of any size up to the factor's. False where A is not positive definite (the factor is then unusable).
bool block_chain_factor(const BlockChain *chain, BlockFactor *factor);
// x = A^-1 b, both (M, 6); x may be b.
void block_factor_solve(const BlockFactor *factor, const double *b, double *x);
// Both in one pass, where only one right-hand side belongs to a matrix: b's forward half costs nothing. b must not be x.
bool block_chain_factor_solve(const BlockChain *chain, BlockFactor *factor, const double *b, double *x);
// The diagonal 6x6 blocks of A^-1 (M, 6, 6) by Takahashi's recursion.
void block_factor_inverse_diagonal(const BlockFactor *factor, double *inverse);
// y = A x, for residuals and tests.
void block_chain_multiply(const BlockChain *chain, const double *x, double *y);

#endif
