// The block form: one semismooth Newton method for normal and friction forces together.
//
// At every iterate u balances f = sum over contacts of J^T f_k (A u = b + J^T f). An iteration gives each contact a law that is linear in its further
// motion delta, f = g - C delta, and solves (A + J^T C J) du = J^T (g - f). A contact adds a 3x3 matrix to its node's block, so that an iteration is one
// factorisation of the chain. n is the normal, v = gap + d_n, d_t the sliding motion, k the stiffness of the node alone (contact_rows.h).
//   open   g = 0, C = 0
//   stick  g = f - P v n - P_t d_t, C = P n n^T + P_t (I - n n^T): v and d_t become 0 up to 1/P; the next iteration removes this remainder
//   slip   g_n = f_n - P v, g_t = mu g_n p - q (d_t across p), C = P n n^T + mu P p n^T + q (I - n n^T - p p^T)
// p is the direction of f_t - r d_t (Alart and Curnier 1991); q = mu f_n r / (|f_t - r d_t| - mu f_n) -> mu f_n / |d_t| is the resistance against a change of
// the sliding direction. mu P p n^T makes the matrix unsymmetric: friction follows the normal force within the iteration. Without it (Tresca friction
// with a fixed bound and a fixed-point iteration over the bound) every outer iteration costs several factorisations, and a wire in a spiral needs 5 to 20
// of them, because friction builds up along it like a power series of exp(mu theta). With it, a step takes 3 to 5 iterations, with quadratic convergence.
//
// Pairs, which join two places of the chain, have the same laws, but their C is not in the matrix (contact_pairs.c).
//
// Robustness depends on the rules for state changes and on a line search.
// - A stiff wire that overlaps the wall over a stretch does so nearly everywhere at once; activating every overlapping contact produces large
//   tensile forces and cycling. Therefore only the deepest contact of each run of neighbouring overlapping contacts is activated at a time: the active
//   set is a few isolated points, found in 3 to 7 iterations. The first iteration activates none if some are loaded already: the old forces do not
//   balance the new loads, and soft bending modes turn the difference into an overlap of millimetres elsewhere.
// - A slipping contact whose motion has the direction of its friction force is first set to stick.
// - The linearised equations of Alart and Curnier overestimate the step at a contact that hardly slides, which then alternates between stick and slip
//   indefinitely. Forces and motion are linear along a step, so that the equations can be evaluated at any fraction of it without a solve: from the
//   fourth iteration on the step is halved until their error is smaller than before. (Changing states one at a time, and minimising the convex problem
//   of Tresca friction in between, were tried before and cost ten times as much in the cases that need it.)
// - The line search can stall at a kink, where the step computed for the present states leads across the boundary between them. The rule for contacts
//   with reversed motion is then switched off or on again, at every second stall r is changed as well, and after three consecutive stalls the full step
//   is taken (after two, some solves cycle indefinitely).
//
// The final forces are projected onto their cones, which changes them by no more than the residual. The motion is not recomputed with them: bending is so
// soft compared with stretching that a force error of 1e-8 of the largest force moves the wire by as much as a residual of 0.1, so that iterates
// that fulfil all laws would be rejected because of the rounding in the projection. If the iteration limit is reached first, the best iterate is returned in
// the same manner.
#include "solver/contact_forms.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { OPEN, STICK, SLIP };

// Penalty P over k: the remaining violation after an iteration is about 1/P, while rounding errors of the matrix grow with P.
static const double penalty = 1e4;
// r over k in the choice of states (usual, and after stalls) and in the line search; the solution does not depend on them.
static const double usual_slope = 1e-3, other_slope = 1e-2, merit_slope = 1e-2;
enum { FIRST_SEARCH = 3, HALVINGS = 6, STALLS_IN_A_ROW = 3 };
static const double stall = 0.05; // a step shortened to less than this makes no progress

static double normal_violation(const ContactRow *c, Vec3 motion) { return c->gap + vec3_dot(motion, c->normal); }

static Vec3 slide_direction(const ContactRow *c, Vec3 motion, double slope, double *size)
{
    Vec3 p = vec3_add_scaled(contact_tangential(c->force, c->normal), -slope * c->stiffness_t, contact_tangential(motion, c->normal));
    *size = vec3_norm(p);
    return *size > 0 ? vec3_scale(p, 1 / *size) : (Vec3){0, 0, 0};
}

