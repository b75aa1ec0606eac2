// Links of the tree that stay inside the lumen: where the straight one between a node and its parent passes through background, nodes are inserted
// along the path through the lumen; where a branch begins, that path also determines its parent.
#ifndef SELDINGER_RECON_TRACK_RBT_LINKS_H
#define SELDINGER_RECON_TRACK_RBT_LINKS_H

#include "recon/track/rbt_residue.h"

// Looks at the links of nodes `first` … t->tree.count-1, one branch whose first node is attached to an earlier one (or is the root), and rewrites
// that part of the tree. `paint` holds the nodes before `first` (NULL: the branch's first link is not looked at). *is_joined is false if no path
// through the lumen leads to the tree; the branch is then removed. False: out of memory.
bool rbt_mend_links(Tracker *t, const RbtPaint *paint, int first, bool *is_joined);

#endif
