// The contact solve: both forms against each other, against enumeration of active sets on dense matrices, and against the laws themselves
// (momentum, Signorini, Coulomb), on a wire pushed through tubes and on random problems. Prints iterations, residuals and times.
#include "chain_scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static uint64_t seed_state = 1;
static double uniform(void) // [-1, 1)
{
    seed_state ^= seed_state << 13;
    seed_state ^= seed_state >> 7;
    seed_state ^= seed_state << 17;
    return (double)(seed_state >> 11) * 0x1p-52 - 1;
}

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// --- The laws, written from contact.h alone ---

static Vec3 displacement(const ContactPoint *p, const double *u)
{
    Vec3 a = vec3_scale(p->normal, -p->tool_radius), d = {0, 0, 0};
    for (int e = 0; e < (p->xi > 0 ? 2 : 1); e++) {
        const double *v = u + 6 * (p->node + e);
        d = vec3_add_scaled(d, e ? p->xi : 1 - p->xi, vec3_add(vec3(v[0], v[1], v[2]), vec3_cross(vec3(v[3], v[4], v[5]), a)));
    }
    return d;
}

typedef struct Laws {
    double momentum;     // largest |A u - b - J^T f| over constrained rows too, where J^T f does not act
    double penetration;  // largest -(gap + d_n) [mm]
    double pull;         // largest tensile force
    double complement;   // largest |f_n (gap + d_n)|
    double cone;         // largest (|f_t| - mu f_n)+ / f_n
    double direction;    // [N] largest over contacts of the lesser of |f_t + mu f_n d_t/|d_t|| (slides) and stiffness |d_t| (sticks)
    double top;          // largest force
} Laws;

static Laws check_laws(const BlockChain *a, const double *b, const ContactSet *set, const double *u)
{
    Laws laws = {0};
    double stiffness = 0;
    for (int i = 0; i < 36 * a->count; i++)
        stiffness = fmax(stiffness, fabs(a->diag[i]));
    size_t n = (size_t)a->count * 6;
    double *r = malloc(n * sizeof *r);
    block_chain_multiply(a, u, r);
    for (size_t i = 0; i < n; i++)
        r[i] -= b[i];
    for (int k = 0; k < set->count; k++) {
        const ContactPoint *p = &set->point[k];
        Vec3 f = p->force, m = vec3_cross(vec3_scale(p->normal, -p->tool_radius), f);
        const double g[6] = {f.x, f.y, f.z, m.x, m.y, m.z};
        for (int e = 0; e < (p->xi > 0 ? 2 : 1); e++)
            for (int q = 0; q < 6; q++)
                if (contact_free_dofs(a, p->node + e) >> q & 1)
                    r[6 * (p->node + e) + q] -= (e ? p->xi : 1 - p->xi) * g[q];
        laws.top = fmax(laws.top, vec3_norm(f));
    }
    for (size_t i = 0; i < n; i++)
        laws.momentum = fmax(laws.momentum, fabs(r[i]));
    free(r);
    for (int k = 0; k < set->count; k++) {
        const ContactPoint *p = &set->point[k];
        Vec3 d = displacement(p, u);
        double v = p->gap + vec3_dot(d, p->normal), fn = vec3_dot(p->force, p->normal);
        Vec3 ft = vec3_add_scaled(p->force, -fn, p->normal), dt = vec3_add_scaled(d, -vec3_dot(d, p->normal), p->normal);
        double t = vec3_norm(ft), slide = vec3_norm(dt);
        laws.penetration = fmax(laws.penetration, -v);
        laws.pull = fmax(laws.pull, -fn);
        laws.complement = fmax(laws.complement, fabs(fn * v));
        if (fn > 0)
            laws.cone = fmax(laws.cone, (t - p->friction * fn) / fn);
        else
            laws.cone = fmax(laws.cone, t);
        if (fn <= 0 || p->friction == 0)
            continue;
        // it sticks, or the force is -mu f_n along the sliding: the smaller of both errors, as force
        double slip = slide > 0 ? vec3_norm(vec3_add_scaled(ft, p->friction * fn / slide, dt)) : 0;
        laws.direction = fmax(laws.direction, fmin(slip, stiffness * slide));
    }
    return laws;
}

// --- Problems ---

typedef struct Problem {
    BlockChain chain;
    BlockFactor *factor;
    double *b, *u;
    ContactSet set;
    ContactSolver *solver;
} Problem;

