// One kernel source, compiled for each instruction set. See field_lanes.h for the layouts and for why all give the same bits, blobby.h for the equations.
// Compiled with -fno-math-errno and -fno-trapping-math, which change no result but allow square roots and selects to be vectorised.
#include "geom/field_lanes.h"

#include "base/base.h"

#include <stddef.h>
#if SIMD_HAS_AVX
#include <immintrin.h>
#endif

_Static_assert(offsetof(VesselMemory, place) == 8 * MEMORY_PLACE && offsetof(VesselMemory, normal) == 8 * MEMORY_NORMAL &&
                   offsetof(VesselMemory, hessian) == 8 * MEMORY_HESSIAN && offsetof(VesselMemory, miss) == 8 * MEMORY_MISS &&
                   offsetof(VesselMemory, step) == 8 * MEMORY_STEP && offsetof(VesselMemory, trust) == 8 * MEMORY_TRUST &&
                   offsetof(VesselMemory, held_at) == 8 * MEMORY_HELD_AT && offsetof(VesselMemory, held_for2) == 8 * MEMORY_HELD_FOR2 &&
                   offsetof(VesselMemory, bound_at) == 8 * MEMORY_BOUND_AT && offsetof(VesselMemory, bound_for) == 8 * MEMORY_BOUND_FOR &&
                   offsetof(VesselMemory, down) == 8 * MEMORY_DOWN && offsetof(VesselMemory, up) == 8 * MEMORY_UP,
               "memories are rows of doubles");
_Static_assert(offsetof(VesselHit, normal) == 8 && offsetof(VesselHit, hessian) == 32 && offsetof(VesselHit, node) == 8 * HIT_ROW, "and so are hits");

void field_directions(Vec3 *direction, int count)
{
    SEL_ASSERT(count > 0, "at least one direction is requested");
    for (int k = 0; k < count; k++) {
        double z = 1 - (2 * k + 1) / (double)count, out = sqrt(1 - z * z), angle = k * PI * (3 - sqrt(5));
        direction[k] = vec3(out * same_cos(angle), out * same_sin(angle), z);
    }
}

static void add_clear_point(ClearPoints *points, Vec3 p)
{
    int at = points->count++;
    points->x[at] = (float)p.x, points->y[at] = (float)p.y, points->z[at] = (float)p.z;
    points->square[at] = (float)vec3_norm2(p);
}

void field_clear_points(ClearPoints *points)
{
    static const int count[] = {CLEAR_ON_OUTER, CLEAR_ON_INNER};
    static const double sphere[] = {CLEAR_OUTER, CLEAR_INNER};
    Vec3 direction[CLEAR_ON_OUTER];
    points->count = 0;
    for (int s = 0; s < 2; s++) {
        field_directions(direction, count[s]);
        for (int k = 0; k < count[s]; k++)
            add_clear_point(points, vec3_scale(direction[k], sphere[s]));
    }
}

void field_clear_rings(ClearPoints *points)
{
    static const double from_axis[] = {0.38, 0.6, 0.82, 1.04};       // [rad]
    static const int count[] = {18, 24, 26, 28};
    points->count = 0;
    for (int r = 0; r < 4; r++)
        for (int k = 0; k < count[r]; k++) {
            double angle = 2 * PI * (k + 0.5 * (r % 2)) / count[r], out = same_sin(from_axis[r]);
            add_clear_point(points, vec3(out * same_cos(angle), out * same_sin(angle), same_cos(from_axis[r])));
        }
    SEL_ASSERT(points->count == CLEAR_ON_RINGS, "the rings' points are a multiple of the lanes");
}

void field_turn_points(const ClearPoints *points, Vec3 axis, ClearPoints *turned)
{
    Vec3 across = vec3_normal_to(axis), along = vec3_cross(axis, across);
    const float ax = (float)across.x, ay = (float)across.y, az = (float)across.z, bx = (float)along.x, by = (float)along.y, bz = (float)along.z;
    const float cx = (float)axis.x, cy = (float)axis.y, cz = (float)axis.z;
    turned->count = points->count;
    for (int k = 0; k < points->count; k++) {
        turned->x[k] = ax * points->x[k] + bx * points->y[k] + cx * points->z[k];
        turned->y[k] = ay * points->x[k] + by * points->y[k] + cy * points->z[k];
        turned->z[k] = az * points->x[k] + bz * points->y[k] + cz * points->z[k];
        turned->square[k] = points->square[k];
    }
}

#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
        load_##set, sample_##set, newton_##set, finish_##set, store_##set, pick_##set, bends_##set, is_clear_##set, look_##set                                 \
    }

#define KERNEL_TEXT "geom/field_kernel.inc"
#include "base/each_simd.inc"
static const FieldKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

const FieldKernels *field_kernels(int isa) { return &kernel_table[simd_choose(isa)]; }
