// Tubes with known cross-sections on a helix, as test shapes: the wall is R(theta, t) in the plane across the curve. Internal to recon. Lengths mm.
//   star      five lobes of a tenth of the radius, which tapers from 1.2 to 0.8 mm
//   ellipse   half axes of 1.2 and 0.8 mm that turn once in 20 mm
//   kidney    half a ring of mean radius 0.9 and half width 0.5 mm with round ends: from its middle, some rays meet the wall three times
// Angles count from the helix's main normal. The helix has a bend radius of 4 mm and rises by 12 mm in two turns.
#ifndef SELDINGER_RECON_PHANTOM_SHAPED_TUBE_H
#define SELDINGER_RECON_PHANTOM_SHAPED_TUBE_H

#include "geom/geom.h"

typedef enum { SHAPED_STAR, SHAPED_ELLIPSE, SHAPED_KIDNEY } ShapedTube;

double shaped_tube_length(void);
// The wall's point at arc length t and angle theta (of the kidney: at theta/2 pi of the way around), and its unit normal into the lumen (may be NULL).
Vec3 shaped_tube_wall(ShapedTube tube, double t, double theta, Vec3 *normal);
// A tree of nodes every 0.5 mm with 60 wall points each, moved by normal noise along the normals. NULL if out of memory.
VesselTree *shaped_tube_sample(ShapedTube tube, double noise_mm, uint64_t seed);

#endif
