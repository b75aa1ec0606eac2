// exp(r/2) = (cos(a/2), sin(a/2) r/a), a = |r|, by series in (a/2)^2; the truncation error is below 1e-16 at 2.5 rad.
#include "solver/node_turn.h"

#include "base/base.h"

INLINE Quat turned(double rx, double ry, double rz, Quat q)
{
    double z = 0.25 * (rx * rx + ry * ry + rz * rz), cosine = -1.0 / 6402373705728000, sine = -1.0 / 121645100408832000;     // -1/18!, -1/19!
    cosine = 1.0 / 20922789888000 + z * cosine, sine = 1.0 / 355687428096000 + z * sine;
    cosine = -1.0 / 87178291200 + z * cosine, sine = -1.0 / 1307674368000 + z * sine;
    cosine = 1.0 / 479001600 + z * cosine, sine = 1.0 / 6227020800 + z * sine;
    cosine = -1.0 / 3628800 + z * cosine, sine = -1.0 / 39916800 + z * sine;
    cosine = 1.0 / 40320 + z * cosine, sine = 1.0 / 362880 + z * sine;
    cosine = -1.0 / 720 + z * cosine, sine = -1.0 / 5040 + z * sine;
    cosine = 1.0 / 24 + z * cosine, sine = 1.0 / 120 + z * sine;
    cosine = -1.0 / 2 + z * cosine, sine = -1.0 / 6 + z * sine;
    cosine = 1 + z * cosine, sine = 0.5 * (1 + z * sine);
    Quat p = quat_mul((Quat){cosine, sine * rx, sine * ry, sine * rz}, q);
    // one Newton step towards unit length suffices, because only rounding has changed it
    double scale = 1.5 - 0.5 * (p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
    return (Quat){p.w * scale, p.x * scale, p.y * scale, p.z * scale};
}

#define KERNEL_TEXT "solver/node_turn_kernel.inc"
#include "base/each_simd.inc"
static void (*const turn_on[SIMD_COUNT])(int, const double *, const double *, const double *, Quat *) = SIMD_FORMS(turn);

void node_turn(int count, const double *rx, const double *ry, const double *rz, Quat *q)
{
    SEL_ASSERT(count >= 0, "the number of nodes is not negative");
    turn_on[simd_level()](count, rx, ry, rz, q);
}
