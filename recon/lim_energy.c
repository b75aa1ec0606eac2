// Kerrien et al. 2017, 4.2: E = E_d + alpha E_c + beta E_a,
//   E_d = sum w_i e_i^2 (eq. 4),  E_a = sum b_i kappa_i^2 (eq. 6),  kappa = N / (2 |g|^3), N = g'Hg - |g|^2 tr H (eq. 5),
//   E_c = 1/(N(N-1)) sum_{j != k} x^12 - 2 x^6, x = s sqrt(rho_j rho_k) / |C_j - C_k| (eq. 7).
// Derivatives with d = P - C, q = |d|^2 / (5 rho^2), u = 1/(1+q), a = -4u^3/(5 rho), b = 24u^4/(25 rho^3), c = -192u^5/(125 rho^5):
//   by C:    df = -a d,  dg_m = -(a e_m + b d_m d),  v = Hg - tr(H) g,
//            dN = -[2(a v + b d (d.v)) + b|g|^2 d + 2b(g.d) g + c(g.d)^2 d - |g|^2 (5b + c|d|^2) d]
//   by rho:  df = u^2 + 4 q u^3,  a' = (4/5) u^3 (1 - 6 q u) / rho^2,  b' = (24/25) u^4 (8 q u - 3) / rho^4,
//            dg = a' d,  dN = 2a'(d.v) + b'(g.d)^2 - |g|^2 (2a' + b'|d|^2)
//   dkappa = dN / (2|g|^3) - 3 kappa g.dg / |g|^2
#include "recon/lim_energy.h"

#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define KERNEL
#endif

enum { ARRAYS = 17 };
// a gradient as short as this has no direction: its curvature counts nothing much
static const float LEAST_GRADIENT2 = 1e-8f;

bool lim_points_create(LimPoints *points, int count)
{
    *points = (LimPoints){.count = count, .padded = (count + LIM_LANES - 1) / LIM_LANES * LIM_LANES};
    size_t n = (size_t)points->padded;
    points->memory = aligned_alloc(64, (n * ARRAYS + LIM_LANES) * sizeof(float));
    if (!points->memory)
        return false;
    memset(points->memory, 0, (n * ARRAYS + LIM_LANES) * sizeof(float));
    float *next = points->memory;
    float **array[ARRAYS] = {&points->x,    &points->y,    &points->z,    &points->f,      &points->g[0], &points->g[1],
                             &points->g[2], &points->h[0], &points->h[1], &points->h[2],   &points->h[3], &points->h[4],
                             &points->h[5], &points->weight, &points->bend, &points->low, &points->high};
    for (int i = 0; i < ARRAYS; i++, next += n)
        *array[i] = next;
    return true;
}

void lim_points_free(LimPoints *points)
{
    free(points->memory);
    *points = (LimPoints){0};
}

void lim_points_reset(LimPoints *points, double iso_level)
{
    size_t bytes = (size_t)points->padded * sizeof(float);
    for (int i = 0; i < points->padded; i++)
        points->f[i] = (float)-iso_level;
    for (int k = 0; k < 3; k++)
        memset(points->g[k], 0, bytes);
    for (int k = 0; k < 6; k++)
        memset(points->h[k], 0, bytes);
}

