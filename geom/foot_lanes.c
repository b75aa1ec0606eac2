// One kernel text, three compilations. See blob_lanes.h and foot_lanes.h for the layouts and why the bits agree, blobby.c for the equations.
// Compiled with -fno-math-errno and -fno-trapping-math, which change no result, so that roots and selects vectorise.
#include "geom/foot_lanes.h"

#include "base/assert.h"

#include "base/simd.h"

#include <string.h>

#define KERNEL_TABLE(isa) \
    {#isa, gradient_##isa, hessian_##isa, predict_##isa, newton_##isa, finish_##isa, estimate_##isa, partner_##isa, mix_##isa, settle_##isa, near_##isa}

#define WIDTH 2
#define TARGET
#define KERNEL(name) name##_baseline
#include "geom/blob_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
static const LaneKernels baseline = KERNEL_TABLE(baseline);

#if defined(__x86_64__) && defined(__GNUC__)
#define WIDTH 4
#define TARGET __attribute__((target("avx2")))
#define KERNEL(name) name##_avx2
#include "geom/blob_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
static const LaneKernels avx2 = KERNEL_TABLE(avx2);

#define WIDTH 8
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))
#define KERNEL(name) name##_avx512
#include "geom/blob_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
static const LaneKernels avx512 = KERNEL_TABLE(avx512);

const LaneKernels *lane_kernels(int isa)
{
    static const LaneKernels *const of[SIMD_COUNT] = {&baseline, &avx2, &avx512};
    SEL_ASSERT(isa >= 0 && isa <= SIMD_COUNT, "instruction sets are 0 to 3");
    int wanted = isa > 0 ? isa - 1 : (int)simd_level(), widest = (int)simd_widest();
    return of[wanted < widest ? wanted : widest];
}
#else
const LaneKernels *lane_kernels(int isa)
{
    (void)isa;
    return &baseline;
}
#endif
