// The block form: one semismooth Newton method for the normal and the friction field together.
//
// With f = sum over contacts of J^T f_k balanced by u at every iterate (A u = b + J^T f), an iteration gives each contact a law that is linear
// in its further motion delta, f = g - C delta, and solves (A + J^T C J) du = J^T (g - f): a contact adds a 3x3 to its node's block, so that an
// iteration is one factorisation of the chain. n normal, v = gap + d_n, d_t the sliding, k the node's own stiffness (contact_rows.h).
//   open   g = 0, C = 0
//   stick  g = f - P v n - P_t d_t, C = P n n^T + P_t (I - n n^T): v and d_t become 0 up to 1/P, and the next iteration removes that rest
//   slip   g_n = f_n - P v, g_t = mu g_n p - q (d_t across p), C = P n n^T + mu P p n^T + q (I - n n^T - p p^T)
// p is the direction of f_t - r d_t (Alart and Curnier 1991), q = mu f_n r / (|f_t - r d_t| - mu f_n) -> mu f_n / |d_t| the resistance against
// turning. mu P p n^T makes the matrix unsymmetric: friction follows the normal force within the iteration. Without it (Tresca's friction
// with the bound frozen, a fixed point over the bound) every outer round costs several factorisations and a wire in a spiral needs 5 to 20
// rounds, as friction builds up along it like a power series of exp(mu theta). With it: 3 to 5 iterations a step, quadratic at the end.
//
// What makes it robust is how states change. A stiff wire that overlaps the wall over a stretch does so nearly everywhere at once; taking in
// every overlapping contact brings large tensile forces and cycles. So of each run of neighbouring overlapping contacts only the deepest is
// taken in at a time: active sets are a few isolated points, found in 3 to 7 iterations. A sliding contact that moves against its own sense
// sticks first. If states still cycle, they change one at a time from the tip (Murty's rule, which ends for the frictionless problem).
// Where that finds no end, contact_convex.c takes over; where friction has no solution that it can find (jammed, mu near 1), it gives up friction
// until nothing overlaps and no force leaves its cone, and `converged` says false.
#include "solver/contact_forms.h"

#include <float.h>
#include <string.h>

enum { OPEN, STICK, SLIP };

// Penalty P over k: the rest after an iteration is about 1/P; rounding of the matrix grows with it.
static const double penalty = 1e4;
// r over k: only the branch that is taken depends on it, not the solution.
static const double slope = 0.01;
enum { PARALLEL_ITERATIONS = 14, SINGLE_ITERATIONS = 16, CONVEX_ITERATIONS = 40, FEASIBLE_ITERATIONS = 200 };

static double normal_violation(const ContactRow *c, Vec3 motion) { return c->gap + vec3_dot(motion, c->normal); }

static Vec3 slide_direction(const ContactRow *c, Vec3 motion, double *size)
{
    Vec3 p = vec3_add_scaled(contact_tangential(c->force, c->normal), -slope * c->stiffness_t, contact_tangential(motion, c->normal));
    *size = vec3_norm(p);
    return *size > 0 ? vec3_scale(p, 1 / *size) : (Vec3){0, 0, 0};
}

// mu f_n; of a contact that is just taken in, from its overlap
static double friction_bound(const ContactRow *c, Vec3 motion)
{
    double fn = vec3_dot(c->force, c->normal);
    return c->friction * (fn > 0 ? fn : fmax(0, -0.01 * c->stiffness_n * normal_violation(c, motion)));
}

