// The contact solve: both forms compared with each other, with enumeration of active sets on dense matrices, and with the laws (momentum, Signorini, Coulomb),
// for a wire pushed through tubes and for random problems. Prints iterations, residuals and times.
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

#include "tests/short_run.h"

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

// --- The laws, as stated in contact.h ---

static Vec3 displacement(const ContactPoint *p, const double *u)
{
    Vec3 a = vec3_scale(p->normal, -p->tool_radius), d = {0, 0, 0};
    for (int e = 0; e < (p->is_between ? 2 : 1); e++) {
        const double *v = u + 6 * (p->node + e);
        double w = e ? p->xi : 1 - p->xi;
        Vec3 arm = vec3_add_scaled(p->is_between ? p->lever[e] : vec3(0, 0, 0), w, a);
        d = vec3_add(vec3_add_scaled(d, w, vec3(v[0], v[1], v[2])), vec3_cross(vec3(v[3], v[4], v[5]), arm));
    }
    return d;
}

typedef struct Laws {
    double momentum;     // largest |A u - b - J^T f| over constrained rows too, where J^T f does not act
    double penetration;  // largest -(gap + d_n) [mm]
    double pull;         // largest tensile force
    double complement;   // largest |f_n (gap + d_n)|
    double cone;         // largest (|f_t| - mu f_n)+ / f_n
    double direction;    // [N] largest over contacts of the smaller of |f_t + mu f_n d_t/|d_t|| (slides) and stiffness |d_t| (sticks)
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
        Vec3 f = p->force;
        for (int e = 0; e < (p->is_between ? 2 : 1); e++) {
            double w = e ? p->xi : 1 - p->xi;
            Vec3 arm = vec3_add_scaled(p->is_between ? p->lever[e] : vec3(0, 0, 0), -w * p->tool_radius, p->normal), m = vec3_cross(arm, f);
            const double g[6] = {w * f.x, w * f.y, w * f.z, m.x, m.y, m.z};
            for (int q = 0; q < 6; q++)
                if (contact_free_dofs(a, p->node + e) >> q & 1)
                    r[6 * (p->node + e) + q] -= g[q];
        }
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
        // the contact sticks, or the force is -mu f_n along the sliding: the smaller of both errors, as a force
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
    assert_true(block_chain_create(&p->chain, nodes, 6));
    p->factor = block_factor_create(nodes, 6);
    p->b = calloc((size_t)nodes * 6, sizeof *p->b);
    p->u = calloc((size_t)nodes * 6, sizeof *p->u);
    p->set = (ContactSet){.count = contacts, .capacity = contacts, .point = calloc((size_t)contacts + 1, sizeof *p->set.point)};
    p->solver = contact_solver_create(nodes, 6, contacts);
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
    return contact_solve(&(ContactProblem){p->solver, &p->chain, p->factor, p->b, &p->set, &o, p->u});
}

static Vec3 draw_unit(void)
{
    for (;;) {
        Vec3 v = {uniform(), uniform(), uniform()};
        double n = vec3_norm(v);
        if (n > 0.1 && n <= 1)
            return vec3_scale(v, 1 / n);
    }
}

