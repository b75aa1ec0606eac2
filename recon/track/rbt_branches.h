// Completes the tree from what was tracked so far: limbs of the residue (rbt_residue.h) are tracked both ways, out to the vessel's end and back into
// the parent, and appended with their links. Repeats until nothing is left, first at half the contrast, then at less.
#ifndef SELDINGER_RECON_TRACK_RBT_BRANCHES_H
#define SELDINGER_RECON_TRACK_RBT_BRANCHES_H

#include "base/base.h"
#include "recon/track/rbt_residue.h"

typedef struct RbtEnds {     // why each branch ended, by number; free both arrays
    const char **why;
    int *seed;               // its seed, -1: found automatically
    int count, capacity;
} RbtEnds;

bool rbt_ends_add(RbtEnds *ends, const char *why, int seed);   // false: out of memory

// Grows t->tree from node `first` on; t->paint is `paint`, which need not contain them yet. The random numbers of a branch depend on its position,
// and each result only on its neighbourhood: a local change leaves the rest of the tree unchanged, bit for bit. False: out of memory.
bool rbt_grow_branches(Tracker *t, RbtPaint *paint, int first, int threads, const Progress *progress, RbtEnds *ends);

#endif
