// A = L D L^T of a block-tridiagonal chain, eliminated from both ends towards the middle node m = M/2.
//
//   left  i = 0 .. m-1:     C = A(i+1, i) = L_i,     right  i = M-1 .. m+1:  C = A(i-1, i) = L_(i-1)^T
//   D_i = T d T^T (T unit lower), Z = C T^-T d^-1, and the neighbour towards the middle loses Z d Z^T.
// Forward: y = T^-1 b, the neighbour's b loses Z y. Backward: x = T^-T (d^-1 y - Z^T x'), x' of the neighbour towards the middle.
//
// The work is latency-bound (six divisions in a row per node), so the two ends are eliminated in one loop, interleaved pivot by pivot:
// their chains of operations do not depend on each other. Columns are 8 lanes wide, 6 in use; lane 6 of the coupling carries the
// right-hand side, which is how a factorisation with one solve (block_chain_factor_solve) gets its forward half for nothing.
// Pivots stay scalar: multiplying with explicit inverses of 6x6 blocks is faster by a third but loses the square root of the condition.
#include "solver/block_chain.h"

#include "geom/simd.h"
#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Per node: T and Z by columns (6 x 8; z lane 6: d^-1 y of the fused solve), and 1/d.
struct BlockFactor {
    int count;
    double *t, *z, *inverse;
};

static double *aligned_zeros(size_t count)
{
    size_t bytes = (count * sizeof(double) + 63) / 64 * 64;
    double *p = aligned_alloc(64, bytes);
    if (p)
        memset(p, 0, bytes);
    return p;
}

bool block_chain_create(BlockChain *chain, int count)
{
    *chain = (BlockChain){0};
    if (count < 1)
        return false;
    chain->count = count;
    // two doubles of padding: a row is read 8 wide
    chain->diag = aligned_zeros((size_t)count * BLOCK + 2);
    chain->lower = aligned_zeros((size_t)count * BLOCK + 2);
    if (!chain->diag || !chain->lower) {
        block_chain_destroy(chain);
        return false;
    }
    return true;
}

void block_chain_destroy(BlockChain *chain)
{
    free(chain->diag);
    free(chain->lower);
    *chain = (BlockChain){0};
}

BlockFactor *block_factor_create(int count)
{
    BlockFactor *f = count < 1 ? NULL : calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->count = count;
    f->t = aligned_zeros((size_t)count * PANEL);
    f->z = aligned_zeros((size_t)count * PANEL);
    f->inverse = aligned_zeros((size_t)count * COLUMN);
    if (!f->t || !f->z || !f->inverse) {
        block_factor_destroy(f);
        return NULL;
    }
    return f;
}

void block_factor_destroy(BlockFactor *factor)
{
    if (!factor)
        return;
    free(factor->t);
    free(factor->z);
    free(factor->inverse);
    free(factor);
}

// r = d^-1 y - Z^T x', then T^T x = r; y_scaled has stride `step` between its six entries.
INLINE void back_substitute_node(const double *t, const double *z, const double *y_scaled, int step, const double *next, double *x)
{
    double r[6];
    UNROLL
    for (int k = 0; k < 6; k++) {
        const double *q = z + COLUMN * k;
        r[k] = y_scaled[step * k] - ((q[0] * next[0] + q[1] * next[1]) + (q[2] * next[2] + q[3] * next[3]) + (q[4] * next[4] + q[5] * next[5]));
    }
    UNROLL
    for (int k = 5; k >= 0; k--)
        UNROLL
        for (int j = 0; j < k; j++)
            r[j] -= t[COLUMN * j + k] * r[k];
    UNROLL
    for (int k = 0; k < 6; k++)
        x[k] = r[k];
}

// y = T^-1 b in place, and b' -= Z y.
INLINE void forward_substitute_node(const double *t, const double *z, double *y, double *next)
{
    UNROLL
    for (int k = 0; k < 6; k++)
        UNROLL
        for (int j = k + 1; j < 6; j++)
            y[j] -= t[COLUMN * k + j] * y[k];
    UNROLL
    for (int j = 0; j < 6; j++)
        next[j] -= (z[j] * y[0] + z[COLUMN + j] * y[1]) + (z[2 * COLUMN + j] * y[2] + z[3 * COLUMN + j] * y[3]) +
                   (z[4 * COLUMN + j] * y[4] + z[5 * COLUMN + j] * y[5]);
}

static const double zeros[6];

// All pivots positive and finite; looked at once, afterwards.
INLINE bool pivots_hold(const BlockFactor *f)
{
    bool ok = true;
    for (size_t i = 0; i < (size_t)f->count; i++)
        for (size_t k = 0; k < 6; k++)
            ok &= f->inverse[COLUMN * i + k] > 0 && f->inverse[COLUMN * i + k] <= DBL_MAX;
    return ok;
}

