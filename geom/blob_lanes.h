// A blobby model laid out for SIMD: groups of four blobs, one blob per lane, evaluated by one kernel compiled for SSE2, AVX2 and AVX-512 (foot_lanes.h has the
// table of kernels).
//
// Layout: a model is `count` groups of five vectors of four doubles; unused lanes hold a blob of weight 0. Every lane sums its blobs in the order of the
// groups, and the lanes are added in one fixed tree, so that every instruction set gives the same bits (no fused multiply-add: -ffp-contract=off). Lanes are
// blobs and not query points because each point has its own model. Four, because the median node of a fitted tree has four blobs: groups of eight left half of
// the lanes idle. With AVX-512, the groups of two points share a vector.
#ifndef SELDINGER_GEOM_BLOB_LANES_H
#define SELDINGER_GEOM_BLOB_LANES_H

#include "geom/blobby.h"

#include <stdint.h>

enum { BLOB_GROUP = 4, BLOB_GROUP_ALIGNMENT = 32 };

typedef struct BlobGroup {
    double cx[BLOB_GROUP] __attribute__((aligned(32)));   // centres [mm] …
    double cy[BLOB_GROUP], cz[BLOB_GROUP];
    double inverse[BLOB_GROUP];      // 1 / (5 rho^2)
    double rho[BLOB_GROUP];          // 0 in unused lanes
} BlobGroup;

static inline int blob_groups_needed(int64_t blobs) { return (int)((blobs + BLOB_GROUP - 1) / BLOB_GROUP); }
void blob_groups_fill(BlobGroup *group, const Blobby *model);

#endif
