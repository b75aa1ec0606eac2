// Internal to solver: which instruction sets the chain's kernels are compiled for (block_lanes.inc has their operations).
#ifndef SELDINGER_SOLVER_BLOCK_LANES_H
#define SELDINGER_SOLVER_BLOCK_LANES_H

#include <stddef.h>

// Loops over the six columns must be unrolled, or the columns live in memory.
#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL _Pragma("GCC unroll 8")
#else
#define UNROLL
#endif
#define INLINE static inline __attribute__((always_inline))
#if defined(__GNUC__) && defined(__x86_64__)
#define BLOCK_HAS_AVX 1
#else
#define BLOCK_HAS_AVX 0
#endif

enum { BLOCK = 36, COLUMN = 8, PANEL = 6 * COLUMN };

#endif