// A straight Timoshenko wire along a random direction: mass plus stiffness as in solver/beam_equations.h, loaded at random, with contacts around it.
static void problem_randomise(Problem *p, double young, double length, double friction, double offset)
{
    int m = p->chain.count;
    double d = 0.36, area = PI * d * d / 4, inertia = area * d * d / 16, shear = young / 2.6,
           phi = 12 * young * inertia / (0.886 * shear * area * length * length);
    double k = young * inertia / (1 + phi), a = 12 * k / pow(length, 3), b = 6 * k / pow(length, 2), c = (4 + phi) * k / length, dd = (2 - phi) * k / length;
    double ka = young * area / length, g = shear * 2 * inertia / length, mass = 6.45e-3 * area * length;
    Vec3 t = draw_unit();
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
        Vec3 v = vec3_scale(draw_unit(), 0.02 * uniform());
        v = vec3_add_scaled(v, 0.05, t);
        p->b[6 * i] = mass * v.x, p->b[6 * i + 1] = mass * v.y, p->b[6 * i + 2] = mass * v.z;
    }
    // loads that move a node by some tenths of a millimetre in the step: stiffness over the length of a bending wave
    double wave = pow(k / (mass / length), 0.25), load = 2 * k / pow(wave, 3);
    for (int n = 0; n < 3; n++) {
        int i = (int)(fabs(uniform()) * m);
        Vec3 f = vec3_scale(draw_unit(), uniform() * load);
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
        ContactPoint *at = &p->set.point[n];
        at->is_between = at->xi > 0;
        double x = at->xi; // of a cubic through both nodes
        at->lever[0] = vec3_scale(t, length * x * (1 - x) * (1 - x));
        at->lever[1] = vec3_scale(t, -length * x * x * (1 - x));
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
    // Momentum holds to the rounding of a solve (some hundred eps) and the projection of forces to their cones, of which a node may have several. No contact
    // pulls. Cones hold to rounding. Violations times the stiffness of a node are small compared with the forces.
    if (!(l.momentum <= 1e-12 * (a * u + b + top) + 10 * tolerance * top && l.pull == 0 && l.cone <= 1e-9 &&
          l.penetration * a <= 1e3 * tolerance * top + 1e-12 * a && l.complement * a <= 1e3 * tolerance * top * top + 1e-12 * a * top &&
          l.direction <= 1e3 * tolerance * top + 1e-12 * a)) {
        print_message("%s: momentum %.2e pull %.2e cone %.2e penetration %.2e complement %.2e direction %.2e, top %.2e stiffness %.2e\n", what, l.momentum,
                      l.pull, l.cone, l.penetration, l.complement, l.direction, l.top, a);
        fail_msg("laws of contact broken");
    }
}

