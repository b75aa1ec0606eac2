#include "base/simd.h"

#include <stdlib.h>
#include <string.h>

const char *const simd_name[SIMD_COUNT] = {"sse2", "avx2", "avx512"};

static int forced = -1;

SimdLevel simd_widest(void)
{
#if defined(__x86_64__) && defined(__GNUC__)
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
    forced = (int)(level < widest ? level : widest);
}

SimdLevel simd_level(void)
{
    if (forced < 0) {
        const char *name = getenv("SELDINGER_SIMD");
        SimdLevel level = simd_widest();
        for (int i = 0; name && i < SIMD_COUNT; i++)
            if (!strcmp(name, simd_name[i]))
                level = (SimdLevel)i;
        simd_force(level);
    }
    return (SimdLevel)forced;
}
