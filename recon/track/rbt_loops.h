// Loops: vessels hang together in rings (a circle of Willis, an artery and a vein through a fistula), a tree has none: where a branch's end meets another branch
// beyond its own way back, the ring is said. Not in Kerrien et al. 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_LOOPS_H
#define SELDINGER_RECON_TRACK_RBT_LOOPS_H

#include "recon/track/rbt_tracker.h"

// Adds the loops of t->tree to the report, whose branches stand already. False: out of memory.
bool rbt_find_loops(const Tracker *t, RbtReport *report);

#endif
