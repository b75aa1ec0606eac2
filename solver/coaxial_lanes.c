// The equations of coaxial.c for straight tools only: one piece, no rest angles, W = 0. With b_k = EI_k / l_k, B = sum b_k, S = sum kappa G A_k l_k:
//   F11 = F22 = 1 / (3 B) + 1 / S,  F12 = -1 / (6 B) + 1 / S,  derivatives with l_k:  b_k / (B^2 l_k) (1/3 or -1/6) - kappa G A_k / S^2
#include "solver/coaxial_lanes.h"

#include "base/base.h"
#include "solver/beam_equations.h"

#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL_ALL _Pragma("GCC unroll 12")
#else
#define UNROLL_ALL
#endif

enum { LANES = COAXIAL_LANES };

INLINE Vec3 get3(double (*row)[LANES], int l) { return vec3(row[0][l], row[1][l], row[2][l]); }
INLINE void put3(double (*row)[LANES], int l, Vec3 v) { row[0][l] = v.x, row[1][l] = v.y, row[2][l] = v.z; }

typedef struct Mixed {       // quantities of all tools of the element together
    double axial[COAXIAL_TOOLS_MAX], torsion[COAXIAL_TOOLS_MAX], own[COAXIAL_TOOLS_MAX];
    double all_axial, all_torsion, bending, shear, length, turn, near, far;
} Mixed;

INLINE void mix(const CoaxialTile *t, int l, const int count, Mixed *m)
{
    double bending = 0, shear = 0, axial = 0, torsion = 0, length = 0, turn = 0;
    UNROLL_ALL
    for (int k = 0; k < count; k++) {
        double own = t->length[k][l], spread = t->spread[k][l];
        m->own[k] = t->bending[k][l] / own;
        bending += m->own[k];
        shear += t->shear[k][l] * own;
        m->axial[k] = t->axial[k][l] / (spread > own ? spread : own);
        m->torsion[k] = t->torsion[k][l] / own;
        axial += m->axial[k];
        torsion += m->torsion[k];
        length += m->axial[k] * own;
        turn += m->torsion[k] * t->turn[k][l];
    }
    m->bending = 1 / bending, m->shear = 1 / shear, m->all_axial = axial, m->all_torsion = torsion;
    m->length = length / axial, m->turn = turn / torsion;
    double near = m->bending * (1.0 / 3) + m->shear, far = m->bending * (-1.0 / 6) + m->shear, unit = 1 / (near * near - far * far);
    m->near = near * unit, m->far = -far * unit;
}

// The nodes' blocks of the chain's rows (BeamTangent), each entry once.
INLINE void put_blocks(CoaxialTile *t, int l, const double n[N_ROWS], const double f[F_ROWS])
{
    UNROLL
    for (int i = 0; i < 3; i++)
        UNROLL
    for (int j = 0; j < 3; j++) {
        int turned = (3 + i) * (4 + i) / 2, sym = SYM[i][j];
        t->k21[6 * i + j][l] = f[F_TT + sym];
        t->k21[6 * i + 3 + j][l] = n[N_TR + 3 * i + j];
        t->k21[6 * (3 + j) + i][l] = f[F_TR + 3 * i + j];
        t->k21[6 * (3 + i) + 3 + j][l] = n[N_FAR + 3 * i + j];
        t->k11[(3 + j) * (4 + j) / 2 + i][l] = -n[N_TR + 3 * i + j];
        t->k22[(3 + j) * (4 + j) / 2 + i][l] = -f[F_TR + 3 * i + j];
        if (j > i)
            continue;
        t->k11[i * (i + 1) / 2 + j][l] = t->k22[i * (i + 1) / 2 + j][l] = -f[F_TT + sym];
        t->k11[turned + 3 + j][l] = n[N_RR + sym];
        t->k22[turned + 3 + j][l] = f[F_RR + sym];
    }
}

INLINE Vec3 turned_into(Quat q, Vec3 v) { return quat_rotate(quat_conjugate(q), v); }

// The derivatives of the strains with S of a tool, and of the nodes' forces: add_column() of coaxial.c.
typedef struct Slide {
    Vec3 bend1, bend2, moment1, moment2;
    double stretch, twist, pull, torque;
} Slide;

