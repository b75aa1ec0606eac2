// Curvature of the wall as stiffness (docs/design.md, "Stability", 1).
//
// During a step the normal rotates by H d (H: Hessian of the gap), so that a contact with force force_n n acts like a spring of stiffness -force_n H. Its
// positive part in the tangent plane is added to the matrix, because the tip oscillates without it. The negative part (convex wall) would make the matrix
// indefinite and takes effect only through the normal of the next step. The gap depends on the position of the axis alone: the arm to the touching point does
// not enter, but between nodes the axis follows the nodes' rotations through the levers.
#include "solver/contact.h"

#include "base/base.h"

#include "solver/block_chain.h"

#include <stddef.h>

// Replaces [xx xy; xy yy] by its positive semi-definite part.
static void clamp_positive(double *xx, double *xy, double *yy)
{
    double mean = (*xx + *yy) / 2, half = (*xx - *yy) / 2, radius = sqrt(half * half + *xy * *xy);
    if (mean >= radius)
        return;
    if (mean <= -radius) {
        *xx = *xy = *yy = 0;
        return;
    }
    // the eigenvalues have opposite signs: the result is (mean + radius) times the projector on the upper eigenvector
    double top = mean + radius, c = half / radius, s = *xy / radius;
    *xx = top * (1 + c) / 2;
    *yy = top * (1 - c) / 2;
    *xy = top * s / 2;
}

bool contact_is_free(const BlockChain *chain, int node, int r)
{
    SEL_ASSERT(node >= 0 && node < chain->count && r >= 0 && r < chain->size, "an unknown is one of the chain's");
    const int n = chain->size;
    const size_t block = (size_t)(n * n);
    const double *d = chain->diag + block * (size_t)node, *before = chain->lower + block * (size_t)(node > 0 ? node - 1 : 0),
                 *after = chain->lower + block * (size_t)node;
    if (d[(n + 1) * r] != 1)
        return true;
    bool any = false;
    for (int c = 0; c < n; c++) {
        any |= c != r && d[n * r + c] != 0;
        any |= node > 0 && before[n * r + c] != 0;
        any |= node + 1 < chain->count && after[n * c + r] != 0;
    }
    return any;
}

unsigned contact_free_dofs(const BlockChain *chain, int node)
{
    unsigned mask = 0;
    for (int r = 0; r < 6; r++)
        mask |= contact_is_free(chain, node, r) ? 1u << r : 0;
    return mask;
}

static void add_block(double *block, int stride, double k[3][3], unsigned mask)
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            if (mask >> r & mask >> c & 1)
                block[stride * r + c] += k[r][c];
}

// block += (w I, -[l]x)^T K (v I, -[m]x)
static void add_levered(double *block, int stride, double k[3][3], double w, Vec3 l, unsigned rows, double v, Vec3 m, unsigned columns)
{
    Mat3 left = mat3_skew(vec3_negate(l)), right = mat3_skew(vec3_negate(m));
    double a[3][6], b[3][6], kb[3][6];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            a[r][c] = r == c ? w : 0, a[r][c + 3] = left.m[r][c];
            b[r][c] = r == c ? v : 0, b[r][c + 3] = right.m[r][c];
        }
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 6; c++)
            kb[r][c] = k[r][0] * b[0][c] + k[r][1] * b[1][c] + k[r][2] * b[2][c];
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++)
            if (rows >> r & columns >> c & 1)
                block[stride * r + c] += a[0][r] * kb[0][c] + a[1][r] * kb[1][c] + a[2][r] * kb[2][c];
}

// b += J' push for a contact on the axis.
static void add_push(const ContactPoint *p, Vec3 push, const unsigned mask[2], int n, double *b)
{
    const double weight[2] = {1 - p->xi, p->xi};
    for (int e = 0; e < (p->is_between ? 2 : 1); e++) {
        Vec3 f = vec3_scale(push, weight[e]), m = p->is_between ? vec3_cross(p->lever[e], push) : vec3(0, 0, 0);
        const double all[6] = {f.x, f.y, f.z, m.x, m.y, m.z};
        for (int r = 0; r < 6; r++)
            b[(size_t)n * (size_t)(p->node + e) + (size_t)r] += mask[e] >> r & 1 ? all[r] : 0;
    }
}

