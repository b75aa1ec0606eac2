// A = L U, eliminated from both ends towards the middle node as in block_chain.c, which see.
//
//   left:  C = A(i+1, i), B = A(i, i+1);  right: C = A(i-1, i), B = A(i, i-1)
//   D_i = T V (T unit lower, V upper), Z = C V^-1, Y = T^-1 B, and the neighbour towards the middle loses Z Y.
// The right-hand side travels as a seventh column of B. Backward: x = V^-1 (T^-1 b - Y x'), x' of the neighbour towards the middle.
#include "solver/block_lu.h"

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
};

BlockLu *block_lu_create(int count)
{
    BlockLu *lu = count < 1 ? NULL : calloc(1, sizeof *lu);
    if (!lu)
        return NULL;
    lu->count = count;
    lu->node = aligned_alloc(64, (size_t)count * sizeof *lu->node);
    if (!lu->node) {
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

static bool (*const eliminate_on[3])(BlockLu *, const double *, const double *, const double *, const double *) = ON(eliminate);
static void (*const back_on[3])(const BlockLu *, double *) = ON(back);
static void (*const forward_on[3])(const BlockLu *, const double *) = ON(forward);

bool block_lu_factor_solve(BlockLu *lu, const double *diag, const double *lower, const double *upper, const double *b, double *x)
{
    if (!eliminate_on[block_isa()](lu, diag, lower, upper, b))
        return false;
    back_on[block_isa()](lu, x);
    return true;
}

void block_lu_solve(const BlockLu *lu, const double *b, double *x)
{
    forward_on[block_isa()](lu, b);
    back_on[block_isa()](lu, x);
}

void block_lu_transpose(int count, const double *from, double *to)
{
    for (int i = 0; i < count; i++, from += BLOCK, to += BLOCK)
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 6; c++)
                to[6 * c + r] = from[6 * r + c];
}
