// Coaxial tools in one element. K tools share the centreline. Tool k occupies there its material interval [S1, S2], with l_k = S2 - S1; its position x in
// (0, 1) is at S1 + l_k x, and its angle is phi_k = (1 - x) phi1 + x phi2. With q(x) = d theta / dx, the rotation rate of the line over the element, the
// bending energy of K rods is
//   sum over k of  integral EI_k / (2 l_k) |q - l_k u_k|^2 dx,   u_k = Rot(phi_k) kappa_k
// Here q / l_k is the curvature per unit length of tool k itself, so the carrier's length plays no part in bending. Minimised for given end angles
// alpha = integral of m q dx, m = (-(1 - x), x), with M the end moments, it gives
//   B = sum EI_k / l_k,  c = sum EI_k u_k,  q = (m'M + c) / B
//   U = 1/2 (alpha - alpha0)' F^-1 (alpha - alpha0) + W,   F = integral m m' / B dx + 1 / sum(kappa G A_k l_k),   alpha0 = integral m c / B dx
//   W = integral of (1/2 sum EI_k l_k |kappa_k|^2 - |c|^2 / (2 B)) dx
// B and kappa_k are constant in a piece, between the borders of all tools. A border at S_b lies at x = (S_b - S1) / l_k and moves with both. Near a node where
// the carrier has a border too, a border passes gradually from one element to the other and lies partly in each (before_border()); otherwise W would have a
// kink where two borders pass each other.
// The moment is linear and F exact for any pieces. With the curvature of the cubic instead, a partly covered element held the inner tool in steps, as on cogs.
// Within a piece, u_k rotates slightly; the integrals of its first two moments are exact. In W, only |c|^2 varies, through the angles d = phi_i - phi_j of
// pairs: the mean of cos d is taken as cos(d_mid) cos(r D), where D is the element's difference of d and r^2 = (width^2 + 1) / 12. r^2 = width^2 / 12 would
// correspond to the exact integral (sinc D/2). The additional 1/12 corrects for the second derivative of the angle inside the element while cos d is
// near 1 (error h^4 there, Numerov's weights). At the fold of two tubes turned against each other the error remains h^2, a quarter of the integral's.
// The energy of stretching and torsion is added:
//   + sum EA_k / (2 l_k) (len - l_k)^2 + GJ_k / (2 l_k) (psi + phi2 - phi1)^2, where EA_k / l_k stands for 1 / integral of dS / EA
// len = chord + bow - (bow and chord of the rest arc, minus its length): beam_equations.h.
// The strain energy EA / l (len - l)^2 grows without bound as l goes to 0, and Newton's method oscillates where S moves by as much as l. If `spread` is longer
// than l, the part of the tool behind S1 is included: the factor is EA / spread, and the energy is quadratic in both.
//
// Derivatives. U is the maximum over M of M'alpha - V(M, p), V = integral of (|m'M + c|^2 / (2 B) - 1/2 sum EI_k l_k |kappa_k|^2), where p are the tools'
// unknowns. So dU/dp = -V_p, and d2U = |d alpha - V_Mp dp|^2 in F^-1, minus V_pp dp dp. V_Mp = d(alpha0 + F M) is the change of the end angles at constant
// moments. The square is convex in the pose and all lengths together (EI/l |d phi - k dl|^2 for one tool), so Newton's method may move S by more than a piece.
// Of -V_pp only positive semi-definite parts are used:
//   lengths: |q|^2 (sum b_k y_k^2 - (sum b_k y_k)^2 / B),  b_k = EI_k / l_k,  y_k = dl_k / l_k: tools stretched differently
//   angles: with chi_k = phi_k + the node's spin, sum of (M . u_k EI_k / B) dchi_k^2 + sum over pairs (c_i . c_j / B) (dphi_i - dphi_j)^2,
//   exact as long as each is positive; the first is lumped at the nodes, M_i . alpha0_i, as in beam_equations.h.
// Neglected: coupling of angle and length (torques), second derivatives with borders, negative parts. The axial and
// torsional terms are treated in the same way: (dlen - dl - T df)^2, f = integral of dS / EA.
#include "solver/coaxial.h"

#include "base/base.h"

#include "solver/beam_equations.h"

#include <stddef.h>
#include <string.h>

static const double SOFT_MOST = 0.4;     // of an element: largest distance over which a border is spread
static const double LENGTH_MIN = 1e-6;   // [mm] least length of a tool between two nodes, so that a bad iterate stays finite

typedef struct Two {         // components about e2 and e3
    double y, z;
} Two;
INLINE Two two_scale(Two a, double s) { return (Two){a.y * s, a.z * s}; }
INLINE Two two_add(Two a, double s, Two b) { return (Two){a.y + s * b.y, a.z + s * b.z}; }
INLINE Two two_turned(Two a) { return (Two){-a.z, a.y}; }        // by a right angle about e1
INLINE double two_dot(Two a, Two b) { return a.y * b.y + a.z * b.z; }

// Cosine, and sine over angle, of a small angle: accurate to rounding up to 2 rad; beyond that libm's functions are used.
INLINE double small_cosine(double angle, double *sine_over_angle)
{
    double q = angle * angle;
    if (q > 4) {
        *sine_over_angle = same_sin(angle) / angle;
        return same_cos(angle);
    }
    double sine = 1 - q * (1.0 / 210) * (1 - q * (1.0 / 272) * (1 - q * (1.0 / 342)));
    sine = 1 - q * (1.0 / 42) * (1 - q * (1.0 / 72) * (1 - q * (1.0 / 110) * (1 - q * (1.0 / 156) * sine)));
    *sine_over_angle = 1 - q * (1.0 / 6) * (1 - q * (1.0 / 20) * sine);
    double cosine = 1 - q * (1.0 / 182) * (1 - q * (1.0 / 240) * (1 - q * (1.0 / 306)));
    cosine = 1 - q * (1.0 / 30) * (1 - q * (1.0 / 56) * (1 - q * (1.0 / 90) * (1 - q * (1.0 / 132) * cosine)));
    return 1 - q * 0.5 * (1 - q * (1.0 / 12) * cosine);
}

enum { F11, F12, F22, A1Y, A1Z, A2Y, A2Z, WASTE, QUANTITIES };   // as CoaxialSlope
INLINE void slope_add(CoaxialSlope *to, double factor, const double v[QUANTITIES])
{
    for (int i = 0; i < 3; i++)
        to->flexibility[i] += factor * v[i];
    to->angle[0][0] += factor * v[A1Y], to->angle[0][1] += factor * v[A1Z];
    to->angle[1][0] += factor * v[A2Y], to->angle[1][1] += factor * v[A2Z];
    to->waste += factor * v[WASTE];
}

