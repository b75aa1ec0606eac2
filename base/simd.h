// Selects the instruction set of all kernels, so that a level can be forced and compared. All levels give the same bits.
#ifndef SELDINGER_BASE_SIMD_H
#define SELDINGER_BASE_SIMD_H

typedef enum { SIMD_SSE2, SIMD_AVX2, SIMD_AVX512, SIMD_COUNT } SimdLevel;
extern const char *const simd_name[SIMD_COUNT];      // "sse2", "avx2", "avx512": the baseline is the compiler's default target

// The widest level of the CPU, or the narrower one given by the environment variable SELDINGER_SIMD (read once) or simd_force().
SimdLevel simd_level(void);
// The widest that the CPU has.
SimdLevel simd_widest(void);
// Not while another thread computes. Levels above simd_widest() are clamped.
void simd_force(SimdLevel level);

#endif
