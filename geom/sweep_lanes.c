// One kernel source, compiled for each instruction set. See sweep_lanes.h for the layouts. Compiled with -fno-math-errno and -fno-trapping-math, which change
// no result but allow square roots and selects to be vectorised.
#include "geom/sweep_lanes.h"

#include "base/base.h"

#include <stddef.h>
#include <string.h>
#if SIMD_HAS_AVX
#include <immintrin.h>
#endif

_Static_assert(offsetof(SweepSegment, origin) == 8 * 12 && offsetof(SweepSegment, n) == 8 * 16 && offsetof(SweepSegment, b) == 8 * 28 &&
                   offsetof(SweepSegment, section) == 8 * 40 && SWEEP_SEGMENT_ROW == 112,
               "segments are rows of doubles");
_Static_assert(40 + 8 * (SWEEP_HARMONICS + 1) <= SWEEP_SEGMENT_ROW, "the tiles of all terms lie in the row");

#define DIAGONAL 0.70710678118654752440
#define WIDE 0.92387953251128675613
#define THIN 0.38268343236508977173
const double sweep_ring_cos[SWEEP_RING] = {1, WIDE, DIAGONAL, THIN, 0, -THIN, -DIAGONAL, -WIDE, -1, -WIDE, -DIAGONAL, -THIN, 0, THIN, DIAGONAL, WIDE};
const double sweep_ring_sin[SWEEP_RING] = {0, THIN, DIAGONAL, WIDE, 1, WIDE, DIAGONAL, THIN, 0, -THIN, -DIAGONAL, -WIDE, -1, -WIDE, -DIAGONAL, -THIN};

#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
        seek_##set, evaluate_##set, evaluate_slope_##set, blend_##set, blend_slope_##set, blobs_slope_##set, width_##set, ring_##set, rings_##set,             \
            minima_##set, near_field_##set, predict_##set, newton_##set, finish_##set                                                                          \
    }

#define KERNEL_TEXT "geom/sweep_kernel.inc"
#include "base/each_simd.inc"
static const SweepKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

const SweepKernels *sweep_kernels(int isa) { return &kernel_table[simd_choose(isa)]; }