static const CoaxialSection NOTHING = {0};     // section past a tip

typedef struct Border {
    double x;                // effective place, as a share of the element
    double by[2], bends;     // derivatives of x with S1 and S2; second derivative of x with the border's place
    int tool;
} Border;

// The length [mm] of an element from its node to a border p [mm] past that node: p, but within w to either side of the node a parabola from 0 to w. *slope: its
// derivative with p.
static double before_border(double p, double w, double *slope)
{
    bool is_near = fabs(p) < w;
    *slope = is_near ? 0.5 * (w + p) / w : p > 0;
    return is_near ? 0.25 * (w + p) * (w + p) / w : fmax(0, p);
}

// The border at `place` [mm] past node 1 of an element of this length.
static Border border_at(const double soft_at[2], int tool, double place, double length)
{
    bool end = 2 * place > length;
    double p = end ? length - place : place, soft = soft_at[end], slope, x = before_border(p, soft, &slope) / length, near = -(slope - x) / length,
           far = -x / length;
    return (Border){end ? 1 - x : x, {end ? far : near, end ? near : far}, fabs(p) < soft ? (end ? -0.5 : 0.5) / (soft * length) : 0, tool};
}

static void put_border(Border *border, int *count, Border own)
{
    if (*count == COAXIAL_BORDERS_MAX)
        return;
    int at = (*count)++;
    for (; at > 0 && border[at - 1].x > own.x; at--)
        border[at] = border[at - 1];
    border[at] = own;
}

// Inserts one tool's borders inside the element, and slightly outside it where they are spread, into the list ordered by place; returns the section at node 1.
static const CoaxialSection *scan(const CoaxialSpan *span, int k, CoaxialRest *rest, Border *border, int *border_count)
{
    const CoaxialSection *last = span->tool->section + span->tool->count - 1;
    double length = rest->strained_length[k], end = span->s1 + length;
    const double soft[2] = {fmin(span->soft[0], SOFT_MOST * length), fmin(span->soft[1], SOFT_MOST * length)}, from = span->s1 - soft[0], to = end + soft[1];
    rest->ends[k] = k > 0 && !span->has_tip && last->end < end;
    rest->own_length[k] = rest->ends[k] ? rest->length : rest->strained_length[k];
    bool has_end = span->has_tip || rest->ends[k];
    if (has_end && last->end <= span->s1)
        return &NOTHING;
    const CoaxialSection *first = coaxial_section_at(span->tool, from), *section = first;
    rest->is_whole[k] = true;
    for (; section < last && section->end < to; section++) {
        rest->is_whole[k] = false;
        put_border(border, border_count, border_at(soft, k, section->end - span->s1, rest->own_length[k]));
    }
    static const double sharp[2] = {0, 0};
    if (has_end && last->end < end) {
        rest->is_whole[k] = false;
        put_border(border, border_count, border_at(sharp, k, last->end - span->s1, rest->own_length[k]));
    }
    return first;
}

// One tool's axial and torsional compliance, from S1 to S2. If `spread` is longer, the part behind S1 is included. At a mouth (spreads_twist) it is always the
// compliance of `spread`, even if node 1 is past the mouth: the part between the two belongs to the element behind as well. Past its tip, a tool is strained
// with the stiffness of its last section.
static void strain(const CoaxialSpan *span, int k, CoaxialRest *rest)
{
    double length = rest->strained_length[k], end = span->s1 + length, spread = span->spreads_twist ? span->spread : fmax(span->spread, length);
    double start = end - spread, axial = 0, torsion = 0;
    const CoaxialSection *last = span->tool->section + span->tool->count - 1, *back = coaxial_section_at(span->tool, start),
                         *first = coaxial_section_at(span->tool, span->s1);
    const CoaxialSection *section = back;
    for (double at = start;; section++) {
        double to = section == last ? end : fmin(section->end, end), from = span->spreads_twist ? at : fmax(at, span->s1);
        axial += (to - at) / section->axial;
        torsion += fmax(0, to - from) / section->torsion;
        at = to;
        if (section == last || section->end >= end)
            break;
    }
    bool spreads_twist = span->spreads_twist, is_spread = spreads_twist || start < span->s1;
    rest->axial[k] = 1 / axial;
    rest->torsion[k] = 1 / torsion;
    rest->axial_end[k][0] = is_spread ? 0 : 1 / first->axial, rest->axial_end[k][1] = 1 / section->axial - (is_spread ? 1 / back->axial : 0);
    rest->torsion_end[k][0] = spreads_twist ? 0 : 1 / first->torsion, rest->torsion_end[k][1] = 1 / section->torsion - (spreads_twist ? 1 / back->torsion : 0);
}

CoaxialSprings coaxial_springs(const CoaxialSpan *span)
{
    SEL_ASSERT(!span->has_tip, "the tool goes through the whole element");
    CoaxialRest rest;
    rest.strained_length[0] = fmax(span->s2 - span->s1, LENGTH_MIN);
    strain(span, 0, &rest);
    return (CoaxialSprings){rest.strained_length[0],
                            rest.axial[0],
                            rest.torsion[0],
                            {rest.axial_end[0][1] - rest.axial_end[0][0], rest.torsion_end[0][1] - rest.torsion_end[0][0]}};
}

// The tools of a piece: their contributions to the element, and the derivatives of these.
typedef struct Parts {
    const CoaxialSection *section[COAXIAL_TOOLS_MAX];
    Two curve[COAXIAL_TOOLS_MAX];              // EI u at the middle of the piece
    Two even[COAXIAL_TOOLS_MAX], odd[COAXIAL_TOOLS_MAX];   // mean of EI u over the piece, and of (x - middle) times it
    double cosine[COAXIAL_TOOLS_MAX], sine[COAXIAL_TOOLS_MAX];     // of half the rotation between the integration points
    double turn[COAXIAL_TOOLS_MAX];            // [rad] phi2 - phi1
} Parts;

