#include "base/simd.h"

#include "base/assert.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

const char *const simd_name[SIMD_COUNT] = {"sse2", "avx2", "avx512"};

// Several threads of an offline computation may call first; each finds the same level.
static atomic_int forced = -1;

SimdLevel simd_widest(void)
{
#if SIMD_HAS_AVX
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        return SIMD_AVX512;
    if (__builtin_cpu_supports("avx2"))
        return SIMD_AVX2;
#endif
    return SIMD_SSE2;
}

void simd_force(SimdLevel level)
{
    SimdLevel widest = simd_widest();
    atomic_store_explicit(&forced, (int)(level < widest ? level : widest), memory_order_relaxed);
}

SimdLevel simd_level(void)
{
    int known = atomic_load_explicit(&forced, memory_order_relaxed);
    if (known < 0) {
        const char *name = getenv("SELDINGER_SIMD");
        SimdLevel level = simd_widest();
        for (int i = 0; name && i < SIMD_COUNT; i++)
            if (!strcmp(name, simd_name[i]))
                level = (SimdLevel)i;
        simd_force(level);
        known = atomic_load_explicit(&forced, memory_order_relaxed);
    }
    return (SimdLevel)known;
}

SimdLevel simd_choose(int number)
{
    SEL_ASSERT(number >= 0 && number <= SIMD_COUNT, "instruction sets are numbered 1 to 3, and 0 leaves the choice open");
    SimdLevel widest = simd_widest(), wanted = number > 0 ? (SimdLevel)(number - 1) : simd_level();
    return wanted < widest ? wanted : widest;
}
