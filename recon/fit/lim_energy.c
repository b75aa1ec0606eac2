// Kerrien et al. 2017, 4.2: E = E_d + alpha E_c + beta E_a,
//   E_d = sum w_i e_i^2 (eq. 4),  E_a = sum b_i kappa_i^2 (eq. 6),  kappa = N / (2 |g|^3), N = g'Hg - |g|^2 tr H (eq. 5),
//   E_c = 1/(N(N-1)) sum_{j != k} x^12 - 2 x^6, x = s sqrt(rho_j rho_k) / |C_j - C_k| (eq. 7).
// Derivatives with d = P - C, q = |d|^2 / (5 rho^2), u = 1/(1+q), a = -4u^3/(5 rho), b = 24u^4/(25 rho^3), c = -192u^5/(125 rho^5):
//   by C:    df = -a d,  dg_m = -(a e_m + b d_m d),  v = Hg - tr(H) g,
//            dN = -[2(a v + b d (d.v)) + b|g|^2 d + 2b(g.d) g + c(g.d)^2 d - |g|^2 (5b + c|d|^2) d]
//   by rho:  df = u^2 + 4 q u^3,  a' = (4/5) u^3 (1 - 6 q u) / rho^2,  b' = (24/25) u^4 (8 q u - 3) / rho^4,
//            dg = a' d,  dN = 2a'(d.v) + b'(g.d)^2 - |g|^2 (2a' + b'|d|^2)
//   dkappa = dN / (2|g|^3) - 3 kappa g.dg / |g|^2
#include "recon/fit/lim_energy.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

enum { ARRAYS = 20, SOLVE_ROWS = 8 };
// squared gradient below which the direction is undefined, so the curvature gets almost no weight
static const float LEAST_GRADIENT2 = 1e-8f;

// The kernel's source is compiled three times; base/simd.h chooses the version that runs. No fused multiply-add (-ffp-contract=off) and one accumulator per
// lane, so all versions give the same bits.
typedef struct LimKernels {
    void (*add)(LimPoints *, const LimBlob *, double);
    void (*sum)(LimPoints *, const LimBlob *, int, double);
    void (*taubin)(const LimPoints *, float *);
    void (*approach)(LimPoints *, float, float);
    void (*feet)(LimPoints *, float, float *, float *);
    void (*moving_energy)(const LimPoints *, const LimBlob *, float (*)[LIM_LANES]);
    void (*total_energy)(const LimPoints *, float (*)[LIM_LANES]);
    void (*residuals)(const LimPoints *, float, float *);
    void (*columns)(const LimPoints *, const LimBlob *, float, float *);
    void (*gram)(const float *, const float *, size_t, int, double *, size_t);
    void (*dot_lanes)(const float *, const float *, int, float *);
    bool (*solve)(double *, int, int, double *);
} LimKernels;
#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
        add_##set, sum_##set, taubin_##set, approach_##set, feet_##set, moving_energy_##set, total_energy_##set, residuals_##set, columns_##set, gram_##set,   \
            dot_lanes_##set, solve_##set                                                                                                                       \
    }

#define KERNEL_TEXT "recon/fit/lim_energy_kernel.inc"
#include "base/each_simd.inc"
static const LimKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

static const LimKernels *kernels(void) { return &kernel_table[simd_level()]; }

bool lim_points_create(LimPoints *points, int count)
{
    *points = (LimPoints){.count = count, .padded = (count + LIM_LANES - 1) / LIM_LANES * LIM_LANES};
    size_t n = (size_t)points->padded;
    points->memory = aligned_alloc(64, (n * ARRAYS + LIM_LANES) * sizeof(float));
    if (!points->memory)
        return false;
    memset(points->memory, 0, (n * ARRAYS + LIM_LANES) * sizeof(float));
    float *next = points->memory;
    float **array[ARRAYS] = {&points->x,    &points->y,    &points->z,    &points->f,        &points->g[0],     &points->g[1],    &points->g[2],
                             &points->h[0], &points->h[1], &points->h[2], &points->h[3],     &points->h[4],     &points->h[5],    &points->weight,
                             &points->bend, &points->low,  &points->high, &points->given[0], &points->given[1], &points->given[2]};
    for (int i = 0; i < ARRAYS; i++, next += n)
        *array[i] = next;
    return true;
}

