// Assembles a chain of beam elements into the blocks of its linear system, LANES elements at a time: each lane evaluates the equations of
// beam_equations.h for one element, then the tile is transposed into blocks. Compiled once per instruction set (beam_chain.inc).
#include "base/base.h"
#include "solver/beam_equations.h"

#include <string.h>

#if defined(__GNUC__) && !defined(__clang__)
#define UNROLL_ROWS _Pragma("GCC unroll 9")
#else
#define UNROLL_ROWS
#endif

enum { LANES = BEAM_PADDING, BLOCK_ENTRIES = 36 };

// Data of LANES neighbouring elements and their first nodes; a row is a quantity.
typedef struct Tile {
    _Alignas(64) double near[N_ROWS][LANES];
    double far[F_ROWS][2 * LANES];       // from column LANES on; column LANES - 1 is the contribution of the preceding element to the first node
    double node[F_ROWS][LANES];          // rows as F_: diagonal block and right-hand side of a node
} Tile;

INLINE BeamInput input_at(const BeamRest *r, const BeamPose *p, int i)
{
    return (BeamInput){
        .x1 = {p->x[i], p->y[i], p->z[i]},
        .x2 = {p->x[i + 1], p->y[i + 1], p->z[i + 1]},
        .q1 = {p->qw[i], p->qx[i], p->qy[i], p->qz[i]},
        .q2 = {p->qw[i + 1], p->qx[i + 1], p->qy[i + 1], p->qz[i + 1]},
        .length = r->length[i],
        .extend = r->extend[i],
        .axial = r->axial[i],
        .near = r->near[i],
        .far = r->far[i],
        .twist = r->twist[i],
        .half_w = r->half_w[i],
        .half_y = r->half_y[i],
        .half_z = r->half_z[i],
    };
}

INLINE void put(double *row, int stride, Vec3 v) { row[0] = v.x, row[stride] = v.y, row[2 * stride] = v.z; }

INLINE void lane_element(const BeamChain *c, int base, int l, bool is_curved, double scale, Tile *t)
{
    BeamInput in = input_at(&c->rest, &c->pose, base + l);
    BeamOutput o;
    element(&in, is_curved, &o);
    double *near = &t->near[0][l], *far = &t->far[0][LANES + l], pull = o.tension + c->drag[base + l];
    tangent_rows(&o, in.length, in.axial, in.near, in.near, in.far, in.twist, scale, pull > 0 ? pull : 0, is_curved, near, LANES, far, 2 * LANES);
    double taut = pull > 0 ? pull : 0;
    Vec3 turn = vec3_scale(vec3_cross(o.chord, vec3_sub(o.own2, o.own1)), c->slides * o.inverse);
    put(near + N_MOMENT * LANES, LANES, vec3_add(o.moment1, vec3_cross(turn, vec3_add_scaled(o.moment1, -taut, o.bow1))));
    put(far + F_FORCE * 2 * LANES, 2 * LANES, vec3_add(o.force2, vec3_cross(turn, vec3_add_scaled(o.force2, -taut, o.stretch))));
    put(far + F_MOMENT * 2 * LANES, 2 * LANES, vec3_add(o.moment2, vec3_cross(turn, vec3_add_scaled(o.moment2, -taut, o.bow2))));
}

INLINE double lane_energy(const BeamChain *c, int base, int l, bool is_curved)
{
    BeamInput in = input_at(&c->rest, &c->pose, base + l);
    BeamOutput o;
    element(&in, is_curved, &o);
    return o.energy;
}

