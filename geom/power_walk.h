// Topological tracking: each tool point follows its node through the tree by power distance d(X, C) = |X - C|^2 - r^2,
// among the node and those near it in the tree only (vessel_tree_link), so that kissing branches are never confused. Kerrien 2017, 6.2.1, eq. (12).
#ifndef SELDINGER_GEOM_POWER_WALK_H
#define SELDINGER_GEOM_POWER_WALK_H

#include "geom/vessel_tree.h"

static inline double power_distance(Vec3 x, Vec3 center, double radius) { return vec3_norm2(vec3_sub(x, center)) - radius * radius; }
// The best node reached from `node` by repeated moves to a strictly better near node, at most `hops` of them; to one whose ball X is outside of by its
// radius or more only where that is also nearer in radii. A point that then is further than 1.2 r
// from its node's centre, and inside the ball of a node to which a way through the tree of at most 2.5 times that distance leads, goes there.
int power_walk(const VesselTree *tree, Vec3 x, int node, int hops);
// The best node of the whole tree (lowest index on ties).
int power_nearest(const VesselTree *tree, Vec3 x);

#endif