// Without friction and with few contacts: all active sets are solved by dense elimination; the consistent one is the solution.
static void agrees_with_enumeration(void **state)
{
    (void)state;
    for (int trial = 0; trial < 60; trial++) {
        enum { K = 7 };
        Problem p;
        int nodes = K + trial % 9;
        problem_create(&p, nodes, K);
        problem_randomise(&p, trial % 2 ? 80000 : 200, 1.5, 0, -0.002);
        for (int i = 0; i < K; i++) // one node per contact, or W is singular and forces are not unique
            p.set.point[i].is_between = false, p.set.point[i].xi = 0, p.set.point[i].node = i;
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

// Soft to stiff, short to long elements, no to strong friction, none to 200 contacts, gaps that never close, overlap at the start, bad warm starts, several
// contacts at one place: if the solver converges, the laws hold; if not, no contact penetrates or leaves its cone.
static void survives_random_problems(void **state)
{
    (void)state;
    const double youngs[] = {50, 1000, 80000, 100000}, frictions[] = {0, 0.2, 0.5, 1};
    const int sizes[] = {0, 1, 5, 40, 200};
    int solved = 0, all = 0, hard = 0, solved_hard = 0;
    for (int t = 0; t < 320; t += WHOLE_OR_SHORT(1, 7)) {
        double young = youngs[t % 4], friction = frictions[t / 4 % 4], length = t / 16 % 2 ? 1.5 : 0.5;
        int contacts = sizes[t / 32 % 5], nodes = t % 3 || contacts > 40 ? 201 : 31;
        Problem p;
        problem_create(&p, nodes, contacts);
        problem_randomise(&p, young, length, friction, t / 160 % 2 ? -0.02 : 0.004);
        for (int i = 0; i < contacts; i++) {
            if (t % 5 == 1)
                p.set.point[i].force = vec3_scale(draw_unit(), 10);
            if (t % 5 == 2)
                p.set.point[i].force = vec3_scale(p.set.point[i].normal, 1e-3);
            if (t % 5 == 3 && i == 0)
                p.set.point[i].force = vec3(NAN, INFINITY, 0);
            if (t % 7 == 3 && i > 0 && i % 4 == 0)
                p.set.point[i].node = p.set.point[i - 1].node, p.set.point[i].is_between = p.set.point[i - 1].is_between,
                p.set.point[i].xi = p.set.point[i - 1].xi, p.set.point[i].normal = p.set.point[i - 1].normal;
        }
        ContactReport r = problem_solve(&p, CONTACT_BLOCK, 800, 1e-6);
        Laws l = check_laws(&p.chain, p.b, &p.set, p.u);
        assert_true(isfinite(r.residual) && isfinite(l.momentum) && isfinite(l.top) && isfinite(l.penetration));
        assert_true(l.pull == 0 && l.cone <= 1e-9 && r.cone_violation <= 1e-9);
        if (!(l.penetration < 1e-4))
            print_message("  penetrates %.1e: E %g friction %g length %g contacts %d nodes %d residual %.1e after %d\n", l.penetration, young, friction, length,
                          contacts, nodes, r.residual, r.iterations);
        bool easy = friction < 0.5;
        all += easy, hard += !easy;
        solved += easy && r.converged, solved_hard += !easy && r.converged;
        if (!r.converged)
            print_message("  not converged: E %g friction %g length %g contacts %d nodes %d residual %.1e after %d\n", young, friction, length, contacts, nodes,
                          r.residual, r.iterations);
        if (r.converged)
            assert_laws(&p, 1e-6, "random");
        problem_destroy(&p);
    }
    print_message("random problems converged: %d of %d with mu <= 0.2, %d of %d with mu >= 0.5\n", solved, all, solved_hard, hard);
    assert_true(solved == all);
    assert_true(solved_hard >= hard * 19 / 20);
}

// --- The wire in tubes ---

typedef struct Scene {
    const char *name;
    double young, length, friction, twist, tube;
    int elements, push, pull;
    bool straight, capsule;
    double tip_curvature, speed;
} Scene;

static void scene_create(const Scene *scene, ChainScene *wire, Vessel **vessel)
{
    ChainSceneOptions o = chain_scene_default_options();
    o.elements = scene->elements;
    o.element_length = scene->length;
    o.young_modulus = scene->young;
    o.friction = scene->friction;
    o.tip_curvature = scene->tip_curvature;
    o.vessel = *vessel = scene->capsule    ? chain_scene_capsule(scene->tube)
                         : scene->straight ? chain_scene_straight(scene->tube)
                                           : chain_scene_spiral(scene->tube, true);
    assert_non_null(*vessel);
    chain_scene_create(wire, &o);
}

static void scene_destroy(ChainScene *wire, Vessel *vessel)
{
    chain_scene_destroy(wire);
    vessel->destroy(vessel);
}

// Both forms solve every 100th state of a push through the spiral until they converge.
static void both_forms_agree(void **state)
{
    (void)state;
    const Scene scenes[] = {
        {.name = "0.5 mm, 100 GPa, mu 0", .young = 1e5, .length = 0.5, .elements = 200, .push = 500, .tube = 0.5},
        {.name = "0.5 mm, 100 GPa, mu 0.2", .young = 1e5, .length = 0.5, .friction = 0.2, .elements = 200, .push = 500, .tube = 0.5, .twist = 0.005},
        {.name = "1.5 mm, 80 GPa, mu 0.2", .young = 8e4, .length = 1.5, .friction = 0.2, .elements = 200, .push = 500, .tube = 0.8, .twist = 0.005},
        {.name = "capsule, 100 GPa, mu 0", .young = 1e5, .length = 0.5, .elements = 120, .push = 500, .tube = 1.25, .capsule = true},
        {.name = "capsule, 100 GPa, mu 0.2", .young = 1e5, .length = 0.5, .friction = 0.2, .elements = 120, .push = 500, .tube = 1.25, .capsule = true},
    };
    for (size_t n = WHOLE_OR_SHORT(0, 1); n < sizeof scenes / sizeof *scenes; n += WHOLE_OR_SHORT(1, 3)) {
        ChainScene w;
        Vessel *vessel;
        scene_create(&scenes[n], &w, &vessel);
        ContactPoint *start = calloc((size_t)w.nodes, sizeof *start), *block = calloc((size_t)w.nodes, sizeof *block);
        double *u = calloc((size_t)w.nodes * 6, sizeof *u);
        ContactOptions tight = contact_default_options(), sweeps = tight;
        tight.tolerance = 1e-9;
        sweeps.form = CONTACT_POINTWISE;
        sweeps.max_iterations = 100000;
        sweeps.tolerance = 1e-8;
        for (int i = 1; i <= scenes[n].push; i++) {
            chain_scene_prepare(&w, 0.05, scenes[n].twist);
            size_t bytes = (size_t)w.set.count * sizeof *start;
            memcpy(start, w.set.point, bytes);
            ContactReport a = contact_solve(&(ContactProblem){w.solver, &w.chain, w.factor, w.b, &w.set, &tight, w.u});
            assert_true(a.converged);
            if (i % 100 == 0 && w.set.count > 0) {
                memcpy(block, w.set.point, bytes);
                memcpy(u, w.u, (size_t)w.nodes * 6 * sizeof *u);
                memcpy(w.set.point, start, bytes);
                ContactReport b = contact_solve(&(ContactProblem){w.solver, &w.chain, w.factor, w.b, &w.set, &sweeps, w.u});
                double top = 1e-3, apart = 0, moved = 0;
                for (int k = 0; k < w.set.count; k++) {
                    top = fmax(top, vec3_norm(block[k].force));
                    apart = fmax(apart, vec3_distance(block[k].force, w.set.point[k].force));
                }
                for (int k = 0; k < 6 * w.nodes; k++)
                    moved = fmax(moved, fabs(u[k] - w.u[k]));
                ContactOptions usual = contact_default_options();
                ContactPoint *sweep = memcpy(calloc((size_t)w.set.count, sizeof *sweep), w.set.point, bytes);
                double *moves = memcpy(calloc((size_t)w.nodes * 6, sizeof *moves), w.u, (size_t)w.nodes * 6 * sizeof *moves), off = 0;
                memcpy(w.set.point, start, bytes);
                assert_true(contact_solve(&(ContactProblem){w.solver, &w.chain, w.factor, w.b, &w.set, &usual, w.u}).converged);
                for (int k = 0; k < w.set.count; k++)
                    off = fmax(off, vec3_distance(block[k].force, w.set.point[k].force));
                memcpy(w.set.point, sweep, bytes);
                memcpy(w.u, moves, (size_t)w.nodes * 6 * sizeof *moves);
                free(sweep);
                free(moves);
                print_message("%-24s step %3d: %2d of %3d active; block %2d factorisations, residual %.0e; pointwise %5d sweeps, residual %.0e; "
                              "forces differ by %.0e, motion by %.0e mm; at default options by %.0e\n",
                              scenes[n].name, i, a.active, w.set.count, a.iterations, a.residual, b.iterations, b.residual, apart / top, moved, off / top);
                assert_true(b.converged);
                assert_true(apart <= 1e-5 * top);
                assert_true(moved <= 1e-8);
                assert_true(off <= 1e-5 * top); // ten times the tolerance
                assert_true(fmax(a.cone_violation, b.cone_violation) <= 1e-9);
                memcpy(w.set.point, block, bytes);
                memcpy(w.u, u, (size_t)w.nodes * 6 * sizeof *u);
            }
            chain_scene_finish(&w);
        }
        free(start);
        free(block);
        free(u);
        scene_destroy(&w, vessel);
    }
}

// Time and convergence over whole runs, with warm starts as in the step.
static void wire_in_tubes(void **state)
{
    (void)state;
    const Scene scenes[] = {
        {.name = "spiral 0.2 mm 80 GPa mu 0", .young = 8e4, .length = 0.2, .elements = 200, .push = 500, .pull = 300, .tube = 0.5, .twist = 0.005},
        {.name = "spiral 0.2 mm 80 GPa mu 0.2",
         .young = 8e4,
         .length = 0.2,
         .friction = 0.2,
         .elements = 200,
         .push = 500,
         .pull = 300,
         .tube = 0.5,
         .twist = 0.005},
        {.name = "spiral 0.5 mm 80 GPa mu 0.2",
         .young = 8e4,
         .length = 0.5,
         .friction = 0.2,
         .elements = 200,
         .push = 500,
         .pull = 300,
         .tube = 0.5,
         .twist = 0.005},
        {.name = "spiral 0.5 mm 100 GPa mu 0.2",
         .young = 1e5,
         .length = 0.5,
         .friction = 0.2,
         .elements = 200,
         .push = 500,
         .pull = 300,
         .tube = 0.5,
         .twist = 0.005},
        {.name = "spiral 0.5 mm 100 GPa mu 0.5",
         .young = 1e5,
         .length = 0.5,
         .friction = 0.5,
         .elements = 200,
         .push = 500,
         .pull = 300,
         .tube = 0.5,
         .twist = 0.005},
        {.name = "spiral 1.5 mm 80 GPa mu 0.2",
         .young = 8e4,
         .length = 1.5,
         .friction = 0.2,
         .elements = 200,
         .push = 500,
         .pull = 300,
         .tube = 0.8,
         .twist = 0.005},
        {.name = "spiral 0.2 mm 0.05 GPa mu 0.2",
         .young = 50,
         .length = 0.2,
         .friction = 0.2,
         .elements = 200,
         .push = 500,
         .pull = 300,
         .tube = 0.5,
         .twist = 0.005},
        {.name = "straight, J tip, twisting",
         .young = 8e4,
         .length = 0.5,
         .friction = 0.2,
         .elements = 200,
         .push = 500,
         .tube = 0.6,
         .twist = 0.05,
         .straight = true,
         .tip_curvature = 0.1},
    };
    for (size_t n = WHOLE_OR_SHORT(0, 2); n < sizeof scenes / sizeof *scenes; n += WHOLE_OR_SHORT(1, 5)) {
        enum { STEPS = 800 };
        static double us[STEPS], iterations[STEPS];
        ChainScene w;
        Vessel *vessel;
        scene_create(&scenes[n], &w, &vessel);
        ContactOptions o = contact_default_options();
        int failed = 0, active = 0, candidates = 0, steps = scenes[n].push + scenes[n].pull;
        double penetration = 0, residual = 0;
        for (int i = 0; i < steps; i++) {
            chain_scene_prepare(&w, i < scenes[n].push ? 0.05 : -0.05, scenes[n].twist);
            double t = now_us();
            ContactReport r = contact_solve(&(ContactProblem){w.solver, &w.chain, w.factor, w.b, &w.set, &o, w.u});
            us[i] = now_us() - t;
            iterations[i] = r.iterations;
            failed += !r.converged;
            active = r.active > active ? r.active : active;
            candidates = w.set.count > candidates ? w.set.count : candidates;
            if (i >= 50) // a J-tip that starts straight springs open across the tube at once
                penetration = fmax(penetration, w.penetration);
            residual = r.converged ? fmax(residual, r.residual) : residual;
            assert_true(r.cone_violation <= 1e-9 && isfinite(r.residual));
            chain_scene_finish(&w);
        }
        qsort(us, (size_t)steps, sizeof *us, by_value);
        qsort(iterations, (size_t)steps, sizeof *iterations, by_value);
        print_message("%-30s up to %3d of %3d active, factorisations median %2.0f p99 %2.0f max %3.0f, %5.1f us median %6.1f p99 %7.1f max, "
                      "residual <= %.0e, %d not converged, penetration <= %.1f um\n",
                      scenes[n].name, active, candidates, iterations[steps / 2], iterations[steps * 99 / 100], iterations[steps - 1], us[steps / 2],
                      us[steps * 99 / 100], us[steps - 1], residual, failed, 1e3 * penetration);
        assert_true(failed <= steps / 100);
        assert_true(penetration < (scenes[n].straight ? 0.05 : 0.02)); // due to the wall's curvature and the rotation of the normal in a step, not to the solve
        scene_destroy(&w, vessel);
    }
}

// Contacts between nodes with levers in all directions: both forms reach the same forces, and the laws hold.
static void levers(void **state)
{
    (void)state;
    for (int trial = 0; trial < 40; trial++) {
        enum { K = 12 };
        Problem p;
        problem_create(&p, 31, K);
        double friction = trial % 3 ? 0.3 : 0;
        problem_randomise(&p, trial % 2 ? 80000 : 500, 1.5, friction, -0.002);
        for (int i = 0; i < K; i++) {
            ContactPoint *c = &p.set.point[i];
            c->is_between = i % 4 != 0;
            c->xi = i % 4 ? 0.1 + 0.8 * fabs(uniform()) : 0;
            for (int e = 0; e < 2; e++)
                c->lever[e] = vec3_add_scaled(c->lever[e], 0.1, draw_unit());
        }
        ContactPoint block[K];
        ContactReport a = problem_solve(&p, CONTACT_BLOCK, 200, 1e-9);
        memcpy(block, p.set.point, sizeof block);
        assert_true(a.converged);
        assert_laws(&p, 1e-6, "levers, block");
        for (int i = 0; i < K; i++)
            p.set.point[i].force = vec3(0, 0, 0);
        ContactReport b = problem_solve(&p, CONTACT_POINTWISE, 400000, 1e-8);
        assert_true(b.converged);
        assert_laws(&p, 1e-6, "levers, pointwise");
        double top = 1e-3, apart = 0;
        for (int i = 0; i < K; i++) {
            top = fmax(top, vec3_norm(block[i].force));
            apart = fmax(apart, vec3_distance(block[i].force, p.set.point[i].force));
        }
        if (!(apart <= 1e-6 * top))
            print_message("trial %d: %.1e apart of %.1e, %d active; %d and %d iterations\n", trial, apart, top, a.active, a.iterations, b.iterations);
        assert_true(apart <= 1e-6 * top);
        problem_destroy(&p);
    }
}

// The wall's curvature as the second derivative of its energy -f H(d, d)/2, with d the motion of the axis: each entry from finite differences of the motion
// given in contact.h (exact, because the energy is quadratic).
static void curvature_follows_levers(void **state)
{
    (void)state;
    for (int trial = 0; trial < 20; trial++) {
        BlockChain chain;
        assert_true(block_chain_create(&chain, 3, 6));
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 6; k++)
                chain.diag[36 * i + 7 * k] = 2;
        for (int k = 0; k < 36; k++)
            chain.lower[k] = chain.lower[36 + k] = 0.1; // no unit rows
        ContactPoint c = {
            .node = 1, .is_between = trial % 4 != 0, .xi = trial % 4 ? 0.1 + 0.8 * fabs(uniform()) : 0, .tool_radius = 0.3, .normal = draw_unit()};
        for (int e = 0; e < 2; e++)
            c.lever[e] = vec3_scale(draw_unit(), 0.5);
        Vec3 e = vec3_normal_to(c.normal), f = vec3_cross(c.normal, e);
        double along = -0.5 - fabs(uniform()), across = -0.2; // concave: both eigenvalues of -H positive
        c.hessian = (Sym3){along * e.x * e.x + across * f.x * f.x, along * e.x * e.y + across * f.x * f.y, along * e.x * e.z + across * f.x * f.z,
                           along * e.y * e.y + across * f.y * f.y, along * e.y * e.z + across * f.y * f.z, along * e.z * e.z + across * f.z * f.z};
        c.force = vec3_scale(c.normal, 3);
        double before[2][36], lower[36];
        memcpy(before, chain.diag + 36, sizeof before);
        memcpy(lower, chain.lower + 36, sizeof lower);
        contact_add_curvature(&(ContactSet){.count = 1, .capacity = 1, .point = &c}, &chain, NULL);
        ContactPoint axis = c;
        axis.tool_radius = 0;
        for (int i = 0; i < 12; i++)
            for (int j = 0; j < 12; j++) {
                double u[18] = {0}, v[18] = {0};
                u[6 + i] = v[6 + j] = 1;
                double want = -3 * vec3_dot(displacement(&axis, u), sym3_mul_vec(&c.hessian, displacement(&axis, v))), got;
                int a = i % 6, b = j % 6;
                if (i / 6 == j / 6)
                    got = chain.diag[36 + 36 * (i / 6) + 6 * a + b] - before[i / 6][6 * a + b];
                else
                    got = i > j ? chain.lower[36 + 6 * a + b] - lower[6 * a + b] : chain.lower[36 + 6 * b + a] - lower[6 * b + a];
                assert_true(fabs(got - want) < 1e-13);
            }
        block_chain_destroy(&chain);
    }
}

// A mirrored problem has the mirrored solution, to rounding. The same problem has a bit-identical solution, whatever the work space contained before.
static void mirrored_and_repeated(void **state)
{
    (void)state;
    for (int trial = 0; trial < 24; trial++) {
        int nodes = 41, contacts = 20, axis = trial % 3;
        Problem p, q;
        problem_create(&p, nodes, contacts);
        problem_create(&q, nodes, contacts);
        problem_randomise(&p, 80000, 1.5, trial % 2 ? 0.2 : 0, -0.002);
        double sign[6];
        for (int k = 0; k < 3; k++) {
            sign[k] = k == axis ? -1 : 1;
            sign[k + 3] = -sign[k]; // rotations are axial vectors
        }
        for (int i = 0; i < 36 * nodes; i++) {
            q.chain.diag[i] = sign[i / 6 % 6] * sign[i % 6] * p.chain.diag[i];
            if (i < 36 * (nodes - 1))
                q.chain.lower[i] = sign[i / 6 % 6] * sign[i % 6] * p.chain.lower[i];
        }
        for (int i = 0; i < 6 * nodes; i++)
            q.b[i] = sign[i % 6] * p.b[i];
        memcpy(q.set.point, p.set.point, (size_t)contacts * sizeof *p.set.point);
        for (int k = 0; k < contacts; k++) {
            Vec3 *n = &q.set.point[k].normal;
            *n = vec3(sign[0] * n->x, sign[1] * n->y, sign[2] * n->z);
            for (int e = 0; e < 2; e++) {
                Vec3 *l = &q.set.point[k].lever[e];
                *l = vec3(sign[0] * l->x, sign[1] * l->y, sign[2] * l->z);
            }
        }
        assert_true(block_chain_factor(&q.chain, q.factor));
        ContactPoint *start = malloc((size_t)contacts * sizeof *start), *first = malloc((size_t)contacts * sizeof *start);
        memcpy(start, p.set.point, (size_t)contacts * sizeof *start);
        ContactReport a = problem_solve(&p, CONTACT_BLOCK, 200, 1e-9), b = problem_solve(&q, CONTACT_BLOCK, 200, 1e-9);
        assert_true(a.converged && b.converged);
        double top = 1e-3;
        for (int k = 0; k < contacts; k++)
            top = fmax(top, vec3_norm(p.set.point[k].force));
        for (int k = 0; k < contacts; k++) {
            Vec3 f = p.set.point[k].force;
            assert_true(vec3_distance(vec3(sign[0] * f.x, sign[1] * f.y, sign[2] * f.z), q.set.point[k].force) <= 1e-7 * top);
        }
        memcpy(first, p.set.point, (size_t)contacts * sizeof *start);
        memcpy(p.set.point, start, (size_t)contacts * sizeof *start);
        problem_solve(&p, CONTACT_POINTWISE, 7, 1e-9); // leaves other values in the work space
        memcpy(p.set.point, start, (size_t)contacts * sizeof *start);
        double *u = malloc((size_t)nodes * 6 * sizeof *u);
        problem_solve(&p, CONTACT_BLOCK, 200, 1e-9);
        memcpy(u, p.u, (size_t)nodes * 6 * sizeof *u);
        assert_memory_equal(first, p.set.point, (size_t)contacts * sizeof *start);
        memcpy(q.set.point, start, (size_t)contacts * sizeof *start);
        ContactOptions o = contact_default_options();
        o.tolerance = 1e-9;
        contact_solve(&(ContactProblem){q.solver, &p.chain, p.factor, p.b, &q.set, &o, q.u});
        assert_memory_equal(u, q.u, (size_t)nodes * 6 * sizeof *u);
        free(u);
        free(start);
        free(first);
        problem_destroy(&p);
        problem_destroy(&q);
    }
}

// A node that cannot move along the normal has no contact force and does not disturb the others; a node that is held only across it still pushes.
static void held_nodes(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++) {
        Problem p;
        problem_create(&p, 21, 3);
        problem_randomise(&p, 80000, 1.5, 0.2, -0.002);
        for (int k = 0; k < 3; k++)
            p.set.point[k].is_between = false, p.set.point[k].xi = 0, p.set.point[k].normal = vec3(0, 1, 0), p.set.point[k].gap = -0.001,
            p.set.point[k].node = 5 + 5 * k;
        for (int hold = 0; hold < 2; hold++) { // node 5: y held at +0.01; node 10: x and z held
            int node = hold ? 10 : 5;
            for (int dof = 0; dof < 3; dof++) {
                if ((dof == 1) == (hold == 1))
                    continue;
                double value = hold ? 0 : 0.01 * (dof == 1);
                if (!hold && dof != 1)
                    continue;
                for (int k = 0; k < 6; k++) {
                    double *d = p.chain.diag + 36 * node, *l0 = p.chain.lower + 36 * (node - 1), *l1 = l0 + 36;
                    p.b[6 * node + k] -= d[6 * k + dof] * value;
                    p.b[6 * node - 6 + k] -= l0[6 * dof + k] * value;
                    p.b[6 * node + 6 + k] -= l1[6 * k + dof] * value;
                    d[6 * dof + k] = d[6 * k + dof] = k == dof;
                    l0[6 * dof + k] = l1[6 * k + dof] = 0;
                }
                p.b[6 * node + dof] = value;
            }
        }
        assert_true(block_chain_factor(&p.chain, p.factor));
        assert_int_equal(contact_free_dofs(&p.chain, 5), 63 & ~2);
        assert_int_equal(contact_free_dofs(&p.chain, 10), 63 & ~5);
        ContactReport r = problem_solve(&p, form ? CONTACT_POINTWISE : CONTACT_BLOCK, form ? 100000 : 200, 1e-8);
        assert_true(r.converged);
        assert_true(vec3_norm(p.set.point[0].force) == 0);
        assert_true(fabs(p.u[6 * 5 + 1] - 0.01) < 1e-15);
        assert_laws(&p, 1e-6, "held nodes");
        problem_destroy(&p);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_enumeration),
        cmocka_unit_test(survives_random_problems),
        cmocka_unit_test(both_forms_agree),
        cmocka_unit_test(wire_in_tubes),
        cmocka_unit_test(levers),
        cmocka_unit_test(curvature_follows_levers),
        cmocka_unit_test(mirrored_and_repeated),
        cmocka_unit_test(held_nodes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
