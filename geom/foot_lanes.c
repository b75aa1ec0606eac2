// One kernel source, compiled for each instruction set. See blob_lanes.h and foot_lanes.h for the layouts and for why all give the same bits, blobby.c for the
// equations. Compiled with -fno-math-errno and -fno-trapping-math, which change no result but allow square roots and selects to be vectorised.
#include "geom/foot_lanes.h"

#include "base/base.h"

#include <string.h>

#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
#set, gradient_##set, hessian_##set, predict_##set, newton_##set, finish_##set, estimate_##set, partner_##set, mix_##set, settle_##set, near_##set     \
    }

#define KERNEL_TEXT "geom/blob_kernel.inc"
#include "base/each_simd.inc"
static const LaneKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

const LaneKernels *lane_kernels(int isa) { return &kernel_table[simd_choose(isa)]; }