// Which contacts shall be active: those that press, and the deepest of each run of neighbours that overlap (`all`: every one).
static void choose_active(const ContactSolver *s, int count, bool all, bool *active)
{
    int i = 0;
    while (i < count) {
        const ContactRow *c = &s->row[i];
        double v = normal_violation(c, s->motion[i]);
        if (s->law[i].state != OPEN || !(v < 0)) {
            active[i] = s->law[i].state != OPEN && vec3_dot(c->force, c->normal) > 0;
            i++;
            continue;
        }
        int deepest = i, j = i;
        for (; j < count && s->law[j].state == OPEN && (j == i || s->row[j].node <= s->row[j - 1].node + 1); j++) {
            double vj = normal_violation(&s->row[j], s->motion[j]);
            if (!(vj < 0))
                break;
            active[j] = all;
            if (vj < v) {
                v = vj;
                deepest = j;
            }
        }
        active[deepest] = true;
        i = j;
    }
}

// States for the next iteration; returns how many changed. `one`: only the change nearest to the tip.
static int choose_states(ContactSolver *s, int count, bool one, bool first)
{
    int changes = 0;
    choose_active(s, count, one, s->flag);
    for (int i = count; i-- > 0;) {
        const ContactRow *c = &s->row[i];
        int was = s->law[i].state, state = OPEN;
        if (s->flag[i]) {
            state = SLIP;
            if (c->friction > 0) {
                double size;
                slide_direction(c, s->motion[i], &size);
                Vec3 slide = contact_tangential(s->motion[i], c->normal);
                bool reversed = was == SLIP && !first && vec3_dot(slide, c->force) > 0;
                state = reversed || size <= friction_bound(c, s->motion[i]) ? STICK : SLIP;
            }
        }
        if (state != was && !(one && changes)) {
            s->law[i].state = state;
            changes++;
        }
    }
    return changes;
}

// C = kn n n^T + oblique n^T + across (I - n n^T - p p^T)
static Mat3 law_matrix(Vec3 n, double kn, Vec3 oblique, double across, Vec3 p)
{
    const double a[3] = {n.x, n.y, n.z}, o[3] = {oblique.x, oblique.y, oblique.z}, b[3] = {p.x, p.y, p.z};
    Mat3 c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c.m[i][j] = kn * a[i] * a[j] + o[i] * a[j] + across * ((i == j) - a[i] * a[j] - b[i] * b[j]);
    return c;
}

// Fills law->force (g) and, unless the old factor is used again, law->c.
static void write_law(const ContactRow *c, Vec3 motion, bool keep_matrix, ContactLaw *law)
{
    Vec3 n = c->normal, none = {0, 0, 0}, slide = contact_tangential(motion, n), ft = contact_tangential(c->force, n);
    double kn = penalty * c->stiffness_n, kt = penalty * c->stiffness_t;
    double fn = vec3_dot(c->force, n), gn = fn - kn * normal_violation(c, motion);
    Vec3 force = none, oblique = none, p = none;
    double across = 0;
    if (law->state == STICK) {
        force = vec3_add_scaled(vec3_add_scaled(ft, -kt, slide), gn, n);
        across = kt;
    } else if (law->state == SLIP) {
        force = vec3_scale(n, gn);
        if (c->friction > 0) {
            double size, bound = friction_bound(c, motion);
            p = slide_direction(c, motion, &size);
            across = size > bound ? fmin(kt, bound * slope * c->stiffness_t / (size - bound)) : size > 0 ? kt : 0;
            oblique = vec3_scale(p, c->friction * kn);
            force = vec3_add_scaled(force, c->friction * gn, p);
            force = vec3_add_scaled(force, -across, vec3_add_scaled(slide, -vec3_dot(slide, p), p));
        }
    }
    law->force = force;
    if (!keep_matrix && law->state != OPEN)
        law->c = law_matrix(n, kn, oblique, across, p);
}

// block += (w I, R)^T K (v I, Q), by columns, where rows and columns are free.
static void add_coupling(const Mat3 *k, double w, const Mat3 *r, unsigned rows, double v, const Mat3 *q, unsigned columns, double *block)
{
    Mat3 rt = mat3_transpose(r), kq = mat3_mul(k, q), rk = mat3_mul(&rt, k), rkq = mat3_mul(&rt, &kq);
    double j[6][6]; // [column][row]
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            j[b][a] = w * v * k->m[a][b];
            j[b + 3][a] = w * kq.m[a][b];
            j[b][a + 3] = v * rk.m[a][b];
            j[b + 3][a + 3] = rkq.m[a][b];
        }
    bool all = (rows & columns) == 63;
    for (int b = 0; b < 6; b++)
        for (int a = 0; a < 6; a++)
            block[6 * b + a] += all || (rows >> a & columns >> b & 1) ? j[b][a] : 0;
}