// A node sums the first end of its element, the second end of the preceding element, and its inertia.
INLINE void lane_node(const BeamChain *c, int base, int l, double rate, Tile *t)
{
    int i = base + l, before = LANES + l - 1, here = LANES + l;
    const BeamInertia *m = &c->inertia;
    Quat q = {c->pose.qw[i], c->pose.qx[i], c->pose.qy[i], c->pose.qz[i]};
    Vec3 axis = first_axis(q), spin = vec3(m->tx[i], m->ty[i], m->tz[i]);
    Columns a = columns(axis), push = columns(vec3_scale(vec3(m->ax[i], m->ay[i], m->az[i]), m->mass[i]));
    Columns turn = columns(vec3_add_scaled(vec3_scale(spin, m->lateral[i]), m->excess[i] * vec3_dot(axis, spin), axis));
    double mass = m->mass[i] * rate, lateral = m->lateral[i] * rate, excess = m->excess[i] * rate;
    UNROLL
    for (int r = 0; r < 3; r++) {
        double about = excess * a.v[r];
        t->node[F_FORCE + r][l] = t->far[F_FORCE + r][here] - t->far[F_FORCE + r][before] + push.v[r];
        t->node[F_MOMENT + r][l] = turn.v[r] - t->near[N_MOMENT + r][l] - t->far[F_MOMENT + r][before];
        UNROLL
        for (int s = 0; s < 3; s++) {
            t->node[F_TR + 3 * r + s][l] = -(t->near[N_TR + 3 * r + s][l] + t->far[F_TR + 3 * r + s][before]);
            if (s < r)
                continue;
            double tt = t->far[F_TT + SYM[r][s]][here] + t->far[F_TT + SYM[r][s]][before];
            double rr = t->near[N_RR + SYM[r][s]][l] + t->far[F_RR + SYM[r][s]][before] + about * a.v[s];
            t->node[F_TT + SYM[r][s]][l] = r == s ? mass - tt : -tt;
            t->node[F_RR + SYM[r][s]][l] = r == s ? rr + lateral : rr;
        }
    }
}

// Viscous forces of an element between two poses: rate J' C (strain - strain at the start). Rows: 3 F_FORCE, 3 moment of node 1, 3 moment of node 2.
// Extension and twist are scalars; the bending angles of the start are rotated with the chord by the smallest rotation. Rigid-body motions of any size and
// spins about the tangents therefore cause no force.
INLINE void lane_damping(const BeamChain *c, const BeamPose *start, int base, int l, double rate, double (*force)[LANES])
{
    BeamInput in = input_at(&c->rest, &c->pose, base + l), from = input_at(&c->rest, start, base + l);
    BeamOutput o, was;
    element(&in, true, &o);
    element(&from, true, &was);
    Vec3 e = o.chord, t1 = o.tangent1, t2 = o.tangent2, axis = vec3_cross(was.chord, e);
    double cosine = 1 + vec3_dot(was.chord, e), unit = 1 / sqrt(2 * cosine + 1e-12);     // undefined where the chord has reversed
    Quat turn = {cosine * unit, axis.x * unit, axis.y * unit, axis.z * unit};
    Vec3 angle1 = vec3_sub(o.angle1, quat_rotate(turn, was.angle1)), angle2 = vec3_sub(o.angle2, quat_rotate(turn, was.angle2));
    Vec3 m1 = vec3_scale(vec3_add(vec3_scale(angle1, in.near), vec3_scale(angle2, in.far)), rate);
    Vec3 m2 = vec3_scale(vec3_add(vec3_scale(angle2, in.near), vec3_scale(angle1, in.far)), rate);
    double tension = rate * (o.tension - was.tension), torque = rate * (o.torque - was.torque);

    // B_i' m = s_i m - (t_i . m) e, D_i' m = P (t_i x m) / l
    Vec3 across = vec3_scale(vec3_add(vec3_cross(t1, m1), vec3_cross(t2, m2)), o.inverse);
    Vec3 moment1 = vec3_add_scaled(vec3_scale(m1, vec3_dot(e, t1)), -vec3_dot(t1, m1), e);
    Vec3 moment2 = vec3_add_scaled(vec3_scale(m2, vec3_dot(e, t2)), -vec3_dot(t2, m2), e);
    c->drag[base + l] = tension;
    put(&force[0][l], LANES, vec3_add_scaled(vec3_add_scaled(across, -vec3_dot(across, e), e), tension, o.stretch));
    put(&force[3][l], LANES, vec3_add_scaled(vec3_add_scaled(moment1, tension, o.bow1), -torque, o.axis));
    put(&force[6][l], LANES, vec3_add_scaled(vec3_add_scaled(moment2, tension, o.bow2), torque, o.axis));
}

