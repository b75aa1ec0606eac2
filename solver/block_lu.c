// A = L U, eliminated from both ends towards the middle node as in block_chain.c, which see.
//
//   left:  C = A(i+1, i), B = A(i, i+1);  right: C = A(i-1, i), B = A(i, i-1)
//   D_i = T V (T unit lower, V upper), Z = C V^-1, Y = T^-1 B, and the neighbour towards the middle loses Z Y.
// The right-hand side travels as a seventh column of B. Backward: x = V^-1 (T^-1 b - Y x'), x' of the neighbour towards the middle.
#include "solver/block_lu.h"

#include "geom/simd.h"
#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Per node, all by columns of eight.
typedef struct Node {
    double t[6][COLUMN], v[6][COLUMN], z[6][COLUMN], y[7][COLUMN]; // of t the lanes below the diagonal count
    double inverse[COLUMN];
} Node;

struct BlockLu {
    int count;
    Node *node;
    double *rest, *change;       // (M, 6) of the refinement
};

BlockLu *block_lu_create(int count)
{
    BlockLu *lu = count < 1 ? NULL : calloc(1, sizeof *lu);
    if (!lu)
        return NULL;
    lu->count = count;
    lu->node = aligned_alloc(64, (size_t)count * sizeof *lu->node);
    lu->rest = calloc((size_t)count * 12, sizeof *lu->rest);
    lu->change = lu->rest + (size_t)count * 6;
    if (!lu->node || !lu->rest) {
        block_lu_destroy(lu);
        return NULL;
    }
    memset(lu->node, 0, (size_t)count * sizeof *lu->node);
    return lu;
}

void block_lu_destroy(BlockLu *lu)
{
    if (!lu)
        return;
    free(lu->node);
    free(lu->rest);
    free(lu);
}

static const double zeros[6];

// No pivot vanishes or overflows.
INLINE bool pivots_hold(const BlockLu *f)
{
    bool ok = true;
    for (int i = 0; i < f->count; i++)
        for (int k = 0; k < 6; k++)
            ok &= f->node[i].inverse[k] != 0 && fabs(f->node[i].inverse[k]) <= DBL_MAX;
    return ok;
}

#define WIDTH 2
#define TARGET
#define KERNEL(name) name##_baseline
#include "solver/block_lu_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#if BLOCK_HAS_AVX
#define WIDTH 4
#define TARGET __attribute__((target("avx2")))
#define KERNEL(name) name##_avx2
#include "solver/block_lu_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#define WIDTH 8
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))
#define KERNEL(name) name##_avx512
#include "solver/block_lu_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#define ON(name) {name##_baseline, name##_avx2, name##_avx512}
#else
#define ON(name) {name##_baseline, name##_baseline, name##_baseline}
#endif

static bool (*const eliminate_on[SIMD_COUNT])(BlockLu *, const double *, const double *, const double *, const double *) = ON(eliminate);
static void (*const back_on[SIMD_COUNT])(const BlockLu *, double *) = ON(back);
static void (*const forward_on[SIMD_COUNT])(const BlockLu *, const double *) = ON(forward);

static bool all_positive(const BlockLu *lu)
{
    bool ok = true;
    for (int i = 0; i < lu->count; i++)
        for (int k = 0; k < 6; k++)
            ok &= lu->node[i].inverse[k] > 0;
    return ok;
}

// r -= B x of one block by columns
static void take_off(const double *block, const double *x, double *r)
{
    for (int c = 0; c < 6; c++)
        for (int k = 0; k < 6; k++)
            r[k] -= block[6 * c + k] * x[c];
}

static void refine(BlockLu *lu, const double *diag, const double *lower, const double *upper, const double *b, double *x)
{
    memcpy(lu->rest, b, (size_t)lu->count * 6 * sizeof *b);
    for (int i = 0; i < lu->count; i++) {
        double *r = lu->rest + 6 * (size_t)i, *at = x + 6 * (size_t)i;
        take_off(diag + (size_t)i * BLOCK, at, r);
        if (i > 0)
            take_off(lower + (size_t)(i - 1) * BLOCK, at - 6, r);
        if (i + 1 < lu->count)
            take_off(upper + (size_t)i * BLOCK, at + 6, r);
    }
    block_lu_solve(lu, lu->rest, lu->change);
    for (size_t k = 0; k < 6 * (size_t)lu->count; k++)
        x[k] += lu->change[k];
}

bool block_lu_factor_solve(BlockLu *lu, int count, const double *diag, const double *lower, const double *upper, const double *b, double *x,
                           bool *exact)
{
    lu->count = count;
    if (!eliminate_on[simd_level()](lu, diag, lower, upper, b))
        return false;
    back_on[simd_level()](lu, x);
    *exact = all_positive(lu);
    if (!*exact)
        refine(lu, diag, lower, upper, b, x);
    return true;
}

void block_lu_solve(const BlockLu *lu, const double *b, double *x)
{
    forward_on[simd_level()](lu, b);
    back_on[simd_level()](lu, x);
}

void block_lu_transpose(int count, const double *from, double *to)
{
    for (int i = 0; i < count; i++, from += BLOCK, to += BLOCK)
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 6; c++)
                to[6 * c + r] = from[6 * r + c];
}