void lim_points_free(LimPoints *points)
{
    free(points->memory);
    *points = (LimPoints){0};
}

void lim_points_add(LimPoints *points, const LimBlob *blob, double sign) { kernels()->add(points, blob, sign); }

void lim_points_sum(LimPoints *points, const LimBlob *blobs, int count, double iso_level) { kernels()->sum(points, blobs, count, iso_level); }

void lim_points_taubin(const LimPoints *points, float *distance) { kernels()->taubin(points, distance); }

void lim_points_approach(LimPoints *points, double longest, double slide) { kernels()->approach(points, (float)longest, (float)slide); }

void lim_points_feet(LimPoints *points, double radius, float *offset, float *slope) { kernels()->feet(points, (float)radius, offset, slope); }

// Adds the lanes of an accumulator in double precision by halves, always in this order.
static double add_lanes(const float *lane)
{
    double half[LIM_LANES / 2];
    for (int l = 0; l < LIM_LANES / 2; l++)
        half[l] = (double)lane[l] + (double)lane[l + LIM_LANES / 2];
    for (int l = 0; l < LIM_LANES / 4; l++)
        half[l] += half[l + LIM_LANES / 4];
    return (half[0] + half[2]) + (half[1] + half[3]);
}

LimEnergy lim_energy(const LimPoints *points, const LimBlob *blob)
{
    float sum[10][LIM_LANES] = {{0}};
    kernels()->moving_energy(points, blob, sum);
    LimEnergy energy = {.distance = add_lanes(sum[0]), .bend = add_lanes(sum[5])};
    for (int k = 0; k < 4; k++) {
        energy.distance_slope[k] = add_lanes(sum[1 + k]);
        energy.bend_slope[k] = add_lanes(sum[6 + k]);
    }
    return energy;
}

void lim_energy_total(const LimPoints *points, double *distance, double *bend)
{
    float sum[2][LIM_LANES] = {{0}};
    kernels()->total_energy(points, sum);
    *distance = add_lanes(sum[0]);
    *bend = add_lanes(sum[1]);
}

void lim_energy_residuals(const LimPoints *points, double beta, float *residual) { kernels()->residuals(points, (float)beta, residual); }

void lim_energy_columns(const LimPoints *points, const LimBlob *blob, double beta, float *column) { kernels()->columns(points, blob, (float)beta, column); }

double lim_energy_dot(const float *a, const float *b, int padded)
{
    float lane[LIM_LANES] = {0};
    kernels()->dot_lanes(a, b, padded, lane);
    return add_lanes(lane);
}

void lim_energy_gram(const float *rows, const float *columns, size_t stride, int length, double *dot, size_t dot_stride)
{
    kernels()->gram(rows, columns, stride, length, dot, dot_stride);
}

bool lim_solve(double *factor, int size, int stride, double *step) { return kernels()->solve(factor, size, stride, step); }

double lim_cohesion(const LimBlob *blobs, int count, int j, double s, double slope[4])
{
    for (int k = 0; k < 4; k++)
        slope[k] = 0;
    if (count < 2)
        return 0;
    double sum = 0, share = 2.0 / ((double)count * (count - 1));
    const LimBlob *a = &blobs[j];
    for (int k = 0; k < count; k++) {
        if (k == j)
            continue;
        const LimBlob *b = &blobs[k];
        double d[3], d2 = 1e-12;
        for (int m = 0; m < 3; m++) {
            d[m] = a->center[m] - b->center[m];
            d2 += d[m] * d[m];
        }
        double x2 = s * s * a->width * b->width / d2, x6 = x2 * x2 * x2, by_x2 = 6 * x6 * (x6 - 1) / x2;   // d(x^12 - 2 x^6) / d(x^2)
        sum += x6 * x6 - 2 * x6;
        for (int m = 0; m < 3; m++)
            slope[m] -= by_x2 * 2 * x2 / d2 * d[m];
        slope[3] += by_x2 * x2 / a->width;
    }
    for (int k = 0; k < 4; k++)
        slope[k] *= share;
    return share * sum;
}

double lim_cohesion_total(const LimBlob *blobs, int count, double s)
{
    double sum = 0, slope[4];
    for (int j = 0; j < count; j++)
        sum += lim_cohesion(blobs, count, j, s, slope);
    return sum / 2;
}
