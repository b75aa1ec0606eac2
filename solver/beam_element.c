// A single element (equations in beam_equations.h) and the length-dependent quantities that the chain and the sheath need.
#include "solver/beam_equations.h"
#include "base/base.h"

void beam_element(const BeamInput *in, BeamOutput *out)
{
    SEL_ASSERT(in->length > 0, "an element has a length");
    SEL_ASSERT(quat_is_unit(in->q1) && quat_is_unit(in->q2), "frames are unit quaternions");
    element(in, in->half_w < 1, out);
}

void beam_tangent(const BeamInput *in, const BeamOutput *out, double scale, BeamTangent *tangent)
{
    double n[N_ROWS], f[F_ROWS];
    tangent_rows(out, in->length, in->axial, in->near, in->near, in->far, in->twist, scale, out->tension > 0 ? out->tension : 0, in->half_w < 1, n, 1, f, 1);
    blocks_from_rows(n, f, tangent);
}

void beam_bending(double length, double bending, double shear, double *near, double *far)
{
    SEL_ASSERT(length > 0 && bending > 0 && shear > 0, "a beam has a length and stiffness");
    double sum = 6 * bending * shear * length / (shear * length * length + 12 * bending), difference = 2 * bending / length;
    *near = 0.5 * (sum + difference);
    *far = 0.5 * (sum - difference);
}

void beam_bending_slope(double length, double bending, double shear, double *near, double *far)
{
    SEL_ASSERT(length > 0 && bending > 0 && shear > 0, "a beam has a length and stiffness");
    double q = shear * length * length + 12 * bending;
    double sum = 6 * bending * shear * (12 * bending - shear * length * length) / (q * q), difference = -2 * bending / (length * length);
    *near = 0.5 * (sum + difference);
    *far = 0.5 * (sum - difference);
}

double beam_arc_rest(double length, double curvature, double *slope)
{
    SEL_ASSERT(length > 0 && curvature >= 0, "the arc has a positive length and a curvature that is not negative");
    // chord = 2/k sin(kL/2), bow = k^2 L^3 / 24; the remainder is k^4 L^5 / 1920 ...
    double half = 0.5 * curvature * length, q = half * half;
    if (half < 0.02) {
        *slope = -q * q / 24 * (1 - q / 30);
        return -length * q * q / 120 * (1 - q / 42);
    }
    *slope = 1 - same_cos(half) - 0.5 * q;
    return length * (1 - same_sin(half) / half - q / 6);
}