// Adds the piece [a, b] to `rest`; ends: derivatives of its contribution with a and with b.
static void add_piece(const CoaxialSpan *span, double a, double b, Parts *p, CoaxialRest *rest, double ends[2][QUANTITIES])
{
    static const double ROOT = 0.28867513459481288;        // 1 / sqrt(12)
    int count = rest->count, curved[COAXIAL_TOOLS_MAX], curved_count = 0;
    double width = b - a, mid = 0.5 * (a + b), reach = ROOT * width, bending = 0, shear = 0, held = 0, square = 0;
    double own[COAXIAL_TOOLS_MAX], own_held[COAXIAL_TOOLS_MAX];
    Two even = {0, 0}, odd = {0, 0}, even_mid = {0, 0}, odd_mid = {0, 0}, even_reach = {0, 0}, odd_reach = {0, 0};
    for (int k = 0; k < count; k++) {
        const CoaxialSection *c = p->section[k];
        double length = rest->own_length[k];
        own[k] = c->bending / length;
        bending += own[k];
        shear += c->shear * length;
        own_held[k] = 0;
        if (c->curve[0] == 0 && c->curve[1] == 0)
            continue;
        rest->is_curved = rest->bends[k] = true;
        curved[curved_count++] = k;
        double turn = span[k].phi2 - span[k].phi1, phi = span[k].phi1 + mid * turn;
        Two u = two_scale((Two){-c->curve[1], c->curve[0]}, c->bending);
        if (phi != 0)
            u = two_add(two_scale(u, same_cos(phi)), same_sin(phi), two_turned(u));
        double cosine = 1, sine = 0;
        if (turn != 0)
            cosine = small_cosine(turn * reach, &sine), sine *= turn * reach;
        double straight = 0.5 * c->bending * (c->curve[0] * c->curve[0] + c->curve[1] * c->curve[1]);
        own_held[k] = straight * width;
        held += straight * length;
        p->curve[k] = u, p->turn[k] = turn, p->cosine[k] = cosine, p->sine[k] = sine;
        p->even[k] = two_scale(u, cosine);
        p->odd[k] = two_scale(two_turned(u), reach * sine);
        even = two_add(even, 1, p->even[k]);
        odd = two_add(odd, 1, p->odd[k]);
        even_mid = two_add(even_mid, turn, two_turned(p->even[k]));
        odd_mid = two_add(odd_mid, turn, two_turned(p->odd[k]));
        even_reach = two_add(even_reach, -turn * sine, u);
        odd_reach = two_add(odd_reach, sine + turn * reach * cosine, two_turned(u));
    }
    double flexible = 1 / bending, by_shear = 1 / shear, weight = width * flexible, twelfth = width * width / 12;
    double m[2] = {-(1 - mid), mid}, value[QUANTITIES] = {0}, by_width[QUANTITIES] = {0}, by_mid[QUANTITIES] = {0};
    double moment[3] = {m[0] * m[0] + twelfth, m[0] * m[1] + twelfth, m[1] * m[1] + twelfth};
    for (int i = 0; i < 3; i++) {
        value[i] = weight * moment[i] + width * by_shear;
        by_width[i] = flexible * (moment[i] + 2 * twelfth) + by_shear;
        by_mid[i] = weight * (i == 0 ? 2 * m[0] : i == 1 ? m[0] + m[1] : 2 * m[1]);
    }
    CoaxialPiece *piece = &rest->piece[rest->piece_count++];
    piece->width = width, piece->middle = mid, piece->bending = bending;
    piece->moment[0] = even.y, piece->moment[1] = even.z;
    for (int k = 0; k < count; k++)
        piece->own[k] = own[k];

    if (curved_count > 0) {
        for (int i = 0; i < 2; i++) {
            Two angle = two_add(odd, m[i], even), mid_slope = two_add(two_add(odd_mid, m[i], even_mid), 1, even);
            Two reach_slope = two_add(odd_reach, m[i], even_reach);
            double *v = value + A1Y + 2 * i, *w = by_width + A1Y + 2 * i, *n = by_mid + A1Y + 2 * i;
            v[0] = weight * angle.y, v[1] = weight * angle.z;
            w[0] = flexible * angle.y + weight * ROOT * reach_slope.y, w[1] = flexible * angle.z + weight * ROOT * reach_slope.z;
            n[0] = weight * mid_slope.y, n[1] = weight * mid_slope.z;
        }
        // W, `waste`: square = half |c|^2, pair by pair
        double r = ROOT * sqrt(width * width + 1), square_mid = 0, square_width = 0, phi_slope[COAXIAL_TOOLS_MAX] = {0}, turn_slope[COAXIAL_TOOLS_MAX] = {0};
        double h11 = m[0] * m[0] + r * r, h12 = -m[0] * m[1] - r * r, h22 = m[1] * m[1] + r * r;
        for (int g = 0; g < curved_count; g++) {
            int i = curved[g];
            square += 0.5 * two_dot(p->curve[i], p->curve[i]);
            for (int h = 0; h < g; h++) {
                int j = curved[h];
                double turn = p->turn[i] - p->turn[j], along = two_dot(p->curve[i], p->curve[j]), cosine = 1, sine = 0;
                double around = two_dot(two_turned(p->curve[i]), p->curve[j]);
                if (turn != 0)
                    cosine = small_cosine(turn * r, &sine), sine *= turn * r;
                square += along * cosine;
                square_mid += turn * around * cosine;
                square_width -= along * turn * sine * width / (12 * r);
                phi_slope[i] += around * cosine, phi_slope[j] -= around * cosine;
                turn_slope[i] -= along * r * sine, turn_slope[j] += along * r * sine;
                double couple = weight * along * cosine;
                if (couple > 0) {
                    rest->couple[i][j][0] += couple * h11;
                    rest->couple[i][j][1] += couple * h12;
                    rest->couple[i][j][2] += couple * h22;
                }
            }
        }
        value[WASTE] = held * width - weight * square;
        by_width[WASTE] = held - flexible * square - weight * square_width;
        by_mid[WASTE] = -weight * square_mid;
        for (int g = 0; g < curved_count; g++) {
            int k = curved[g];
            double by_phi[QUANTITIES] = {0}, by_turn[QUANTITIES] = {0};
            for (int i = 0; i < 2; i++) {
                Two share = two_scale(two_add(p->odd[k], m[i], p->even[k]), weight);
                rest->share[k][i][0] += share.y, rest->share[k][i][1] += share.z;
                Two turned = two_turned(share);
                Two other = two_scale(two_add(two_scale(p->curve[k], -m[i] * p->sine[k]), reach * p->cosine[k], two_turned(p->curve[k])), weight * reach);
                by_phi[A1Y + 2 * i] = turned.y, by_phi[A1Z + 2 * i] = turned.z;
                by_turn[A1Y + 2 * i] = other.y, by_turn[A1Z + 2 * i] = other.z;
            }
            by_phi[WASTE] = -weight * phi_slope[k];
            by_turn[WASTE] = -weight * turn_slope[k];
            CoaxialSlope *phi1 = &rest->slope[4 * k + COAXIAL_PHI1], *phi2 = &rest->slope[4 * k + COAXIAL_PHI2];
            slope_add(phi1, 1 - mid, by_phi), slope_add(phi1, -1, by_turn);
            slope_add(phi2, mid, by_phi), slope_add(phi2, 1, by_turn);
        }
    }
    // lengths
    for (int k = 0; k < count; k++) {
        double by_length[QUANTITIES], part = own[k] * flexible / rest->own_length[k], stiff = p->section[k]->shear * by_shear * by_shear * width;
        for (int i = 0; i < 3; i++)
            by_length[i] = part * weight * moment[i] - stiff;
        for (int i = A1Y; i < WASTE; i++)
            by_length[i] = part * value[i];
        by_length[WASTE] = own_held[k] - part * weight * square;
        slope_add(&rest->slope[4 * k + COAXIAL_S1], -1, by_length);
        slope_add(&rest->slope[4 * k + COAXIAL_S2], 1, by_length);
    }
    for (int i = 0; i < QUANTITIES; i++) {
        ends[0][i] = 0.5 * by_mid[i] - by_width[i];
        ends[1][i] = 0.5 * by_mid[i] + by_width[i];
    }
    for (int i = 0; i < 3; i++)
        rest->flexibility[i] += value[i];
    for (int i = 0; i < 2; i++)
        rest->angle[i][0] += value[A1Y + 2 * i], rest->angle[i][1] += value[A1Z + 2 * i];
    rest->waste += value[WASTE];
}

