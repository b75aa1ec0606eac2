// Estimates what a single click does not give: the centre of the lumen, its radius and direction, and which end of the vessel is the root. Not in Kerrien et
// al. 2017, whose first start has a radius and a direction.
#ifndef SELDINGER_RECON_TRACK_RBT_START_H
#define SELDINGER_RECON_TRACK_RBT_START_H

#include "recon/track/rbt_tracker.h"

// Finds a cylinder at a start [mm] in the lumen. The seed's `toward` or radius is kept if given. Returns false, with the reason in t->why, if none is found.
bool rbt_estimate_start(Tracker *t, const RbtSeed *seed, Cylinder *out, double *inlier_rate);
// Finds the cylinder of highest inlier rate near the tube `guess`, or a little further along it, whose axis is brighter than `level`. Returns false if there
// is none.
bool rbt_refine_start(Tracker *t, const Cylinder *guess, bool radius_is_known, double level, Cylinder *out, double *inlier_rate);

// Decides which of the two branches tracked from one start leads to the root: returns true if the end of `a` is the root. The root is the only end that
// reaches the volume's border; if both or neither do, it is the wider end (medians of the last nodes), and of equally wide ends the one nearer to the border.
// Neither branch may be empty. *why describes the choice.
bool rbt_root_is_at_end_of(const Tracker *t, const Track *a, const Track *b, const char **why);

#endif