// mu f_n; for a newly activated contact an estimate from its overlap.
static double friction_bound(const ContactRow *c, Vec3 motion)
{
    double fn = vec3_dot(c->force, c->normal);
    return c->friction * (fn > 0 ? fn : fmax(0, -0.01 * c->stiffness_n * normal_violation(c, motion)));
}

// Selects the active wall contacts: those with a compressive force, and the deepest of each run of overlapping neighbours.
static void choose_active(const ContactSolver *s, bool *active)
{
    const int count = s->wall_count, *wall = s->wall;
    int i = 0;
    while (i < count) {
        int at = wall[i];
        SEL_ASSERT(at >= 0 && at < s->banded && !s->row[at].far && !s->row[at].slide, "the list of walls contains no pairs or slides");
        const ContactRow *c = &s->row[at];
        double v = normal_violation(c, s->motion[at]);
        if (s->law[at].state != OPEN || !(v < 0)) {
            active[at] = s->law[at].state != OPEN && vec3_dot(c->force, c->normal) > 0;
            i++;
            continue;
        }
        int deepest = at, j = i;
        for (; j < count && s->law[wall[j]].state == OPEN && (j == i || s->row[wall[j]].chain_node <= s->row[wall[j - 1]].chain_node + 1); j++) {
            double vj = normal_violation(&s->row[wall[j]], s->motion[wall[j]]);
            if (!(vj < 0))
                break;
            active[wall[j]] = false;
            if (vj < v) {
                v = vj;
                deepest = wall[j];
            }
        }
        active[deepest] = true;
        i = j;
    }
}

static bool are_neighbours(const ContactRow *a, const ContactRow *b)
{
    return abs(a->chain_node - b->chain_node) <= 1 && abs(a->far->chain_node - b->far->chain_node) <= 1;
}

// The same for pairs, which have neighbours on both strands.
static void choose_active_pairs(const ContactSolver *s, int count, bool *active)
{
    for (int i = s->banded; i < count; i++) {
        const ContactRow *c = &s->row[i];
        double v = normal_violation(c, s->motion[i]);
        active[i] = s->law[i].state != OPEN ? vec3_dot(c->force, c->normal) > 0 : v < 0;
        for (int j = s->banded; j < count && active[i] && s->law[i].state == OPEN; j++) {
            double other = normal_violation(&s->row[j], s->motion[j]);
            active[i] = j == i || s->law[j].state != OPEN || !are_neighbours(c, &s->row[j]) || v < other || (v == other && i < j);
        }
    }
}

