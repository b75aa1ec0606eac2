// Completes the tree tracked so far: limbs of the residue (rbt_residue.h) are tracked in both directions, out to the vessel's end and back into the parent,
// and appended with their links. Repeats until no limb is left, first at half the contrast, then at a lower one.
#ifndef SELDINGER_RECON_TRACK_RBT_BRANCHES_H
#define SELDINGER_RECON_TRACK_RBT_BRANCHES_H

#include "base/base.h"
#include "recon/track/rbt_residue.h"

typedef struct RbtEnds {     // reasons why each branch ended, by branch number; the caller frees both arrays
    const char **why;
    int *seed;               // number of its seed; -1: found automatically
    int count, capacity;
} RbtEnds;

bool rbt_ends_add(RbtEnds *ends, const char *why, int seed);   // returns false if out of memory

// Grows t->tree from node `first` on; t->paint is `paint`, which need not contain these nodes yet. The random numbers of a branch depend on its position, and
// each result only on its neighbourhood: a local change leaves the rest of the tree bit for bit the same. Returns false if out of memory.
bool rbt_grow_branches(Tracker *t, RbtPaint *paint, int first, int threads, const Progress *progress, RbtEnds *ends);

#endif
