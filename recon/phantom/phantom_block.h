// Boxes of bone beside a synthetic vessel. Lengths mm.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_BLOCK_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_BLOCK_H

#include "geom/geom.h"

typedef struct ShapeBlock {  // a box
    Vec3 center, axis[3];    // unit, at right angles
    Vec3 half;               // edges along them [mm]
} ShapeBlock;
double shape_block_distance(const ShapeBlock *block, Vec3 x);   // signed, > 0 inside

#endif
