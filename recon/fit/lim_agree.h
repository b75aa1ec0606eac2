// Computes points of the wall on which the local models of a fitted tree agree: the wall that a tool touches, with the models blended towards the borders of
// their cells (geom/vessel.h, LIM_BLEND). A second fit to these points and to the data brings neighbouring models together, also where the data have holes.
#ifndef SELDINGER_RECON_FIT_LIM_AGREE_H
#define SELDINGER_RECON_FIT_LIM_AGREE_H

#include "geom/geom.h"

enum { LIM_AGREED_MOST = 240 };   // largest number of points of a node

// Returns true if x lies in the power cell of `node` among the nodes near it, ignoring the node `spared` (-1: none).
bool lim_is_in_cell(const VesselTree *tree, int node, int spared, Vec3 x);
// Returns two unit vectors that form a frame with the node's direction, fixed to its points: a rotated or mirrored tree has rotated or mirrored frames.
void lim_frame(const VesselTree *tree, int node, Vec3 *e1, Vec3 *e2);
// Computes points of the agreed wall in each node's cell: point (N, LIM_AGREED_MOST), count (N), and the largest distance of the node's own wall from them:
// differs (N) [mm]. The caller provides the arrays. Returns false if out of memory. The result does not depend on `threads` (0: all cores).
bool lim_agree(const VesselTree *model, int threads, Vec3 *point, int *count, double *differs);

#endif
