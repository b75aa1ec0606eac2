// A first start in a sac. The first branch would lead through the sac as if it were a vessel, and the sac would not be found as one. The tracking then starts again
// from the vessel beside it. Not in Kerrien et al. 2017, where the user clicks vessels and sacs apart. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_SAC_START_H
#define SELDINGER_RECON_TRACK_RBT_SAC_START_H

#include "recon/track/rbt_tracker.h"

enum { SAC_STARTS = 3 };

typedef struct SacStart {
    int count;
    Vec3 vessel[SAC_STARTS]; // [mm] places in the vessel beside the sac, the nearest first: the start that is found near the sac may still be the sac
    double radius;           // [mm] of the sac
} SacStart;

// Whether the first branch, the only one in the tree, is in a sac at this place [mm]: a short part of it is much wider than the vessel that follows on one side, and
// the other side ends there within the volume or is narrow, too; or the branch has hardly left the sac, and a vessel leaves it elsewhere.
bool rbt_starts_in_sac(const Tracker *t, Vec3 start, SacStart *sac);
// Whether what was found from there is much narrower than the sac.
bool rbt_is_vessel_of_sac(const Tracker *t, const SacStart *sac);

#endif
