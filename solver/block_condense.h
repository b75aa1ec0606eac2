// A chain condensed to some of its nodes: the others, which carry no load but their own, are eliminated once (static condensation, a Schur
// complement). The smaller chain has the same solution at the nodes that are kept, whatever is added there to its matrix and its right-hand
// side; the others follow from it. Solving again and again with changes at few nodes then costs what those nodes cost.
#ifndef SELDINGER_SOLVER_BLOCK_CONDENSE_H
#define SELDINGER_SOLVER_BLOCK_CONDENSE_H

#include "solver/block_chain.h"

typedef struct BlockCondenser BlockCondenser;

BlockCondenser *block_condenser_create(int count, int size);
void block_condenser_destroy(BlockCondenser *condenser);
// Which nodes to keep: all flags are false, and false again after condensing.
bool *block_condenser_keep(BlockCondenser *condenser);
// Looks which unknowns of a chain are coupled to anything: once for all chains that are condensed until the next time, which may have more in no other place.
void block_condenser_survey(BlockCondenser *condenser, const BlockChain *chain);
// The chain of the flagged nodes and one more, which balances the work, and its right-hand side; NULL where A is not positive definite.
// Valid until the next call.
const BlockChain *block_condense(BlockCondenser *condenser, const BlockChain *chain, const double *b);
double *block_condenser_side(BlockCondenser *condenser);
// Another right-hand side of the chain that was condensed last: the small chain's becomes that of b (M, n), and what is expanded next belongs to it.
void block_condenser_turn_to(BlockCondenser *condenser, const double *b);
// How many of a node's unknowns are coupled to anything, by nodes of the small chain: they come first there, unless they lie scattered.
const unsigned char *block_condenser_live(const BlockCondenser *condenser);
// The place of a kept node in the small chain.
int block_condenser_place(const BlockCondenser *condenser, int node);
// x (M, n) of all nodes from that of the kept ones.
void block_condenser_expand(const BlockCondenser *condenser, const double *kept, double *x);

#endif
