// Detects a vessel in noise, where single voxels are meaningless, by comparing the mean over a piece of tube with the mean around it. Not in Kerrien et al.
// 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_SCAN_H
#define SELDINGER_RECON_TRACK_RBT_SCAN_H

#include "recon/track/rbt_tracker.h"

enum { RBT_LEVELS = 5 };
extern const double rbt_level_voxels[RBT_LEVELS];   // standard deviation of each level's smoothing, in voxels; the first is 0

typedef struct RbtLevels {   // the volume and smoothed copies of it, created on first use
    const Volume *volume;
    Volume *smooth[RBT_LEVELS];  // copies of the whole volume; at most one at a time
    Volume *near[RBT_LEVELS];    // copies of the neighbourhood of the place scanned last, the first one unsmoothed
    Vec3 center;
    double noise[RBT_LEVELS];    // [grey values] standard deviation of the noise of a voxel
    int threads;
} RbtLevels;

RbtLevels rbt_levels_of(const Volume *volume, int threads);
// Returns a smoothed copy, owned by `levels`; the copy returned before is freed. Returns NULL if out of memory.
const Volume *rbt_level(RbtLevels *levels, int level);
double rbt_level_noise(RbtLevels *levels, int level);
void rbt_levels_free(RbtLevels *levels);

typedef struct RbtSight {    // how clearly a tube stands out
    double contrast;         // [grey values] brightness inside minus brightness beside it, without the brightest sixth of the ring (a neighbour)
    double certainty;        // contrast over its standard error from the noise of the voxels; HUGE_VAL without noise
    double evenness;         // contrast to the third and fourth brightest twelfth of the ring, relative to `contrast`: 1 a tube, 0 a step or a slab
} RbtSight;
// Measures a piece of the tube as long as it is wide, on the voxels of the unsmoothed volume.
RbtSight rbt_sight_of(const Volume *volume, double noise, const Cylinder *tube);

// Least certainty with which a node's tube stands out in a noisy volume. It is lower than for a start, because a node has neighbours.
#define RBT_NODE_CERTAINTY 3.5
bool rbt_node_stands_out(const Tracker *t, const RbtLevels *levels, const Cylinder *tube);

enum { RBT_SCANS = 12 };
bool rbt_is_tube(const RbtSight *sight);   // returns true if the evenness is high enough

// Finds the tubes around x that stand out most, one per radius, best first; x lies within three quarters of its radius from the axis of each. If `radius`
// [mm] or `axis` is given (not 0, not NULL), it is kept. Returns their number, at most RBT_SCANS; 0 if nothing is brighter than its surroundings, or with
// t->out_of_memory.
int rbt_scan(Tracker *t, RbtLevels *levels, Vec3 x, double radius, const Vec3 *axis, Cylinder *out);
// Returns the least smoothed level on which the wall of this tube stands out of the noise, among the levels that do not blur it away.
int rbt_level_for(RbtLevels *levels, const Cylinder *tube);

#endif
