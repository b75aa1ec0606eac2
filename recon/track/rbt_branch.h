// Tracks one branch: estimates a node, and tracks from the first node until the vessel ends. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_BRANCH_H
#define SELDINGER_RECON_TRACK_RBT_BRANCH_H

#include "recon/track/rbt_tracker.h"

extern const char rbt_enters_forbidden[];     // value of Tracker.why if a branch ended at a forbidden region

// Prepares the directions of the RANSAC search. Must be called first.
void tracker_prepare_axes(Tracker *t);
// The estimation step from a predicted cylinder. Writes the node to t->estimate; returns false, with the reason in t->why, if there is none.
bool tracker_estimate(Tracker *t, const Cylinder *predicted, double relative_threshold);
// Tracks from an estimate of the first node until the vessel ends. `until_tree`: the branch is tracked back towards its parent and ends inside another
// branch's tube.
void tracker_run(Tracker *t, const Cylinder *start, Track *branch, bool until_tree);
// Sets t->estimate to a node at `c` whose points are the first wall points that rays hit nearby.
void tracker_opening(Tracker *t, const Cylinder *c, double contrast);

#endif
