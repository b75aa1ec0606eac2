// Detects a vessel in noise, where single voxels are meaningless, by the mean over a piece of tube against the mean around it. Not in Kerrien et al.
// 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_SCAN_H
#define SELDINGER_RECON_TRACK_RBT_SCAN_H

#include "recon/track/rbt_tracker.h"

enum { RBT_LEVELS = 5 };
extern const double rbt_level_voxels[RBT_LEVELS];   // standard deviation of each level's smoothing, in voxels; the first is 0

typedef struct RbtLevels {   // the volume and smoothed copies of it, made on first use
    const Volume *volume;
    Volume *smooth[RBT_LEVELS];  // of the whole; at most one at a time
    Volume *near[RBT_LEVELS];    // of what lies around the place that was scanned last, the first as it is
    Vec3 center;
    double noise[RBT_LEVELS];    // standard deviation of a voxel [grey values]
    int threads;
} RbtLevels;

RbtLevels rbt_levels_of(const Volume *volume, int threads);
// A smoothed copy, owned by `levels`; the one returned before is freed. NULL: out of memory.
const Volume *rbt_level(RbtLevels *levels, int level);
double rbt_level_noise(RbtLevels *levels, int level);
void rbt_levels_free(RbtLevels *levels);

typedef struct RbtSight {    // how clearly a tube stands out
    double contrast;         // [grey values] of its inside less what is beside it, without the brightest sixth (a neighbour)
    double certainty;        // contrast over its standard error by the noise of the voxels; HUGE_VAL without noise
    double evenness;         // contrast to the ring's third and fourth brightest twelfth, as a share of it: 1 a tube, 0 a step or a slab
} RbtSight;
// Over a piece of the tube as long as it is wide, by the voxels of the volume as it is.
RbtSight rbt_sight_of(const Volume *volume, double noise, const Cylinder *tube);

// In a noisy volume: whether a node's tube stands out on its own. The threshold is lower than for a start, because it has neighbours.
#define RBT_NODE_CERTAINTY 3.5
bool rbt_node_stands_out(const Tracker *t, const RbtLevels *levels, const Cylinder *tube);

enum { RBT_SCANS = 12 };
bool rbt_is_tube(const RbtSight *sight);   // even enough

// The tubes around x that stand out most, one a radius, best first: x lies within three quarters of its radius from the axis of each. `radius` [mm]
// and `axis` are kept if given (else 0, NULL). Returns their number, at most RBT_SCANS; 0 if nothing is brighter than what is around it or
// t->out_of_memory.
int rbt_scan(Tracker *t, RbtLevels *levels, Vec3 x, double radius, const Vec3 *axis, Cylinder *out);
// The least smoothed level on which the wall of this tube stands out of the noise, of those that do not blur it away.
int rbt_level_for(RbtLevels *levels, const Cylinder *tube);

#endif
