// The inner loops of the whole-tree fit, over one node's rows, compiled for each instruction set (geom/simd.h); all give the same bits.
#ifndef SELDINGER_RECON_FIELD_LANES_H
#define SELDINGER_RECON_FIELD_LANES_H

// A blob as seen from a node: its centre relative to the node's [mm].
typedef struct LaneBlob {
    float x, y, z, reach, amplitude;
} LaneBlob;

// Adds the blobs' field to f, and their gradient to g[0..2] of the first `sloped` rows; counts are multiples of FIELD_LANES.
void field_lanes_sum(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, int count, float *f, float *const g[3]);
// Derivatives by a blob's amplitude, centre (in units of its reach) and logarithm of its reach: five columns, each of `rows` entries scale * df, then of
// `sloped` entries bend * d(n.g). `stride` entries from column to column.
void field_lanes_columns(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, const float *scale, const float *bend,
                         const float *const n[3], float *column, int stride);

#endif