// Chooses the states of the next iteration and returns the number of changes.
static int choose_states(ContactSolver *s, int count, bool first)
{
    int changes = 0, pressing = 0;
    s->slope = s->stalls / 2 % 2 ? other_slope : usual_slope;
    for (int i = 0; i < s->wall_count; i++)
        pressing += s->law[s->wall[i]].state != OPEN;
    for (int i = s->banded; i < count; i++)
        pressing += s->law[i].state != OPEN;
    for (int i = 0; i < count; i++)
        s->flag[i] = s->law[i].state != OPEN;
    if (!first || pressing == 0 || s->knows_motion) {
        choose_active(s, s->flag);
        choose_active_pairs(s, count, s->flag);
    }
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &s->row[i];
        int was = s->law[i].state, state = OPEN;
        if (s->flag[i]) {
            state = SLIP;
            if (c->friction > 0) {
                double size;
                slide_direction(c, s->motion[i], s->slope, &size);
                Vec3 slide = contact_tangential(s->motion[i], c->normal);
                bool reversed = s->stalls % 2 == 0 && was == SLIP && !first && vec3_dot(slide, c->force) > 0;
                state = reversed || size <= friction_bound(c, s->motion[i]) ? STICK : SLIP;
            }
        }
        s->law[i].state = state;
        changes += state != was;
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

// Sets law->force (g, the force after a motion of `from`) and, unless the factor is reused, law->c.
static void write_law(const ContactRow *c, Vec3 motion, Vec3 from, double slope, bool keep_matrix, ContactLaw *law)
{
    Vec3 n = c->normal, none = {0, 0, 0}, slide = contact_tangential(from, n), ft = contact_tangential(c->force, n);
    double kn = penalty * c->stiffness_n, kt = penalty * c->stiffness_t;
    double fn = vec3_dot(c->force, n), gn = fn - kn * normal_violation(c, from);
    Vec3 force = none, oblique = none, p = none;
    double across = 0;
    if (law->state == STICK) {
        force = vec3_add_scaled(vec3_add_scaled(ft, -kt, slide), gn, n);
        across = kt;
    } else if (law->state == SLIP) {
        force = vec3_scale(n, gn);
        if (c->friction > 0) {
            double size, bound = friction_bound(c, motion);
            p = slide_direction(c, motion, slope, &size);
            across = size > bound ? fmin(kt, bound * slope * c->stiffness_t / (size - bound)) : size > 0 ? kt : 0;
            law->along = vec3_scale(p, c->friction);
            oblique = vec3_scale(law->along, kn);
            force = vec3_add_scaled(force, c->friction * gn, p);
            force = vec3_add_scaled(force, -across, vec3_add_scaled(slide, -vec3_dot(slide, p), p));
        }
    }
    law->force = force;
    if (!keep_matrix && law->state != OPEN)
        law->c = law_matrix(n, kn, oblique, across, p);
}

static void cross_into(double x, double y, double z, Vec3 b, double out[3])
{
    out[0] = y * b.z - z * b.y;
    out[1] = z * b.x - x * b.z;
    out[2] = x * b.y - y * b.x;
}

// block += (w I, [r]x)^T K (v I, [q]x), column-major, in free rows and columns. Rows of K [q]x are the rows of K times q; columns of [r]x^T K are the
// columns of K times r.
static void add_coupling(const Mat3 *k, double w, Vec3 r, unsigned rows, double v, Vec3 q, unsigned columns, double *block, int stride)
{
    double j[6][6], kq[3][3]; // j: [column][row]
    for (int a = 0; a < 3; a++)
        cross_into(k->m[a][0], k->m[a][1], k->m[a][2], q, kq[a]);
    for (int b = 0; b < 3; b++) {
        cross_into(v * k->m[0][b], v * k->m[1][b], v * k->m[2][b], r, j[b] + 3);
        cross_into(kq[0][b], kq[1][b], kq[2][b], r, j[b + 3] + 3);
        for (int a = 0; a < 3; a++) {
            j[b][a] = w * v * k->m[a][b];
            j[b + 3][a] = w * kq[a][b];
        }
    }
    if ((rows & columns) != 63)
        for (int b = 0; b < 6; b++)
            for (int a = 0; a < 6; a++)
                j[b][a] = rows >> a & columns >> b & 1 ? j[b][a] : 0;
    for (int b = 0; b < 6; b++)
        for (int a = 0; a < 6; a++)
            block[stride * b + a] += j[b][a];
}

// Adds J^T C J to the matrix, with J = (w I, R) for each node, R = -[arm]x.
static void add_law(const ContactRow *c, const Mat3 *k, ContactSolver *s)
{
    SEL_ASSERT(c->node >= 0 && c->node + c->nodes <= s->matrix.count, "a contact is at nodes of the matrix");
    Vec3 r[2];
    const double *w = c->weight;
    const int n = c->stride;
    const size_t block = (size_t)(n * n), at = (size_t)c->node;
    for (int e = 0; e < c->nodes; e++) {
        r[e] = contact_row_negative_arm(c, e);
        add_coupling(k, w[e], r[e], c->mask[e], w[e], r[e], c->mask[e], s->matrix.diag + block * (at + (size_t)e), n);
    }
    if (c->nodes < 2)
        return;
    add_coupling(k, w[1], r[1], c->mask[1], w[0], r[0], c->mask[0], s->turned + block * at, n);
    add_coupling(k, w[0], r[0], c->mask[0], w[1], r[1], c->mask[1], s->matrix.lower + block * at, n);
}

// Subtracts from row e of a slipping contact, [A(i, i-1) A(i, i) A(i, i+1) | rhs], J^T mu p / w times its component along n. The law's P (n + mu p) n^T
// is thereby reduced to P n n^T, and the elimination, which has no pivoting, finds large positive pivots.
static void straighten(const ContactRow *c, ContactLaw *law, int e, ContactSolver *s)
{
    SEL_ASSERT(!c->far && !c->slide && e < c->nodes, "rows of contacts with the wall are straightened, not those of pairs or slides");
    const int n = c->stride;
    double *v = law->lean[e], w = c->weight[e];
    law->leans[e] = c->mask[e] == 63 && !(w < 0.05);
    if (!law->leans[e])
        return;
    ContactRow here = *c;
    double push[2 * BLOCK_LARGEST] = {0};
    here.node = 0;
    contact_row_push(&here, vec3_scale(law->along, 1 / w), push);
    for (int k = 0; k < 6; k++)
        v[k] = push[n * e + k];
    size_t i = (size_t)(c->node + e), block = (size_t)(n * n);
    double *columns[4] = {i > 0 ? s->turned + block * (i - 1) : NULL, s->matrix.diag + block * i,
                          (int)i + 1 < s->matrix.count ? s->matrix.lower + block * i : NULL, s->rhs + (size_t)n * i};
    for (int k = 0; k < 4; k++)
        for (double *x = columns[k]; x && x < columns[k] + (k < 3 ? n * n : n); x += n) {
            double t = c->normal.x * x[0] + c->normal.y * x[1] + c->normal.z * x[2];
            for (int r = 0; r < 6; r++)
                x[r] -= v[r] * t;
        }
}

// Solves for another right-hand side with the same matrix, after applying the row operations of straighten() to it.
static void solve_straightened(const ContactSolver *s, const BlockFactor *factor, double *b, double *x)
{
    if (s->symmetric) {
        block_factor_solve(factor, b, x);
        return;
    }
    for (int i = 0; i < s->banded; i++)
        for (int e = 0; s->law[i].state == SLIP && s->row[i].friction > 0 && e < s->row[i].nodes; e++) {
            const ContactRow *c = &s->row[i];
            double *y = b + (size_t)c->stride * (size_t)(c->node + e);
            double t = c->normal.x * y[0] + c->normal.y * y[1] + c->normal.z * y[2];
            for (int r = 0; s->law[i].leans[e] && r < 6; r++)
                y[r] -= s->law[i].lean[e][r] * t;
        }
    block_lu_solve(s->lu, b, x);
}

// Restores the chain's blocks in the rows of a contact.
static void restore(ContactSolver *s, const BlockChain *chain, const ContactRow *c)
{
    SEL_ASSERT(c->node >= 0 && c->node + c->nodes <= chain->count, "a contact is at nodes of the chain");
    const size_t block = (size_t)(c->stride * c->stride), bytes = block * sizeof(double), last = (size_t)(c->node + c->nodes - 1);
    for (size_t i = (size_t)c->node; i <= last; i++)
        memcpy(s->matrix.diag + block * i, chain->diag + block * i, bytes);
    for (size_t i = (size_t)(c->node > 0 ? c->node - 1 : 0); i <= last && (int)i + 1 < chain->count; i++) {
        memcpy(s->matrix.lower + block * i, chain->lower + block * i, bytes);
        memcpy(s->turned + block * i, s->turned_chain + block * i, bytes);
    }
}

// Assembles the matrix of the present laws and its right-hand side; only blocks that held or hold a contact differ from the chain's.
static void assemble(ContactSolver *s, const BlockChain *chain, int count)
{
    for (int i = 0; i < count; i++)
        if (s->law[i].touched)
            restore(s, chain, &s->row[i]);
    for (int i = 0; i < count; i++) {
        s->law[i].touched = s->law[i].state != OPEN;
        if (s->law[i].touched)
            add_law(&s->row[i], &s->law[i].c, s);
    }
    for (int i = 0; i < count; i++)
        for (int e = 0; s->law[i].state == SLIP && s->row[i].friction > 0 && e < s->row[i].nodes; e++)
            straighten(&s->row[i], &s->law[i], e, s);
}

static void assemble_reset(ContactSolver *s, const BlockChain *chain, int count)
{
    size_t blocks = (size_t)chain->count * (size_t)(chain->size * chain->size) * sizeof(double);
    memcpy(s->matrix.diag, chain->diag, blocks);
    memcpy(s->matrix.lower, chain->lower, blocks);
    block_lu_transpose(chain->count - 1, chain->size, chain->lower, s->turned_chain);
    memcpy(s->turned, s->turned_chain, blocks);
    for (int i = 0; i < count; i++)
        s->law[i].touched = false;
}

// Sum of the squared errors of the laws after the fraction t of the step.
static double merit(const ContactSolver *s, int count, double t)
{
    double sum = 0;
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &s->row[i];
        Vec3 d = vec3_add_scaled(s->motion[i], t, s->law[i].step);
        if (c->inert || (contact_row_is_idle(c, d) && s->law[i].state == OPEN))
            continue;
        Vec3 force = vec3_mix(c->force, s->law[i].force, t);
        sum += vec3_norm2(contact_error(c, force, d, merit_slope));
    }
    return sum;
}