// Adds the stiffness force roll lean lean' and its effect on `leant`.
static void add_roll(const ContactPoint *p, double force, const unsigned mask[2], BlockChain *chain, double *b)
{
    const int n = chain->size;
    const size_t block = (size_t)(n * n), at = (size_t)p->node;
    double k = force * p->roll, lean[2][6], *diag = chain->diag + block * at, *lower = chain->lower + block * at;
    for (int e = 0; e < 2; e++)
        for (int r = 0; r < 6; r++)
            lean[e][r] = mask[e] >> r & 1 ? p->lean[e][r] : 0;
    for (int r = 0; r < 6; r++) {
        double near = k * lean[0][r], far = k * lean[1][r];
        for (int c = 0; c < 6; c++) {
            diag[n * r + c] += near * lean[0][c];
            diag[block + (size_t)(n * r + c)] += far * lean[1][c];
            lower[n * r + c] += far * lean[0][c];
        }
        if (b) {
            b[(size_t)n * at + (size_t)r] += near * p->leant;
            b[(size_t)n * (at + 1) + (size_t)r] += far * p->leant;
        }
    }
}

void contact_add_curvature(const ContactSet *set, BlockChain *chain, double *b)
{
    SEL_ASSERT(set->count >= 0 && set->count <= set->capacity, "the number of contacts is within the set's capacity");
    const int n = chain->size;
    const size_t block = (size_t)(n * n);
    for (int i = 0; i < set->count; i++) {
        const ContactPoint *p = &set->point[i];
        SEL_REQUIRE(p->node >= 0 && p->node < chain->count, "a contact is at a node of the chain");
        SEL_ASSERT(p->friction >= 0 && p->roll >= 0, "friction and roll are not negative");
        double force = vec3_dot(p->force, p->normal);
        if (!(force > 0))
            continue;
        bool has_two = p->is_between && p->node + 1 < chain->count;
        const unsigned mask[2] = {contact_free_dofs(chain, p->node), has_two ? contact_free_dofs(chain, p->node + 1) : 0};
        if (p->roll > 0 && has_two)
            add_roll(p, force, mask, chain, b);
        Vec3 e = vec3_normal_to(p->normal), f = vec3_cross(p->normal, e);
        Vec3 he = sym3_mul_vec(&p->hessian, e);
        double xx = -force * vec3_dot(e, he), xy = -force * vec3_dot(f, he), yy = -force * sym3_quadratic(&p->hessian, f);
        if (!isfinite(xx) || !isfinite(xy) || !isfinite(yy))
            continue;
        clamp_positive(&xx, &xy, &yy);
        if (b && (xx != 0 || yy != 0) && vec3_norm2(p->slid) > 0) {
            double along = vec3_dot(e, p->slid), across = vec3_dot(f, p->slid);
            add_push(p, vec3_add(vec3_scale(e, xx * along + xy * across), vec3_scale(f, xy * along + yy * across)), mask, n, b);
        }
        double x[3] = {e.x, e.y, e.z}, y[3] = {f.x, f.y, f.z}, k[3][3];
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                k[r][c] = xx * x[r] * x[c] + xy * (x[r] * y[c] + y[r] * x[c]) + yy * y[r] * y[c];
        unsigned here = mask[0], next = mask[1];
        double *diag = chain->diag + block * (size_t)p->node;
        if (!has_two) {
            add_block(diag, n, k, here);
            continue;
        }
        double near = 1 - p->xi, far = p->xi;
        add_levered(diag, n, k, near, p->lever[0], here, near, p->lever[0], here);
        add_levered(diag + block, n, k, far, p->lever[1], next, far, p->lever[1], next);
        add_levered(chain->lower + block * (size_t)p->node, n, k, far, p->lever[1], next, near, p->lever[0], here);
    }
}
