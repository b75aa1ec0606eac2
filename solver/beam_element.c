// The corotational beam element. DESIGN section 3.
//
// Nodes 1 and 2 with positions x_i and frames R_i; chord e = (x2 - x1) / l. A circular section bends alike in all directions, so no
// frame has to turn with the chord: all that is needed are the node's tangents.
//   t_i     = R_i c_i            c_i: direction of the rest chord in the frame of node i (e1 where the element is straight at rest)
//   theta_i = g(e . t_i) e x t_i bending angle from chord to tangent, g = angle / sine
//   psi     = x component of the rotation vector of F1' F2, F_i = R_i C_i: twist, exact where curvature and twist are constant
//   bow     = L/30 (2 |b1|^2 - b1 . b2 + 2 |b2|^2)   arc less chord of the cubic shape, b_i = g(e . a_i) e x a_i, a_i = R_i e1
//   ext     = l + bow - extend
//   E = EA/(2L) ext^2 + c/2 (|theta1|^2 + |theta2|^2) + d theta1 . theta2 + GJ/(2L) psi^2
//   c - d = 2 EI / L,  c + d = 6 EI / ((1 + Phi) L),  Phi = 12 EI / (kappa G A L^2)
// Forces are the exact derivative of E. E does not change when the nodes are swapped with e and the frames reversed, nor in a
// rigid motion, nor when mirrored. The bow makes the chord shorten with the square of the bending angles: without it a chain rolls up
// to a polygon whose chords (not arcs) have the rest length, (pi/N)^2/6 too large; its second derivative is the consistent
// geometric stiffness. g is a polynomial in z = (1 - e . t)/2 = sin^2(angle/2), cut after z^7: 3e-9 off at 0.64 rad, and smooth
// everywhere, which acos is not.
//
// Tangent: J' C J (main), positive semi-definite, and the geometric stiffness of a tension only: a compression's part would make the
// matrix indefinite (DESIGN section 4, item 2). To first order in the angles
//   d theta_i = B_i d phi_i + D_i (d x2 - d x1),   B_i = s_i I - t_i e',   D_i = -[t_i]x P / l,   s_i = e . t_i,   P = I - e e'
// B_i, not P: B_i t_i = 0, so spinning a bent wire about its own tangent costs nothing, as it should. With P in its place the matrix held
// EI k^2 of stiffness a length against spin and lacked as much elsewhere; eigenvalues of the true Hessian against it reached 9 in a wire coiled
// in a capsule (above 2 a Newton step overshoots, and the coil shook until it left the vessel); with B they stay below 1.02 in equilibrium.
#include "solver/beam_element.h"

#include <stddef.h>

#if defined(__GNUC__) && !defined(__clang__)
#define INLINE static inline __attribute__((always_inline))
#define VECTOR_LOOP _Pragma("GCC ivdep")
#define UNROLL _Pragma("GCC unroll 3")
#else
#define INLINE static inline
#define VECTOR_LOOP
#define UNROLL
#endif

// angle / sine and its derivative with the cosine, from z = sin^2(angle/2): sum of 4^k (k!)^2 / (2k+1)! z^k.
INLINE double angle_over_sine(double z, double *slope)
{
    const double a1 = 2.0 / 3, a2 = 8.0 / 15, a3 = 16.0 / 35, a4 = 128.0 / 315, a5 = 256.0 / 693, a6 = 1024.0 / 3003, a7 = 2048.0 / 6435;
    *slope = -0.5 * (a1 + z * (2 * a2 + z * (3 * a3 + z * (4 * a4 + z * (5 * a5 + z * (6 * a6 + z * (7 * a7)))))));
    return 1 + z * (a1 + z * (a2 + z * (a3 + z * (a4 + z * (a5 + z * (a6 + z * a7))))));
}

INLINE Vec3 first_axis(Quat q)
{
    return vec3(1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y));
}

