// Selects the instruction set of all kernels, so that a level can be forced and results compared. All levels give the same bits.
#ifndef SELDINGER_BASE_SIMD_H
#define SELDINGER_BASE_SIMD_H

// 1 if kernels are compiled for more than the compiler's default target (base/simd_kernel.h).
#if defined(__x86_64__) && defined(__GNUC__)
#define SIMD_HAS_AVX 1
#else
#define SIMD_HAS_AVX 0
#endif

typedef enum { SIMD_SSE2, SIMD_AVX2, SIMD_AVX512, SIMD_COUNT } SimdLevel;
extern const char *const simd_name[SIMD_COUNT];      // "sse2", "avx2", "avx512": the baseline is the compiler's default target

// The widest level of the CPU, or the narrower one set by the environment variable SELDINGER_SIMD (read once) or simd_force().
SimdLevel simd_level(void);
// The widest level that the CPU supports.
SimdLevel simd_widest(void);
// By number: 0 simd_level(), 1 SSE2, 2 AVX2, 3 AVX-512; a level that the CPU does not support becomes its widest.
SimdLevel simd_choose(int number);
// Must not be called while another thread computes. Levels above simd_widest() are clamped.
void simd_force(SimdLevel level);

#endif
