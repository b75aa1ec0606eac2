// One branch: the estimation of a node, and the tracking from a first one until the vessel ends. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_BRANCH_H
#define SELDINGER_RECON_TRACK_RBT_BRANCH_H

#include "recon/track/rbt_tracker.h"

extern const char rbt_enters_forbidden[];     // value of Tracker.why for this kind of end

// To be called first: prepares the directions of the RANSAC search.
void tracker_prepare_axes(Tracker *t);
// The estimation step from a predicted cylinder; the node goes to t->estimate, false with t->why.
bool tracker_estimate(Tracker *t, const Cylinder *predicted, double relative_threshold);
// Tracks from an estimate of the first node until the vessel ends; `until_tree`: tracked back towards the parent, it ends inside another branch's
// tube.
void tracker_run(Tracker *t, const Cylinder *start, Track *branch, bool until_tree);
// Makes t->estimate a node at `c` whose points are the first walls that rays meet nearby.
void tracker_opening(Tracker *t, const Cylinder *c, double contrast);

#endif