static void problem_create(Problem *p, int nodes, int contacts)
{
    assert_true(block_chain_create(&p->chain, nodes));
    p->factor = block_factor_create(nodes);
    p->b = calloc((size_t)nodes * 6, sizeof *p->b);
    p->u = calloc((size_t)nodes * 6, sizeof *p->u);
    p->set = (ContactSet){.count = contacts, .capacity = contacts, .point = calloc((size_t)contacts + 1, sizeof *p->set.point)};
    p->solver = contact_solver_create(nodes, contacts);
    assert_non_null(p->factor);
    assert_non_null(p->solver);
}

static void problem_destroy(Problem *p)
{
    block_chain_destroy(&p->chain);
    block_factor_destroy(p->factor);
    free(p->b);
    free(p->u);
    free(p->set.point);
    contact_solver_destroy(p->solver);
}

static ContactReport problem_solve(Problem *p, ContactForm form, int iterations, double tolerance)
{
    ContactOptions o = contact_default_options();
    o.form = form;
    o.max_iterations = iterations;
    o.tolerance = tolerance;
    return contact_solve(p->solver, &p->chain, p->factor, p->b, &p->set, &o, p->u);
}

static Vec3 random_unit(void)
{
    for (;;) {
        Vec3 v = {uniform(), uniform(), uniform()};
        double n = vec3_norm(v);
        if (n > 0.1 && n <= 1)
            return vec3_scale(v, 1 / n);
    }
}

// A straight Timoshenko wire along a random direction: mass plus stiffness as in DESIGN section 3, loaded at random, with contacts around it.
static void problem_randomise(Problem *p, double young, double length, double friction, double offset)
{
    int m = p->chain.count;
    double d = 0.36, area = PI * d * d / 4, inertia = area * d * d / 16, shear = young / 2.6, phi = 12 * young * inertia / (0.886 * shear * area * length * length);
    double k = young * inertia / (1 + phi), a = 12 * k / pow(length, 3), b = 6 * k / pow(length, 2), c = (4 + phi) * k / length, dd = (2 - phi) * k / length;
    double ka = young * area / length, g = shear * 2 * inertia / length, mass = 6.45e-3 * area * length;
    Vec3 t = random_unit();
    const double tv[3] = {t.x, t.y, t.z};
    Mat3 cross = mat3_skew(t);
    memset(p->chain.diag, 0, (size_t)m * 36 * sizeof(double));
    memset(p->chain.lower, 0, (size_t)m * 36 * sizeof(double));
    for (int i = 0; i < m; i++)
        for (int q = 0; q < 6; q++)
            p->chain.diag[36 * i + 7 * q] += q < 3 ? mass : mass * length * length / 12;
    for (int i = 0; i + 1 < m; i++)
        for (int r = 0; r < 3; r++)
            for (int q = 0; q < 3; q++) {
                double pq = (r == q) - tv[r] * tv[q], tt = tv[r] * tv[q], x = cross.m[r][q];
                double *d0 = p->chain.diag + 36 * i, *d1 = d0 + 36, *l = p->chain.lower + 36 * i;
                double ktt = a * pq + ka * tt;
                d0[6 * r + q] += ktt, d1[6 * r + q] += ktt, l[6 * r + q] -= ktt;
                d0[6 * r + q + 3] += -b * x, d0[6 * (r + 3) + q] += b * x; // force from rotation: [t]x, and its transpose
                d1[6 * r + q + 3] += b * x, d1[6 * (r + 3) + q] += -b * x;
                l[6 * r + q + 3] += b * x;
                l[6 * (r + 3) + q] += b * x;
                d0[6 * (r + 3) + q + 3] += c * pq + g * tt, d1[6 * (r + 3) + q + 3] += c * pq + g * tt;
                l[6 * (r + 3) + q + 3] += dd * pq - g * tt;
            }
    assert_true(block_chain_factor(&p->chain, p->factor));
    Vec3 side = vec3_normal_to(t), other = vec3_cross(t, side);
    for (int i = 0; i < m; i++) {
        Vec3 v = vec3_scale(random_unit(), 0.02 * uniform());
        v = vec3_add_scaled(v, 0.05, t);
        p->b[6 * i] = mass * v.x, p->b[6 * i + 1] = mass * v.y, p->b[6 * i + 2] = mass * v.z;
    }
    // loads of the size that moves a node by some tenths of a millimetre in the step: stiffness of a bending wave's length
    double wave = pow(k / (mass / length), 0.25), load = 2 * k / pow(wave, 3);
    for (int n = 0; n < 3; n++) {
        int i = (int)(fabs(uniform()) * m);
        Vec3 f = vec3_scale(random_unit(), uniform() * load);
        p->b[6 * i] += f.x, p->b[6 * i + 1] += f.y, p->b[6 * i + 2] += f.z;
    }
    for (int n = 0; n < p->set.count; n++) {
        // a wall on one side, or the problem has no solution where opposite walls overlap at one stiff place
        double angle = uniform(), tilt = 0.1 * uniform();
        int i = p->set.count < m ? (int)((n + 0.5) * m / p->set.count) : (int)(fabs(uniform()) * m);
        Vec3 normal = vec3_unit(vec3_add_scaled(vec3_add_scaled(vec3_scale(side, cos(angle)), sin(angle), other), tilt, t));
        p->set.point[n] = (ContactPoint){.node = i,
                                         .xi = i + 1 < m && uniform() > 0.4 ? fabs(uniform()) : 0,
                                         .normal = normal,
                                         .gap = 0.005 * uniform() + offset,
                                         .friction = friction,
                                         .tool_radius = 0.18};
    }
}

