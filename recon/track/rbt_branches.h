// The whole tree from what was tracked so far: limbs of the residue (rbt_residue.h) are tracked both ways, out to the vessel's end and back into the
// parent, and appended with their links. Repeats until nothing is left, first at half the contrast, then at less.
#ifndef SELDINGER_RECON_TRACK_RBT_BRANCHES_H
#define SELDINGER_RECON_TRACK_RBT_BRANCHES_H

#include "base/parallel.h"
#include "recon/track/rbt_residue.h"

typedef struct RbtEnds {     // why each branch ended, by number; free both arrays
    const char **why;
    int *seed;               // that named it, -1: it was found
    int count, capacity;
} RbtEnds;

bool rbt_ends_add(RbtEnds *ends, const char *why, int seed);   // false: out of memory

// Grows t->tree from its nodes `first` on; t->paint is `paint`, in which they need not stand yet. Random numbers of a branch come from its place, and what
// is done at one place depends on what is near it alone: elsewhere the tree is the same bit for bit. False: out of memory.
bool rbt_grow_branches(Tracker *t, RbtPaint *paint, int first, int threads, const Progress *progress, RbtEnds *ends);

#endif
