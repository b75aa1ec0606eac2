// The inner loops of the whole-tree fit, over one node's rows, compiled for each instruction set (base/simd.h). All versions give the same bits.
#ifndef SELDINGER_RECON_FIT_FIT_LANES_H
#define SELDINGER_RECON_FIT_FIT_LANES_H

#include <stdint.h>

enum { FIELD_LANES = 16, FIT_ENTRIES = 8, FIT_ROWS = 256 };

// A blob whose centre is relative to a node's centre [mm].
typedef struct LaneBlob {
    float x, y, z, reach, amplitude;
} LaneBlob;

// Adds the blobs' field to f, and their gradient to g[0..2] for the first `sloped` rows. Counts are multiples of FIELD_LANES.
void fit_lanes_sum(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, int count, float *f, float *const g[3]);
// A node's scales: radius r, knee of the loss and least |g| [mm, mm, 1/mm], and weight of the slope [mm].
typedef struct FitScale {
    double radius, knee, least_slope, bend;
} FitScale;

// The squares of the rows, with their weights: of data f/|g|, by Geman and McClure's loss e^2 / (1 + e^2/knee^2), and bend (r|g|/2 - 1); of guards scale times
// the distance from [low, high].
void fit_lanes_losses(const float *f, float *const g[3], const float *weight, int rows, const FitScale *scale, double *loss);
void fit_lanes_guard_losses(const float *f, const float *low, const float *high, const float *weight, int rows, double scale, double *loss);
// The linearisation of data: factors of the derivatives of f and of n.g, the residuals of both, and the direction n of g. The loss's weight is held.
void fit_lanes_weigh(const float *f, float *const g[3], const float *weight, int rows, const FitScale *by, float *scale, float *bend, float *residual,
                     float *off, float *const n[3]);
// Computes the derivatives by a blob's amplitude, centre (in units of its reach) and logarithm of its reach: five columns, each of `rows` entries scale * df,
// then of `sloped` entries bend * d(n.g). `stride` is the number of entries from column to column.
void fit_lanes_columns(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, const float *scale, const float *bend,
                       const float *const n[3], float *column, int stride);
// A blob's derivatives in a tile, row by row.
typedef struct FitRows {
    float row[FIT_ROWS][FIT_ENTRIES];   // five derivatives, the residual, two zeros; only live rows are set
    uint64_t live[FIT_ROWS / 64];       // bit i: row i is not zero
} FitRows;

// Fills a blob's rows from its five columns and the tile's residuals.
void fit_lanes_transpose(const float *column, int stride, const float *residual, int rows, FitRows *to);
// Computes product = J'K for the rows J of one blob and K of another one; column 5 is J' times the residual.
void fit_lanes_product(const FitRows *left, const FitRows *right, int rows, float product[5][FIT_ENTRIES]);
// Sums over a tile's data within `reach` of (x, y, z): m w, m w^2, m w e, m w e^2, with m the weights, w = (1 - d^2/reach^2)^3 and e the values. Counts as above. Adds to `sum`,
// lane by lane.
void fit_lanes_mean(const float *x, const float *y, const float *z, const float *weight, const float *value, int rows, const LaneBlob *ball,
                    float sum[4][FIELD_LANES]);

#endif