static double step_length(const ContactSolver *s, int count)
{
    double start = merit(s, count, 0), least = HUGE_VAL, best = 1, t = 1;
    for (int k = 0; k < HALVINGS && least > start; k++, t /= 2) {
        double m = merit(s, count, t);
        if (m < least) {
            least = m;
            best = t;
        }
    }
    return best;
}

// Step for the present states: s->delta, and each contact's motion and final force. s->rhs contains the other terms of the right-hand side. If `whole`, in the
// first iterations, the step is the whole motion rather than an increment: poor initial forces may have moved the wire far, and their rounding errors must not
// remain. Returns false if the matrix cannot be factored.
static bool newton_step(ContactSolver *s, const BlockChain *chain, int count, bool reuse, bool whole)
{
    bool symmetric = true;
    const Vec3 none = {0, 0, 0};
    for (int i = 0; i < count; i++) {
        const ContactRow *c = &s->row[i];
        if (s->law[i].state == OPEN && contact_row_is_idle(c, s->motion[i])) {
            s->law[i].force = none;
            continue;
        }
        write_law(c, s->motion[i], whole ? none : s->motion[i], s->slope, reuse, &s->law[i]);
        if (c->far && s->law[i].state != OPEN)
            continue;
        symmetric &= s->law[i].state != SLIP || c->friction == 0;
        contact_row_push(c, whole ? s->law[i].force : vec3_sub(s->law[i].force, c->force), s->rhs);
    }
    bool exact = true;
    if (reuse) {
        solve_straightened(s, s->factor, s->rhs, s->delta);
    } else {
        assemble(s, chain, s->banded);
        s->symmetric = symmetric;
        if (symmetric ? !block_chain_factor_solve(&s->matrix, s->factor, s->rhs, s->delta)
                      : !block_lu_factor_solve(s->lu, chain->count, s->matrix.diag, s->turned, s->matrix.lower, s->rhs, s->delta,
                                               chain == s->small ? block_condenser_live(s->condenser) : NULL, &exact))
            return false;
    }
    s->inexact |= !exact;
    if (s->banded < count && !contact_pairs_step(s, count, reuse, whole, solve_straightened))
        return false;
    for (int i = 0; i < count; i++) {
        ContactLaw *law = &s->law[i];
        law->step = contact_row_motion(&s->row[i], s->delta);
        law->force = law->state == OPEN ? (Vec3){0, 0, 0} : vec3_sub(law->force, mat3_mul_vec(&law->c, law->step));
    }
    return true;
}