// --- Tests ---

static void assert_laws(const Problem *p, double tolerance, const char *what)
{
    Laws l = check_laws(&p->chain, p->b, &p->set, p->u);
    double top = fmax(l.top, 1e-3), b = 0, a = 0;
    for (int i = 0; i < 6 * p->chain.count; i++)
        b = fmax(b, fabs(p->b[i]));
    for (int i = 0; i < 36 * p->chain.count; i++)
        a = fmax(a, fabs(p->chain.diag[i]));
    double u = 0;
    for (int i = 0; i < 6 * p->chain.count; i++)
        u = fmax(u, fabs(p->u[i]));
    // momentum to the rounding of a solve (some hundred eps); nothing pulls; cone to rounding; violations times the stiffness of a node are small against the forces
    if (!(l.momentum <= 1e-12 * (a * u + b + top) && l.pull == 0 && l.cone <= 1e-9 && l.penetration * a <= 1e3 * tolerance * top + 1e-12 * a &&
          l.complement * a <= 1e3 * tolerance * top * top + 1e-12 * a * top && l.direction <= 1e3 * tolerance * top + 1e-12 * a)) {
        print_message("%s: momentum %.2e pull %.2e cone %.2e penetration %.2e complement %.2e direction %.2e, top %.2e stiffness %.2e\n", what,
                      l.momentum, l.pull, l.cone, l.penetration, l.complement, l.direction, l.top, a);
        fail_msg("laws of contact broken");
    }
}

// Frictionless, few contacts: every active set by dense elimination; the one that is consistent is the solution.
static void agrees_with_enumeration(void **state)
{
    (void)state;
    for (int trial = 0; trial < 60; trial++) {
        enum { K = 7 };
        Problem p;
        int nodes = K + trial % 9;
        problem_create(&p, nodes, K);
        problem_randomise(&p, trial % 2 ? 80000 : 200, 1.5, 0, -0.002);
        for (int i = 0; i < K; i++) // a node each, or W is singular and forces are not unique
            p.set.point[i].xi = 0, p.set.point[i].node = i;
        double w[K][K], q[K], best[K];
        double *v = malloc((size_t)nodes * 6 * sizeof *v);
        block_factor_solve(p.factor, p.b, v);
        for (int i = 0; i < K; i++)
            q[i] = p.set.point[i].gap + vec3_dot(displacement(&p.set.point[i], v), p.set.point[i].normal);
        for (int j = 0; j < K; j++) {
            memset(v, 0, (size_t)nodes * 6 * sizeof *v);
            double *at = v + 6 * p.set.point[j].node;
            at[0] = p.set.point[j].normal.x, at[1] = p.set.point[j].normal.y, at[2] = p.set.point[j].normal.z;
            block_factor_solve(p.factor, v, v);
            for (int i = 0; i < K; i++)
                w[i][j] = vec3_dot(displacement(&p.set.point[i], v), p.set.point[i].normal);
        }
        double best_error = HUGE_VAL;
        for (int set = 0; set < 1 << K; set++) {
            double f[K] = {0}, m[K][K + 1];
            int index[K], n = 0;
            for (int i = 0; i < K; i++)
                if (set >> i & 1)
                    index[n++] = i;
            for (int r = 0; r < n; r++) {
                for (int c = 0; c < n; c++)
                    m[r][c] = w[index[r]][index[c]];
                m[r][n] = -q[index[r]];
            }
            bool singular = false;
            for (int r = 0; r < n && !singular; r++) {
                singular = !(m[r][r] > 1e-9 * w[index[r]][index[r]]);
                for (int s = r + 1; s < n; s++) {
                    double t = m[s][r] / m[r][r];
                    for (int c = r; c <= n; c++)
                        m[s][c] -= t * m[r][c];
                }
            }
            if (singular)
                continue;
            for (int r = n - 1; r >= 0; r--) {
                double sum = m[r][n];
                for (int c = r + 1; c < n; c++)
                    sum -= m[r][c] * f[index[c]];
                f[index[r]] = sum / m[r][r];
            }
            double error = 0;
            for (int i = 0; i < K; i++) {
                double gap = q[i];
                for (int j = 0; j < K; j++)
                    gap += w[i][j] * f[j];
                error = fmax(error, fmax(-f[i] * w[i][i], set >> i & 1 ? 0 : -gap));
            }
            if (error < best_error) {
                best_error = error;
                memcpy(best, f, sizeof f);
            }
        }
        assert_true(best_error < 1e-12);
        for (int form = 0; form < 2; form++) {
            for (int i = 0; i < K; i++)
                p.set.point[i].force = vec3(0, 0, 0);
            ContactReport r = problem_solve(&p, form == 0 ? CONTACT_BLOCK : CONTACT_POINTWISE, form == 0 ? 200 : 400000, 1e-9);
            if (!r.converged)
                print_message("trial %d nodes %d form %d residual %.1e after %d\n", trial, nodes, form, r.residual, r.iterations);
            assert_true(r.converged);
            double top = 1e-3;
            for (int i = 0; i < K; i++)
                top = fmax(top, best[i]);
            for (int i = 0; i < K; i++)
                assert_true(fabs(vec3_dot(p.set.point[i].force, p.set.point[i].normal) - best[i]) < 1e-6 * top);
            assert_laws(&p, 1e-6, form == 0 ? "block" : "pointwise");
        }
        free(v);
        problem_destroy(&p);
    }
}

