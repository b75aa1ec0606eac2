// The safe form of a contact solve, where the direct Newton method (contact_newton.c) finds no end: Tresca's friction, whose bounds s_k are given,
// makes the step a convex minimum, and a Newton method with exact line search on its augmented Lagrangian always reaches it.
//
//   phi(u) = u'Au/2 - b'u + sum_k  |(l_n - r_n v)+|^2 / (2 r_n) + h(l_t - r_t d_t),   h(p) = |p|^2/(2 r_t) in the disc |p| <= s, s|p|/r_t - s^2/(2 r_t) outside
// v = gap + d_n. The force of a contact is f(d) = (l_n - r_n v)+ n + P_s(l_t - r_t d_t). At every iterate A u = b + J^T g with some forces g per
// contact, so the gradient is J^T (g - f), the step solves (A + J^T C J) du = J^T (f - g) with C = -df/dd, and along it g moves to f - C dd.
// Outer rounds set l = f and raise r. contact_convex follows Coulomb's law by s = mu f_n (a fixed point: the usual block Gauss-Seidel between the
// normal and the friction field). contact_feasible starts without friction, which always has a solution, and then gives as much friction as
// the normal forces still bear: nothing overlaps and every force is in its cone, though it may be smaller than Coulomb's.
#include "solver/contact_forms.h"

#include <string.h>

static Vec3 smooth_force(const ContactRow *c, const ContactLaw *law, double ratio, Vec3 motion, Mat3 *stiffness)
{
    Vec3 n = c->normal, f = {0, 0, 0};
    double rn = ratio * c->stiffness_n, rt = ratio * c->stiffness_t;
    double fn = vec3_dot(law->multiplier, n) - rn * (c->gap + vec3_dot(motion, n)), turn = 0, along = 0;
    if (fn > 0)
        f = vec3_scale(n, fn);
    Vec3 p = vec3_add_scaled(contact_tangential(law->multiplier, n), -rt, contact_tangential(motion, n)), e = {0, 0, 0};
    double size = vec3_norm(p);
    if (law->bound > 0) {
        bool slides = size > law->bound;
        turn = slides ? rt * law->bound / size : rt;
        along = slides ? 0 : rt;
        if (size > 0)
            e = vec3_scale(p, 1 / size);
        f = vec3_add_scaled(f, slides ? law->bound / size : 1, p);
    }
    if (stiffness) {
        const double a[3] = {n.x, n.y, n.z}, b[3] = {e.x, e.y, e.z};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                stiffness->m[i][j] = (fn > 0 ? rn : 0) * a[i] * a[j] + turn * ((i == j) - a[i] * a[j] - b[i] * b[j]) + along * b[i] * b[j];
    }
    return f;
}

// d phi / dt at t along the step.
static double slope_along(const ContactSolver *s, int count, double ratio, double t)
{
    double sum = 0;
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &s->row[i];
        const ContactLaw *law = &s->law[i];
        if (c->inert)
            continue;
        Vec3 f = smooth_force(c, law, ratio, vec3_add_scaled(s->motion[i], t, law->step), NULL);
        sum += vec3_dot(vec3_sub(vec3_mix(c->force, law->force, t), f), law->step);
    }
    return sum;
}

// The zero of the slope in (0, 1], where full steps overshoot; phi is convex, the slope rises.
static double line_search(const ContactSolver *s, int count, double ratio)
{
    double low = 0, at_low = slope_along(s, count, ratio, 0), high = 1, at_high = slope_along(s, count, ratio, 1);
    double enough = 0.01 * fabs(at_low);
    if (at_high <= enough)
        return 1;
    for (int k = 0; k < 40; k++) {
        double t = (low * at_high - high * at_low) / (at_high - at_low);
        if (!(t > low && t < high))
            t = (low + high) / 2;
        double at = slope_along(s, count, ratio, t);
        if (fabs(at) <= enough)
            return t;
        if (at < 0) {
            low = t;
            at_low = at;
            at_high /= 2;
        } else {
            high = t;
            at_high = at;
            at_low /= 2;
        }
    }
    return low > 0 ? low : high;
}