// Takes the fraction t of the step. Returns false if the result is not finite.
static bool take_step(ContactSolver *s, int unknowns, int count, double t, double *u)
{
    SEL_ASSERT(t > 0 && t <= 1, "the fraction of the step is in (0, 1]");
    double sum = 0;
    for (int k = 0; k < unknowns; k++) {
        u[k] += t * s->delta[k];
        sum += fabs(u[k]);
    }
    for (int i = 0; i < count; i++) {
        Vec3 *f = &s->row[i].force;
        s->motion[i] = vec3_add_scaled(s->motion[i], t, s->law[i].step);
        *f = t == 1 ? s->law[i].force : vec3_mix(*f, s->law[i].force, t);
        sum += fabs(f->x) + fabs(f->y) + fabs(f->z);
    }
    return sum <= DBL_MAX;
}

// Largest imbalance between u and the forces [N, N mm].
static double imbalance(ContactSolver *s, const BlockChain *chain, const double *b, int count, const double *u)
{
    double worst = 0;
    memcpy(s->rhs, b, (size_t)(chain->count * chain->size) * sizeof *b);
    for (int i = 0; i < count; i++)
        contact_row_push(&s->row[i], s->row[i].force, s->rhs);
    block_chain_multiply(chain, u, s->delta);
    for (int k = 0; k < chain->size * chain->count; k++)
        worst = fmax(worst, fabs(s->delta[k] - s->rhs[k]));
    return worst;
}

// Saves the iterate, or restores the saved one.
static void copy_iterate(ContactSolver *s, int unknowns, int count, bool keep, double *u)
{
    memcpy(keep ? s->best_u : u, keep ? u : s->best_u, (size_t)unknowns * sizeof *u);
    for (int i = 0; i < count; i++)
        *(keep ? &s->best[i] : &s->row[i].force) = keep ? s->row[i].force : s->best[i];
}

