// Measures a vessel's wall by a ring of rays perpendicular to its axis, where no cylinder was fitted. Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_RING_H
#define SELDINGER_RECON_TRACK_RBT_RING_H

#include "recon/track/rbt_link_path.h"

enum { RING = 24 };
static const double RING_WIDEST = 2;      // largest width of an ostium, in radii of its vessel

// Casts rays perpendicular to `axis` and finds the distances [mm] at which they leave the lumen around x: 0 if they do not within 1.2 RING_WIDEST radii and
// two voxels. direction, distance: (RING).
void rbt_ring_cast(const Tracker *t, Vec3 x, Vec3 axis, const LinkLight *light, double radius, Vec3 *direction, double *distance);
// Median of the distances up to `most`; 0 if fewer than half of the rays have one.
double rbt_ring_median(const double *distance, double most);
// Fits a circle by least squares to the ring's edges up to `most`; `offset` is its centre, from x, in the plane. Returns false if a quarter of the ring has
// no edge.
bool rbt_ring_center(const Vec3 *direction, const double *distance, double most, Vec3 axis, Vec3 *offset);
// Median ratio of radius to edge distance at the first nodes of the vessel that begins at `node`; 1 if none has an edge.
double rbt_ring_scale(const Tracker *t, int node, const LinkLight *light);
// Measures the nodes that were placed on voxels along a path through the lumen where no cylinder fits: they move to the centre of their cross-section.
void rbt_measure_set_nodes(Tracker *t);

#endif
