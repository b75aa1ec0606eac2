// The node of least power distance (power_walk.h) in a large tree, for points that are located for the first time: boxes about sixteen nodes that follow
// each other in the tree, boxes about sixteen such boxes, and so on. Nodes of a tree stand in the order of its branches, so that boxes are small. The
// answer is power_nearest's; a hundred thousand nodes cost a microsecond instead of a hundred.
// Owns its boxes; reads the tree it was made of, which must outlive it and not change.
#ifndef SELDINGER_GEOM_POWER_BLOCKS_H
#define SELDINGER_GEOM_POWER_BLOCKS_H

#include "geom/vessel_tree.h"

enum { POWER_BLOCK = 16, POWER_LEVELS = 8 };   // boxes in a box, and levels: 16^8 is more than an int counts

typedef struct PowerBox {
    Vec3 low, high;          // [mm] of the centres
    double radius;           // [mm] the largest
} PowerBox;

typedef struct PowerBlocks {
    const VesselTree *tree;
    int levels, count[POWER_LEVELS];      // of boxes, the smallest on level 0
    PowerBox *box[POWER_LEVELS];          // all in one piece, box[0]
} PowerBlocks;

// False where memory lacks; then free is due all the same.
bool power_blocks_create(PowerBlocks *blocks, const VesselTree *tree);
void power_blocks_free(PowerBlocks *blocks);
int power_blocks_nearest(const PowerBlocks *blocks, Vec3 x);

#endif
