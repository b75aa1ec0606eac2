// One element: the equations of beam_equations.h, and what the chain and the sheath take from a length.
#include "solver/beam_equations.h"

void beam_element(const BeamInput *in, BeamOutput *out)
{
    element(in, in->half_w < 1, out);
}

void beam_tangent(const BeamInput *in, const BeamOutput *out, double scale, BeamTangent *tangent)
{
    double n[N_ROWS], f[F_ROWS];
    tangent_rows(out, in->length, in->axial, in->near, in->far, in->twist, scale, out->tension > 0 ? out->tension : 0, in->half_w < 1, n, 1, f, 1);
    double *k11 = tangent->k11, *k21 = tangent->k21, *k22 = tangent->k22;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int tt = 6 * i + j, tr = tt + 3, rt = 6 * (3 + j) + i, rr = 6 * (3 + i) + 3 + j, sym = SYM[i][j];
            k21[tt] = f[F_TT + sym];
            k21[tr] = n[N_TR + 3 * i + j];
            k21[rt] = f[F_TR + 3 * i + j];
            k21[rr] = n[N_FAR + 3 * i + j];
            k11[tt] = k22[tt] = -f[F_TT + sym];
            k11[tr] = k11[rt] = -n[N_TR + 3 * i + j];
            k22[tr] = k22[rt] = -f[F_TR + 3 * i + j];
            k11[rr] = n[N_RR + sym];
            k22[rr] = f[F_RR + sym];
        }
}

void beam_bending(double length, double bending, double shear, double *near, double *far)
{
    double sum = 6 * bending * shear * length / (shear * length * length + 12 * bending), difference = 2 * bending / length;
    *near = 0.5 * (sum + difference);
    *far = 0.5 * (sum - difference);
}

void beam_bending_slope(double length, double bending, double shear, double *near, double *far)
{
    double q = shear * length * length + 12 * bending;
    double sum = 6 * bending * shear * (12 * bending - shear * length * length) / (q * q), difference = -2 * bending / (length * length);
    *near = 0.5 * (sum + difference);
    *far = 0.5 * (sum - difference);
}

double beam_arc_rest(double length, double curvature, double *slope)
{
    // chord = 2/k sin(kL/2); bow = k^2 L^3 / 24: what is left is k^4 L^5 / 1920 ...
    double half = 0.5 * curvature * length, q = half * half;
    if (half < 0.02) {
        *slope = -q * q / 24 * (1 - q / 30);
        return -length * q * q / 120 * (1 - q / 42);
    }
    *slope = 1 - cos(half) - 0.5 * q;
    return length * (1 - sin(half) / half - q / 6);
}
