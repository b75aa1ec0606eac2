// Attaches branches to the tree (section 3.3), and tracks the first branch in both directions from its start. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_TRUNK_H
#define SELDINGER_RECON_TRACK_RBT_TRUNK_H

#include "recon/track/rbt_tracker.h"

// Returns the node to which a subtree that starts at x is attached, among the first `node_count` nodes of the tree.
int tracker_attachment(const Tracker *t, Vec3 x, int node_count);
// Appends a branch's nodes: those of the return path reversed, then those of the outgoing path. Returns false if out of memory.
bool tracker_adopt(Tracker *t, const Track *out, const Track *back, int number);
// Tracks from a cylinder in both directions into the empty tree; nodes are in order from the root. Returns false if nothing was found, or if out of memory.
bool tracker_both_ways(Tracker *t, const RbtSeed *seed, const Cylinder *start, int number);
// Describes the estimate at the first start in t->start, for the report.
void tracker_report_start(Tracker *t, const RbtSeed *seed, const Cylinder *start, const char *root);

#endif
