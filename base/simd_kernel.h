// Macros for kernels: loops compiled once for each instruction set. The code of a kernel is a file that base/each_simd.inc includes; it is called through a
// table indexed by
// simd_level() or simd_choose():
//
//   #define KERNEL_TEXT "solver/node_turn_kernel.inc"     // TARGET static void KERNEL(turn)(...) { ... }
//   #include "base/each_simd.inc"
//   static void (*const turn_on[SIMD_COUNT])(...) = SIMD_FORMS(turn);
//   ... turn_on[simd_level()](...);
//
// Several kernels that are used together can be grouped in a structure: SIMD_EACH(MACRO), where MACRO(set) makes the initialiser from names that end in
// `_##set`.
#ifndef SELDINGER_BASE_SIMD_KERNEL_H
#define SELDINGER_BASE_SIMD_KERNEL_H

#include "base/simd.h"

// The helper functions of a kernel are compiled for its instruction set only if they are inlined.
#define INLINE static inline __attribute__((always_inline))
// Placed before a loop whose lanes are independent.
#if defined(__GNUC__) && !defined(__clang__)
#define VECTOR_LOOP _Pragma("GCC ivdep")
#else
#define VECTOR_LOOP
#endif

#define SIMD_PASTE(name, set) name##_##set
#define SIMD_JOIN(name, set) SIMD_PASTE(name, set)
#if SIMD_HAS_AVX
#define SIMD_EACH(MACRO)                                                                                                                                       \
    {                                                                                                                                                          \
        MACRO(sse2), MACRO(avx2), MACRO(avx512)                                                                                                                \
    }
#define SIMD_FORMS(name)                                                                                                                                       \
    {                                                                                                                                                          \
        name##_sse2, name##_avx2, name##_avx512                                                                                                                \
    }
#else
#define SIMD_EACH(MACRO)                                                                                                                                       \
    {                                                                                                                                                          \
        MACRO(sse2), MACRO(sse2), MACRO(sse2)                                                                                                                  \
    }
#define SIMD_FORMS(name)                                                                                                                                       \
    {                                                                                                                                                          \
        name##_sse2, name##_sse2, name##_sse2                                                                                                                  \
    }
#endif

#endif