KERNEL void lim_points_add(LimPoints *points, const LimBlob *blob, double sign)
{
    const float *restrict x = points->x, *restrict y = points->y, *restrict z = points->z;
    float *const sum[10] = {points->f,    points->g[0], points->g[1], points->g[2], points->h[0],
                            points->h[1], points->h[2], points->h[3], points->h[4], points->h[5]};
    float cx = (float)blob->center[0], cy = (float)blob->center[1], cz = (float)blob->center[2], rho = (float)blob->width, sg = (float)sign;
    float iq = 1 / (5 * rho * rho), ka = 0.8f / rho, kb = 0.96f / (rho * rho * rho);
    // a block's terms first, then added array by array: written in one loop, gcc checks 10 x 13 pairs of arrays for overlap and gives up
    for (int base = 0; base < points->padded; base += LIM_LANES) {
        float term[10][LIM_LANES];
        for (int l = 0; l < LIM_LANES; l++) {
            float dx = x[base + l] - cx, dy = y[base + l] - cy, dz = z[base + l] - cz, d2 = dx * dx + dy * dy + dz * dz;
            float u = 1 / (1 + d2 * iq), u2 = u * u, a = -sg * ka * (u2 * u), b = sg * kb * (u2 * u2);
            term[0][l] = sg * rho * u2;
            term[1][l] = a * dx;
            term[2][l] = a * dy;
            term[3][l] = a * dz;
            term[4][l] = a + b * dx * dx;
            term[5][l] = b * dx * dy;
            term[6][l] = b * dx * dz;
            term[7][l] = a + b * dy * dy;
            term[8][l] = b * dy * dz;
            term[9][l] = a + b * dz * dz;
        }
        for (int k = 0; k < 10; k++) {
            float *restrict to = sum[k] + base;
            for (int l = 0; l < LIM_LANES; l++)
                to[l] += term[k][l];
        }
    }
}

KERNEL void lim_points_sum(LimPoints *points, const LimBlob *blobs, int count, double iso_level)
{
    const float *restrict x = points->x, *restrict y = points->y, *restrict z = points->z;
    float *const sum[10] = {points->f,    points->g[0], points->g[1], points->g[2], points->h[0],
                            points->h[1], points->h[2], points->h[3], points->h[4], points->h[5]};
    for (int base = 0; base < points->padded; base += LIM_LANES) {
        float term[10][LIM_LANES] = {{0}};
        for (int l = 0; l < LIM_LANES; l++)
            term[0][l] = (float)-iso_level;
        for (int j = 0; j < count; j++) {
            const LimBlob *blob = &blobs[j];
            float cx = (float)blob->center[0], cy = (float)blob->center[1], cz = (float)blob->center[2], rho = (float)blob->width;
            float iq = 1 / (5 * rho * rho), ka = 0.8f / rho, kb = 0.96f / (rho * rho * rho);
            for (int l = 0; l < LIM_LANES; l++) {
                float dx = x[base + l] - cx, dy = y[base + l] - cy, dz = z[base + l] - cz, d2 = dx * dx + dy * dy + dz * dz;
                float u = 1 / (1 + d2 * iq), u2 = u * u, a = -ka * (u2 * u), b = kb * (u2 * u2);
                term[0][l] += rho * u2;
                term[1][l] += a * dx;
                term[2][l] += a * dy;
                term[3][l] += a * dz;
                term[4][l] += a + b * dx * dx;
                term[5][l] += b * dx * dy;
                term[6][l] += b * dx * dz;
                term[7][l] += a + b * dy * dy;
                term[8][l] += b * dy * dz;
                term[9][l] += a + b * dz * dz;
            }
        }
        for (int k = 0; k < 10; k++)
            memcpy(sum[k] + base, term[k], sizeof term[k]);
    }
}

KERNEL void lim_points_taubin(const LimPoints *points, float *distance)
{
    const float *restrict f = points->f, *restrict gx = points->g[0], *restrict gy = points->g[1], *restrict gz = points->g[2];
    for (int i = 0; i < points->padded; i++) {
        float g2 = gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i] + LEAST_GRADIENT2;
        distance[i] = f[i] / sqrtf(g2);
    }
}

// Adds the lanes of an accumulator in their order, in double.
static double add_lanes(const float *lane)
{
    double sum = 0;
    for (int l = 0; l < LIM_LANES; l++)
        sum += (double)lane[l];
    return sum;
}

