// A = L D L^T of a block-tridiagonal chain, eliminated from both ends towards the middle node m = M/2.
//
//   left  i = 0 .. m-1:     C = A(i+1, i) = L_i,     right  i = M-1 .. m+1:  C = A(i-1, i) = L_(i-1)^T
//   D_i = T d T^T (T unit lower), Z = C T^-T d^-1, and Z d Z^T is subtracted from the block of the next node towards the middle.
// Forward: y = T^-1 b, and Z y is subtracted from b of the next node. Backward: x = T^-T (d^-1 y - Z^T x'), x' of the next node towards the middle.
//
// The computation is bound by latency (one division after another for each unknown). Both ends are therefore eliminated in one loop, interleaved pivot by
// pivot, because their operations are independent. Columns are 8 lanes wide for blocks of 6 and 16 for larger ones; the lane after the last row of the coupling
// holds the right-hand side, so that a factorisation with one solve (block_chain_factor_solve) gets its forward substitution without extra cost.
// Pivots are scalar: multiplication by explicit inverses of the 6x6 blocks is a third faster, but loses accuracy by the square root of the condition number.
#include "solver/block_chain.h"

#include "base/base.h"

#include "solver/block_lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Per node: T and Z column-major (size x BLOCK_COLUMN(size); lane `size` of Z: d^-1 y of the combined solve), and 1/d.
struct BlockFactor {
    int count, capacity, size;
    double *t, *z, *inverse;
};

bool block_size_is_known(int size) { return size == 6 || size == 8 || size == 10 || size == 12; }

bool block_chain_create(BlockChain *chain, int count, int size)
{
    *chain = (BlockChain){0};
    if (count < 1 || !block_size_is_known(size))
        return false;
    chain->count = count;
    chain->size = size;
    chain->diag = block_zeros(block_doubles(count, size));
    chain->lower = block_zeros(block_doubles(count, size));
    if (!chain->diag || !chain->lower) {
        block_chain_destroy(chain);
        return false;
    }
    return true;
}

void block_chain_destroy(BlockChain *chain)
{
    block_zeros_free(chain->diag);
    block_zeros_free(chain->lower);
    *chain = (BlockChain){0};
}

BlockFactor *block_factor_create(int count, int size)
{
    BlockFactor *f = count < 1 || !block_size_is_known(size) ? NULL : calloc(1, sizeof *f);
    if (!f)
        return NULL;
    size_t m = (size_t)count;
    f->count = f->capacity = count;
    f->size = size;
    f->t = block_zeros(m * (size_t)BLOCK_PANEL(size));
    f->z = block_zeros(m * (size_t)BLOCK_PANEL(size));
    f->inverse = block_zeros(m * (size_t)BLOCK_COLUMN(size));
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
    block_zeros_free(factor->t);
    block_zeros_free(factor->z);
    block_zeros_free(factor->inverse);
    free(factor);
}

static const double zeros[BLOCK_LARGEST];

#define KERNELS "solver/block_chain_kernel.inc"
#define SMALL 8
#include "solver/block_sizes.inc"

static bool (*const eliminate_on[BLOCK_SIZES][SIMD_COUNT])(const BlockChain *, BlockFactor *, const double *) = BLOCK_FORMS(eliminate);
static void (*const back_substitute_on[BLOCK_SIZES][SIMD_COUNT])(const BlockFactor *, double *, const double *, int, int) = BLOCK_FORMS(back_substitute);
static void (*const forward_substitute_on[BLOCK_SIZES][SIMD_COUNT])(const BlockFactor *, double *) = BLOCK_FORMS(forward_substitute);

bool block_chain_factor(const BlockChain *chain, BlockFactor *factor)
{
    SEL_REQUIRE(chain->count > 0 && chain->count <= factor->capacity, "a factor has room for the nodes of its chain");
    factor->count = chain->count;
    return chain->size == factor->size && eliminate_on[block_size_index(chain->size)][simd_level()](chain, factor, NULL);
}

bool block_chain_factor_solve(const BlockChain *chain, BlockFactor *factor, const double *b, double *x)
{
    SEL_ASSERT(b != x, "b and x are different arrays");
    SEL_REQUIRE(chain->count > 0 && chain->count <= factor->capacity, "a factor has room for the nodes of its chain");
    int size = chain->size, form = block_size_index(size);
    factor->count = chain->count;
    if (size != factor->size || !eliminate_on[form][simd_level()](chain, factor, b))
        return false;
    back_substitute_on[form][simd_level()](factor, x, factor->z + size, BLOCK_PANEL(size), BLOCK_COLUMN(size));
    return true;
}

void block_factor_solve(const BlockFactor *factor, const double *b, double *x)
{
    SEL_ASSERT(factor->count > 0 && block_size_is_known(factor->size), "a chain has been factored");
    int size = factor->size, form = block_size_index(size);
    if (x != b)
        memcpy(x, b, (size_t)(factor->count * size) * sizeof *x);
    forward_substitute_on[form][simd_level()](factor, x);
    back_substitute_on[form][simd_level()](factor, x, x, size, 1);
}

// S_i = D_i^-1 + G^T S' G with G = Z T^-1 = C D_i^-1 and S' of the next node towards the middle.
INLINE void multiply(const BlockChain *chain, const double *x, double *y, const int size)
{
    const size_t block = (size_t)(size * size);
    for (int i = 0; i < chain->count; i++) {
        const double *d = chain->diag + (size_t)i * block, *before = chain->lower + (size_t)(i > 0 ? i - 1 : 0) * block,
                     *after = chain->lower + (size_t)i * block;
        for (int r = 0; r < size; r++) {
            double sum = 0;
            for (int c = 0; c < size; c++)
                sum += d[size * r + c] * x[size * i + c];
            for (int c = 0; i > 0 && c < size; c++)
                sum += before[size * r + c] * x[size * (i - 1) + c];
            for (int c = 0; i + 1 < chain->count && c < size; c++)
                sum += after[size * c + r] * x[size * (i + 1) + c];
            y[size * i + r] = sum;
        }
    }
}

// A constant block size makes the loops faster.
void block_chain_multiply(const BlockChain *chain, const double *x, double *y)
{
    SEL_ASSERT(block_size_is_known(chain->size) && x != y, "there are kernels for the size, and x and y are different arrays");
    switch (chain->size) {
    case 6: multiply(chain, x, y, 6); break;
    case 8: multiply(chain, x, y, 8); break;
    case 10: multiply(chain, x, y, 10); break;
    default: multiply(chain, x, y, 12); break;
    }
}