INLINE void find_lane(CoaxialTile *t, int l, const int count, double scale)
{
    Mixed m;
    mix(t, l, count, &m);
    Quat q1 = {t->q1[0][l], t->q1[1][l], t->q1[2][l], t->q1[3][l]}, q2 = {t->q2[0][l], t->q2[1][l], t->q2[2][l], t->q2[3][l]};
    BeamInput beam = {.x1 = get3(t->x1, l),
                      .x2 = get3(t->x2, l),
                      .q1 = q1,
                      .q2 = q2,
                      .length = t->length[0][l],
                      .extend = m.length,
                      .axial = m.all_axial,
                      .far = m.far,
                      .twist = m.all_torsion};
    BeamOutput o;
    element_between(&beam, (BeamEnds){m.near, m.near, {1, 0, 0, 0}, {1, 0, 0, 0}, -m.turn}, false, &o);
    double n[N_ROWS], f[F_ROWS], pull = o.tension > 0 ? o.tension : 0;
    tangent_rows(&o, beam.length, m.all_axial, m.near, m.near, m.far, m.all_torsion, scale, pull, false, n, 1, f, 1);
    put_blocks(t, l, n, f);
    put3(t->force, l, vec3_negate(o.force2));
    put3(t->force + 3, l, o.moment1);
    put3(t->force + 6, l, o.force2);
    put3(t->force + 9, l, o.moment2);

    // bending of the tools
    Vec3 m1 = vec3_add(vec3_scale(o.angle1, m.near), vec3_scale(o.angle2, m.far)), m2 = vec3_add(vec3_scale(o.angle2, m.near), vec3_scale(o.angle1, m.far));
    double stiff = 0;
    UNROLL_ALL
    for (int k = 0; k < count; k++)
        stiff += t->bending[k][l];
    Vec3 curvature = vec3_scale(vec3_sub(m2, m1), 0.5 / stiff);
    t->bent[l] = sqrt(vec3_norm2(curvature));
    put3(t->moment[0], l, vec3_scale(curvature, stiff));
    t->tension[0][l] = o.tension;
    if (count == 1)
        return;

    double square1 = 0.5 * vec3_norm2(m1), square12 = vec3_dot(m1, m2), square2 = 0.5 * vec3_norm2(m2), psi = o.torque / m.all_torsion - m.turn;
    double strain = o.tension / m.all_axial + m.length, held_bending = 0, held_tension = 0;
    // tools stretched differently where the line is bent: add_sharing()
    Vec3 own1 = turned_into(q1, m1), own2 = turned_into(q2, m2);
    double hy = 0.5 * (own2.y - own1.y), hz = 0.5 * (own2.z - own1.z), sy = own1.y + own2.y, sz = own1.z + own2.z;
    double square = (hy * hy + hz * hz + (sy * sy + sz * sz) * (1.0 / 12)) * m.bending * m.bending;
    Slide s[COAXIAL_TOOLS_MAX];
    UNROLL_ALL
    for (int k = count - 1; k > 0; k--) {
        int i = k - 1;
        double own = t->length[k][l], spread = t->spread[k][l], soft = own < spread ? 0 : 1 / t->axial[k][l], limp = 1 / t->torsion[k][l];
        double tension = m.axial[k] * (strain - own), torque = m.torsion[k] * (psi + t->turn[k][l]);
        double part = m.own[k] / own * m.bending * m.bending, sheared = t->shear[k][l] * m.shear * m.shear;
        double near = part * (1.0 / 3) - sheared, far = part * (-1.0 / 6) - sheared;
        t->slide_force[i][l] = -(square1 * near + square12 * far + square2 * near) - (tension + 0.5 * (tension * tension * soft + torque * torque * limp));
        t->turn_force[i][l] = torque;
        held_bending += t->bending[k][l];
        held_tension += tension;
        put3(t->moment[k], l, vec3_scale(curvature, held_bending));
        t->tension[k][l] = held_tension;

        Slide *c = &s[k];
        c->bend1 = vec3_negate(vec3_add(vec3_scale(m1, near), vec3_scale(m2, far)));
        c->bend2 = vec3_negate(vec3_add(vec3_scale(m1, far), vec3_scale(m2, near)));
        c->moment1 = vec3_add(vec3_scale(c->bend1, m.near), vec3_scale(c->bend2, m.far));
        c->moment2 = vec3_add(vec3_scale(c->bend2, m.near), vec3_scale(c->bend1, m.far));
        c->stretch = -(1 + tension * soft);
        c->twist = -torque * limp;
        c->pull = m.axial[k] * c->stretch;
        c->torque = m.torsion[k] * c->twist;
        Vec3 e = o.chord, t1 = o.tangent1, t2 = o.tangent2;
        Vec3 across = vec3_scale(vec3_add(vec3_cross(t1, c->moment1), vec3_cross(t2, c->moment2)), o.inverse);
        across = vec3_add_scaled(vec3_add_scaled(across, -vec3_dot(across, e), e), c->pull, o.stretch);
        Vec3 on1 = vec3_add_scaled(vec3_scale(c->moment1, vec3_dot(e, t1)), -vec3_dot(t1, c->moment1), e);
        Vec3 on2 = vec3_add_scaled(vec3_scale(c->moment2, vec3_dot(e, t2)), -vec3_dot(t2, c->moment2), e);
        on1 = vec3_add_scaled(vec3_add_scaled(on1, c->pull, o.bow1), -c->torque, o.axis);
        on2 = vec3_add_scaled(vec3_add_scaled(on2, c->pull, o.bow2), c->torque, o.axis);
        put3(t->by_slide[i], l, vec3_scale(across, -scale));
        put3(t->by_slide[i] + 3, l, vec3_scale(on1, scale));
        put3(t->by_slide[i] + 6, l, vec3_scale(across, scale));
        put3(t->by_slide[i] + 9, l, vec3_scale(on2, scale));
        double turn_turn = scale * m.torsion[k];
        put3(t->by_turn[i], l, vec3_scale(o.axis, turn_turn));
        t->turn_turn[i][l] = turn_turn;
        t->slide_turn[i][l] = turn_turn * c->twist;
        double share = square * m.own[k] / own;
        t->slide_slide[i][i][l] = scale * (vec3_dot(c->moment1, c->bend1) + vec3_dot(c->moment2, c->bend2) + c->pull * c->stretch + c->torque * c->twist) +
                                  (share / own - share * m.bending * m.own[k] / own);
        UNROLL_ALL
        for (int j = count - 1; j > k; j--)
            t->slide_slide[i][j - 1][l] = t->slide_slide[j - 1][i][l] =
                scale * (vec3_dot(s[j].moment1, c->bend1) + vec3_dot(s[j].moment2, c->bend2)) - share * m.bending * m.own[j] / t->length[j][l];
    }
}

