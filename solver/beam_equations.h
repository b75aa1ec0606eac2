// Equations of the corotational beam element, for one element and for the lanes of a chain. Internal to beam_element.c and beam_chain.c.
//
// Nodes 1 and 2 have positions x_i and frames R_i; the chord is e = (x2 - x1) / l. A circular section has the same bending stiffness in all directions,
// so that no frame has to rotate with the chord: the tangents at the nodes are sufficient.
//   t_i     = R_i c_i            c_i: direction of the rest chord in the frame of node i (e1 where the element is straight at rest)
//   theta_i = g(e . t_i) e x t_i bending angle from chord to tangent, g = angle / sine
//   psi     = x component of the rotation vector of F1' F2, F_i = R_i C_i: twist, exact where curvature and twist are constant
//   bow     = L/30 (2 |b1|^2 - b1 . b2 + 2 |b2|^2)   arc length minus chord of the cubic shape, b_i = g(e . a_i) e x a_i, a_i = R_i e1
//   ext     = l + bow - extend
//   E = EA/(2L) ext^2 + c/2 (|theta1|^2 + |theta2|^2) + d theta1 . theta2 + GJ/(2L) psi^2
//   c - d = 2 EI / L,  c + d = 6 EI / ((1 + Phi) L),  Phi = 12 EI / (kappa G A L^2)
// Several coaxial tools (coaxial.c) additionally need only a separate c at each end, c1 and c2, rest chords that are not mirror images, and a rest twist.
// Forces are the exact derivative of E. E is invariant under rigid motion, under reflection, and under exchange of the nodes with e and the frames reversed.
// The bow shortens the chord with the square of the bending angles. Without it a chain rolls up to a polygon whose chords (not arcs) have the rest length,
// (pi/N)^2/6 too large. Its second derivative is the consistent geometric stiffness. g is a polynomial in z = (1 - e . t)/2 = sin^2(angle/2), truncated
// after z^7: its error is 3e-9 at 0.64 rad, and unlike acos it is smooth everywhere.
//
// Tangent stiffness: J' C J (main part, positive semi-definite) plus the geometric stiffness of a tension only: that of a compression would make the
// matrix indefinite (docs/design.md, "Stability", 2). To first order in the angles
//   d theta_i = B_i d phi_i + D_i (d x2 - d x1),   B_i = s_i I - t_i e',   D_i = -[t_i]x P / l,   s_i = e . t_i,   P = I - e e'
// B_i is used rather than P because B_i t_i = 0: spinning a bent wire about its own tangent then costs no energy, which is correct. With P the matrix had
// a stiffness EI k^2 per length against spin and too little elsewhere; the eigenvalues of the true Hessian relative to it reached 9 in a wire coiled
// in a capsule (above 2 a Newton step overshoots, and the coil oscillated until it left the vessel). With B they stay below 1.02 in equilibrium.
// The derivative of the extension is exact, because the axial stiffness is the largest. Sines in place of angles in it (5 % off at 0.3 rad) gave
// eigenvalues of 2.9 for elements of 10 mm length and 0.1 mm diameter that rotate by 0.63 rad and 13 at 0.9 rad, and the steps alternated without
// converging. They are now 1.11 and 1.23.
#ifndef SELDINGER_SOLVER_BEAM_EQUATIONS_H
#define SELDINGER_SOLVER_BEAM_EQUATIONS_H

#include "base/base.h"
#include "solver/beam.h"

#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL _Pragma("GCC unroll 3")
#else
#define UNROLL
#endif

// Angle / sine and its derivative with respect to the cosine, from z = sin^2(angle/2): sum of 4^k (k!)^2 / (2k+1)! z^k.
INLINE double angle_over_sine(double z, double *slope)
{
    const double a1 = 2.0 / 3, a2 = 8.0 / 15, a3 = 16.0 / 35, a4 = 128.0 / 315, a5 = 256.0 / 693, a6 = 1024.0 / 3003, a7 = 2048.0 / 6435;
    *slope = -0.5 * (a1 + z * (2 * a2 + z * (3 * a3 + z * (4 * a4 + z * (5 * a5 + z * (6 * a6 + z * (7 * a7)))))));
    return 1 + z * (a1 + z * (a2 + z * (a3 + z * (a4 + z * (a5 + z * (a6 + z * a7))))));
}

