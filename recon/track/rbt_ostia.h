// Models the ostia of a tracked tree. A branch begins where its first cylinder fits, up to two radii outside its parent's wall; from there to the parent's
// axis nothing describes the ostium. Each of these links is measured in the image and either gets nodes or is refused. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_OSTIA_H
#define SELDINGER_RECON_TRACK_RBT_OSTIA_H

#include "recon/track/rbt_tracker.h"

typedef struct RbtJunctions {   // {0} is empty; the caller frees `junction`
    RbtJunction *junction;      // `branch` and `parent` are the numbers of the nodes' branches, not those of the report
    int count;
} RbtJunctions;

// Rewrites t->tree. `is_named[branch]`: the trace file gives this branch, so it is kept. Junctions are in the order of their branches' numbers. Returns false
// if out of memory.
bool rbt_open_ostia(Tracker *t, const bool *is_named, int threads, RbtJunctions *out);
// Depth of x inside the vessel around node `node` [mm]; < 0 outside it.
double rbt_depth_in_vessel(const Track *tree, int node, Vec3 x);

#endif
