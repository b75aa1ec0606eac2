// For each solid the blocks of pixels that its rectangle meets; outside its shadow the length is 0. All lengths are in units of the ray to a pixel's place in the plane
// of the isocentre: they are multiplied by that length at the end.
#include "render/shape_raster.h"

#include "base/base.h"

#include <math.h>
#include <string.h>

enum { MOST_SIDE = 1024 };

#define KERNEL_TEXT "render/shape_raster_kernel.inc"
#include "base/each_simd.inc"

typedef void AddRow(const ShadowVertex *, int, const float *, float, float *);
static AddRow *const add_whole_on[SIMD_COUNT] = SIMD_FORMS(add_whole), *const add_cut_on[SIMD_COUNT] = SIMD_FORMS(add_cut),
                     *const add_any_on[SIMD_COUNT] = SIMD_FORMS(add_any);

static AddRow *adder_of(const ShadowVertex *shape)
{
    const int level = (int)simd_level();
    bool is_cut = false;
    for (int k = 0; k < 2; k++)
        for (int j = 0; j < 3; j++)
            is_cut = is_cut || shape->plane[k][j] != 0;
    return shape->solid[2] > 0 ? add_any_on[level] : is_cut ? add_cut_on[level] : add_whole_on[level];
}

static int limited(double x, int least, int most) { return x < least ? least : x > most ? most : (int)x; }

static void add_shape(const ShadowVertex *shape, const float box[4], int side, int first, int rows, const float *across, float *value)
{
    AddRow *add = adder_of(shape);
    const int low = limited(floor((double)box[0] * side - 0.5), 0, side) / SHAPE_BLOCK * SHAPE_BLOCK;
    const int high = (limited(ceil((double)box[2] * side + 0.5), 0, side) + SHAPE_BLOCK - 1) / SHAPE_BLOCK * SHAPE_BLOCK;
    const int bottom = limited(floor((double)box[1] * side - 0.5), first, first + rows), top = limited(ceil((double)box[3] * side + 0.5), first, first + rows);
    for (int y = bottom; y < top; y++)
        add(shape, high - low, across + low, ((float)y + 0.5f) / (float)side - 0.5f, value + (size_t)y * (size_t)side + low);
}

void shape_raster(const ShapeShadows *shadows, const CArm *c_arm, int side, int first, int rows, float *value)
{
    SEL_ASSERT(side % SHAPE_BLOCK == 0 && side <= MOST_SIDE, "a row is a whole number of blocks");
    float across[MOST_SIDE];
    for (int x = 0; x < side; x++)
        across[x] = ((float)x + 0.5f) / (float)side - 0.5f;
    memset(value + (size_t)first * (size_t)side, 0, (size_t)rows * (size_t)side * sizeof *value);
    for (int i = 0; i < shadows->count / SHADOW_VERTICES; i++)
        add_shape(&shadows->vertex[i * SHADOW_VERTICES], shadows->box[i], side, first, rows, across, value);
    const float far = (float)C_ARM_SOURCE_MM, field = (float)c_arm->field_mm;
    for (int y = first; y < first + rows; y++) {
        float *row = value + (size_t)y * (size_t)side;
        const float up = ((float)y + 0.5f) / (float)side - 0.5f;
        for (int x = 0; x < side; x++)
            row[x] *= sqrtf(far * far + (across[x] * across[x] + up * up) * field * field);
    }
}
