// s(x) = sum_ijk v_ijk b(x - i) b(y - j) b(z - k), b the cubic B-spline: with t = x - floor(x) the four weights are
// (1-t)^3 / 6, (4 - 6 t^2 + 3 t^3) / 6, (4 - 6 u^2 + 3 u^3) / 6 with u = 1 - t, t^3 / 6.
// Floats suffice: 64 products of values known to a few digits. A row's four taps are four lanes, joined at the end: rows are added along y, then slices
// along z, then lanes, always in this order, so that a sample has the same bits on every instruction set, alone or in a line.
//
// Lines are sampled in blocks: positions and cells of a block at once, then sample by sample with the cell's taps in registers, which the next sample
// mostly shares (a ray takes ten samples per voxel). Lanes of different samples would have to gather each of their 64 taps.
#include "recon/volume/bspline.h"
#include "base/base.h"

#include <string.h>

typedef float Row __attribute__((vector_size(16)));

// Weights of the taps at -1, 0, 1, 2 from the cell; `t` is the position within the cell, 0 to 1.
INLINE void weights(float t, float *w0, float *w1, float *w2, float *w3)
{
    const float sixth = 1.0f / 6;
    float u = 1 - t, t2 = t * t, u2 = u * u;
    *w0 = u2 * u * sixth;
    *w1 = (4 - 6 * t2 + 3 * (t2 * t)) * sixth;
    *w2 = (4 - 6 * u2 + 3 * (u2 * u)) * sixth;
    *w3 = t2 * t * sixth;
}

INLINE Row load_row(const float *from)
{
    Row row;
    memcpy(&row, from, sizeof row);
    return row;
}

// Four samples at once: the lanes of each sample times its weights (one array of samples for each lane), added as (0 + 1) + (2 + 3).
INLINE Row join_lanes(const Row *r, const float *w, size_t stride)
{
    Row a = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5), b = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5);
    Row c = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7), d = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
    Row l0 = __builtin_shufflevector(a, b, 0, 1, 4, 5), l1 = __builtin_shufflevector(a, b, 2, 3, 6, 7);
    Row l2 = __builtin_shufflevector(c, d, 0, 1, 4, 5), l3 = __builtin_shufflevector(c, d, 2, 3, 6, 7);
    return (l0 * load_row(w) + l1 * load_row(w + stride)) + (l2 * load_row(w + 2 * stride) + l3 * load_row(w + 3 * stride));
}

// Samples near the border, where some taps lie outside the grid; those taps count as the volume's minimum.
static float sample_at_border(const Volume *volume, const int base[3], const float wx[4], const float wy[4], const float wz[4])
{
    float sum = 0;
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++) {
                int x = base[0] + i, y = base[1] + j, z = base[2] + k;
                bool inside = x >= 0 && y >= 0 && z >= 0 && x < volume->size[0] && y < volume->size[1] && z < volume->size[2];
                float value = inside ? volume->value[((size_t)z * (size_t)volume->size[1] + (size_t)y) * (size_t)volume->size[0] + (size_t)x] : volume->minimum;
                sum += wz[k] * wy[j] * wx[i] * value;
            }
    return sum;
}

// Samples at any continuous voxel coordinates, near the border too.
static float sample(const Volume *volume, double x, double y, double z)
{
    const int *size = volume->size;
    // far outside (or not a number) no tap is inside
    if (!(x > -3 && y > -3 && z > -3 && x < size[0] + 2 && y < size[1] + 2 && z < size[2] + 2))
        return volume->minimum;
    // all coordinates are > -3, so truncating the shifted number equals floor(), which is a function call without SSE4
    int base[3] = {(int)(x + 4) - 5, (int)(y + 4) - 5, (int)(z + 4) - 5};
    float w[3][4];
    const double place[3] = {x, y, z};
    for (int a = 0; a < 3; a++)
        weights((float)(place[a] - (base[a] + 1)), &w[a][0], &w[a][1], &w[a][2], &w[a][3]);
    if (base[0] < 0 || base[1] < 0 || base[2] < 0 || base[0] + 3 >= size[0] || base[1] + 3 >= size[1] || base[2] + 3 >= size[2])
        return sample_at_border(volume, base, w[0], w[1], w[2]);
    size_t row = (size_t)size[0], slice = row * (size_t)size[1];
    const float *first = volume->value + (size_t)base[2] * slice + (size_t)base[1] * row + (size_t)base[0];
    Row sum = {0, 0, 0, 0};
    for (int k = 0; k < 4; k++, first += slice)
        sum += w[2][k] *
               (((w[1][0] * load_row(first) + w[1][1] * load_row(first + row)) + w[1][2] * load_row(first + 2 * row)) + w[1][3] * load_row(first + 3 * row));
    return (sum[0] * w[0][0] + sum[1] * w[0][1]) + (sum[2] * w[0][2] + sum[3] * w[0][3]);
}

float bspline_sample(const Volume *volume, Vec3 voxel) { return sample(volume, voxel.x, voxel.y, voxel.z); }

// --- lines ---

enum { LINE_BLOCK = 16 };

typedef struct LineBlock {
    double place[3][LINE_BLOCK];     // voxel coordinates
    float weight[3][4][LINE_BLOCK];
    int cell[LINE_BLOCK];            // index of the first of its 64 taps; -1: some tap is outside the grid
} LineBlock;

// Fills in the block for the samples from number `first` on.
INLINE void line_block_place(LineBlock *block, const Volume *volume, Vec3 start, Vec3 step, int first)
{
    const double begin[3] = {start.x, start.y, start.z}, along[3] = {step.x, step.y, step.z};
    int base[3][LINE_BLOCK];
    float part[LINE_BLOCK];
    for (int a = 0; a < 3; a++) {
        double most = volume->size[a];
        for (int s = 0; s < LINE_BLOCK; s++) {
            double x = begin[a] + (first + s) * along[a], held = x > 0 ? x : 0;   // clamped to where a cast to int is defined; no cell lies outside
            held = held < most ? held : most;
            base[a][s] = (int)(held + 4) - 5;
            block->place[a][s] = x;
            part[s] = (float)(held - (base[a][s] + 1));
        }
        for (int s = 0; s < LINE_BLOCK; s++)
            weights(part[s], &block->weight[a][0][s], &block->weight[a][1][s], &block->weight[a][2][s], &block->weight[a][3][s]);
    }
    const int nx = volume->size[0], ny = volume->size[1], nz = volume->size[2];
    for (int s = 0; s < LINE_BLOCK; s++) {
        int x = base[0][s], y = base[1][s], z = base[2][s];
        bool inside = (x >= 0) & (y >= 0) & (z >= 0) & (x + 3 < nx) & (y + 3 < ny) & (z + 3 < nz);
        unsigned cell = ((unsigned)z * (unsigned)ny + (unsigned)y) * (unsigned)nx + (unsigned)x;   // may wrap around for samples that do not use it
        block->cell[s] = inside ? (int)cell : -1;
    }
}

#define KERNEL_TEXT "recon/volume/bspline_kernel.inc"
#include "base/each_simd.inc"
static void (*const sample_line_on[SIMD_COUNT])(const Volume *, Vec3, Vec3, int, float *) = SIMD_FORMS(sample_line);

void bspline_sample_line(const Volume *volume, Vec3 start, Vec3 step, int count, float *out) { sample_line_on[simd_level()](volume, start, step, count, out); }