// Newton iterations for fixed multipliers and bounds, until the forces agree with the motion or the budget ends.
static void minimise(ContactSolver *s, const BlockChain *chain, int count, double ratio, double tolerance, int *budget, double *u)
{
    size_t n = (size_t)chain->count * 6;
    for (; *budget > 0;) {
        double rest = 0, top = 1e-3;
        memset(s->rhs, 0, n * sizeof *s->rhs);
        for (int i = 0; i < count; i++) {
            const ContactRow *c = &s->row[i];
            ContactLaw *law = &s->law[i];
            if (c->inert)
                continue;
            law->force = smooth_force(c, law, ratio, s->motion[i], &law->c);
            law->state = 1;
            Vec3 change = vec3_sub(law->force, c->force);
            rest = fmax(rest, vec3_norm(change));
            top = fmax(top, vec3_norm(law->force));
            contact_row_push(c, change, s->rhs);
        }
        if (rest <= tolerance * top)
            return;
        contact_assemble(s, chain, count);
        --*budget;
        if (!block_chain_factor_solve(&s->matrix, s->factor, s->rhs, s->delta))
            return;
        for (int i = 0; i < count; i++) {
            s->law[i].step = contact_row_motion(&s->row[i], s->delta);
            s->law[i].force = vec3_sub(s->law[i].force, mat3_mul_vec(&s->law[i].c, s->law[i].step));
        }
        double t = line_search(s, count, ratio);
        for (size_t k = 0; k < n; k++)
            u[k] += t * s->delta[k];
        for (int i = 0; i < count; i++) {
            ContactRow *c = &s->row[i];
            if (c->inert)
                continue;
            c->force = vec3_mix(c->force, s->law[i].force, t);
            s->motion[i] = vec3_add_scaled(s->motion[i], t, s->law[i].step);
        }
    }
}

// Forces cut to their cones, and motion balanced with them: what would be handed out.
static void hand_out(ContactSolver *s, const BlockFactor *factor, const double *b, int count, ContactReport *report, double *u)
{
    for (int i = 0; i < count; i++) {
        ContactRow *c = &s->row[i];
        c->force = s->law[i].multiplier = contact_project(c->force, c->normal, c->friction);
    }
    contact_balance(s, factor, b, count, u);
    contact_residual(s->row, count, s->motion, report);
}

bool contact_convex(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, double tolerance, int budget,
                    ContactReport *report, double *u)
{
    int start = budget;
    double ratio = 0.01, inner = 1e-2;
    hand_out(s, factor, b, count, report, u);
    while (budget > 0 && report->residual > tolerance) {
        for (int i = 0; i < count; i++)
            s->law[i].bound = s->row[i].friction * vec3_dot(s->row[i].force, s->row[i].normal);
        minimise(s, chain, count, ratio, inner, &budget, u);
        hand_out(s, factor, b, count, report, u);
        ratio = fmin(ratio * 10, 1e4);
        inner = fmax(inner * 0.1, 0.1 * tolerance);
    }
    report->iterations += start - budget;
    return report->residual <= tolerance;
}

// One minimum for the present bounds; true where nothing overlaps afterwards.
static bool settle(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, double tolerance, int *budget,
                   ContactReport *report, double *u)
{
    double ratio = 0.01, inner = 1e-2;
    for (int round = 0; round < 12 && *budget > 0; round++) {
        minimise(s, chain, count, ratio, inner, budget, u);
        double top = 1e-3, cut = 0;
        for (int i = 0; i < count; i++) {
            ContactRow *c = &s->row[i];
            Vec3 f = contact_project(c->force, c->normal, c->friction);
            cut = fmax(cut, vec3_distance(f, c->force));
            top = fmax(top, vec3_norm(f));
        }
        hand_out(s, factor, b, count, report, u);
        if (contact_normal_residual(s->row, count, s->motion) <= tolerance)
            return true;
        if (round > 2 && cut > tolerance * top)
            return false; // friction forces that their normal forces do not bear: lower the bounds
        ratio = fmin(ratio * 10, 1e4);
        inner = fmax(inner * 0.1, 0.1 * tolerance);
    }
    return false;
}

void contact_feasible(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, double tolerance, int budget,
                      ContactReport *report, double *u)
{
    int start = budget;
    for (int i = 0; i < count; i++) {
        ContactRow *c = &s->row[i];
        s->law[i].bound = 0;
        c->force = s->law[i].multiplier = vec3_scale(c->normal, fmax(0, vec3_dot(c->force, c->normal)));
    }
    contact_balance(s, factor, b, count, u);
    settle(s, chain, factor, b, count, tolerance, &budget, report, u);
    for (int i = 0; i < count; i++) {
        s->best[i] = s->row[i].force;
        s->law[i].bound = s->row[i].friction * vec3_dot(s->row[i].force, s->row[i].normal);
    }
    bool done = false;
    for (int round = 0; round < 6 && budget > 0 && !done; round++) {
        done = settle(s, chain, factor, b, count, tolerance, &budget, report, u);
        for (int i = 0; i < count && !done; i++)
            s->law[i].bound = fmin(s->law[i].bound, s->row[i].friction * vec3_dot(s->row[i].force, s->row[i].normal));
    }
    if (!done) {
        for (int i = 0; i < count; i++)
            s->row[i].force = s->best[i];
        hand_out(s, factor, b, count, report, u);
    }
    report->iterations += start - budget;
}
