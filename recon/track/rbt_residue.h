// What the tracked tubes leave over: the volume is painted with the tree's tubes, and bright voxels that touch the paint are searched for limbs, the
// beginnings of vessels that were not tracked yet. Not in Kerrien et al. 2017, whose users click each branch.
#ifndef SELDINGER_RECON_TRACK_RBT_RESIDUE_H
#define SELDINGER_RECON_TRACK_RBT_RESIDUE_H

#include "recon/track/rbt_paint.h"

// What is brighter than the vessel beside it by more than this share of its contrast is bone, metal, not vessel.
#define RBT_BRIGHTER 0.12
#define RBT_NOISE_SHARE 0.6   // of the noise (four standard deviations) that is allowed on top

enum { RBT_LIMB_PLACES = 24 };
typedef struct RbtLimb {
    int count;               // places, from the contact outwards
    Vec3 place[RBT_LIMB_PLACES];
    double radius[RBT_LIMB_PLACES];   // [mm] from the area of its cross-section there
    int contact;             // node that it touches
    double level, ceiling;   // brightness of its border; above which it is no vessel
    double depth;            // [mm] of its last place, by the way inside it
    uint64_t key;            // its last voxel: the place that its random numbers come from
    bool is_cut;             // it goes on beyond the reach of the search
    int stem;                // limb of the same search that it parts from, or -1
    int stem_place;          // … after this place of it
} RbtLimb;

// Limbs on nodes first … end-1. Their border is the brightness `share` of the way from the background beside the node to the node's own, and at least
// `noise` above the background. To be freed; *count is -1 where memory lacks.
RbtLimb *rbt_find_limbs(const Tracker *t, const RbtPaint *paint, int first, int end, double share, double noise, int *count);

#endif