// Soft to stiff, short to long elements, no to strong friction, none to 200 contacts, gaps that never close and overlap at the start, bad
// warm starts, several contacts at one place: laws hold where it converges; where it does not, nothing penetrates or leaves its cone.
static void survives_random_problems(void **state)
{
    (void)state;
    const double youngs[] = {50, 1000, 80000, 100000}, frictions[] = {0, 0.2, 0.5, 1};
    const int sizes[] = {0, 1, 5, 40, 200};
    int solved = 0, all = 0, hard = 0, solved_hard = 0;
    for (int t = 0; t < 320; t++) {
        double young = youngs[t % 4], friction = frictions[t / 4 % 4], length = t / 16 % 2 ? 1.5 : 0.5;
        int contacts = sizes[t / 32 % 5], nodes = t % 3 || contacts > 40 ? 201 : 31;
        Problem p;
        problem_create(&p, nodes, contacts);
        problem_randomise(&p, young, length, friction, t / 160 % 2 ? -0.02 : 0.004);
        for (int i = 0; i < contacts; i++) {
            if (t % 5 == 1)
                p.set.point[i].force = vec3_scale(random_unit(), 1e3);
            if (t % 5 == 2)
                p.set.point[i].force = vec3_scale(p.set.point[i].normal, 1e-3);
            if (t % 5 == 3 && i == 0)
                p.set.point[i].force = vec3(NAN, INFINITY, 0);
            if (t % 7 == 3 && i > 0 && i % 4 == 0)
                p.set.point[i].node = p.set.point[i - 1].node, p.set.point[i].xi = p.set.point[i - 1].xi, p.set.point[i].normal = p.set.point[i - 1].normal;
        }
        ContactReport r = problem_solve(&p, CONTACT_BLOCK, 200, 1e-6);
        Laws l = check_laws(&p.chain, p.b, &p.set, p.u);
        assert_true(isfinite(r.residual) && isfinite(l.momentum) && isfinite(l.top) && isfinite(l.penetration));
        assert_true(l.pull == 0 && l.cone <= 1e-9 && r.cone_violation <= 1e-9);
        if (!(l.penetration < 1e-4))
            print_message("  penetrates %.1e: E %g friction %g length %g contacts %d nodes %d residual %.1e after %d\n", l.penetration, young, friction, length, contacts, nodes, r.residual, r.iterations);
        bool easy = friction < 0.5;
        all += easy, hard += !easy;
        solved += easy && r.converged, solved_hard += !easy && r.converged;
        if (easy && !r.converged)
            print_message("  not converged: E %g friction %g length %g contacts %d nodes %d residual %.1e after %d\n", young, friction, length, contacts, nodes, r.residual, r.iterations);
        if (r.converged)
            assert_laws(&p, 1e-6, "random");
        problem_destroy(&p);
    }
    print_message("random problems converged: %d of %d with mu <= 0.2, %d of %d with mu >= 0.5\n", solved, all, solved_hard, hard);
    assert_true(solved == all);
    assert_true(solved_hard >= hard * 9 / 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_enumeration),
        cmocka_unit_test(survives_random_problems),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
