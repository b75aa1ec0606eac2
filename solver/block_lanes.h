// Internal to solver: which block sizes and instruction sets the chain's kernels are compiled for (block_lanes.inc has their operations).
#ifndef SELDINGER_SOLVER_BLOCK_LANES_H
#define SELDINGER_SOLVER_BLOCK_LANES_H

#include <stddef.h>

// Loops over the columns must be unrolled, or small blocks do not stay in registers.
#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL _Pragma("GCC unroll 16")
#define ROLL _Pragma("GCC unroll 1")
#else
#define UNROLL
#define ROLL
#endif
#define INLINE static inline __attribute__((always_inline))
#if defined(__GNUC__) && defined(__x86_64__)
#define BLOCK_HAS_AVX 1
#else
#define BLOCK_HAS_AVX 0
#endif

// Columns have room for a right-hand side behind the last row and are padded to eights.
#define BLOCK_COLUMN(size) (((size) + 8) / 8 * 8)
#define BLOCK_PANEL(size) ((size) * BLOCK_COLUMN(size))

// A kernel's name for the SIZE and the LEVEL that are being compiled (block_levels.inc).
#define BLOCK_JOIN(name, size, level) name##_##size##_##level
#define BLOCK_NAME(name, size, level) BLOCK_JOIN(name, size, level)
#define KERNEL(name) BLOCK_NAME(name, SIZE, LEVEL)

// Tables of a kernel by block_size_index() and simd_level().
#if BLOCK_HAS_AVX
#define BLOCK_LEVELS(name, size) {name##_##size##_baseline, name##_##size##_avx2, name##_##size##_avx512}
#else
#define BLOCK_LEVELS(name, size) {name##_##size##_baseline, name##_##size##_baseline, name##_##size##_baseline}
#endif
#define BLOCK_FORMS(name) {BLOCK_LEVELS(name, 6), BLOCK_LEVELS(name, 8), BLOCK_LEVELS(name, 10), BLOCK_LEVELS(name, 12)}
enum { BLOCK_SIZES = 4 };
static inline int block_size_index(int size) { return (size - 6) / 2; }

#endif
