// Limits the tree: points that the tracking must not pass (`until`), and excluded vessels (`not`), which compete with the tree for the lumen. Not in Kerrien
// et al. 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_LIMITS_H
#define SELDINGER_RECON_TRACK_RBT_LIMITS_H

#include "recon/track/rbt_tracker.h"

// Places a disc across the vessel at each point of `until`, with 1.5 times its radius, in t->stop. `start`: the first start [mm], which must lie in none of
// the discs. Returns false with a fault, or without a fault if out of memory.
bool rbt_place_stops(Tracker *t, Vec3 start, const char *path, Faults *faults);
// Tracks the vessel at a point of `not` in both directions and divides the lumen that it shares with the first branch, whose start is `start`. If one of the
// two passes through both points, it is cut at its narrowest place between them; otherwise the first branch ends where it enters the tube of the excluded
// vessel. The excluded vessel stays in the tree as branch `number`, with a root of its own. Returns false with a fault, or if out of memory
// (t->out_of_memory).
bool rbt_add_rival(Tracker *t, const RbtRegion *point, Vec3 start, int number, const char *path, Faults *faults);
// Removes all nodes whose root is not the first node; *branches and *length [mm] receive how much was removed. Returns false if out of memory.
bool rbt_drop_rivals(Tracker *t, int *branches, double *length);

#endif
