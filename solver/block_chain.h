// Symmetric positive definite block-tridiagonal systems with blocks of 6, 8, 10 or 12: the matrix of a chain of beams, coaxial ones included.
//
//   A = [ D0  L0' ...       ]   diag[i] = D_i (symmetric, stored in full), lower[i] = L_i = A(i+1, i)
//       [ L0  D1  L1' ...   ]
// Blocks are row-major, the first 64-byte aligned; vectors have `size` doubles a node: translation xyz [mm], rotation xyz [rad], then for each
// tool inside (at most three) its material coordinate [mm] and its angle [rad]. Where a node has no such tool its rows are unit rows.
// Nothing allocates but create.
#ifndef SELDINGER_SOLVER_BLOCK_CHAIN_H
#define SELDINGER_SOLVER_BLOCK_CHAIN_H

#include <stdbool.h>
#include <stddef.h>

enum { BLOCK_LARGEST = 12 };

typedef struct BlockChain {
    int count;               // M nodes
    int size;                // n unknowns a node
    double *diag;            // (M, n, n)
    double *lower;           // (M-1, n, n)
} BlockChain;

typedef struct BlockFactor BlockFactor;   // (two-ended) LDL^T of a chain

// 6, 8, 10 or 12: there are kernels for these. Creating anything of another size fails.
bool block_size_is_known(int size);
// What `count` blocks take, with padding: rows are read 8 or 16 wide.
static inline size_t block_doubles(int count, int size) { return (size_t)count * (size_t)(size * size) + 8; }

bool block_chain_create(BlockChain *chain, int count, int size);
void block_chain_destroy(BlockChain *chain);
BlockFactor *block_factor_create(int count, int size);
void block_factor_destroy(BlockFactor *factor);

// Of a chain of blocks of the factor's size, with as many nodes as the factor's or fewer. False where A is not positive definite (the factor
// is then unusable).
bool block_chain_factor(const BlockChain *chain, BlockFactor *factor);
// x = A^-1 b, both (M, n); x may be b.
void block_factor_solve(const BlockFactor *factor, const double *b, double *x);
// Both in one pass, where only one right-hand side belongs to a matrix: b's forward half costs nothing. b must not be x.
bool block_chain_factor_solve(const BlockChain *chain, BlockFactor *factor, const double *b, double *x);
// The diagonal blocks of A^-1 (M, n, n) by Takahashi's recursion.
void block_factor_inverse_diagonal(const BlockFactor *factor, double *inverse);
// y = A x, for residuals and tests.
void block_chain_multiply(const BlockChain *chain, const double *x, double *y);

#endif
