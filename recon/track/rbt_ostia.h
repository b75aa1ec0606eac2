// Internal to recon: the ostia of a tracked tree. A branch begins where its first cylinder fits, up to two radii beyond its parent's wall; between
// that and the parent's axis nothing describes the mouth. Each such link is measured in the image and either gets nodes or is refused.
#ifndef SELDINGER_RECON_TRACK_RBT_OSTIA_H
#define SELDINGER_RECON_TRACK_RBT_OSTIA_H

#include "recon/track/rbt_tracker.h"

typedef struct RbtJunctions {   // {0}; free(junction)
    RbtJunction *junction;      // `branch` and `parent` are the numbers of the nodes' branches, not those of the report
    int count;
} RbtJunctions;

// Rewrites t->tree. `is_named[branch]`: the trace names the branch, so it is kept. Junctions in the order of their branches' numbers. False: out of
// memory.
bool rbt_open_ostia(Tracker *t, const bool *is_named, int threads, RbtJunctions *out);
// How deep x lies in the vessel about node `node` [mm], < 0 outside it.
double rbt_depth_in_vessel(const Track *tree, int node, Vec3 x);

#endif
