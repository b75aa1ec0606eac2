// Static condensation of a chain to some of its nodes: the other nodes are eliminated once (Schur complement). The condensed chain has the same solution
// at the kept nodes, whatever is added there to its matrix and its right-hand side; the solution at the other nodes follows from it. Repeated solutions
// with changes at few nodes then cost only as much as those nodes.
#ifndef SELDINGER_SOLVER_BLOCK_CONDENSE_H
#define SELDINGER_SOLVER_BLOCK_CONDENSE_H

#include "solver/block_chain.h"

typedef struct BlockCondenser BlockCondenser;

// For chains of up to `count` nodes. Returns NULL if out of memory, count < 1 or the size is unknown. block_condenser_destroy() accepts NULL.
BlockCondenser *block_condenser_create(int count, int size);
void block_condenser_destroy(BlockCondenser *condenser);
// Flags of the nodes to keep, for the caller to set. All flags are false initially and again after condensation.
bool *block_condenser_keep(BlockCondenser *condenser);
// Determines which unknowns of a chain do not have unit rows. Valid for all chains condensed until the next call; these must have unit rows in the same places.
void block_condenser_survey(BlockCondenser *condenser, const BlockChain *chain);
// Returns the chain of the flagged nodes and one more, which balances the work of both ends, with its right-hand side; NULL if A is not positive definite.
// Valid until the next call.
const BlockChain *block_condense(BlockCondenser *condenser, const BlockChain *chain, const double *b);
double *block_condenser_side(BlockCondenser *condenser);
// Replaces the right-hand side of the chain that was condensed last by b (M, n) and updates that of the condensed chain; the next expansion uses it.
void block_condenser_turn_to(BlockCondenser *condenser, const double *b);
// Number of unknowns without unit rows of each node of the condensed chain. They are the first unknowns of the node unless they are scattered.
const unsigned char *block_condenser_live(const BlockCondenser *condenser);
// Index of a kept node in the condensed chain.
int block_condenser_place(const BlockCondenser *condenser, int node);
// Computes x (M, n) of all nodes from the solution at the kept nodes.
void block_condenser_expand(const BlockCondenser *condenser, const double *kept, double *x);

#endif