// --- conversion of rows to blocks ---

typedef double Quad __attribute__((vector_size(32)));
typedef double LooseQuad __attribute__((vector_size(32), may_alias, aligned(8)));

// Transposes four rows of four lanes into four columns: `to` and the three places `stride` apart after it.
INLINE void transpose(const double *row0, const double *row1, const double *row2, const double *row3, double *to, int stride)
{
    Quad a = *(const LooseQuad *)row0, b = *(const LooseQuad *)row1, c = *(const LooseQuad *)row2, d = *(const LooseQuad *)row3;
    Quad ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    Quad cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    *(LooseQuad *)to = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
    *(LooseQuad *)(to + stride) = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
    *(LooseQuad *)(to + 2 * stride) = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
    *(LooseQuad *)(to + 3 * stride) = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

// Entries of a block as rows of a tile, row-major.
#define BLOCK_ROWS(tt, tr, rt, rr)                                                                                                                             \
    {                                                                                                                                                          \
        tt(0, 0), tt(0, 1), tt(0, 2), tr(0, 0), tr(0, 1), tr(0, 2), tt(1, 0), tt(1, 1), tt(1, 2), tr(1, 0), tr(1, 1), tr(1, 2), tt(2, 0), tt(2, 1), tt(2, 2),  \
            tr(2, 0), tr(2, 1), tr(2, 2), rt(0, 0), rt(0, 1), rt(0, 2), rr(0, 0), rr(0, 1), rr(0, 2), rt(1, 0), rt(1, 1), rt(1, 2), rr(1, 0), rr(1, 1),        \
            rr(1, 2), rt(2, 0), rt(2, 1), rt(2, 2), rr(2, 0), rr(2, 1), rr(2, 2)                                                                               \
    }

INLINE void scatter_diagonal(const Tile *t, double *block)
{
#define TT(r, c) t->node[F_TT + SYM[r][c]]
#define TR(r, c) t->node[F_TR + 3 * r + c]
#define RT(r, c) t->node[F_TR + 3 * c + r]
#define RR(r, c) t->node[F_RR + SYM[r][c]]
    const double *row[BLOCK_ENTRIES] = BLOCK_ROWS(TT, TR, RT, RR);
#undef TT
#undef TR
#undef RT
#undef RR
    for (int l = 0; l < LANES; l += 4)
        UNROLL_ROWS
    for (int k = 0; k < BLOCK_ENTRIES; k += 4)
        transpose(row[k] + l, row[k + 1] + l, row[k + 2] + l, row[k + 3] + l, block + l * BLOCK_ENTRIES + k, BLOCK_ENTRIES);
}

INLINE void scatter_lower(const Tile *t, double *block)
{
#define TT(r, c) t->far[F_TT + SYM[r][c]] + LANES
#define TR(r, c) t->near[N_TR + 3 * r + c]
#define RT(r, c) t->far[F_TR + 3 * c + r] + LANES
#define RR(r, c) t->near[N_FAR + 3 * r + c]
    const double *row[BLOCK_ENTRIES] = BLOCK_ROWS(TT, TR, RT, RR);
#undef TT
#undef TR
#undef RT
#undef RR
    for (int l = 0; l < LANES; l += 4)
        UNROLL_ROWS
    for (int k = 0; k < BLOCK_ENTRIES; k += 4)
        transpose(row[k] + l, row[k + 1] + l, row[k + 2] + l, row[k + 3] + l, block + l * BLOCK_ENTRIES + k, BLOCK_ENTRIES);
}

// Six rows, transposed as two groups of four that share two rows.
INLINE void scatter_side(const Tile *t, double *b)
{
    const double(*row)[LANES] = t->node + F_FORCE;
    for (int l = 0; l < LANES; l += 4) {
        transpose(row[0] + l, row[1] + l, row[2] + l, row[3] + l, b + 6 * l, 6);
        transpose(row[2] + l, row[3] + l, row[4] + l, row[5] + l, b + 6 * l + 2, 6);
    }
}

// Writes only the first `lanes` lanes to the chain; `lower` is NULL after the last element.
INLINE void scatter(const Tile *t, int lanes, double *diag, double *lower, double *b)
{
    if (lanes == LANES) {
        scatter_diagonal(t, diag);
        scatter_lower(t, lower);
        scatter_side(t, b);
        return;
    }
    _Alignas(64) double all[BLOCK_ENTRIES * LANES];
    size_t bytes = BLOCK_ENTRIES * (size_t)lanes * sizeof(double);
    scatter_diagonal(t, all);
    memcpy(diag, all, bytes);
    if (lower) {
        scatter_lower(t, all);
        memcpy(lower, all, bytes);
    }
    scatter_side(t, all);
    memcpy(b, all, bytes / 6);
}

INLINE void leave_to_next(Tile *t, int lanes)
{
    for (int k = 0; k < F_ROWS; k++)
        t->far[k][LANES - 1] = t->far[k][LANES - 1 + lanes];
}

// Whether the elements from `base` on are curved at rest; *lanes: how many of them are alike in this. Sections are long, so that few groups end early.
INLINE bool group_at(const BeamRest *r, int base, int last, int *lanes)
{
    bool is_curved = r->half_w[base] < 1;
    int count = 1;
    while (count < LANES && base + count < last && (r->half_w[base + count] < 1) == is_curved)
        count++;
    *lanes = count;
    return is_curved;
}

#define KERNEL_TEXT "solver/beam_chain.inc"
#include "base/each_simd.inc"

static void (*const assemble_on[SIMD_COUNT])(const BeamChain *, int, int, double, double, BlockChain *, double *) = SIMD_FORMS(assemble);

void beam_chain_assemble(const BeamChain *beam, int first, int last, double scale, double rate, BlockChain *chain, double *b)
{
    SEL_ASSERT(first >= 0 && first <= last && last < chain->count && chain->size == 6, "the elements lie within the chain, with six unknowns per node");
    SEL_ASSERT(scale > 0 && rate >= 0, "the stiffness factor is positive and the mass factor is not negative");
    assemble_on[simd_level()](beam, first, last, scale, rate, chain, b);
}

static void (*const damping_on[SIMD_COUNT])(const BeamChain *, const BeamPose *, int, double, double (*)[LANES]) = SIMD_FORMS(damping);

void beam_chain_damp(const BeamChain *beam, const BeamPose *start, int first, int last, double rate, double *b)
{
    SEL_ASSERT(first >= 0 && first <= last && rate >= 0, "the damping rate is not negative and the elements lie within the chain");
    _Alignas(64) double force[9][LANES];
    memset(b + 6 * (size_t)first, 0, 6 * (size_t)(last + 1 - first) * sizeof *b);
    for (int base = first; base < last; base += LANES) {
        damping_on[simd_level()](beam, start, base, rate, force);
        for (int l = 0; l < LANES && base + l < last; l++) {
            double *at = b + 6 * (size_t)(base + l);
            for (int k = 0; k < 3; k++) {
                at[k] += force[k][l];
                at[6 + k] -= force[k][l];
                at[3 + k] -= force[3 + k][l];
                at[9 + k] -= force[6 + k][l];
            }
        }
    }
}

static double (*const energy_on[SIMD_COUNT])(const BeamChain *, int, int) = SIMD_FORMS(energy);

double beam_chain_energy(const BeamChain *beam, int first, int last)
{
    SEL_ASSERT(first >= 0 && last <= beam->rest.count, "the elements lie within the chain");
    return energy_on[simd_level()](beam, first, last);
}
