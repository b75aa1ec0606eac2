// Branches become a tree (section 3.3), the first of them tracked both ways from its start. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_TRUNK_H
#define SELDINGER_RECON_TRACK_RBT_TRUNK_H

#include "recon/track/rbt_tracker.h"

// Where to attach a subtree that starts at x to the first `node_count` nodes of the tree.
int tracker_attachment(const Tracker *t, Vec3 x, int node_count);
// Appends a branch's nodes: those of the return path reversed, then those of the outgoing path. False: out of memory.
bool tracker_adopt(Tracker *t, const Track *out, const Track *back, int number);
// Tracks from a cylinder both ways into the empty tree; nodes follow each other from the root on. False if nothing was found, or out of memory.
bool tracker_both_ways(Tracker *t, const RbtSeed *seed, const Cylinder *start, int number);
// What was estimated at the first start, for the report.
void tracker_say_start(Tracker *t, const RbtSeed *seed, const Cylinder *start, const char *root);

#endif