typedef struct Bend {        // an angle from the chord e to a tangent t
    Vec3 t, n, angle;        // n = e x t
    double s, g, h;          // e . t, angle / sine, its derivative with s
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

// Given m = dE/d angle: returns dE for a rotation of t, adds dE/de to *along.
INLINE Vec3 bend_back(const Bend *b, Vec3 e, Vec3 m, Vec3 *along)
{
    double mn = b->h * vec3_dot(m, b->n);
    *along = vec3_add(*along, vec3_add_scaled(vec3_scale(vec3_cross(b->t, m), b->g), mn, b->t));
    Vec3 turn = vec3_scale(vec3_add_scaled(vec3_scale(m, b->s), -vec3_dot(b->t, m), e), b->g);
    return vec3_add_scaled(turn, -mn, b->n);
}

INLINE void element(const BeamInput *in, bool is_curved, BeamOutput *out)
{
    Vec3 d = vec3_sub(in->x2, in->x1);
    double l = sqrt(vec3_norm2(d)), inverse = 1 / l;
    Vec3 e = vec3_scale(d, inverse);
    Quat f1 = in->q1, f2 = in->q2;
    if (is_curved) {
        f1 = quat_mul(in->q1, (Quat){in->half_w, 0, in->half_y, in->half_z});
        f2 = quat_mul(in->q2, (Quat){in->half_w, 0, -in->half_y, -in->half_z});
    }
    Bend c1 = bend_from(e, first_axis(f1)), c2 = bend_from(e, first_axis(f2));
    Bend b1 = c1, b2 = c2;
    if (is_curved) {
        b1 = bend_from(e, first_axis(in->q1));
        b2 = bend_from(e, first_axis(in->q2));
    }

    // axial, with the bow
    double share = in->length * (1.0 / 30);
    Vec3 bow1 = vec3_scale(vec3_sub(vec3_scale(b1.angle, 4), b2.angle), share);
    Vec3 bow2 = vec3_scale(vec3_sub(vec3_scale(b2.angle, 4), b1.angle), share);
    double bow = 0.5 * (vec3_dot(bow1, b1.angle) + vec3_dot(bow2, b2.angle));
    double extension = l + bow - in->extend, tension = in->axial * extension;

    // bending
    Vec3 m1 = vec3_add(vec3_scale(c1.angle, in->near), vec3_scale(c2.angle, in->far));
    Vec3 m2 = vec3_add(vec3_scale(c2.angle, in->near), vec3_scale(c1.angle, in->far));
    double energy = 0.5 * (tension * extension + vec3_dot(m1, c1.angle) + vec3_dot(m2, c2.angle));

    // torsion: p = (w, v) the rotation from F1 to F2, seen in F1
    Quat p = quat_mul(quat_conjugate(f1), f2);
    double h, g = angle_over_sine(0.5 * (1 - p.w), &h);
    double psi = 2 * g * p.x, torque = in->twist * psi;
    Vec3 axis = vec3(g * p.w - h * p.x * p.x, g * p.z - h * p.x * p.y, -g * p.y - h * p.x * p.z);
    axis = quat_rotate(f1, axis);
    Vec3 turn = vec3_scale(axis, torque);
    energy += 0.5 * torque * psi;

    Vec3 along = vec3(0, 0, 0), t1, t2;
    if (is_curved) {
        t1 = vec3_sub(bend_back(&c1, e, m1, &along), turn);
        t2 = vec3_add(bend_back(&c2, e, m2, &along), turn);
        out->chord1 = t1;
        out->chord2 = t2;
        t1 = vec3_add(t1, bend_back(&b1, e, vec3_scale(bow1, tension), &along));
        t2 = vec3_add(t2, bend_back(&b2, e, vec3_scale(bow2, tension), &along));
    } else {
        t1 = vec3_sub(bend_back(&c1, e, vec3_add_scaled(m1, tension, bow1), &along), turn);
        t2 = vec3_add(bend_back(&c2, e, vec3_add_scaled(m2, tension, bow2), &along), turn);
        out->chord1 = out->chord2 = vec3(0, 0, 0);
    }
    along = vec3_scale(vec3_add_scaled(along, -vec3_dot(along, e), e), inverse);
    Vec3 tilt = vec3_cross(e, vec3_add(vec3_scale(bow1, b1.s), vec3_scale(bow2, b2.s)));
    out->chord = e;
    out->tangent1 = c1.t;
    out->tangent2 = c2.t;
    out->stretch = vec3_add_scaled(e, inverse, tilt);
    out->bow1 = vec3_add_scaled(vec3_scale(bow1, b1.s), -vec3_dot(b1.t, bow1), e);
    out->bow2 = vec3_add_scaled(vec3_scale(bow2, b2.s), -vec3_dot(b2.t, bow2), e);
    out->axis = axis;
    out->force2 = vec3_add_scaled(along, tension, e);
    out->moment1 = t1;
    out->moment2 = t2;
    out->inverse = inverse;
    out->tension = tension;
    out->energy = energy;
    out->bow = bow;
    out->angle1 = c1.angle;
    out->angle2 = c2.angle;
    out->turn1 = b1.angle;
    out->turn2 = b2.angle;
}

void beam_element(const BeamInput *in, BeamOutput *out)
{
    element(in, in->half_w < 1, out);
}

INLINE void set(BeamVectors v, int i, Vec3 value) { v.x[i] = value.x, v.y[i] = value.y, v.z[i] = value.z; }
INLINE Vec3 get(BeamVectors v, int i) { return vec3(v.x[i], v.y[i], v.z[i]); }

INLINE void chain_strain(const BeamRest *rest, const BeamPose *pose, int first, int last, bool is_curved, const BeamStrain *strain)
{
    const double *restrict x = pose->x, *restrict y = pose->y, *restrict z = pose->z;
    const double *restrict qw = pose->qw, *restrict qx = pose->qx, *restrict qy = pose->qy, *restrict qz = pose->qz;
    const BeamRest r = *rest;
    const BeamStrain s = *strain;
    VECTOR_LOOP
    for (int i = first; i < last; i++) {
        BeamInput in = {
            .x1 = {x[i], y[i], z[i]},
            .x2 = {x[i + 1], y[i + 1], z[i + 1]},
            .q1 = {qw[i], qx[i], qy[i], qz[i]},
            .q2 = {qw[i + 1], qx[i + 1], qy[i + 1], qz[i + 1]},
            .length = r.length[i],
            .extend = r.extend[i],
            .axial = r.axial[i],
            .near = r.near[i],
            .far = r.far[i],
            .twist = r.twist[i],
            .half_w = r.half_w[i],
            .half_y = r.half_y[i],
            .half_z = r.half_z[i],
        };
        BeamOutput o;
        element(&in, is_curved, &o);
        set(s.chord, i, o.chord);
        set(s.tangent1, i, o.tangent1);
        set(s.tangent2, i, o.tangent2);
        set(s.stretch, i, o.stretch);
        set(s.bow1, i, o.bow1);
        set(s.bow2, i, o.bow2);
        set(s.axis, i, o.axis);
        set(s.force2, i, o.force2);
        set(s.moment1, i, o.moment1);
        set(s.moment2, i, o.moment2);
        s.inverse[i] = o.inverse;
        s.tension[i] = o.tension;
        s.energy[i] = o.energy;
    }
}

BEAM_KERNEL
static void chain_strain_straight(const BeamRest *rest, const BeamPose *pose, int first, int last, const BeamStrain *strain)
{
    chain_strain(rest, pose, first, last, false, strain);
}

BEAM_KERNEL
static void chain_strain_curved(const BeamRest *rest, const BeamPose *pose, int first, int last, const BeamStrain *strain)
{
    chain_strain(rest, pose, first, last, true, strain);
}

void beam_chain_strain(const BeamRest *rest, const BeamPose *pose, int first, int last, const BeamStrain *strain)
{
    // runs of elements that are straight or curved at rest: sections are long, so runs are few
    for (int i = first; i < last;) {
        bool is_curved = rest->half_w[i] < 1;
        int end = i + 1;
        while (end < last && (rest->half_w[end] < 1) == is_curved)
            end++;
        (is_curved ? chain_strain_curved : chain_strain_straight)(rest, pose, i, end, strain);
        i = end;
    }
}

// Blocks of LANES elements side by side, entry k of lane l at [k * LANES + l]: computed over lanes, then transposed into the chain. Element by
// element it took 15 us for 200, rows of six as vectors 18.
enum { LANES = 8, BLOCK_ENTRIES = 36 };

INLINE void put(double *block, int stride, int r, int c, int i, int j, double value)
{
    block[((r + i) * 6 + c + j) * stride] = value;
}

typedef struct Columns {
    double v[3];
} Columns;
INLINE Columns columns(Vec3 v) { return (Columns){{v.x, v.y, v.z}}; }

// The part of the tangent between the displacement of node 2 and the rotation of node j, T = sum over i of C_ij t_i:
//   sum over i of D_i' C_ij B_j = (s_j P [T]x - P (T x t_j) e') / l,   P [T]x = [T]x - e (e x T)'
typedef struct Coupling {
    double m[3][3];
} Coupling;
INLINE Coupling coupling(Vec3 e, Vec3 sum, Vec3 tangent, double s, double inverse)
{
    Vec3 around = vec3_cross(sum, tangent);
    Columns v = columns(e), w = columns(vec3_add_scaled(around, -vec3_dot(around, e), e)), across = columns(vec3_cross(e, sum));
    double skew[3][3] = {{0, -sum.z, sum.y}, {sum.z, 0, -sum.x}, {-sum.y, sum.x, 0}};
    Coupling k;
    UNROLL
    for (int i = 0; i < 3; i++)
        UNROLL
        for (int j = 0; j < 3; j++)
            k.m[i][j] = inverse * (s * (skew[i][j] - v.v[i] * across.v[j]) - w.v[i] * v.v[j]);
    return k;
}

// The blocks of one element, entries `stride` apart.
INLINE void tangent_blocks(const BeamOutput *o, double length, double axial, double near, double far, double twist, double scale,
                           int stride, double *restrict k11, double *restrict k21, double *restrict k22)
{
    double pull = o->tension > 0 ? o->tension : 0, inverse = o->inverse;
    double ka = axial * scale, kt = twist * scale;
    double c = near * scale + pull * length * (4.0 / 30), d = far * scale - pull * length * (1.0 / 30);
    Vec3 e = o->chord, t1 = o->tangent1, t2 = o->tangent2;
    double s1 = vec3_dot(e, t1), s2 = vec3_dot(e, t2), t12 = vec3_dot(t1, t2), i2 = inverse * inverse;
    double a = 2 * (c + d * t12) * i2 + pull * inverse;
    Coupling u1 = coupling(e, vec3_add(vec3_scale(t1, c), vec3_scale(t2, d)), t1, s1, inverse);
    Coupling u2 = coupling(e, vec3_add(vec3_scale(t1, d), vec3_scale(t2, c)), t2, s2, inverse);
    Columns v = columns(e), ext = columns(o->stretch), w1 = columns(o->bow1), w2 = columns(o->bow2), g = columns(o->axis);
    Columns p1 = columns(t1), p2 = columns(t2), q1 = columns(vec3_add_scaled(t1, -s1, e)), q2 = columns(vec3_add_scaled(t2, -s2, e));
    UNROLL
    for (int i = 0; i < 3; i++) {
        // rows of B_i' B_j and of the second-order rest of D_i' D_j
        double x1 = i2 * (c * q1.v[i] + d * q2.v[i]), x2 = i2 * (c * q2.v[i] + d * q1.v[i]);
        double y11 = c * (v.v[i] - s1 * p1.v[i]), z11 = -c * s1 * v.v[i], y22 = c * (v.v[i] - s2 * p2.v[i]), z22 = -c * s2 * v.v[i];
        double y21 = d * (t12 * v.v[i] - s2 * p1.v[i]), z21 = -d * s1 * v.v[i];
        double ke = ka * ext.v[i], k1 = ka * w1.v[i], k2 = ka * w2.v[i], kg = kt * g.v[i];
        UNROLL
        for (int j = 0; j < 3; j++) {
            double id = i == j ? 1.0 : 0.0;
            double tt = a * (id - v.v[i] * v.v[j]) - x1 * q1.v[j] - x2 * q2.v[j] + ke * ext.v[j];
            double e1 = u1.m[i][j] + ke * w1.v[j], e2 = u2.m[i][j] + ke * w2.v[j], gg = kg * g.v[j];
            put(k11, stride, 0, 0, i, j, tt);
            put(k11, stride, 0, 3, i, j, -e1);
            put(k11, stride, 3, 0, j, i, -e1);
            put(k11, stride, 3, 3, i, j, c * s1 * s1 * id + y11 * v.v[j] + z11 * p1.v[j] + k1 * w1.v[j] + gg);
            put(k22, stride, 0, 0, i, j, tt);
            put(k22, stride, 0, 3, i, j, e2);
            put(k22, stride, 3, 0, j, i, e2);
            put(k22, stride, 3, 3, i, j, c * s2 * s2 * id + y22 * v.v[j] + z22 * p2.v[j] + k2 * w2.v[j] + gg);
            put(k21, stride, 0, 0, i, j, -tt);
            put(k21, stride, 0, 3, i, j, e1);
            put(k21, stride, 3, 0, j, i, -e2);
            put(k21, stride, 3, 3, i, j, d * s1 * s2 * id + y21 * v.v[j] + z21 * p2.v[j] + k2 * w1.v[j] - gg);
        }
    }
}

void beam_tangent(const BeamInput *in, const BeamOutput *out, double scale, BeamTangent *tangent)
{
    tangent_blocks(out, in->length, in->axial, in->near, in->far, in->twist, scale, 1, tangent->k11, tangent->k21, tangent->k22);
}

INLINE void lane_tangent(const BeamRest *r, const BeamStrain *s, int i, double scale, double *k11, double *k21, double *k22)
{
    BeamOutput o = {.chord = get(s->chord, i), .tangent1 = get(s->tangent1, i), .tangent2 = get(s->tangent2, i), .stretch = get(s->stretch, i),
                    .bow1 = get(s->bow1, i), .bow2 = get(s->bow2, i), .axis = get(s->axis, i), .inverse = s->inverse[i], .tension = s->tension[i]};
    tangent_blocks(&o, r->length[i], r->axial[i], r->near[i], r->far[i], r->twist[i], scale, LANES, k11, k21, k22);
}

typedef double Quad __attribute__((vector_size(32)));
typedef double LooseQuad __attribute__((vector_size(32), may_alias, aligned(8)));

// Rows of a tile (BLOCK_ENTRIES, LANES) become the blocks of consecutive elements.
INLINE void scatter_blocks(const double *tile, double *block)
{
    for (int k = 0; k < BLOCK_ENTRIES; k += 4)
        for (int l = 0; l < LANES; l += 4) {
            const double *at = tile + k * LANES + l;
            Quad a = *(const LooseQuad *)at, b = *(const LooseQuad *)(at + LANES), c = *(const LooseQuad *)(at + 2 * LANES),
                 d = *(const LooseQuad *)(at + 3 * LANES);
            Quad ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
            Quad cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
            double *to = block + l * BLOCK_ENTRIES + k;
            *(LooseQuad *)to = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
            *(LooseQuad *)(to + BLOCK_ENTRIES) = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
            *(LooseQuad *)(to + 2 * BLOCK_ENTRIES) = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
            *(LooseQuad *)(to + 3 * BLOCK_ENTRIES) = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
        }
}

BEAM_KERNEL
void beam_chain_tangent(const BeamRest *rest, const BeamStrain *strain, int first, int last, double scale, BlockChain *chain)
{
    if (first >= last)
        return;
    _Alignas(64) double k11[BLOCK_ENTRIES * LANES], k21[BLOCK_ENTRIES * LANES], k22[BLOCK_ENTRIES * LANES], carry[BLOCK_ENTRIES];
    const BeamRest r = *rest;
    const BeamStrain s = *strain;
    double *diagonal = chain->diag + BLOCK_ENTRIES * (size_t)first, *lower = chain->lower + BLOCK_ENTRIES * (size_t)first;
    for (int k = 0; k < BLOCK_ENTRIES; k++)
        carry[k] = diagonal[k];
    int base = first;
    for (; base + LANES <= last; base += LANES) {
        VECTOR_LOOP
        for (int l = 0; l < LANES; l++)
            lane_tangent(&r, &s, base + l, scale, k11 + l, k21 + l, k22 + l);
        // a node's block: what the element before leaves, and this one's
        for (int k = 0; k < BLOCK_ENTRIES; k++) {
            double *at = k11 + k * LANES, *other = k22 + k * LANES;
            at[0] += carry[k];
            carry[k] = other[LANES - 1];
            for (int l = 1; l < LANES; l++)
                at[l] += other[l - 1];
        }
        scatter_blocks(k11, diagonal);
        scatter_blocks(k21, lower);
        diagonal += LANES * BLOCK_ENTRIES;
        lower += LANES * BLOCK_ENTRIES;
    }
    for (; base < last; base++, diagonal += BLOCK_ENTRIES, lower += BLOCK_ENTRIES) {
        lane_tangent(&r, &s, base, scale, k11, k21, k22);
        for (int k = 0; k < BLOCK_ENTRIES; k++) {
            diagonal[k] = k11[k * LANES] + carry[k];
            lower[k] = k21[k * LANES];
            carry[k] = k22[k * LANES];
        }
    }
    for (int k = 0; k < BLOCK_ENTRIES; k++)
        diagonal[k] = carry[k];
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