INLINE Vec3 first_axis(Quat q) { return vec3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)); }

typedef struct Bend {        // bending angle from the chord e to a tangent t
    Vec3 t, n, angle;        // n = e x t
    double s, g, h;          // e . t, angle / sine, derivative of g with respect to s
} Bend;

INLINE Bend bend_from(Vec3 e, Vec3 t)
{
    Bend b;
    b.t = t;
    b.n = vec3_cross(e, t);
    b.s = vec3_dot(e, t);
    b.g = angle_over_sine(0.5 * (1 - b.s), &b.h);
    b.angle = vec3_scale(b.n, b.g);
    return b;
}

// Given m = dE/d angle: returns the derivative of E with respect to a rotation of t and adds dE/de to *along.
INLINE Vec3 bend_back(const Bend *b, Vec3 e, Vec3 m, Vec3 *along)
{
    double mn = b->h * vec3_dot(m, b->n);
    *along = vec3_add(*along, vec3_add_scaled(vec3_scale(vec3_cross(b->t, m), b->g), mn, b->t));
    Vec3 turn = vec3_scale(vec3_add_scaled(vec3_scale(m, b->s), -vec3_dot(b->t, m), e), b->g);
    return vec3_add_scaled(turn, -mn, b->n);
}

// End properties of an element of several tools. A single uniform tool has the same stiffness at both ends, mirrored rest chords and no rest twist (element()).
typedef struct BeamEnds {
    double near1, near2;     // [N mm] c of each end; d is in->far
    Quat rest1, rest2;       // from each node's frame to the rest chord, (w, 0, y, z)
    double twist;            // [rad] at rest
} BeamEnds;

INLINE void element_between(const BeamInput *in, BeamEnds ends, bool is_curved, BeamOutput *out)
{
    Vec3 d = vec3_sub(in->x2, in->x1);
    double l = sqrt(vec3_norm2(d)), inverse = 1 / l;
    Vec3 e = vec3_scale(d, inverse);
    Quat f1 = in->q1, f2 = in->q2;
    if (is_curved) {
        f1 = quat_mul(in->q1, ends.rest1);
        f2 = quat_mul(in->q2, ends.rest2);
    }
    Bend c1 = bend_from(e, first_axis(f1)), c2 = bend_from(e, first_axis(f2));
    Bend b1 = c1, b2 = c2;
    if (is_curved) {
        b1 = bend_from(e, first_axis(in->q1));
        b2 = bend_from(e, first_axis(in->q2));
    }

    // axial strain, including the bow
    double share = in->length * (1.0 / 30);
    Vec3 bow1 = vec3_scale(vec3_sub(vec3_scale(b1.angle, 4), b2.angle), share);
    Vec3 bow2 = vec3_scale(vec3_sub(vec3_scale(b2.angle, 4), b1.angle), share);
    double bow = 0.5 * (vec3_dot(bow1, b1.angle) + vec3_dot(bow2, b2.angle));
    double extension = l + bow - in->extend, tension = in->axial * extension;

    // bending
    Vec3 m1 = vec3_add(vec3_scale(c1.angle, ends.near1), vec3_scale(c2.angle, in->far));
    Vec3 m2 = vec3_add(vec3_scale(c2.angle, ends.near2), vec3_scale(c1.angle, in->far));
    double energy = 0.5 * (tension * extension + vec3_dot(m1, c1.angle) + vec3_dot(m2, c2.angle));
    // the second derivative of theta with respect to a spin of the node is minus the rest angle, b - c
    double spin1 = is_curved ? vec3_dot(m1, vec3_sub(b1.angle, c1.angle)) : 0, spin2 = is_curved ? vec3_dot(m2, vec3_sub(b2.angle, c2.angle)) : 0;

    // torsion: p = (w, v) is the rotation from F1 to F2 in the frame F1
    Quat p = quat_mul(quat_conjugate(f1), f2);
    double h, g = angle_over_sine(0.5 * (1 - p.w), &h);
    double psi = 2 * g * p.x - ends.twist, torque = in->twist * psi;
    Vec3 axis = vec3(g * p.w - h * p.x * p.x, g * p.z - h * p.x * p.y, -g * p.y - h * p.x * p.z);
    axis = quat_rotate(f1, axis);
    Vec3 turn = vec3_scale(axis, torque);
    energy += 0.5 * torque * psi;

    Vec3 along = vec3(0, 0, 0), bow_along = vec3(0, 0, 0);
    Vec3 t1 = vec3_sub(bend_back(&c1, e, m1, &along), turn), t2 = vec3_add(bend_back(&c2, e, m2, &along), turn);
    Vec3 by1 = bend_back(&b1, e, bow1, &bow_along), by2 = bend_back(&b2, e, bow2, &bow_along);
    out->chord1 = is_curved ? t1 : vec3(0, 0, 0);
    out->chord2 = is_curved ? t2 : vec3(0, 0, 0);
    along = vec3_scale(vec3_add_scaled(along, -vec3_dot(along, e), e), inverse);
    bow_along = vec3_scale(vec3_add_scaled(bow_along, -vec3_dot(bow_along, e), e), inverse);
    out->chord = e;
    out->tangent1 = c1.t;
    out->tangent2 = c2.t;
    out->stretch = vec3_add(e, bow_along);
    out->own1 = b1.t;
    out->own2 = b2.t;
    out->spin1 = spin1 > 0 ? spin1 : 0;
    out->spin2 = spin2 > 0 ? spin2 : 0;
    out->bow1 = by1;
    out->bow2 = by2;
    out->axis = axis;
    out->force2 = vec3_add_scaled(along, tension, out->stretch);
    out->moment1 = vec3_add_scaled(t1, tension, by1);
    out->moment2 = vec3_add_scaled(t2, tension, by2);
    out->inverse = inverse;
    out->tension = tension;
    out->torque = torque;
    out->energy = energy;
    out->bow = bow;
    out->angle1 = c1.angle;
    out->angle2 = c2.angle;
    out->turn1 = b1.angle;
    out->turn2 = b2.angle;
}

