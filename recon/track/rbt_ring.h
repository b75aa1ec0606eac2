// Internal to recon: what rays square to a vessel see of its wall, where no cylinder was fitted.
#ifndef SELDINGER_RECON_TRACK_RBT_RING_H
#define SELDINGER_RECON_TRACK_RBT_RING_H

#include "recon/track/rbt_link_path.h"

enum { RING = 24 };
static const double RING_WIDEST = 2;      // that a mouth may be, in radii of its vessel

// Distances [mm] at which the rays square to `axis` leave the lumen about x: 0 where they do not within 1.2 RING_WIDEST radii and two voxels.
// direction, distance: (RING).
void rbt_ring_cast(const Tracker *t, Vec3 x, Vec3 axis, const LinkLight *light, double radius, Vec3 *direction, double *distance);
// Median of the distances up to `most`; 0 where fewer than half of the rays have one.
double rbt_ring_median(const double *distance, double most);
// The circle of least squares through the ring's edges up to `most`: its centre, from x, in the plane. False where a quarter of the ring has none.
bool rbt_ring_center(const Vec3 *direction, const double *distance, double most, Vec3 axis, Vec3 *offset);
// Radius over edge at the first nodes of the vessel that begins at `node`, median; 1 where none shows its edge.
double rbt_ring_scale(const Tracker *t, int node, const LinkLight *light);
// Measures the nodes that were set on voxels, along a path through the lumen where no cylinder fits: they move to the middle of what they see square to it.
void rbt_measure_set_nodes(Tracker *t);

#endif