#define KERNEL_TEXT "solver/coaxial_lanes.inc"
#include "base/each_simd.inc"

void coaxial_tile_find(CoaxialTile *tile, double scale)
{
    SEL_ASSERT(tile->lanes > 0 && tile->lanes <= LANES && tile->count > 0 && tile->count <= COAXIAL_TOOLS_MAX, "a tile holds elements of some tools");
    static void (*const find_on[COAXIAL_TOOLS_MAX][SIMD_COUNT])(CoaxialTile *, double) = {SIMD_FORMS(find_1), SIMD_FORMS(find_2), SIMD_FORMS(find_3),
                                                                                          SIMD_FORMS(find_4)};
    // lanes without an element repeat the first element
    for (int l = tile->lanes; l < LANES; l++)
        for (double(*row)[LANES] = tile->x1; row < tile->k11; row++)
            (*row)[l] = (*row)[0];
    find_on[tile->count - 1][simd_level()](tile, scale);
}

// The section from `from` to `to`. NULL if a border lies between them, if the section is curved, or if the tool ends there, unless it `carries`.
static const CoaxialSection *only_section(const CoaxialTool *tool, double from, double to, bool carries)
{
    const CoaxialSection *section = coaxial_section_at(tool, from), *last = tool->section + tool->count - 1;
    bool reaches = section->end >= to || (carries && section == last);
    return reaches && section->curve[0] == 0 && section->curve[1] == 0 ? section : NULL;
}

bool coaxial_tile_take(CoaxialTile *tile, const CoaxialInput *in)
{
    SEL_ASSERT(tile->lanes < LANES, "the tile has a lane for another element");
    SEL_ASSERT(in->count > 0 && in->count <= COAXIAL_TOOLS_MAX && (tile->lanes == 0 || in->count == tile->count),
               "all elements of a tile have the same number of tools");
    const CoaxialSection *section[COAXIAL_TOOLS_MAX];
    for (int k = 0; k < in->count; k++) {
        const CoaxialSpan *p = &in->span[k];
        double back = fmin(p->s1 - p->soft[0], p->s2 - p->spread);
        if (p->has_tip || p->spreads_twist || p->is_fixed != (k == 0) || !(p->s2 - p->s1 > 1e-3 * in->span[0].spread))
            return false;
        section[k] = only_section(p->tool, back, p->s2 + p->soft[1], k == 0);
        if (!section[k])
            return false;
    }
    int l = tile->lanes++;
    tile->count = in->count;
    put3(tile->x1, l, in->x1);
    put3(tile->x2, l, in->x2);
    tile->q1[0][l] = in->q1.w, tile->q1[1][l] = in->q1.x, tile->q1[2][l] = in->q1.y, tile->q1[3][l] = in->q1.z;
    tile->q2[0][l] = in->q2.w, tile->q2[1][l] = in->q2.x, tile->q2[2][l] = in->q2.y, tile->q2[3][l] = in->q2.z;
    for (int k = 0; k < in->count; k++) {
        const CoaxialSpan *p = &in->span[k];
        tile->length[k][l] = p->s2 - p->s1;
        tile->turn[k][l] = p->phi2 - p->phi1;
        tile->spread[k][l] = p->spread;
        tile->bending[k][l] = section[k]->bending;
        tile->axial[k][l] = section[k]->axial;
        tile->torsion[k][l] = section[k]->torsion;
        tile->shear[k][l] = section[k]->shear;
    }
    return true;
}
