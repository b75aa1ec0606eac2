// Finds aneurysms in the residue: a limb that is much wider than the adjacent vessel and has walls all around is an aneurysm. Not in Kerrien et al. 2017,
// where the user clicks inside each; the point extraction is theirs (section 3.4).
#ifndef SELDINGER_RECON_TRACK_RBT_SACS_H
#define SELDINGER_RECON_TRACK_RBT_SACS_H

#include "recon/track/rbt_residue.h"

// Returns true if the limb is an aneurysm. t->estimate is then its node: the sphere fitted to the first wall points that rays from its middle hit, and those
// points.
bool rbt_is_sac(Tracker *t, const RbtPaint *paint, const RbtLimb *limb);

// Appends nodes for further centres if the aneurysm is not spherical; their parents are indices in `sac`. Returns false if out of memory.
bool rbt_fill_sac(Tracker *t, const RbtPaint *paint, const RbtLimb *limb, Track *sac);

#endif
