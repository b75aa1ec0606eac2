// Symmetric positive definite block-tridiagonal systems with blocks of 6, 8, 10 or 12 unknowns: the matrix of a beam chain, with or without coaxial tools.
//
//   A = [ D0  L0' ...       ]   diag[i] = D_i (symmetric, stored in full), lower[i] = L_i = A(i+1, i)
//       [ L0  D1  L1' ...   ]
// Blocks are row-major, the first one 64-byte aligned. Vectors have `size` doubles per node: translation xyz [mm], rotation xyz [rad], then the material
// coordinate [mm] and the angle [rad] of each inner tool (at most three). Where a node has no such tool, its rows are unit rows.
// Only the create functions allocate.
#ifndef SELDINGER_SOLVER_BLOCK_CHAIN_H
#define SELDINGER_SOLVER_BLOCK_CHAIN_H

#include <stdbool.h>
#include <stddef.h>

enum { BLOCK_LARGEST = 12 };

typedef struct BlockChain {
    int count;               // M, number of nodes
    int size;                // n, unknowns per node
    double *diag;            // (M, n, n)
    double *lower;           // (M-1, n, n)
    // The first `slim` nodes have only their unknowns 0 and 3 coupled, to each other and to those of the neighbours; the others have unit rows. With n = 6 only,
    // for speed: results are the same with 0.
    int slim;
} BlockChain;

typedef struct BlockFactor BlockFactor;   // two-ended LDL^T factor of a chain

// True for 6, 8, 10 and 12, for which there are kernels. Creating an object of any other size fails.
bool block_size_is_known(int size);
// Number of doubles in `count` blocks, including padding: rows are read in groups of 8 or 16.
static inline size_t block_doubles(int count, int size) { return (size_t)count * (size_t)(size * size) + 8; }

// Creates zeroed arrays for `count` nodes. Returns false if out of memory, count < 1 or the size is unknown.
bool block_chain_create(BlockChain *chain, int count, int size);
void block_chain_destroy(BlockChain *chain);
// For chains of up to `count` nodes. Returns NULL if out of memory, count < 1 or the size is unknown. block_factor_destroy() accepts NULL.
BlockFactor *block_factor_create(int count, int size);
void block_factor_destroy(BlockFactor *factor);

// Factors a chain with blocks of the factor's size and at most as many nodes as the factor was created for. Returns false if A is not positive definite;
// the factor is then unusable.
bool block_chain_factor(const BlockChain *chain, BlockFactor *factor);
// x = A^-1 b, both (M, n); x may be b.
void block_factor_solve(const BlockFactor *factor, const double *b, double *x);
// Factorisation and solution in one pass, for a single right-hand side: its forward substitution costs nothing. b and x must be different.
bool block_chain_factor_solve(const BlockChain *chain, BlockFactor *factor, const double *b, double *x);
// y = A x, for residuals and tests.
void block_chain_multiply(const BlockChain *chain, const double *x, double *y);

#endif