INLINE void element(const BeamInput *in, bool is_curved, BeamOutput *out)
{
    Quat rest1 = {in->half_w, 0, in->half_y, in->half_z}, rest2 = {in->half_w, 0, -in->half_y, -in->half_z};
    element_between(in, (BeamEnds){in->near, in->near, rest1, rest2, 0}, is_curved, out);
}

// Distinct entries of the tangent of an element. With A = [tt, tr; tr', rr] for the unknowns (displacement, rotation) of each node,
//   k11 = [-F_TT, -N_TR; ., N_RR]   k21 = [F_TT, N_TR; F_TR', N_FAR]   k22 = [-F_TT, -F_TR; ., F_RR]
// N_ rows belong to the first node of the element, F_ rows to the second; signs are those of k21. Symmetric blocks have six entries (SYM).
// The gradient of the energy follows the tangent.
enum { N_TR = 0, N_RR = 9, N_FAR = 15, N_MOMENT = 24, N_ROWS = 27 };
enum { F_TT = 0, F_TR = 6, F_RR = 15, F_FORCE = 21, F_MOMENT = 24, F_ROWS = 27 };
static const int SYM[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

typedef struct Columns {
    double v[3];
} Columns;
INLINE Columns columns(Vec3 v) { return (Columns){{v.x, v.y, v.z}}; }

// Coupling between the displacement of node 2 and the rotation of node j, with T = sum over i of C_ij t_i:
//   sum over i of D_i' C_ij B_j = (s_j P [T]x - P (T x t_j) e') / l,   P [T]x = [T]x - e (e x T)'
typedef struct Coupling {
    double m[3][3];
} Coupling;
INLINE Coupling coupling(Vec3 e, Vec3 sum, Vec3 tangent, double s, double inverse)
{
    Vec3 around = vec3_scale(vec3_cross(sum, tangent), inverse), turn = vec3_scale(sum, inverse * s);
    Columns v = columns(e), w = columns(vec3_add_scaled(around, -vec3_dot(around, e), e)), across = columns(vec3_cross(e, turn));
    double skew[3][3] = {{0, -turn.z, turn.y}, {turn.z, 0, -turn.x}, {-turn.y, turn.x, 0}};
    Coupling k;
    UNROLL
    for (int i = 0; i < 3; i++)
        UNROLL
    for (int j = 0; j < 3; j++)
        k.m[i][j] = i == j ? -v.v[i] * across.v[j] - w.v[i] * v.v[j] : skew[i][j] - v.v[i] * across.v[j] - w.v[i] * v.v[j];
    return k;
}

// Rows of the tangent: the main part times `scale`, plus the geometric part of the tension `pull` >= 0. Row k is at [k * stride].
INLINE void tangent_rows(const BeamOutput *o, double length, double axial, double near1, double near2, double far, double twist, double scale, double pull,
                         bool is_curved, double *restrict n, int n_stride, double *restrict f, int f_stride)
{
    double inverse = o->inverse, ka = axial * scale, kt = twist * scale;
    double c1 = near1 * scale + pull * length * (4.0 / 30), c2 = near2 * scale + pull * length * (4.0 / 30), d = far * scale - pull * length * (1.0 / 30);
    Vec3 e = o->chord, t1 = o->tangent1, t2 = o->tangent2;
    double s1 = vec3_dot(e, t1), s2 = vec3_dot(e, t2), t12 = vec3_dot(t1, t2), i2 = inverse * inverse;
    double a = (c1 + c2 + 2 * (d * t12)) * i2 + pull * inverse;
    Coupling u1 = coupling(e, vec3_add(vec3_scale(t1, c1), vec3_scale(t2, d)), t1, s1, inverse);
    Coupling u2 = coupling(e, vec3_add(vec3_scale(t1, d), vec3_scale(t2, c2)), t2, s2, inverse);
    Columns v = columns(e), ext = columns(o->stretch), w1 = columns(o->bow1), w2 = columns(o->bow2), g = columns(o->axis);
    Columns a1 = columns(o->own1), a2 = columns(o->own2);
    Columns p1 = columns(t1), p2 = columns(t2), q1 = columns(vec3_add_scaled(t1, -s1, e)), q2 = columns(vec3_add_scaled(t2, -s2, e));
    UNROLL
    for (int i = 0; i < 3; i++) {
        // rows of B_i' B_j and of the second-order remainder of D_i' D_j
        double av = a * v.v[i], x1 = i2 * (c1 * q1.v[i] + d * q2.v[i]), x2 = i2 * (c2 * q2.v[i] + d * q1.v[i]);
        double y11 = c1 * (v.v[i] - s1 * p1.v[i]), z11 = c1 * s1 * v.v[i], y22 = c2 * (v.v[i] - s2 * p2.v[i]), z22 = c2 * s2 * v.v[i];
        double y21 = d * (t12 * v.v[i] - s2 * p1.v[i]), z21 = d * s1 * v.v[i];
        double ke = ka * ext.v[i], k1 = ka * w1.v[i], k2 = ka * w2.v[i], kg = kt * g.v[i];
        UNROLL
        for (int j = 0; j < 3; j++) {
            double r21 = y21 * v.v[j] - z21 * p2.v[j] + k2 * w1.v[j] - kg * g.v[j];
            n[(N_TR + 3 * i + j) * n_stride] = u1.m[i][j] + ke * w1.v[j];
            f[(F_TR + 3 * i + j) * f_stride] = -u2.m[i][j] - ke * w2.v[j];
            n[(N_FAR + 3 * i + j) * n_stride] = i == j ? d * s1 * s2 + r21 : r21;
            if (j < i)
                continue;
            double tt = av * v.v[j] + x1 * q1.v[j] + x2 * q2.v[j] - ke * ext.v[j];
            double r11 = y11 * v.v[j] - z11 * p1.v[j] + k1 * w1.v[j] + kg * g.v[j];
            double r22 = y22 * v.v[j] - z22 * p2.v[j] + k2 * w2.v[j] + kg * g.v[j];
            if (is_curved)
                r11 += o->spin1 * a1.v[i] * a1.v[j], r22 += o->spin2 * a2.v[i] * a2.v[j];
            f[(F_TT + SYM[i][j]) * f_stride] = i == j ? tt - a : tt;
            n[(N_RR + SYM[i][j]) * n_stride] = i == j ? c1 * s1 * s1 + r11 : r11;
            f[(F_RR + SYM[i][j]) * f_stride] = i == j ? c2 * s2 * s2 + r22 : r22;
        }
    }
}

// Converts the rows of one element to blocks.
INLINE void blocks_from_rows(const double n[N_ROWS], const double f[F_ROWS], BeamTangent *tangent)
{
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

#endif
