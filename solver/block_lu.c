// A = L U, eliminated from both ends towards the middle node, as in block_chain.c.
//
//   left:  C = A(i+1, i), B = A(i, i+1);  right: C = A(i-1, i), B = A(i, i-1)
//   D_i = T V (T unit lower, V upper), Z = C V^-1, Y = T^-1 B, and Z Y is subtracted from the block of the next node towards the middle.
// The right-hand side is an additional column of B. Backward: x = V^-1 (T^-1 b - Y x'), x' of the next node towards the middle.
#include "solver/block_lu.h"

#include "base/base.h"

#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Data of a node: T, V and Z, column-major (T is valid below the diagonal), then Y followed by the column of the right-hand side, and 1/d.
#define T_AT 0
#define V_AT PANEL
#define Z_AT (2 * PANEL)
#define Y_AT (3 * PANEL)
#define INVERSE_AT (4 * PANEL + COLUMN)
#define NODE (4 * PANEL + 2 * COLUMN)
static size_t node_doubles(int size) { return (size_t)(4 * BLOCK_PANEL(size) + 2 * BLOCK_COLUMN(size)); }

struct BlockLu {
    int count, capacity, size;
    unsigned char *live;         // (M) leading unknowns of each node, before its unit rows
    double *node;
    double *rest, *change;       // (M, n) residual and correction of the refinement
};

BlockLu *block_lu_create(int count, int size)
{
    BlockLu *lu = count < 1 || !block_size_is_known(size) ? NULL : calloc(1, sizeof *lu);
    if (!lu)
        return NULL;
    size_t m = (size_t)count;
    lu->count = lu->capacity = count;
    lu->size = size;
    lu->node = block_zeros(m * node_doubles(size));
    lu->live = calloc(m, 1);
    lu->rest = calloc(2 * m * (size_t)size, sizeof *lu->rest);
    if (!lu->node || !lu->rest || !lu->live) {
        block_lu_destroy(lu);
        return NULL;
    }
    lu->change = lu->rest + m * (size_t)size;
    return lu;
}

void block_lu_destroy(BlockLu *lu)
{
    if (!lu)
        return;
    block_zeros_free(lu->node);
    free(lu->live);
    free(lu->rest);
    free(lu);
}

static const double zeros[BLOCK_LARGEST];

#define KERNELS "solver/block_lu_kernel.inc"
#define SMALL 8
#include "solver/block_sizes.inc"

static bool (*const eliminate_on[BLOCK_SIZES][SIMD_COUNT])(BlockLu *, const double *, const double *, const double *, const double *) = BLOCK_FORMS(eliminate);
static void (*const back_on[BLOCK_SIZES][SIMD_COUNT])(const BlockLu *, double *) = BLOCK_FORMS(back);
static void (*const forward_on[BLOCK_SIZES][SIMD_COUNT])(const BlockLu *, const double *) = BLOCK_FORMS(forward);

static bool all_positive(const BlockLu *lu)
{
    const size_t stride = node_doubles(lu->size);
    const double *inverse = lu->node + stride - BLOCK_COLUMN(lu->size);
    bool ok = true;
    for (int i = 0; i < lu->count; i++, inverse += stride)
        for (int k = 0; k < lu->size; k++)
            ok &= inverse[k] > 0;
    return ok;
}

// r -= B x for one column-major block.
static void take_off(const double *block, const double *x, double *r, int size)
{
    for (int c = 0; c < size; c++)
        for (int k = 0; k < size; k++)
            r[k] -= block[size * c + k] * x[c];
}

static void refine(BlockLu *lu, const double *diag, const double *lower, const double *upper, const double *b, double *x)
{
    SEL_ASSERT(lu->count > 0 && lu->count <= lu->capacity, "a chain has been factored");
    const int size = lu->size;
    const size_t n = (size_t)size, block = n * n;
    memcpy(lu->rest, b, (size_t)lu->count * n * sizeof *b);
    for (int i = 0; i < lu->count; i++) {
        double *r = lu->rest + n * (size_t)i, *at = x + n * (size_t)i;
        take_off(diag + (size_t)i * block, at, r, size);
        if (i > 0)
            take_off(lower + (size_t)(i - 1) * block, at - n, r, size);
        if (i + 1 < lu->count)
            take_off(upper + (size_t)i * block, at + n, r, size);
    }
    block_lu_solve(lu, lu->rest, lu->change);
    for (size_t k = 0; k < n * (size_t)lu->count; k++)
        x[k] += lu->change[k];
}

bool block_lu_factor_solve(BlockLu *lu, int count, const double *diag, const double *lower, const double *upper, const double *b, double *x,
                           const unsigned char *live, bool *exact)
{
    SEL_REQUIRE(count > 0 && count <= lu->capacity, "a factor has room for the nodes of its chain");
    SEL_ASSERT(b != x, "b and x are different arrays");
    lu->count = count;
    if (live)
        memcpy(lu->live, live, (size_t)count);
    else
        memset(lu->live, lu->size, (size_t)count);
    if (!eliminate_on[block_size_index(lu->size)][simd_level()](lu, diag, lower, upper, b))
        return false;
    back_on[block_size_index(lu->size)][simd_level()](lu, x);
    *exact = all_positive(lu);
    if (!*exact)
        refine(lu, diag, lower, upper, b, x);
    return true;
}

void block_lu_solve(const BlockLu *lu, const double *b, double *x)
{
    SEL_ASSERT(lu->count > 0 && b != x, "a chain has been factored");
    forward_on[block_size_index(lu->size)][simd_level()](lu, b);
    back_on[block_size_index(lu->size)][simd_level()](lu, x);
}

INLINE void transpose(int count, const double *from, double *to, const int size)
{
    for (int i = 0; i < count; i++, from += size * size, to += size * size)
        for (int r = 0; r < size; r++)
            for (int c = 0; c < size; c++)
                to[size * c + r] = from[size * r + c];
}

void block_lu_transpose(int count, int size, const double *from, double *to)
{
    if (size == 6) // the usual size, as a constant
        transpose(count, from, to, 6);
    else
        transpose(count, from, to, size);
}
