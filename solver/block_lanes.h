// Internal to solver: columns of 6x6 blocks as vectors of eight lanes (six in use), and which instruction sets kernels on them are compiled for.
// The order of operations is the same for all of them, and contraction is off: same bits.
#ifndef SELDINGER_SOLVER_BLOCK_LANES_H
#define SELDINGER_SOLVER_BLOCK_LANES_H

#include <stddef.h>

#if defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__x86_64__)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CLONES
#endif
// Loops over the six columns must be unrolled, or the columns live in memory.
#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL _Pragma("GCC unroll 8")
#else
#define UNROLL
#endif
#define INLINE static inline __attribute__((always_inline))

typedef double Lanes __attribute__((vector_size(64), may_alias));
typedef double LooseLanes __attribute__((vector_size(64), may_alias, aligned(8)));

enum { BLOCK = 36, COLUMN = 8, PANEL = 6 * COLUMN };

// The rows of a row-major block as vectors (which are the columns of its transpose). Reads two doubles past the block.
INLINE void load_rows(Lanes *v, const double *a)
{
    UNROLL
    for (int k = 0; k < 6; k++)
        v[k] = *(const LooseLanes *)(a + 6 * k);
}

INLINE void load_columns(Lanes *v, const double *a)
{
    UNROLL
    for (int k = 0; k < 6; k++)
        v[k] = (Lanes){a[k], a[6 + k], a[12 + k], a[18 + k], a[24 + k], a[30 + k], 0, 0};
}

#endif
