#include "recon/fit/fit_lanes.h"

#include "base/base.h"

#include <string.h>

typedef struct FitKernels {
    void (*sum)(const float *, const float *, const float *, int, int, const LaneBlob *, int, float *, float *, float *, float *);
    void (*columns)(const float *, const float *, const float *, int, int, const LaneBlob *, const float *, const float *, const float *, const float *,
                    const float *, float *, int);
    void (*gram)(const float *, int, int, float *);
    void (*mean)(const float *, const float *, const float *, const float *, const float *, int, const LaneBlob *, float (*)[FIELD_LANES]);
} FitKernels;

#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
        sum_##set, columns_##set, gram_##set, mean_##set                                                                                                       \
    }

#define KERNEL_TEXT "recon/fit/fit_kernel.inc"
#include "base/each_simd.inc"
static const FitKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

static const FitKernels *kernels(void) { return &kernel_table[simd_level()]; }

void fit_lanes_sum(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, int count, float *f, float *const g[3])
{
    kernels()->sum(x, y, z, rows, sloped, blob, count, f, g[0], g[1], g[2]);
}

void fit_lanes_columns(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, const float *scale, const float *bend,
                       const float *const n[3], float *column, int stride)
{
    kernels()->columns(x, y, z, rows, sloped, blob, scale, bend, n[0], n[1], n[2], column, stride);
}

void fit_lanes_mean(const float *x, const float *y, const float *z, const float *weight, const float *value, int rows, const LaneBlob *ball,
                    float sum[4][FIELD_LANES])
{
    kernels()->mean(x, y, z, weight, value, rows, ball, sum);
}

void fit_lanes_gram(const float *row, int rows, int stride, float *product) { kernels()->gram(row, rows, stride, product); }
