// Finds the node of least power distance (power_walk.h) in a large tree, for points that are located for the first time: bounding boxes of sixteen consecutive
// nodes, boxes of sixteen such boxes, and so on. The nodes of a tree are stored branch by branch, so the boxes are small. The result is that of power_nearest;
// with a hundred thousand nodes it takes a microsecond instead of a hundred.
// Owns its boxes; reads the tree, which must outlive it and not change.
#ifndef SELDINGER_GEOM_POWER_BLOCKS_H
#define SELDINGER_GEOM_POWER_BLOCKS_H

#include "geom/vessel_tree.h"

enum { POWER_BLOCK = 16, POWER_LEVELS = 8 };   // children of a box, and levels: 16^8 is more than INT_MAX

typedef struct PowerBox {
    Vec3 low, high;          // [mm] bounds of the centres
    double radius;           // [mm] largest radius
} PowerBox;

typedef struct PowerBlocks {
    const VesselTree *tree;
    int levels, count[POWER_LEVELS];      // number of boxes; level 0 has the smallest
    PowerBox *box[POWER_LEVELS];          // one allocation, owned by box[0]
} PowerBlocks;

// Returns false if out of memory; power_blocks_free must be called in either case.
bool power_blocks_create(PowerBlocks *blocks, const VesselTree *tree);
void power_blocks_free(PowerBlocks *blocks);
int power_blocks_nearest(const PowerBlocks *blocks, Vec3 x);
// The same node, sooner if `near` lies near x.
int power_blocks_nearest_from(const PowerBlocks *blocks, Vec3 x, int near);

#endif