// The shortening of the rest arc, 1 - chord / length, beyond its second-order term: that of an arc of constant curvature with the same total rotation.
static void set_arc(CoaxialRest *rest)
{
    double u[2] = {0.5 * (rest->angle[1][0] - rest->angle[0][0]), 0.5 * (rest->angle[1][1] - rest->angle[0][1])}, q = u[0] * u[0] + u[1] * u[1];
    // 1 - sin(a)/a - a^2/6, a^2 = q; to rounding up to a = 1
    const double c2 = -1.0 / 120, c3 = 1.0 / 5040, c4 = -1.0 / 362880, c5 = 1.0 / 39916800, c6 = -1.0 / 6227020800.0, c7 = 1.0 / 1307674368000.0;
    double share = q * q * (c2 + q * (c3 + q * (c4 + q * (c5 + q * (c6 + q * c7)))));
    double slope = q * (2 * c2 + q * (3 * c3 + q * (4 * c4 + q * (5 * c5 + q * (6 * c6 + q * 7 * c7))))) * rest->length;
    rest->arc_by_length = share;
    rest->arc = share * rest->length;
    for (int j = 0; j < 2; j++) {
        rest->arc_by_angle[1][j] = slope * u[j];
        rest->arc_by_angle[0][j] = -slope * u[j];
    }
}

static CoaxialChord rest_chord(const double angle[2])
{
    double y = -angle[0], z = -angle[1], q = y * y + z * z, half, cosine = small_cosine(0.5 * sqrt(q), &half);     // sine over angle of the half
    double grow = half * cosine, stay = q > 4e-4 ? (1 - grow) / q : (1 - 0.05 * q) / 6;
    return (CoaxialChord){.turn = {cosine, 0, 0.5 * half * y, 0.5 * half * z}, .v = {y, z}, .grow = grow, .stay = stay, .lean = 0.5 * half * half};
}

// A tool that ends inside bends as if its S2 were S1 plus the carrier's length.
static void bend_with_carrier(CoaxialRest *rest, int k)
{
    const CoaxialSlope *by_end = &rest->slope[4 * k + COAXIAL_S2];
    double slope[QUANTITIES] = {by_end->flexibility[0], by_end->flexibility[1], by_end->flexibility[2], by_end->angle[0][0],
                                by_end->angle[0][1],    by_end->angle[1][0],    by_end->angle[1][1],    by_end->waste};
    slope_add(&rest->slope[4 * k + COAXIAL_S1], 1, slope);
    slope_add(&rest->slope[4 * k + COAXIAL_S2], -1, slope);
    slope_add(&rest->slope[COAXIAL_S1], -1, slope);
    slope_add(&rest->slope[COAXIAL_S2], 1, slope);
}

// Combines the tools of an element, carrier first, 1 <= count <= COAXIAL_TOOLS_MAX.
static void coaxial_rest(const CoaxialSpan *span, int count, CoaxialRest *rest)
{
    SEL_ASSERT(count > 0 && count <= COAXIAL_TOOLS_MAX && !span[0].has_tip, "an element has tools, the first of which carries it from end to end");
    memset(rest, 0, offsetof(CoaxialRest, piece));
    rest->count = count;
    rest->length = fmax(span[0].s2 - span[0].s1, LENGTH_MIN);
    Border border[COAXIAL_BORDERS_MAX];
    int border_count = 0;
    Parts parts;
    for (int k = 0; k < count; k++) {
        rest->strained_length[k] = span[k].has_tip ? rest->length : fmax(span[k].s2 - span[k].s1, LENGTH_MIN);
        parts.section[k] = scan(&span[k], k, rest, border, &border_count);
        if (!span[k].has_tip)
            strain(&span[k], k, rest);
    }
    double from = 0, ends[2][QUANTITIES], before[QUANTITIES] = {0};
    for (int i = 0; i <= border_count; i++) {
        double to = i < border_count ? border[i].x : 1;
        add_piece(span, from, to, &parts, rest, ends);
        if (i > 0) {         // the border between the previous piece and this one
            const Border *b = &border[i - 1];
            int k = b->tool;
            for (int q = 0; q < QUANTITIES; q++)
                before[q] += ends[0][q];
            if (b->bends != 0 && rest->soft_count < COAXIAL_TOOLS_MAX) {
                CoaxialSoft *soft = &rest->soft[rest->soft_count++];
                *soft = (CoaxialSoft){.tool = k, .end = b->x > 0.5, .bends = b->bends};
                slope_add(&soft->slope, 1, before);
            }
            slope_add(&rest->slope[4 * k + COAXIAL_S1], b->by[0], before);
            slope_add(&rest->slope[4 * k + COAXIAL_S2], b->by[1], before);
        }
        if (i < border_count) {
            const CoaxialTool *tool = span[border[i].tool].tool;
            const CoaxialSection **section = &parts.section[border[i].tool];
            *section = *section + 1 < tool->section + tool->count ? *section + 1 : &NOTHING;
        }
        memcpy(before, ends[1], sizeof before);
        from = to;
    }
    for (int k = 1; k < count; k++)
        if (rest->ends[k])
            bend_with_carrier(rest, k);
    double f11 = rest->flexibility[0], f12 = rest->flexibility[1], f22 = rest->flexibility[2], unit = 1 / (f11 * f22 - f12 * f12);
    rest->near1 = f22 * unit, rest->near2 = f11 * unit, rest->far = -f12 * unit;
    if (rest->is_curved) {
        set_arc(rest);
        rest->chord[0] = rest_chord(rest->angle[0]), rest->chord[1] = rest_chord(rest->angle[1]);
    } else
        rest->chord[0].turn = rest->chord[1].turn = quat_identity();
}

