// Links of the tree that stay inside the lumen: where the straight one between a node and its parent passes through background, nodes are inserted along
// the way through the lumen, and where a branch begins that way also says which node is its parent.
#ifndef SELDINGER_RECON_TRACK_RBT_LINKS_H
#define SELDINGER_RECON_TRACK_RBT_LINKS_H

#include "recon/track/rbt_residue.h"

// Looks at the links of nodes `first` … t->tree.count-1, one branch whose own first node hangs on an earlier one (or is the root), and rewrites that part of
// the tree. `paint` holds the nodes before `first` (NULL: the branch's first link is not looked at). *is_joined is false where no way through
// the lumen leads to the tree: the branch is removed. False: out of memory.
bool rbt_mend_links(Tracker *t, const RbtPaint *paint, int first, bool *is_joined);

#endif
