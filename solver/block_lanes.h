// Internal to solver: the block sizes and instruction sets for which the chain kernels are compiled (block_lanes.inc has the operations on columns).
#ifndef SELDINGER_SOLVER_BLOCK_LANES_H
#define SELDINGER_SOLVER_BLOCK_LANES_H

#include "base/base.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

// Loops over the columns must be unrolled; otherwise small blocks do not stay in registers.
#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL _Pragma("GCC unroll 16")
#define ROLL _Pragma("GCC unroll 1")
#else
#define UNROLL
#define ROLL
#endif

// A column has room for a right-hand side after the last row and is padded to a multiple of eight.
#define BLOCK_COLUMN(size) (((size) + 8) / 8 * 8)
#define BLOCK_PANEL(size) ((size)*BLOCK_COLUMN(size))

// Tables of a kernel, indexed by block_size_index() and simd_level(). In the kernel's name SIZE precedes the instruction set.
#define BLOCK_VARIANT(name) SIMD_JOIN(name, SIZE)
#define BLOCK_FORMS(name)                                                                                                                                      \
    {                                                                                                                                                          \
        SIMD_FORMS(name##_6), SIMD_FORMS(name##_8), SIMD_FORMS(name##_10), SIMD_FORMS(name##_12)                                                               \
    }
// Zeroed doubles, aligned to 64 bytes. As calloc() gives them, so that pages that are never used take no memory: many nodes are never factored.
static inline double *block_zeros(size_t count)
{
    enum { ALIGN = 64 };
    char *all = calloc(count * sizeof(double) + 2 * ALIGN, 1);
    if (!all)
        return NULL;
    char *at = all + ALIGN + (ALIGN - (uintptr_t)all % ALIGN) % ALIGN;
    ((void **)(void *)at)[-1] = all;
    return (double *)(void *)at;
}
static inline void block_zeros_free(double *zeros)
{
    if (zeros)
        free(((void **)zeros)[-1]);
}
enum { BLOCK_SIZES = 4 };
static inline int block_size_index(int size) { return (size - 6) / 2; }

#endif