// The rotation of the rest chord when its angles change by dv, in the node's frame.
INLINE Vec3 turn_slope(const CoaxialChord *t, Two dv)
{
    double along = t->stay * (t->v[0] * dv.y + t->v[1] * dv.z);
    return vec3(t->lean * (t->v[0] * dv.z - t->v[1] * dv.y), t->grow * dv.y + along * t->v[0], t->grow * dv.z + along * t->v[1]);
}
// The transpose of turn_slope(): x in the node's frame.
INLINE Two turn_back(const CoaxialChord *t, Vec3 x)
{
    double along = t->stay * (t->v[0] * x.y + t->v[1] * x.z);
    return (Two){t->grow * x.y + along * t->v[0] - t->lean * t->v[1] * x.x, t->grow * x.z + along * t->v[1] + t->lean * t->v[0] * x.x};
}

// A span with a tip is as long as the carrier, and its angle is constant in space: s2 = s1 + l, phi2 = phi1 minus the twist of the nodes' frames. (With phi2 =
// phi1 the tool's curvature would jump by half that twist as its tip passes a node.) The derivative with the twist enters the moments; the tangent neglects it.
static void fold(const CoaxialSpan *span, int count, double *row, int stride)
{
    for (int k = 1; k < count; k++) {
        if (!span[k].has_tip)
            continue;
        double *r = row + 4 * k * stride, by_end = r[COAXIAL_S2 * stride];
        r[COAXIAL_S1 * stride] += by_end;
        r[COAXIAL_PHI1 * stride] += r[COAXIAL_PHI2 * stride];
        r[COAXIAL_S2 * stride] = r[COAXIAL_PHI2 * stride] = 0;
        row[COAXIAL_S1 * stride] -= by_end;
        row[COAXIAL_S2 * stride] += by_end;
    }
}

static bool has_tips(const CoaxialInput *in)
{
    for (int k = 1; k < in->count; k++)
        if (in->span[k].has_tip)
            return true;
    return false;
}

// Is the tool's column needed? The length of a tool with a tip is the carrier's.
static bool is_wanted(const CoaxialInput *in, int k) { return !in->span[k].is_fixed || (in->span[k].has_tip && !in->span[0].is_fixed); }

INLINE Two seen_from(Quat q, Vec3 v)
{
    Vec3 own = quat_rotate(quat_conjugate(q), v);
    return (Two){own.y, own.z};
}

// Twist from frame 1 to frame 2, and its derivative with a rotation of frame 2 relative to frame 1: psi of beam_equations.h, for the nodes' own frames.
static double frames_twist(const CoaxialInput *in, Vec3 *axis)
{
    Quat p = quat_mul(quat_conjugate(in->q1), in->q2);
    double h, g = angle_over_sine(0.5 * (1 - p.w), &h);
    *axis = quat_rotate(in->q1, vec3(g * p.w - h * p.x * p.x, g * p.z - h * p.x * p.y, -g * p.y - h * p.x * p.z));
    return 2 * g * p.x;
}

typedef struct Bent {        // an element's end moments: half their squares and their product; the energy's derivatives with the rest angles
    double square[3];
    Two by[2];
} Bent;

// [mJ] The derivative of the energy with an unknown, from `s`, the derivatives of `rest` with that unknown.
static double energy_slope(const Bent *b, const CoaxialSlope *s)
{
    return s->waste - (b->square[0] * s->flexibility[0] + b->square[1] * s->flexibility[1] + b->square[2] * s->flexibility[2]) + b->by[0].y * s->angle[0][0] +
           b->by[0].z * s->angle[0][1] + b->by[1].y * s->angle[1][0] + b->by[1].z * s->angle[1][1];
}