// The matrix += J^T C J with J = (w I, R) for each node, R = -[arm]x.
static void add_law(const ContactRow *c, const Mat3 *k, ContactSolver *s)
{
    Mat3 r[2];
    for (int e = 0; e < c->nodes; e++) {
        r[e] = mat3_skew(contact_row_negative_arm(c, e));
        add_coupling(k, c->weight[e], &r[e], c->mask[e], c->weight[e], &r[e], c->mask[e], s->matrix.diag + 36 * (size_t)(c->node + e));
    }
    if (c->nodes < 2)
        return;
    add_coupling(k, c->weight[1], &r[1], c->mask[1], c->weight[0], &r[0], c->mask[0], s->turned + 36 * (size_t)c->node);
    add_coupling(k, c->weight[0], &r[0], c->mask[0], c->weight[1], &r[1], c->mask[1], s->matrix.lower + 36 * (size_t)c->node);
}

// The matrix of the present laws: only blocks that held or hold a contact differ from the chain's.
void contact_assemble(ContactSolver *s, const BlockChain *chain, int count)
{
    const size_t block = 36 * sizeof(double);
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &s->row[i];
        for (int e = 0; s->law[i].touched && e < c->nodes; e++)
            memcpy(s->matrix.diag + 36 * (size_t)(c->node + e), chain->diag + 36 * (size_t)(c->node + e), block);
        if (s->law[i].touched && c->nodes == 2) {
            memcpy(s->matrix.lower + 36 * (size_t)c->node, chain->lower + 36 * (size_t)c->node, block);
            block_lu_transpose(1, chain->lower + 36 * (size_t)c->node, s->turned + 36 * (size_t)c->node);
        }
    }
    for (int i = 0; i < count; i++) {
        s->law[i].touched = s->law[i].state != OPEN;
        if (s->law[i].touched)
            add_law(&s->row[i], &s->law[i].c, s);
    }
}

void contact_assemble_reset(ContactSolver *s, const BlockChain *chain, int count)
{
    size_t blocks = (size_t)chain->count * 36 * sizeof(double);
    memcpy(s->matrix.diag, chain->diag, blocks);
    memcpy(s->matrix.lower, chain->lower, blocks);
    block_lu_transpose(chain->count - 1, chain->lower, s->turned);
    for (int i = 0; i < count; i++)
        s->law[i].touched = false;
}

// One Newton iteration in the present states. False where the matrix cannot be factored or the result is not finite.
static bool newton_iteration(ContactSolver *s, const BlockChain *chain, int count, bool reuse, double *u)
{
    bool symmetric = true;
    memset(s->rhs, 0, (size_t)chain->count * 6 * sizeof *s->rhs);
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &s->row[i];
        write_law(c, s->motion[i], reuse, &s->law[i]);
        symmetric &= s->law[i].state != SLIP || c->friction == 0;
        contact_row_push(c, vec3_sub(s->law[i].force, c->force), s->rhs);
    }
    if (reuse) {
        if (s->symmetric)
            block_factor_solve(s->factor, s->rhs, s->delta);
        else
            block_lu_solve(s->lu, s->rhs, s->delta);
    } else {
        contact_assemble(s, chain, count);
        s->symmetric = symmetric;
        if (symmetric ? !block_chain_factor_solve(&s->matrix, s->factor, s->rhs, s->delta)
                      : !block_lu_factor_solve(s->lu, s->matrix.diag, s->turned, s->matrix.lower, s->rhs, s->delta))
            return false;
    }
    double sum = 0;
    for (size_t k = 0; k < (size_t)chain->count * 6; k++) {
        u[k] += s->delta[k];
        sum += fabs(u[k]);
    }
    for (int i = 0; i < count; i++) {
        Vec3 d = contact_row_motion(&s->row[i], s->delta);
        s->motion[i] = vec3_add(s->motion[i], d);
        s->row[i].force = s->law[i].state == OPEN ? (Vec3){0, 0, 0} : vec3_sub(s->law[i].force, mat3_mul_vec(&s->law[i].c, d));
        sum += fabs(s->row[i].force.x) + fabs(s->row[i].force.y) + fabs(s->row[i].force.z);
    }
    return sum <= DBL_MAX;
}