#define WIDTH 2
#define TARGET
#define KERNEL(name) name##_baseline
#include "solver/block_chain_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#if BLOCK_HAS_AVX
#define WIDTH 4
#define TARGET __attribute__((target("avx2")))
#define KERNEL(name) name##_avx2
#include "solver/block_chain_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#define WIDTH 8
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))
#define KERNEL(name) name##_avx512
#include "solver/block_chain_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
#define ON(name) {name##_baseline, name##_avx2, name##_avx512}
#else
#define ON(name) {name##_baseline, name##_baseline, name##_baseline}
#endif

static bool (*const eliminate_on[SIMD_COUNT])(const BlockChain *, BlockFactor *, const double *) = ON(eliminate);
static void (*const back_substitute_on[SIMD_COUNT])(const BlockFactor *, double *, const double *, int, int) = ON(back_substitute);
static void (*const forward_substitute_on[SIMD_COUNT])(const BlockFactor *, double *) = ON(forward_substitute);

bool block_chain_factor(const BlockChain *chain, BlockFactor *factor)
{
    factor->count = chain->count;
    return eliminate_on[simd_level()](chain, factor, NULL);
}

bool block_chain_factor_solve(const BlockChain *chain, BlockFactor *factor, const double *b, double *x)
{
    factor->count = chain->count;
    if (!eliminate_on[simd_level()](chain, factor, b))
        return false;
    back_substitute_on[simd_level()](factor, x, factor->z + 6, PANEL, COLUMN);
    return true;
}

void block_factor_solve(const BlockFactor *factor, const double *b, double *x)
{
    if (x != b)
        memcpy(x, b, (size_t)factor->count * 6 * sizeof *x);
    forward_substitute_on[simd_level()](factor, x);
    back_substitute_on[simd_level()](factor, x, x, 6, 1);
}

// S_i = D_i^-1 + G^T S' G with G = Z T^-1 = C D_i^-1, S' the neighbour's towards the middle.
static void inverse_block(const BlockFactor *f, size_t i, const double *towards, double *s)
{
    const double *t = f->t + i * PANEL, *z = f->z + i * PANEL, *inverse = f->inverse + i * COLUMN;
    double ti[6][6] = {{0}}, g[6][6] = {{0}}, sg[6][6] = {{0}};
    // ti = T^-1 by columns: ti[c][r]
    for (int c = 0; c < 6; c++) {
        ti[c][c] = 1;
        for (int r = c + 1; r < 6; r++)
            for (int k = c; k < r; k++)
                ti[c][r] -= t[COLUMN * k + r] * ti[c][k];
    }
    if (towards) {
        for (int c = 0; c < 6; c++)
            for (int k = c; k < 6; k++)
                for (int r = 0; r < 6; r++)
                    g[c][r] += z[COLUMN * k + r] * ti[c][k];
        for (int c = 0; c < 6; c++)
            for (int k = 0; k < 6; k++)
                for (int r = 0; r < 6; r++)
                    sg[c][r] += towards[6 * k + r] * g[c][k];
    }
    for (int r = 0; r < 6; r++)
        for (int c = 0; c <= r; c++) {
            double sum = 0;
            for (int k = r; k < 6; k++)
                sum += ti[r][k] * inverse[k] * ti[c][k];
            for (int k = 0; k < 6; k++)
                sum += g[r][k] * sg[c][k];
            s[6 * r + c] = s[6 * c + r] = sum;
        }
}

void block_factor_inverse_diagonal(const BlockFactor *factor, double *inverse)
{
    size_t count = (size_t)factor->count, m = count / 2;
    inverse_block(factor, m, NULL, inverse + m * BLOCK);
    for (size_t i = m; i-- > 0;)
        inverse_block(factor, i, inverse + (i + 1) * BLOCK, inverse + i * BLOCK);
    for (size_t i = m + 1; i < count; i++)
        inverse_block(factor, i, inverse + (i - 1) * BLOCK, inverse + i * BLOCK);
}

void block_chain_multiply(const BlockChain *chain, const double *x, double *y)
{
    for (int i = 0; i < chain->count; i++) {
        const double *d = chain->diag + (size_t)i * BLOCK, *before = chain->lower + (size_t)(i > 0 ? i - 1 : 0) * BLOCK,
                     *after = chain->lower + (size_t)i * BLOCK;
        for (int r = 0; r < 6; r++) {
            double sum = 0;
            for (int c = 0; c < 6; c++)
                sum += d[6 * r + c] * x[6 * i + c];
            for (int c = 0; i > 0 && c < 6; c++)
                sum += before[6 * r + c] * x[6 * (i - 1) + c];
            for (int c = 0; i + 1 < chain->count && c < 6; c++)
                sum += after[6 * c + r] * x[6 * (i + 1) + c];
            y[6 * i + r] = sum;
        }
    }
}
