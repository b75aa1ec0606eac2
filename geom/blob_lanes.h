// The hot form of a blobby model: groups of eight blobs, one blob a lane, evaluated by one kernel compiled for SSE2, AVX2 and AVX-512
// (foot_lanes.h has the table of kernels).
//
// Layout: a model is `count` groups, each seven vectors of eight doubles; unused lanes hold a blob of no weight. Every lane sums its blobs in
// the order of the groups, and the lanes are added by one fixed tree, so that every instruction set gives the same bits (no fused
// multiply-add: -ffp-contract=off). Lanes are blobs and not query points because each point has a model of its own.
#ifndef SELDINGER_GEOM_BLOB_LANES_H
#define SELDINGER_GEOM_BLOB_LANES_H

#include "geom/blobby.h"

#include <stdint.h>

enum { BLOB_GROUP_ALIGNMENT = 64 };

typedef struct BlobGroup {
    double cx[8] __attribute__((aligned(64)));   // centres [mm] …
    double cy[8], cz[8];
    double inverse[8];       // 1 / (5 rho^2)
    double rho[8], a[8], b[8];   // rho, -4/(5 rho), 24/(25 rho^3); all 0 in unused lanes
} BlobGroup;

static inline int blob_groups_needed(int64_t blobs) { return (int)((blobs + 7) / 8); }
void blob_groups_fill(BlobGroup *group, const Blobby *model);

#endif
