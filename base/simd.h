// Which of a kernel's forms to run: one answer for the whole program, so that a level can be forced and compared. All forms give the same bits.
#ifndef SELDINGER_BASE_SIMD_H
#define SELDINGER_BASE_SIMD_H

typedef enum { SIMD_SSE2, SIMD_AVX2, SIMD_AVX512, SIMD_COUNT } SimdLevel;
extern const char *const simd_name[SIMD_COUNT];      // "sse2", "avx2", "avx512": the baseline is whatever the compiler takes for granted

// The widest level that the CPU has, or the narrower one that the environment variable SELDINGER_SIMD names (read once) or simd_force() asked for.
SimdLevel simd_level(void);
// The widest that the CPU has.
SimdLevel simd_widest(void);
// Not while another thread computes. Levels above simd_widest() are cut to it.
void simd_force(SimdLevel level);

#endif
