// Which nodes see a shared blob: the flood from its owner over near nodes whose power cells, widened by a margin, meet the blob's support.
// A point that stands up to the margin beyond its node's cell is therefore still answered by the whole field.
#ifndef SELDINGER_GEOM_BLOB_FLOOD_H
#define SELDINGER_GEOM_BLOB_FLOOD_H

#include "geom/vessel_tree.h"

#define BLOB_FLOOD_MARGIN 0.3    // of a cell's node's radius

typedef struct BlobFlood {   // memory of a flood; one a thread
    int node_count;          // N
    int stamp;
    int *mark;               // (N)
    int *node;               // (N) the nodes found, the owner first
} BlobFlood;

bool blob_flood_create(BlobFlood *flood, int node_count);
void blob_flood_free(BlobFlood *flood);
// The nodes that see a blob of `owner` at `center` with radius of support `reach` [mm], to flood->node; returns their number, at least 1.
int blob_flood_nodes(BlobFlood *flood, const VesselTree *tree, int owner, Vec3 center, double reach);
// Makes tree->seen_offset and tree->seen; needs the near lists. False where there is no memory for them.
bool blob_flood_list(VesselTree *tree);

#endif
