// Topological tracking: each tool point follows its node through the tree by the power distance d(X, C) = |X - C|^2 - r^2, among the node and the nodes near it
// in the tree only (vessel_tree_link), so that branches that touch are never confused. Kerrien et al. 2017, 6.2.1, eq. (12).
#ifndef SELDINGER_GEOM_POWER_WALK_H
#define SELDINGER_GEOM_POWER_WALK_H

#include "geom/vessel_tree.h"

static inline double power_distance(Vec3 x, Vec3 center, double radius) { return vec3_norm2(vec3_sub(x, center)) - radius * radius; }
// The best node reached from `node` by at most `hops` moves to a strictly better near node. A move to a node whose ball X is outside of by the ball's radius or
// more is allowed only if X is also nearer to it relative to the radii. Afterwards, a point that is further than 1.2 r from its node's centre moves to a node
// whose ball holds it, if the path through the tree to that node is at most 2.5 times that distance.
int power_walk(const VesselTree *tree, Vec3 x, int node, int hops);
// The best node of the whole tree (lowest index on ties).
int power_nearest(const VesselTree *tree, Vec3 x);

#endif
