// Boxes of bone beside a synthetic vessel. Lengths in mm.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_BLOCK_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_BLOCK_H

#include "geom/geom.h"

typedef struct ShapeBlock {  // a box
    Vec3 center, axis[3];    // axis: orthogonal unit vectors
    Vec3 half;               // [mm] half lengths of the edges along the axes
} ShapeBlock;
double shape_block_distance(const ShapeBlock *block, Vec3 x);   // signed, > 0 inside

#endif
