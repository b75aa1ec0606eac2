// The residue: bright voxels outside the tracked tubes but touching them. It is searched for limbs, the beginnings of vessels not tracked yet. Not in Kerrien
// et al. 2017, where the user clicks each branch.
#ifndef SELDINGER_RECON_TRACK_RBT_RESIDUE_H
#define SELDINGER_RECON_TRACK_RBT_RESIDUE_H

#include "recon/track/rbt_paint.h"

// Anything brighter than the adjacent vessel by more than this fraction of its contrast is bone or metal, not vessel.
#define RBT_BRIGHTER 0.12
#define RBT_NOISE_SHARE 0.6   // fraction of the noise (four standard deviations) allowed in addition

enum { RBT_LIMB_PLACES = 24 };
typedef struct RbtLimb {
    int count;               // number of places, from the contact outwards
    Vec3 place[RBT_LIMB_PLACES];
    double radius[RBT_LIMB_PLACES];   // [mm] computed from the area of its cross-section there
    int contact;             // node that it touches
    double level, ceiling;   // brightness of its border, and brightness above which it is not a vessel
    double depth;            // [mm] path length to its last place
    uint64_t key;            // its last voxel; seeds its random numbers
    bool is_cut;             // it reaches beyond the searched region
    int stem;                // limb of the same search from which it branches, or -1
    int stem_place;          // place of the stem after which it branches
} RbtLimb;

// Finds the limbs that touch nodes first … end-1. Their border is the brightness at the fraction `share` between the background near the node and the node's
// own brightness, and at least `noise` above the background. The caller frees the result; *count is -1 if out of memory.
RbtLimb *rbt_find_limbs(const Tracker *t, const RbtPaint *paint, int first, int end, double share, double noise, int *count);

#endif