static void keep_forces(ContactSolver *s, int count)
{
    for (int i = 0; i < count; i++)
        s->best[i] = s->row[i].force;
}

// Back to kept forces, with the states that they show.
static void restart(ContactSolver *s, const BlockFactor *factor, const double *b, int count, double *u)
{
    for (int i = 0; i < count; i++) {
        ContactRow *c = &s->row[i];
        c->force = contact_project(s->best[i], c->normal, c->friction);
        s->law[i].state = vec3_dot(c->force, c->normal) > 0 ? SLIP : OPEN;
    }
    contact_balance(s, factor, b, count, u);
}

// Newton iterations until the residual of forces cut to their cones is below the tolerance; at most `parallel` + `single`.
static bool iterate(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, int parallel, int single,
                    double tolerance, ContactReport *report, double *u)
{
    double best = DBL_MAX;
    bool fresh = true; // no factor yet
    for (int it = 0; it < parallel + single; it++) {
        int changes = choose_states(s, count, it >= parallel, it == 0);
        bool reuse = !fresh && !changes && report->residual < 1e-3 && s->symmetric;
        double before = report->residual;
        report->iterations++;
        if (!newton_iteration(s, chain, count, reuse, u))
            return false;
        double residual = contact_residual(s->row, count, s->motion, report);
        fresh = reuse && residual > 0.05 * before; // the old factor does not serve any more
        if (residual < best) {
            best = residual;
            keep_forces(s, count);
        }
        if (residual > tolerance)
            continue;
        for (int i = 0; i < count; i++)
            s->row[i].force = contact_project(s->row[i].force, s->row[i].normal, s->row[i].friction);
        contact_balance(s, factor, b, count, u);
        if (contact_residual(s->row, count, s->motion, report) <= tolerance)
            return true;
    }
    return false;
}

ContactReport contact_newton(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count,
                             const ContactOptions *options, double *u)
{
    ContactReport report = {0};
    keep_forces(s, count);
    restart(s, factor, b, count, u);
    contact_residual(s->row, count, s->motion, &report);
    report.converged = report.residual <= options->tolerance;
    if (report.converged)
        return report;
    contact_assemble_reset(s, chain, count);
    while (report.iterations < options->max_iterations) {
        int left = options->max_iterations - report.iterations, parallel = left < PARALLEL_ITERATIONS ? left : PARALLEL_ITERATIONS;
        int single = left - parallel < SINGLE_ITERATIONS ? left - parallel : SINGLE_ITERATIONS;
        report.converged = iterate(s, chain, factor, b, count, parallel, single, options->tolerance, &report, u);
        if (report.converged)
            return report;
        restart(s, factor, b, count, u);
        left = options->max_iterations - report.iterations;
        report.converged = contact_convex(s, chain, factor, b, count, options->tolerance, left < CONVEX_ITERATIONS ? left : CONVEX_ITERATIONS,
                                          &report, u);
        if (report.converged)
            return report;
        keep_forces(s, count);
        restart(s, factor, b, count, u);
    }
    contact_feasible(s, chain, factor, b, count, options->tolerance, FEASIBLE_ITERATIONS, &report, u);
    report.converged = report.residual <= options->tolerance;
    return report;
}
