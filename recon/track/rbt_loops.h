// Reports loops: vessels may form rings (the circle of Willis, an artery and a vein joined by a fistula), which a tree cannot represent. A loop is reported
// if a branch's end touches another branch that is not near it along the tree. Not in Kerrien et al. 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_LOOPS_H
#define SELDINGER_RECON_TRACK_RBT_LOOPS_H

#include "recon/track/rbt_tracker.h"

// Adds the loops of t->tree to the report, which must have its branches already. Returns false if out of memory.
bool rbt_find_loops(const Tracker *t, RbtReport *report);

#endif