KERNEL static void moving_energy(const LimPoints *p, const LimBlob *blob, float (*restrict sum)[LIM_LANES])
{
    const float *restrict x = p->x, *restrict y = p->y, *restrict z = p->z, *restrict still = p->f;
    const float *restrict sx = p->g[0], *restrict sy = p->g[1], *restrict sz = p->g[2];
    const float *restrict sxx = p->h[0], *restrict sxy = p->h[1], *restrict sxz = p->h[2], *restrict syy = p->h[3], *restrict syz = p->h[4],
                          *restrict szz = p->h[5];
    const float *restrict weight = p->weight, *restrict bend = p->bend, *restrict low = p->low, *restrict high = p->high;
    float cx = (float)blob->center[0], cy = (float)blob->center[1], cz = (float)blob->center[2], rho = (float)blob->width;
    float r2 = rho * rho, iq = 1 / (5 * r2), ka = 0.8f / rho, kb = 0.96f / (r2 * rho), kc = 1.536f / (r2 * r2 * rho);
    float ka1 = 0.8f / r2, kb1 = 0.96f / (r2 * r2);
    for (int base = 0; base < p->padded; base += LIM_LANES) {
        for (int l = 0; l < LIM_LANES; l++) {
            int i = base + l;
            float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz, d2 = dx * dx + dy * dy + dz * dz;
            float q = d2 * iq, u = 1 / (1 + q), u2 = u * u, u3 = u2 * u, u4 = u2 * u2;
            float a = -ka * u3, b = kb * u4, c = -kc * (u4 * u), a1 = ka1 * u3 * (1 - 6 * q * u), b1 = kb1 * u4 * (8 * q * u - 3);
            float f = still[i] + rho * u2, gx = sx[i] + a * dx, gy = sy[i] + a * dy, gz = sz[i] + a * dz;
            float hxx = sxx[i] + a + b * dx * dx, hxy = sxy[i] + b * dx * dy, hxz = sxz[i] + b * dx * dz;
            float hyy = syy[i] + a + b * dy * dy, hyz = syz[i] + b * dy * dz, hzz = szz[i] + a + b * dz * dz;
            float inside = f < low[i] ? low[i] : f, welcome = inside > high[i] ? high[i] : inside;
            float e = f - welcome, we = 2 * weight[i] * e, pull = -we * a;
            float g2 = gx * gx + gy * gy + gz * gz + LEAST_GRADIENT2, trace = hxx + hyy + hzz;
            float vx = hxx * gx + hxy * gy + hxz * gz, vy = hxy * gx + hyy * gy + hyz * gz, vz = hxz * gx + hyz * gy + hzz * gz;
            float n = gx * vx + gy * vy + gz * vz - g2 * trace;
            float inverse = 1 / g2, half_cube = 0.5f * inverse * sqrtf(inverse), kappa = n * half_cube;
            vx -= trace * gx;
            vy -= trace * gy;
            vz -= trace * gz;
            float dv = dx * vx + dy * vy + dz * vz, gd = gx * dx + gy * dy + gz * dz;
            float on_d = 2 * b * dv + b * g2 + c * gd * gd - g2 * (5 * b + c * d2), on_g = 2 * b * gd, on_v = 2 * a;
            float wk = 2 * bend[i] * kappa, three = 3 * kappa * inverse;
            float along_v = -half_cube * on_v, along_g = three * a - half_cube * on_g, along_d = three * b * gd - half_cube * on_d;
            sum[0][l] += weight[i] * e * e;
            sum[1][l] += pull * dx;
            sum[2][l] += pull * dy;
            sum[3][l] += pull * dz;
            sum[4][l] += we * (u2 + 4 * q * u3);
            sum[5][l] += bend[i] * kappa * kappa;
            sum[6][l] += wk * (along_v * vx + along_g * gx + along_d * dx);
            sum[7][l] += wk * (along_v * vy + along_g * gy + along_d * dy);
            sum[8][l] += wk * (along_v * vz + along_g * gz + along_d * dz);
            sum[9][l] += wk * (half_cube * (2 * a1 * dv + b1 * gd * gd - g2 * (2 * a1 + b1 * d2)) - three * a1 * gd);
        }
    }
}

LimEnergy lim_energy(const LimPoints *points, const LimBlob *blob)
{
    float sum[10][LIM_LANES] = {{0}};
    moving_energy(points, blob, sum);
    LimEnergy energy = {.distance = add_lanes(sum[0]), .bend = add_lanes(sum[5])};
    for (int k = 0; k < 4; k++) {
        energy.distance_slope[k] = add_lanes(sum[1 + k]);
        energy.bend_slope[k] = add_lanes(sum[6 + k]);
    }
    return energy;
}

