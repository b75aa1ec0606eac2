// Estimates what a single click leaves open: the centre of the lumen, its radius and direction, and which end of the vessel is the root. Not in
// Kerrien et al. 2017, whose first start has a radius and a direction.
#ifndef SELDINGER_RECON_TRACK_RBT_START_H
#define SELDINGER_RECON_TRACK_RBT_START_H

#include "recon/track/rbt_tracker.h"

// Finds a cylinder at a start [mm] in the lumen; keeps the seed's `toward` or radius if given. False if none is found, with t->why.
bool rbt_estimate_start(Tracker *t, const RbtSeed *seed, Cylinder *out, double *inlier_rate);
// The cylinder of the highest inlier rate about the tube `guess`, or somewhat further along it, whose axis is brighter than `level`. False if there
// is none.
bool rbt_refine_start(Tracker *t, const Cylinder *guess, bool radius_is_known, double level, Cylinder *out, double *inlier_rate);

// Of the two branches tracked from one start: is the end of `a` the root? The only end that reaches the volume's border is; where both or none does,
// the wider one (medians of the last nodes), and of equals the one nearer to the border. Neither may be empty. *why says which.
bool rbt_root_is_at_end_of(const Tracker *t, const Track *a, const Track *b, const char **why);

#endif
