#include "recon/fit/fit_lanes.h"

#include "base/base.h"

#include <string.h>

typedef struct FitKernels {
    void (*sum)(const float *, const float *, const float *, int, int, const LaneBlob *, int, float *, float *, float *, float *);
    void (*losses)(const float *, const float *, const float *, const float *, const float *, int, const FitScale *, double *);
    void (*guard_losses)(const float *, const float *, const float *, const float *, int, double, double *);
    void (*weigh)(const float *, const float *, const float *, const float *, const float *, int, const FitScale *, float *, float *, float *, float *, float *,
                  float *, float *);
    void (*columns)(const float *, const float *, const float *, int, int, const LaneBlob *, const float *, const float *, const float *, const float *,
                    const float *, float *, int);
    void (*transpose)(const float *, int, const float *, int, float (*)[FIT_ENTRIES], uint64_t *);
    void (*product)(const FitRows *, const FitRows *, int, float (*)[FIT_ENTRIES]);
    void (*mean)(const float *, const float *, const float *, const float *, const float *, int, const LaneBlob *, float (*)[FIELD_LANES]);
} FitKernels;

#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
        sum_##set, losses_##set, guard_losses_##set, weigh_##set, columns_##set, transpose_##set, product_##set, mean_##set                                    \
    }

#define KERNEL_TEXT "recon/fit/fit_kernel.inc"
#include "base/each_simd.inc"
static const FitKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

static const FitKernels *kernels(void) { return &kernel_table[simd_level()]; }

void fit_lanes_sum(const float *x, const float *y, const float *z, int rows, int sloped, const LaneBlob *blob, int count, float *f, float *const g[3])
{
    kernels()->sum(x, y, z, rows, sloped, blob, count, f, g[0], g[1], g[2]);
}

void fit_lanes_losses(const float *f, float *const g[3], const float *weight, int rows, const FitScale *scale, double *loss)
{
    kernels()->losses(f, g[0], g[1], g[2], weight, rows, scale, loss);
}

void fit_lanes_guard_losses(const float *f, const float *low, const float *high, const float *weight, int rows, double scale, double *loss)
{
    kernels()->guard_losses(f, low, high, weight, rows, scale, loss);
}

void fit_lanes_weigh(const float *f, float *const g[3], const float *weight, int rows, const FitScale *by, float *scale, float *bend, float *residual,
                     float *off, float *const n[3])
{
    kernels()->weigh(f, g[0], g[1], g[2], weight, rows, by, scale, bend, residual, off, n[0], n[1], n[2]);
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

void fit_lanes_transpose(const float *column, int stride, const float *residual, int rows, FitRows *to)
{
    kernels()->transpose(column, stride, residual, rows, to->row, to->live);
}

void fit_lanes_product(const FitRows *left, const FitRows *right, int rows, float product[5][FIT_ENTRIES]) { kernels()->product(left, right, rows, product); }