void coaxial_element(const CoaxialInput *in, CoaxialOutput *out)
{
    SEL_ASSERT(in->count > 0 && in->count <= COAXIAL_TOOLS_MAX, "an element has tools");
    SEL_ASSERT(quat_is_unit(in->q1) && quat_is_unit(in->q2), "frames are unit quaternions");
    CoaxialRest *rest = &out->rest;
    int count = in->count;
    bool tips = has_tips(in);
    Vec3 frames_axis = vec3(0, 0, 0);
    if (tips) {
        CoaxialSpan span[COAXIAL_TOOLS_MAX];
        double twist = frames_twist(in, &frames_axis);
        for (int k = 0; k < count; k++) {
            span[k] = in->span[k];
            if (span[k].has_tip)
                span[k].phi2 = span[k].phi1 - twist;
        }
        coaxial_rest(span, count, rest);
    } else
        coaxial_rest(in->span, count, rest);
    double axial = 0, torsion = 0, length = 0, turn = 0, own_turn[COAXIAL_TOOLS_MAX];
    for (int k = 0; k < count; k++) {
        own_turn[k] = in->span[k].has_tip ? 0 : in->span[k].phi2 - in->span[k].phi1;
        axial += rest->axial[k], torsion += rest->torsion[k];
        length += rest->axial[k] * rest->strained_length[k];
        turn += rest->torsion[k] * own_turn[k];
    }
    length /= axial, turn /= torsion;
    BeamInput beam = {.x1 = in->x1,
                      .x2 = in->x2,
                      .q1 = in->q1,
                      .q2 = in->q2,
                      .length = rest->length,
                      .extend = length - rest->arc,
                      .axial = axial,
                      .far = rest->far,
                      .twist = torsion};
    BeamEnds ends = {rest->near1, rest->near2, rest->chord[0].turn, rest->chord[1].turn, -turn};
    BeamOutput *o = &out->beam;
    if (rest->is_curved)
        element_between(&beam, ends, true, o);
    else
        element_between(&beam, ends, false, o);

    double energy = o->energy + rest->waste, psi = o->torque / torsion - turn;
    for (int k = 0; k < count; k++) {
        double short_by = length - rest->strained_length[k], turned = own_turn[k] - turn;
        energy += 0.5 * (rest->axial[k] * short_by * short_by + rest->torsion[k] * turned * turned);
        out->tension[k] = rest->axial[k] * (o->tension / axial + short_by);
        out->torque[k] = rest->torsion[k] * (psi + own_turn[k]);
    }
    out->energy = energy;
    Vec3 m1 = vec3_add(vec3_scale(o->angle1, rest->near1), vec3_scale(o->angle2, rest->far));
    Vec3 m2 = vec3_add(vec3_scale(o->angle2, rest->near2), vec3_scale(o->angle1, rest->far));
    out->end_moment[0] = m1, out->end_moment[1] = m2;
    double square1 = 0.5 * vec3_norm2(m1), square12 = vec3_dot(m1, m2), square2 = 0.5 * vec3_norm2(m2);
    Two by1 = {0, 0}, by2 = {0, 0};
    if (rest->is_curved) {
        by1 = turn_back(&rest->chord[0], quat_rotate(quat_conjugate(in->q1), o->chord1));
        by2 = turn_back(&rest->chord[1], quat_rotate(quat_conjugate(in->q2), o->chord2));
        by1 = two_add((Two){-by1.y, -by1.z}, o->tension, (Two){rest->arc_by_angle[0][0], rest->arc_by_angle[0][1]});
        by2 = two_add((Two){-by2.y, -by2.z}, o->tension, (Two){rest->arc_by_angle[1][0], rest->arc_by_angle[1][1]});
    }
    const Bent bent = {{square1, square12, square2}, {by1, by2}};
    double *g = out->gradient;
    for (int i = 0; i < rest->soft_count; i++)
        rest->soft[i].stiffness = fmax(0, energy_slope(&bent, &rest->soft[i].slope) * rest->soft[i].bends);
    for (int k = 0; k < count; k++) {
        for (int j = 0; j < 4; j++)
            g[4 * k + j] = energy_slope(&bent, &rest->slope[4 * k + j]);
        double t = out->tension[k], q = out->torque[k];
        if (in->span[k].has_tip)
            continue;
        for (int end = 0; end < 2; end++) {
            double sign = end ? -1 : 1;
            g[4 * k + 2 * end] += sign * (t + 0.5 * (t * t * rest->axial_end[k][end] + q * q * rest->torsion_end[k][end]));
            g[4 * k + 2 * end + 1] -= sign * q;
        }
    }
    double by_length = o->tension * (o->bow / rest->length + rest->arc_by_length);
    g[COAXIAL_S1] -= by_length;
    g[COAXIAL_S2] += by_length;
    for (int k = 1; tips && k < count; k++)
        if (in->span[k].has_tip) {
            Vec3 moment = vec3_scale(frames_axis, g[4 * k + COAXIAL_PHI2]);
            o->moment1 = vec3_add(o->moment1, moment);
            o->moment2 = vec3_sub(o->moment2, moment);
        }
    fold(in->span, count, g, 1);
    for (int k = 0; k < count; k++)
        for (int j = 0; j < 4; j++)
            if (in->span[k].is_fixed)
                g[4 * k + j] = 0;
}

// --- the tangent ---

// The derivatives of the strains with one of the tools' unknowns.
typedef struct Column {
    Vec3 bend1, bend2;       // end angles, from V_Mp
    Vec3 moment1, moment2;   // the resulting moments
    double stretch, twist;   // of all tools together
    double own_stretch, own_twist; // additional, of its own tool
    double pull, torque;     // the resulting force and torque
} Column;

typedef struct Work {        // data of one tangent
    const CoaxialInput *in;
    const CoaxialOutput *out;
    double scale, axial, torsion;              // sums over all tools
    double spin[2][COAXIAL_TOOLS_MAX];         // [N mm] about the nodes' tangents
    bool is_wanted[COAXIAL_TOOLS_MAX];
    Column column[COAXIAL_COLUMNS];
    int full[COAXIAL_COLUMNS], full_count;     // columns that change the end angles and are not the negative of another column
} Work;

static void nodes_tangent(const Work *w, const double spin[2], BeamTangent *tangent)
{
    const CoaxialRest *rest = &w->out->rest;
    BeamOutput o = w->out->beam;
    double n[N_ROWS], f[F_ROWS], pull = o.tension > 0 ? o.tension : 0;
    o.spin1 = spin[0], o.spin2 = spin[1];
    tangent_rows(&o, rest->length, w->axial, rest->near1, rest->near2, rest->far, w->torsion, w->scale, pull, rest->is_curved, n, 1, f, 1);
    blocks_from_rows(n, f, tangent);
}

// Adds value times dl_a dl_b, dl = ds2 - ds1.
static void add_lengths(CoaxialTangent *t, int a, int b, double value)
{
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            t->own[4 * a + 2 * i][4 * b + 2 * j] += i == j ? value : -value;
}

static void add_pair(CoaxialTangent *t, int a, int b, double sign, const double h[3])
{
    double(*own)[COAXIAL_COLUMNS] = t->own;
    own[4 * a + COAXIAL_PHI1][4 * b + COAXIAL_PHI1] += sign * h[0];
    own[4 * a + COAXIAL_PHI1][4 * b + COAXIAL_PHI2] += sign * h[1];
    own[4 * a + COAXIAL_PHI2][4 * b + COAXIAL_PHI1] += sign * h[1];
    own[4 * a + COAXIAL_PHI2][4 * b + COAXIAL_PHI2] += sign * h[2];
}

// The stiffness from tools that are stretched differently where the line is bent, piece by piece: |q|^2 (sum b y^2 - (sum b y)^2 / B).
static void add_sharing(const CoaxialInput *in, const CoaxialOutput *out, CoaxialTangent *t)
{
    const CoaxialRest *rest = &out->rest;
    Two m1 = seen_from(in->q1, out->end_moment[0]), m2 = seen_from(in->q2, out->end_moment[1]), slope = two_add(m1, 1, m2);
    double sum[COAXIAL_TOOLS_MAX][COAXIAL_TOOLS_MAX] = {{0}};
    for (int n = 0; n < rest->piece_count; n++) {
        const CoaxialPiece *p = &rest->piece[n];
        Two held = two_add(two_add(two_scale(m1, -(1 - p->middle)), p->middle, m2), 1, (Two){p->moment[0], p->moment[1]});
        double flexible = 1 / p->bending, square = (two_dot(held, held) + two_dot(slope, slope) * p->width * p->width / 12) * flexible * flexible * p->width;
        for (int i = 0; i < rest->count; i++) {
            double a = p->own[i] / rest->own_length[i];
            sum[i][i] += square * a / rest->own_length[i];
            for (int j = 0; j <= i; j++)
                sum[i][j] -= square * flexible * a * p->own[j] / rest->own_length[j];
        }
    }
    for (int i = 0; i < rest->count; i++)
        for (int j = 0; j <= i; j++) {
            add_lengths(t, i, j, sum[i][j]);
            if (j < i)
                add_lengths(t, j, i, sum[i][j]);
        }
}

