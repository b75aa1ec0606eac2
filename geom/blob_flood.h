// Computes which nodes evaluate ("see") a shared blob: a flood from its owner over near nodes whose power cells, widened by a margin, meet the blob's support.
// Because of the margin, the field is complete also for a point that lies up to the margin beyond its node's cell.
#ifndef SELDINGER_GEOM_BLOB_FLOOD_H
#define SELDINGER_GEOM_BLOB_FLOOD_H

#include "geom/vessel_tree.h"

#define BLOB_FLOOD_MARGIN 0.3    // relative to the radius of the cell's node

typedef struct BlobFlood {   // work memory of a flood; one per thread
    int node_count;          // N
    int stamp;
    int *mark;               // (N)
    int *node;               // (N) the nodes found, the owner first
} BlobFlood;

bool blob_flood_create(BlobFlood *flood, int node_count);
void blob_flood_free(BlobFlood *flood);
// Writes the nodes that see a blob of `owner` at `center` with radius of support `reach` [mm] to flood->node. Returns their number, at least 1.
int blob_flood_nodes(BlobFlood *flood, const VesselTree *tree, int owner, Vec3 center, double reach);
// Builds tree->seen_offset and tree->seen; requires the near lists. Returns false if out of memory.
bool blob_flood_list(VesselTree *tree);

#endif