KERNEL static void total_energy(const LimPoints *p, float (*restrict sum)[LIM_LANES])
{
    const float *restrict sf = p->f, *restrict sx = p->g[0], *restrict sy = p->g[1], *restrict sz = p->g[2];
    const float *restrict sxx = p->h[0], *restrict sxy = p->h[1], *restrict sxz = p->h[2], *restrict syy = p->h[3], *restrict syz = p->h[4],
                          *restrict szz = p->h[5];
    const float *restrict weight = p->weight, *restrict bend = p->bend, *restrict low = p->low, *restrict high = p->high;
    for (int base = 0; base < p->padded; base += LIM_LANES) {
        for (int l = 0; l < LIM_LANES; l++) {
            int i = base + l;
            float f = sf[i], gx = sx[i], gy = sy[i], gz = sz[i];
            float inside = f < low[i] ? low[i] : f, welcome = inside > high[i] ? high[i] : inside, e = f - welcome;
            float g2 = gx * gx + gy * gy + gz * gz + LEAST_GRADIENT2, inverse = 1 / g2;
            float vx = sxx[i] * gx + sxy[i] * gy + sxz[i] * gz, vy = sxy[i] * gx + syy[i] * gy + syz[i] * gz,
                  vz = sxz[i] * gx + syz[i] * gy + szz[i] * gz;
            float n = gx * vx + gy * vy + gz * vz - g2 * (sxx[i] + syy[i] + szz[i]), kappa = n * (0.5f * inverse * sqrtf(inverse));
            sum[0][l] += weight[i] * e * e;
            sum[1][l] += bend[i] * kappa * kappa;
        }
    }
}

void lim_energy_total(const LimPoints *points, double *distance, double *bend)
{
    float sum[2][LIM_LANES] = {{0}};
    total_energy(points, sum);
    *distance = add_lanes(sum[0]);
    *bend = add_lanes(sum[1]);
}

KERNEL void lim_energy_residuals(const LimPoints *p, float *residual)
{
    const float *restrict f = p->f, *restrict weight = p->weight, *restrict low = p->low, *restrict high = p->high;
    float *restrict out = residual;
    for (int i = 0; i < p->padded; i++) {
        float inside = f[i] < low[i] ? low[i] : f[i], welcome = inside > high[i] ? high[i] : inside;
        out[i] = sqrtf(weight[i]) * (f[i] - welcome);
    }
}

KERNEL void lim_energy_columns(const LimPoints *p, const LimBlob *blob, float *column)
{
    const float *restrict x = p->x, *restrict y = p->y, *restrict z = p->z, *restrict f = p->f;
    const float *restrict weight = p->weight, *restrict low = p->low, *restrict high = p->high;
    size_t n = (size_t)p->padded;
    float *restrict by_x = column, *restrict by_y = column + n, *restrict by_z = column + 2 * n, *restrict by_rho = column + 3 * n;
    float cx = (float)blob->center[0], cy = (float)blob->center[1], cz = (float)blob->center[2], rho = (float)blob->width;
    float iq = 1 / (5 * rho * rho), ka = 0.8f / rho;
    for (int i = 0; i < p->padded; i++) {
        float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz, q = (dx * dx + dy * dy + dz * dz) * iq, u = 1 / (1 + q), u2 = u * u, u3 = u2 * u;
        // a residual between its bounds has no slope; data (bounds 0, 0) always have
        float active = (f[i] < low[i] ? 1.0f : 0.0f) + (f[i] >= high[i] ? 1.0f : 0.0f);
        float w = sqrtf(weight[i]) * active, a = w * ka * u3;
        by_x[i] = a * dx;
        by_y[i] = a * dy;
        by_z[i] = a * dz;
        by_rho[i] = w * (u2 + 4 * q * u3);
    }
}

KERNEL static void dot_lanes(const float *restrict a, const float *restrict b, int padded, float *restrict lane)
{
    for (int base = 0; base < padded; base += LIM_LANES)
        for (int l = 0; l < LIM_LANES; l++)
            lane[l] += a[base + l] * b[base + l];
}

double lim_energy_dot(const float *a, const float *b, int padded)
{
    float lane[LIM_LANES] = {0};
    dot_lanes(a, b, padded, lane);
    return add_lanes(lane);
}

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