// The force on a border changes while the border passes from one element to the next, with S at the node between them.
static void add_soft(const CoaxialRest *rest, CoaxialTangent *t)
{
    for (int n = 0; n < rest->soft_count; n++) {
        int k = rest->soft[n].tool, at = 4 * k + (rest->soft[n].end && !rest->ends[k] ? COAXIAL_S2 : COAXIAL_S1);
        t->own[at][at] += rest->soft[n].stiffness;
    }
}

INLINE void put_rows(double (*row)[COAXIAL_COLUMNS], int column, Vec3 v) { row[0][column] = v.x, row[1][column] = v.y, row[2][column] = v.z; }

// The change of a chord's angle at a node when the rest chord rotates by w, and its transpose for a moment: B of beam_equations.h.
INLINE Vec3 by_turn(Vec3 e, Vec3 t, Vec3 w) { return vec3_add_scaled(vec3_scale(w, vec3_dot(e, t)), -vec3_dot(e, w), t); }
INLINE Vec3 by_turn_back(Vec3 e, Vec3 t, Vec3 m) { return vec3_add_scaled(vec3_scale(m, vec3_dot(e, t)), -vec3_dot(t, m), e); }

// The stiffness against spin about a node's tangent, tool by tool. The last curved tool receives the remainder, so that a single tool has the value of
// beam_equations.h. Only positive parts are kept.
static void set_spin(Work *w, double all[2])
{
    const CoaxialOutput *out = w->out;
    const BeamOutput *o = &out->beam;
    double left[2] = {vec3_dot(out->end_moment[0], vec3_sub(o->turn1, o->angle1)), vec3_dot(out->end_moment[1], vec3_sub(o->turn2, o->angle2))};
    Two m[2] = {seen_from(w->in->q1, out->end_moment[0]), seen_from(w->in->q2, out->end_moment[1])};
    int last = 0, count = w->in->count;
    for (int k = 0; k < count; k++) {
        if (out->rest.bends[k])
            last = k;
        for (int i = 0; i < 2; i++) {
            const double *share = out->rest.share[k][i];
            left[i] -= w->spin[i][k] = m[i].y * share[0] + m[i].z * share[1];
        }
    }
    for (int i = 0; i < 2; i++) {
        w->spin[i][last] += left[i];
        for (int k = 0; k < count; k++) {
            w->spin[i][k] = fmax(w->spin[i][k], 0);
            all[i] += w->spin[i][k];
        }
    }
}

// The column of a straight tool's angle: torsion only.
static void add_torsion_column(Work *w, int p, CoaxialTangent *tangent)
{
    double sign = p % 4 == COAXIAL_PHI2 ? 1 : -1, torque = sign * w->out->rest.torsion[p / 4];
    Vec3 on = vec3_scale(w->out->beam.axis, w->scale * torque);
    w->column[p] = (Column){.own_twist = sign, .torque = torque};
    put_rows(tangent->cross + 3, p, vec3_negate(on));
    put_rows(tangent->cross + 9, p, on);
}

// The derivatives of the strains with unknown p, and of the nodes' forces.
static void add_column(Work *w, int p, CoaxialTangent *tangent)
{
    const CoaxialInput *in = w->in;
    const CoaxialRest *rest = &w->out->rest;
    const BeamOutput *o = &w->out->beam;
    const CoaxialSlope *s = &rest->slope[p];
    int k = p / 4, j = p % 4, end = j / 2;
    double sign = end ? -1 : 1, scale = w->scale;
    Vec3 e = o->chord, t1 = o->tangent1, t2 = o->tangent2, m1 = w->out->end_moment[0], m2 = w->out->end_moment[1];
    Column *c = &w->column[p];
    w->full[w->full_count++] = p;
    c->bend1 = vec3_negate(vec3_add(vec3_scale(m1, s->flexibility[0]), vec3_scale(m2, s->flexibility[1])));
    c->bend2 = vec3_negate(vec3_add(vec3_scale(m1, s->flexibility[1]), vec3_scale(m2, s->flexibility[2])));
    c->stretch = c->twist = 0;
    if (rest->is_curved) {
        Vec3 w1 = quat_rotate(in->q1, turn_slope(&rest->chord[0], (Two){-s->angle[0][0], -s->angle[0][1]}));
        Vec3 w2 = quat_rotate(in->q2, turn_slope(&rest->chord[1], (Two){-s->angle[1][0], -s->angle[1][1]}));
        c->bend1 = vec3_add(c->bend1, by_turn(e, t1, w1));
        c->bend2 = vec3_add(c->bend2, by_turn(e, t2, w2));
        c->twist = vec3_dot(o->axis, vec3_sub(w2, w1));
        for (int i = 0; i < 2; i++)
            c->stretch += s->angle[i][0] * rest->arc_by_angle[i][0] + s->angle[i][1] * rest->arc_by_angle[i][1];
    }
    if (k == 0 && j % 2 == 0)
        c->stretch -= sign * (o->bow / rest->length + rest->arc_by_length);
    c->own_stretch = j % 2 == 0 ? sign * (1 + w->out->tension[k] * rest->axial_end[k][end]) : 0;
    c->own_twist = j % 2 == 0 ? sign * w->out->torque[k] * rest->torsion_end[k][end] : -sign;
    c->moment1 = vec3_add(vec3_scale(c->bend1, rest->near1), vec3_scale(c->bend2, rest->far));
    c->moment2 = vec3_add(vec3_scale(c->bend2, rest->near2), vec3_scale(c->bend1, rest->far));
    c->pull = w->axial * c->stretch + rest->axial[k] * c->own_stretch;
    c->torque = w->torsion * c->twist + rest->torsion[k] * c->own_twist;

    Vec3 across = vec3_scale(vec3_add(vec3_cross(t1, c->moment1), vec3_cross(t2, c->moment2)), o->inverse * scale);
    across = vec3_add_scaled(vec3_add_scaled(across, -vec3_dot(across, e), e), scale * c->pull, o->stretch);
    Vec3 on1 = vec3_add_scaled(vec3_add_scaled(by_turn_back(e, t1, c->moment1), c->pull, o->bow1), -c->torque, o->axis);
    Vec3 on2 = vec3_add_scaled(vec3_add_scaled(by_turn_back(e, t2, c->moment2), c->pull, o->bow2), c->torque, o->axis);
    on1 = vec3_scale(on1, scale), on2 = vec3_scale(on2, scale);
    if (j == COAXIAL_PHI1)
        on1 = vec3_add_scaled(on1, w->spin[0][k], o->own1);
    if (j == COAXIAL_PHI2)
        on2 = vec3_add_scaled(on2, w->spin[1][k], o->own2);
    put_rows(tangent->cross, p, vec3_negate(across));
    put_rows(tangent->cross + 3, p, on1);
    put_rows(tangent->cross + 6, p, across);
    put_rows(tangent->cross + 9, p, on2);
}

