// The inner loops of the whole-tree fit, over one node's rows, compiled for each instruction set (base/simd.h). All versions give the same bits.
#ifndef SELDINGER_RECON_FIT_FIT_LANES_H
#define SELDINGER_RECON_FIT_FIT_LANES_H

enum { FIELD_LANES = 16 };

// A blob whose centre is relative to a node's centre [mm].
typedef struct LaneBlob {
    float x, y, z, reach, amplitude;
} LaneBlob;

// Adds the blobs' field to f, and their gradient to g[0..2] for the first `sloped` rows. Counts are multiples of FIELD_LANES.
void fit_lanes_sum(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, int count, float *f, float *const g[3]);
// Computes the derivatives by a blob's amplitude, centre (in units of its reach) and logarithm of its reach: five columns, each of `rows` entries scale * df,
// then of `sloped` entries bend * d(n.g). `stride` is the number of entries from column to column.
void fit_lanes_columns(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, const float *scale, const float *bend,
                       const float *const n[3], float *column, int stride);
// Computes product (stride, stride) = J'J for J (rows, stride); stride is a multiple of FIELD_LANES. Only the upper triangle is valid.
void fit_lanes_gram(const float *row, int rows, int stride, float *product);
// Sums over a tile's data within `reach` of (x, y, z): w, w^2, w e, w e^2, with w = (1 - d^2/reach^2)^3 and e the values. Counts as above. Adds to `sum`,
// lane by lane.
void fit_lanes_mean(const float *x, const float *y, const float *z, const float *weight, const float *value, int rows, const LaneBlob *ball,
                    float sum[4][FIELD_LANES]);

#endif