void contact_cut(ContactSolver *s, int count, ContactReport *report)
{
    report->active = report->pairs = 0;
    report->cone_violation = 0;
    for (int i = 0; i < count; i++) {
        ContactRow *c = &s->row[i];
        if (c->inert)
            continue;
        c->force = contact_project(c, c->force);
        bool presses = vec3_dot(c->force, c->normal) > 0;
        *(c->far ? &report->pairs : &report->active) += presses;
        if (presses)
            report->cone_violation = fmax(report->cone_violation, contact_row_excess(c));
    }
}

bool contact_newton_again(ContactSolver *s, const BlockChain *chain, const double *change, int count, double *u, ContactReport *report)
{
    SEL_ASSERT(change != s->rhs && u != s->delta, "the arguments are not the solver's work space");
    int unknowns = chain->size * chain->count;
    memcpy(s->rhs, change, (size_t)unknowns * sizeof *s->rhs);
    bool finite = newton_step(s, chain, count, true, false) && take_step(s, unknowns, count, 1, u);
    contact_residual(s->row, count, s->motion, report);
    return finite;
}

ContactReport contact_newton(ContactSolver *s, const BlockChain *chain, const BlockFactor *factor, const double *b, int count, const ContactOptions *options,
                             double *u)
{
    SEL_ASSERT(chain->count <= s->node_count && chain->size == s->matrix.size, "the solver was made for such a chain");
    SEL_ASSERT(b != s->rhs && u != s->best_u, "the arguments are not the solver's work space");
    ContactReport report = {0};
    s->matrix.count = chain->count;
    int unknowns = chain->size * chain->count, most = options->max_iterations / CONTACT_SWEEPS_PER_FACTOR;
    for (int i = 0; i < count; i++)
        s->law[i].state = vec3_dot(s->row[i].force, s->row[i].normal) > 0 ? SLIP : OPEN;
    if (!s->knows_motion)    // a given estimate is better than the motion that balances the forces
        contact_balance(s, factor, b, count, u);
    contact_residual(s->row, count, s->motion, &report);
    double least = HUGE_VAL, residual = report.residual; // of the best iterate: its error in N and its residual
    bool fresh = true, finite = true, unbalanced = false; // fresh: no factor to reuse yet
    int in_a_row = 0;
    s->stalls = 0;
    s->inexact = false;
    while ((report.residual > options->tolerance || s->knows_motion) && report.iterations < most) {
        if (report.residual * report.largest < least && !s->knows_motion) {
            least = report.residual * report.largest;
            residual = report.residual;
            copy_iterate(s, unknowns, count, true, u);
        }
        bool first = report.iterations == 0, search = report.iterations >= FIRST_SEARCH && !unbalanced;
        if (first)
            assemble_reset(s, chain, count);
        bool reuse = choose_states(s, count, first) == 0 && !fresh && report.residual < 1e-3 && s->symmetric;
        if (search)
            memset(s->rhs, 0, (size_t)unknowns * sizeof *s->rhs);
        else
            memcpy(s->rhs, b, (size_t)unknowns * sizeof *s->rhs);
        if (!newton_step(s, chain, count, reuse, !search)) {
            if (s->knows_motion && block_chain_factor(chain, s->factor))       // u is not set yet
                contact_balance(s, s->factor, b, count, u);
            break;
        }
        if (!search) {
            memset(u, 0, (size_t)unknowns * sizeof *u);
            memset(s->motion, 0, (size_t)count * sizeof *s->motion);
        }
        double t = search ? step_length(s, count) : 1, before = report.residual;
        in_a_row = t < stall ? in_a_row + 1 : 0;
        s->stalls += t < stall;
        if (in_a_row == STALLS_IN_A_ROW) {
            t = 1;
            in_a_row = 0;
        }
        report.iterations++;
        s->knows_motion = false;         // from now on `motion` belongs to the iterate
        finite = take_step(s, unknowns, count, t, u);
        if (!finite)
            break;
        contact_residual(s->row, count, s->motion, &report);
        fresh = reuse && report.residual > 0.05 * before; // the old factor no longer reduces the residual
        unbalanced = false;
        if (s->inexact && report.residual <= options->tolerance) { // digits were lost: solve once more for the whole motion
            report.residual = fmax(report.residual, imbalance(s, chain, b, count, u) / report.largest);
            unbalanced = report.residual > options->tolerance;
            s->inexact = false;
        }
    }
    s->knows_motion = false;
    report.converged = finite && report.residual <= options->tolerance;
    if (!report.converged && report.iterations > 0 && !(finite && report.residual * report.largest < least)) {
        copy_iterate(s, unknowns, count, false, u);
        report.residual = residual;
    }
    return report;
}
