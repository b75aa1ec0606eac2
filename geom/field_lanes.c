// One kernel text, three compilations. See field_lanes.h for the layouts and why the bits agree, blobby.h for the equations.
// Compiled with -fno-math-errno and -fno-trapping-math, which change no result, so that roots and selects vectorise.
#include "geom/field_lanes.h"

#include "base/assert.h"

#include "base/same_math.h"
#include "base/simd.h"

#include <stddef.h>
#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#endif

_Static_assert(offsetof(VesselMemory, place) == 8 * MEMORY_PLACE && offsetof(VesselMemory, normal) == 8 * MEMORY_NORMAL &&
              offsetof(VesselMemory, hessian) == 8 * MEMORY_HESSIAN && offsetof(VesselMemory, miss) == 8 * MEMORY_MISS &&
              offsetof(VesselMemory, step) == 8 * MEMORY_STEP && offsetof(VesselMemory, trust) == 8 * MEMORY_TRUST &&
              offsetof(VesselMemory, held_at) == 8 * MEMORY_HELD_AT && offsetof(VesselMemory, held_for2) == 8 * MEMORY_HELD_FOR2 &&
              offsetof(VesselMemory, bound_at) == 8 * MEMORY_BOUND_AT && offsetof(VesselMemory, bound_for) == 8 * MEMORY_BOUND_FOR &&
              offsetof(VesselMemory, down) == 8 * MEMORY_DOWN && offsetof(VesselMemory, up) == 8 * MEMORY_UP, "memories are rows of doubles");
_Static_assert(offsetof(VesselHit, normal) == 8 && offsetof(VesselHit, hessian) == 32 && offsetof(VesselHit, node) == 8 * HIT_ROW, "so are answers");

void field_directions(Vec3 *way, int count)
{
    SEL_ASSERT(count > 0, "at least one direction is asked for");
    for (int k = 0; k < count; k++) {
        double z = 1 - (2 * k + 1) / (double)count, out = sqrt(1 - z * z), angle = k * PI * (3 - sqrt(5));
        way[k] = vec3(out * same_cos(angle), out * same_sin(angle), z);
    }
}

void field_clear_points(ClearPoints *points)
{
    static const int count[] = {CLEAR_ON_OUTER, CLEAR_ON_INNER};
    static const double sphere[] = {CLEAR_OUTER, CLEAR_INNER};
    Vec3 way[CLEAR_ON_OUTER];
    for (int s = 0, at = 0; s < 2; s++) {
        field_directions(way, count[s]);
        for (int k = 0; k < count[s]; k++, at++) {
            points->x[at] = (float)(sphere[s] * way[k].x);
            points->y[at] = (float)(sphere[s] * way[k].y);
            points->z[at] = (float)(sphere[s] * way[k].z);
        }
    }
}

#define KERNEL_TABLE(isa) {load_##isa, sample_##isa, newton_##isa, finish_##isa, store_##isa, pick_##isa, bends_##isa, is_clear_##isa, look_##isa}

#define WIDTH 2
#define TARGET
#define KERNEL(name) name##_baseline
#include "geom/field_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
static const FieldKernels baseline = KERNEL_TABLE(baseline);

#if defined(__x86_64__) && defined(__GNUC__)
#define WIDTH 4
#define TARGET __attribute__((target("avx2")))
#define KERNEL(name) name##_avx2
#include "geom/field_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
static const FieldKernels avx2 = KERNEL_TABLE(avx2);

#define WIDTH 8
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))
#define KERNEL(name) name##_avx512
#include "geom/field_kernel.inc"
#undef WIDTH
#undef TARGET
#undef KERNEL
static const FieldKernels avx512 = KERNEL_TABLE(avx512);

const FieldKernels *field_kernels(int isa)
{
    static const FieldKernels *const of[SIMD_COUNT] = {&baseline, &avx2, &avx512};
    SEL_ASSERT(isa >= 0 && isa <= SIMD_COUNT, "instruction sets are 0 to 3");
    int wanted = isa > 0 ? isa - 1 : (int)simd_level(), widest = (int)simd_widest();
    return of[wanted < widest ? wanted : widest];
}
#else
const FieldKernels *field_kernels(int isa)
{
    (void)isa;
    return &baseline;
}
#endif
