#include "recon/fit_lanes.h"

#include "geom/simd.h"

#include <string.h>

typedef struct FitKernels {
    void (*sum)(const float *, const float *, const float *, int, int, const LaneBlob *, int, float *, float *, float *, float *);
    void (*columns)(const float *, const float *, const float *, int, int, const LaneBlob *, const float *, const float *, const float *, const float *,
                    const float *, float *, int);
    void (*gram)(const float *, int, int, float *);
    void (*mean)(const float *, const float *, const float *, const float *, const float *, int, const LaneBlob *, float (*)[FIELD_LANES]);
} FitKernels;

#define TARGET
#define KERNEL(name) name##_baseline
#include "recon/fit_kernel.inc"
#undef TARGET
#undef KERNEL
static const FitKernels baseline = {sum_baseline, columns_baseline, gram_baseline, mean_baseline};

#if defined(__x86_64__) && defined(__GNUC__)
#define TARGET __attribute__((target("avx2")))
#define KERNEL(name) name##_avx2
#include "recon/fit_kernel.inc"
#undef TARGET
#undef KERNEL
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512")))
#define KERNEL(name) name##_avx512
#include "recon/fit_kernel.inc"
#undef TARGET
#undef KERNEL
static const FitKernels avx2 = {sum_avx2, columns_avx2, gram_avx2, mean_avx2}, avx512 = {sum_avx512, columns_avx512, gram_avx512, mean_avx512};

static const FitKernels *kernels(void)
{
    static const FitKernels *const of[SIMD_COUNT] = {&baseline, &avx2, &avx512};
    return of[simd_level()];
}
#else
static const FitKernels *kernels(void) { return &baseline; }
#endif

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
