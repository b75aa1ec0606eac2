// s(x) = sum_ijk v_ijk b(x - i) b(y - j) b(z - k), b the cubic B-spline: with t = x - floor(x) the four weights are
// (1-t)^3 / 6, (4 - 6 t^2 + 3 t^3) / 6, (4 - 6 u^2 + 3 u^3) / 6 with u = 1 - t, t^3 / 6.
// Floats suffice: 64 products of values known to a few digits. A row's four taps are four lanes, joined at the end: rows are added along y, then slices
// along z, then lanes, always in this order, so that a sample has the same bits on every instruction set, alone or in a line.
//
// Lines are sampled in blocks: positions, weights and cells of a block at once, then the sums along y sample by sample, with the cell's taps in registers,
// which the next sample mostly shares (a ray takes ten samples per voxel), and then the sums along z and x in lanes of samples. Lanes of samples from the
// beginning would have to gather each of their 64 taps.
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

enum { LINE_BLOCK = 64, LINE_LANES = 8 };

typedef struct LineBlock {
    float weight[3][4][LINE_BLOCK];
    int cell[LINE_BLOCK + 1];        // index of the first of a sample's 64 taps; -1: some tap is outside the grid. -2 after the last sample
} LineBlock;

// Returns true if all taps of samples first … last are in the grid. Coordinates along a line are monotonic, rounded ones too.
INLINE bool line_is_inside(const Volume *volume, Vec3 start, Vec3 step, int first, int last)
{
    const double begin[3] = {start.x, start.y, start.z}, along[3] = {step.x, step.y, step.z};
    bool is_inside = true;
    for (int a = 0; a < 3; a++) {
        double x = begin[a] + first * along[a] + 4, y = begin[a] + last * along[a] + 4, most = volume->size[a] + 2;
        is_inside = is_inside && x >= 5 && x < most && y >= 5 && y < most;
    }
    return is_inside;
}

// Weights and cells of samples whose taps are all in the grid. `count`: a multiple of LINE_LANES. Short loops: a processor overlaps their chains of
// operations, but not those of one long loop.
INLINE void line_place_inside(LineBlock *block, const Volume *volume, Vec3 start, Vec3 step, int first, int count)
{
    const double begin[3] = {start.x, start.y, start.z}, along[3] = {step.x, step.y, step.z};
    const double row = volume->size[0], slice = row * volume->size[1], stride[3] = {1, row, slice}, origin = 5 * (1 + row + slice);
    float part[3][LINE_BLOCK];
    for (int l = 0; l < count; l += LINE_LANES) {
        double cell[LINE_LANES];
        for (int s = 0; s < LINE_LANES; s++)
            cell[s] = -origin;
        for (int a = 0; a < 3; a++)
            for (int s = 0; s < LINE_LANES; s++) {
                double x = begin[a] + (first + l + s) * along[a], whole = (double)(int)(x + 4);
                part[a][l + s] = (float)(x - (whole - 4));
                cell[s] += stride[a] * whole;
            }
        for (int s = 0; s < LINE_LANES; s++)
            block->cell[l + s] = (int)cell[s];
    }
    for (int a = 0; a < 3; a++)
        for (int l = 0; l < count; l += LINE_LANES)
            for (int s = l; s < l + LINE_LANES; s++)
                weights(part[a][s], &block->weight[a][0][s], &block->weight[a][1][s], &block->weight[a][2][s], &block->weight[a][3][s]);
    block->cell[count] = -2;
}

// The same for samples anywhere.
INLINE void line_place(LineBlock *block, const Volume *volume, Vec3 start, Vec3 step, int first, int count)
{
    const double begin[3] = {start.x, start.y, start.z}, along[3] = {step.x, step.y, step.z};
    for (int s = 0; s < count; s++) {
        int base[3];
        bool is_inside = true;
        for (int a = 0; a < 3; a++) {
            double x = begin[a] + (first + s) * along[a];
            is_inside = is_inside && x + 4 >= 5 && x + 4 < volume->size[a] + 2;
            base[a] = is_inside ? (int)(x + 4) - 5 : 0;
            weights(is_inside ? (float)(x - (base[a] + 1)) : 0, &block->weight[a][0][s], &block->weight[a][1][s], &block->weight[a][2][s],
                    &block->weight[a][3][s]);
        }
        block->cell[s] = is_inside ? (base[2] * volume->size[1] + base[1]) * volume->size[0] + base[0] : -1;
    }
    block->cell[count] = -2;
}

#define KERNEL_TEXT "recon/volume/bspline_kernel.inc"
#include "base/each_simd.inc"
static void (*const sample_line_on[SIMD_COUNT])(const Volume *, Vec3, Vec3, int, float *) = SIMD_FORMS(sample_line);

void bspline_sample_line(const Volume *volume, Vec3 start, Vec3 step, int count, float *out) { sample_line_on[simd_level()](volume, start, step, count, out); }