// J' C J of the tools' unknowns with each other.
static void multiply_columns(const Work *w, CoaxialTangent *tangent)
{
    const CoaxialRest *rest = &w->out->rest;
    double(*own)[COAXIAL_COLUMNS] = tangent->own;
    int columns_count = 4 * rest->count;
    for (int a = 0; a < w->full_count; a++) {
        int p = w->full[a], k = p / 4;
        const Column *c = &w->column[p];
        double stretch_pull = c->pull - w->axial * c->stretch, twist_torque = c->torque - w->torsion * c->twist;
        for (int b = 0; b <= a; b++) {
            int q = w->full[b];
            const Column *d = &w->column[q];
            // the sum over all tools of (all + own)^2: pull and torque already contain the own part once
            double value = vec3_dot(c->moment1, d->bend1) + vec3_dot(c->moment2, d->bend2) + d->pull * c->stretch + stretch_pull * d->stretch +
                           d->torque * c->twist + twist_torque * d->twist;
            if (q / 4 == k)
                value += stretch_pull * d->own_stretch + twist_torque * d->own_twist;
            own[p][q] = own[q][p] = w->scale * value;
        }
        for (int n = 0; n < rest->count; n++)
            for (int j = COAXIAL_PHI1; w->is_wanted[n] && !rest->bends[n] && j < 4; j += 2) {
                int q = 4 * n + j;
                own[p][q] = own[q][p] = w->scale * w->column[q].torque * (c->twist + (n == k ? c->own_twist : 0));
            }
    }
    for (int k = 0; k < rest->count; k++) {
        if (!w->is_wanted[k])
            continue;
        double stiff = w->scale * rest->torsion[k];
        if (!rest->bends[k])
            add_pair(tangent, k, k, 1, (double[3]){stiff, -stiff, stiff});
        if (!rest->is_whole[k])
            continue;
        int p = 4 * k + COAXIAL_S1, opposite = 4 * k + COAXIAL_S2;
        for (int i = 0; i < 12; i++)
            tangent->cross[i][p] = -tangent->cross[i][opposite];
        for (int q = 0; q < columns_count; q++)
            own[p][q] = -own[opposite][q];
        for (int q = 0; q < columns_count; q++)
            own[q][p] = -own[q][opposite];
    }
}

// Transforms the columns of tips to the unknowns that tips have, and clears those of fixed spans.
static void settle_columns(const CoaxialInput *in, CoaxialTangent *tangent)
{
    int columns_count = 4 * in->count;
    if (has_tips(in)) {
        for (int i = 0; i < 12; i++)
            fold(in->span, in->count, tangent->cross[i], 1);
        for (int i = 0; i < columns_count; i++)
            fold(in->span, in->count, tangent->own[i], 1);
        for (int i = 0; i < columns_count; i++)
            fold(in->span, in->count, &tangent->own[0][i], COAXIAL_COLUMNS);
    }
    for (int k = 0; k < in->count; k++)
        for (int j = 4 * k; in->span[k].is_fixed && j < 4 * k + 4; j++) {
            for (int i = 0; i < 12; i++)
                tangent->cross[i][j] = 0;
            for (int i = 0; i < columns_count; i++)
                tangent->own[i][j] = tangent->own[j][i] = 0;
        }
}

void coaxial_tangent(const CoaxialInput *in, const CoaxialOutput *out, double scale, CoaxialTangent *tangent)
{
    SEL_ASSERT(scale > 0 && out->rest.count == in->count, "coaxial_element() was called first, and the scale is positive");
    const CoaxialRest *rest = &out->rest;
    int count = in->count;
    Work w;
    w.in = in, w.out = out, w.scale = scale, w.axial = w.torsion = 0, w.full_count = 0;
    memset(w.spin, 0, sizeof w.spin);
    for (int k = 0; k < count; k++)
        w.axial += rest->axial[k], w.torsion += rest->torsion[k];
    double spin[2] = {0, 0};
    if (rest->is_curved)
        set_spin(&w, spin);
    nodes_tangent(&w, spin, &tangent->nodes);

    memset(tangent->own, 0, (size_t)(4 * count) * sizeof tangent->own[0]);
    for (int i = 0; i < 12; i++)
        memset(tangent->cross[i], 0, (size_t)(4 * count) * sizeof(double));
    bool any = false;
    for (int k = 0; k < count; k++) {
        any |= w.is_wanted[k] = is_wanted(in, k);
        for (int p = 4 * k; w.is_wanted[k] && p < 4 * k + 4; p++) {
            if (p % 2 == 1 && !rest->bends[k])
                add_torsion_column(&w, p, tangent);
            else if (p % 4 != COAXIAL_S1 || !rest->is_whole[k])
                add_column(&w, p, tangent);
        }
    }
    if (!any)
        return;
    multiply_columns(&w, tangent);
    if (count > 1)
        add_sharing(in, out, tangent);
    add_soft(rest, tangent);
    for (int k = 0; k < count; k++) {
        tangent->own[4 * k + COAXIAL_PHI1][4 * k + COAXIAL_PHI1] += w.spin[0][k];
        tangent->own[4 * k + COAXIAL_PHI2][4 * k + COAXIAL_PHI2] += w.spin[1][k];
        for (int j = 0; j < k; j++) {
            add_pair(tangent, k, k, 1, rest->couple[k][j]);
            add_pair(tangent, j, j, 1, rest->couple[k][j]);
            add_pair(tangent, k, j, -1, rest->couple[k][j]);
            add_pair(tangent, j, k, -1, rest->couple[k][j]);
        }
    }
    settle_columns(in, tangent);
}
