// Keeps the links of the tree inside the lumen: if the straight link between a node and its parent passes through background, nodes are inserted along a path
// through the lumen; for the first node of a branch, that path also determines its parent.
#ifndef SELDINGER_RECON_TRACK_RBT_LINKS_H
#define SELDINGER_RECON_TRACK_RBT_LINKS_H

#include "recon/track/rbt_residue.h"

// Checks the links of nodes `first` … t->tree.count-1 and rewrites that part of the tree. These nodes are one branch, whose first node is attached to an
// earlier node (or is the root). `paint` holds the nodes before `first` (NULL: the branch's first link is not checked). *is_joined is false if no path
// through the lumen leads to the tree; the branch is then removed. Returns false if out of memory.
bool rbt_repair_links(Tracker *t, const RbtPaint *paint, int first, bool *is_joined);

#endif
