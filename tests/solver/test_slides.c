// Chains with more than six unknowns per node in the contact solve, and friction between coaxial tools (slides): exact solutions of springs that stick and
// slip, and the laws of contact.h, checked by independent code in this file, for slides together with contacts of the wall.
#include "chain_scene.h"
#include "tests/short_run.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint64_t seed_state = 7;
static double uniform(void) // [-1, 1)
{
    seed_state ^= seed_state << 13;
    seed_state ^= seed_state >> 7;
    seed_state ^= seed_state << 17;
    return (double)(seed_state >> 11) * 0x1p-52 - 1;
}

typedef struct Problem {
    int nodes, size;
    BlockChain chain;
    BlockFactor *factor;
    double *b, *u;
    ContactSet set;
    ContactSolver *solver;
} Problem;

static void create(Problem *p, int nodes, int size, int walls, int slides)
{
    *p = (Problem){.nodes = nodes, .size = size};
    assert_true(block_chain_create(&p->chain, nodes, size));
    p->factor = block_factor_create(nodes, size);
    p->b = calloc((size_t)(nodes * size), sizeof *p->b);
    p->u = calloc((size_t)(nodes * size), sizeof *p->u);
    p->set = (ContactSet){.count = walls,
                          .capacity = walls,
                          .point = calloc((size_t)walls + 1, sizeof *p->set.point),
                          .slide_count = slides,
                          .slide = calloc((size_t)slides + 1, sizeof *p->set.slide)};
    p->solver = contact_solver_create(nodes, size, walls + slides);
    assert_non_null(p->factor);
    assert_non_null(p->solver);
}

static void destroy(Problem *p)
{
    block_chain_destroy(&p->chain);
    block_factor_destroy(p->factor);
    free(p->b);
    free(p->u);
    free(p->set.point);
    free(p->set.slide);
    contact_solver_destroy(p->solver);
}

static ContactReport solve(Problem *p, ContactForm form, int iterations, double tolerance)
{
    assert_true(block_chain_factor(&p->chain, p->factor));
    ContactOptions o = {.form = form, .max_iterations = iterations, .tolerance = tolerance};
    return contact_solve(&(ContactProblem){p->solver, &p->chain, p->factor, p->b, &p->set, &o, p->u});
}

static double *diagonal(Problem *p, int node, int row, int column) { return &p->chain.diag[(node * p->size + row) * p->size + column]; }
static double *lower(Problem *p, int node, int row, int column) { return &p->chain.lower[(node * p->size + row) * p->size + column]; }

static void unit_row(Problem *p, int node, int k, double value)
{
    for (int j = 0; j < p->size; j++) {
        p->b[p->size * node + j] -= *diagonal(p, node, j, k) * value;
        *diagonal(p, node, k, j) = *diagonal(p, node, j, k) = j == k;
        if (node > 0) {
            p->b[p->size * (node - 1) + j] -= *lower(p, node - 1, k, j) * value;
            *lower(p, node - 1, k, j) = 0;
        }
        if (node + 1 < p->nodes) {
            p->b[p->size * (node + 1) + j] -= *lower(p, node, j, k) * value;
            *lower(p, node, j, k) = 0;
        }
    }
    p->b[p->size * node + k] = value;
}

// Adds the stiffness k between nodes i and i+1 for g . (unknowns of i, unknowns of i+1).
static void add_spring(Problem *p, int i, double k, const double *g)
{
    const int n = p->size;
    for (int r = 0; r < n; r++)
        for (int c = 0; c < n; c++) {
            *diagonal(p, i, r, c) += k * g[r] * g[c];
            *diagonal(p, i + 1, r, c) += k * g[n + r] * g[n + c];
            *lower(p, i, r, c) += k * g[n + r] * g[c];
        }
}

// --- The laws ---

static bool is_free(const Problem *p, int node, int k) { return contact_is_free(&p->chain, node, k); }

// The largest error relative to the tolerance of the solve: momentum, the wall's laws, the slides' laws. At most 1 if they hold.
static double broken(const Problem *p, double tolerance)
{
    const int n = p->size, all = n * p->nodes;
    double *r = malloc((size_t)all * sizeof *r), a = 0, top = 1e-3, u = 0, b = 0, momentum = 0, worst = 0;
    block_chain_multiply(&p->chain, p->u, r);
    for (int i = 0; i < all * n; i++)
        a = fmax(a, fabs(p->chain.diag[i]));
    for (int i = 0; i < all; i++) {
        r[i] -= p->b[i];
        u = fmax(u, fabs(p->u[i]));
        b = fmax(b, fabs(p->b[i]));
    }
    for (int k = 0; k < p->set.count; k++) {
        const ContactPoint *c = &p->set.point[k];
        Vec3 f = c->force, m = vec3_cross(vec3_scale(c->normal, -c->tool_radius), f);
        const double g[6] = {f.x, f.y, f.z, m.x, m.y, m.z};
        assert_true(c->xi == 0);
        for (int q = 0; q < 6; q++)
            r[n * c->node + q] -= is_free(p, c->node, q) ? g[q] : 0;
        top = fmax(top, vec3_norm(f));
    }
    for (int k = 0; k < p->set.slide_count; k++) {
        const ContactSlide *c = &p->set.slide[k];
        r[n * c->node + c->unknown] -= c->force[0];
        r[n * c->node + c->unknown + 1] -= c->radius * c->force[1];
        top = fmax(top, hypot(c->force[0], c->force[1]));
    }
    for (int i = 0; i < all; i++)
        momentum = fmax(momentum, fabs(r[i]));
    free(r);
    // rounding of a solve, and the projection of forces to their cones
    worst = fmax(worst, momentum / (1e-12 * (a * u + b + top) + 10 * tolerance * top));
    // violations times the stiffness of a node are small compared with the forces
    const double small = 1e3 * tolerance * top + 1e-12 * a;
    for (int k = 0; k < p->set.count; k++) {
        const ContactPoint *c = &p->set.point[k];
        const double *v = p->u + n * c->node;
        Vec3 d = vec3_add(vec3(v[0], v[1], v[2]), vec3_cross(vec3(v[3], v[4], v[5]), vec3_scale(c->normal, -c->tool_radius)));
        double gap = c->gap + vec3_dot(d, c->normal), fn = vec3_dot(c->force, c->normal);
        Vec3 ft = vec3_add_scaled(c->force, -fn, c->normal), dt = vec3_add_scaled(d, -vec3_dot(d, c->normal), c->normal);
        double slide = vec3_norm(dt);
        worst = fmax(worst, fmax(-gap * a / small, fn < 0 ? HUGE_VAL : 0));
        worst = fmax(worst, fabs(fn * gap) * a / (small * top));
        worst = fmax(worst, (vec3_norm(ft) - c->friction * fn) / (1e-9 * top));
        if (fn > 0 && c->friction > 0)
            worst = fmax(worst, fmin(slide > 0 ? vec3_norm(vec3_add_scaled(ft, c->friction * fn / slide, dt)) : 0, a * slide) / small);
    }
    for (int k = 0; k < p->set.slide_count; k++) {
        const ContactSlide *c = &p->set.slide[k];
        const double *v = p->u + n * c->node + c->unknown;
        bool s = is_free(p, c->node, c->unknown), phi = is_free(p, c->node, c->unknown + 1) && c->radius > 0;
        double d[2] = {s ? v[0] : 0, phi ? c->radius * v[1] : 0}, force = hypot(c->force[0], c->force[1]);
        double t[2] = {s ? c->held[0] - c->bound / c->give * d[0] : 0, phi ? c->held[1] - c->bound / c->give * d[1] : 0};
        double size = hypot(t[0], t[1]), cut = size > c->bound ? c->bound / size : 1;
        worst = fmax(worst, fmax(hypot(c->force[0] - cut * t[0], c->force[1] - cut * t[1]) / small, (force - c->bound) / (1e-9 * top)));
    }
    return worst;
}

static void assert_laws(const Problem *p, double tolerance)
{
    double worst = broken(p, tolerance);
    if (!(worst <= 1))
        print_message("laws broken by %.1e of what is allowed\n", worst);
    assert_true(worst <= 1);
}

// --- Springs with exact solutions ---

static const int sizes[] = {8, 10, 12};

// A node with springs k and c = k radius^2 for S and phi, loaded by (f, radius f'), and a slide: a spring of stiffness bound / give from its last force, until
// it slips. In further steps with the same load it stays in place. The start values, even meaningless ones, do not change the result.
static void gives_and_holds_at(ContactForm form, int size, int unknown, int trial)
{
    const double radius = 0.4, k = 30, bound = 0.7, give = 1e-3, own = bound / give;
    Problem p;
    create(&p, 3, size, 0, 1);
    for (int i = 0; i < 3; i++)
        for (int q = 0; q < size; q++)
            *diagonal(&p, i, q, q) = 5;
    double angle = trial % 8 * PI / 4, load = trial / 8 % 2 ? 0.6 * bound : 3 * bound, held = trial / 16 % 2 ? 0.5 * bound : 0, at = 0;
    bool across = trial / 32;            // its last force is along the load, or across it
    const int s = size + unknown, phi = s + 1;
    *diagonal(&p, 1, unknown, unknown) = k;
    *diagonal(&p, 1, unknown + 1, unknown + 1) = k * radius * radius;
    p.b[size] = 2;                       // an independent neighbour
    p.set.slide[0] = (ContactSlide){.node = 1,
                                    .unknown = unknown,
                                    .radius = radius,
                                    .bound = bound,
                                    .give = give,
                                    .held = {held * cos(angle + across * PI / 2), held * sin(angle + across * PI / 2)}};
    double *f = p.set.slide[0].force, x[2] = {0, 0};
    if (trial % 3 == 1)
        f[0] = -20, f[1] = 3;
    if (trial % 3 == 2)
        f[0] = NAN, f[1] = -bound * sin(angle);
    for (int step = 0; step < 5; step++) {
        p.b[s] = load * cos(angle) - k * x[0];
        p.b[phi] = radius * (load * sin(angle) - k * x[1]);
        ContactReport r = solve(&p, form, 200, 1e-10); // rounding of d times bound / give
        assert_true(r.converged && r.active == 0);
        assert_laws(&p, 1e-10);
        assert_true(fabs(p.u[size] - 0.4) < 1e-15);
        double d[2] = {p.u[s], radius * p.u[phi]};
        assert_true(fabs(d[0] - p.set.slide[0].slip[0]) < 1e-14 && fabs(d[1] - p.set.slide[0].slip[1]) < 1e-14);
        if (step == 0 && !across) {
            double elastic = (load + held) / (k + own);
            at = held - own * elastic > -bound ? elastic : (load - bound) / k;
            assert_true(fabs(d[0] - at * cos(angle)) < 1e-10 && fabs(d[1] - at * sin(angle)) < 1e-10);
        }
        if (step > 0)
            assert_true(fabs(d[0]) < 1e-12 && fabs(d[1]) < 1e-12);
        for (int i = 0; i < 2; i++)
            x[i] += d[i], p.set.slide[0].held[i] = f[i];
    }
    destroy(&p);
}

static void gives_and_holds(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++)
        for (int t = 0; t < 3; t++)
            for (int unknown = 6; unknown < sizes[t]; unknown += 2)
                for (int trial = 0; trial < 64; trial++)
                    gives_and_holds_at(form ? CONTACT_POINTWISE : CONTACT_BLOCK, sizes[t], unknown, trial);
}

// A slide on a constrained unknown, or with radius 0, has no effect; with bound 0 there is no slide.
static void held_and_frictionless(void **state)
{
    (void)state;
    for (int form = 0; form < 2; form++)
        for (int what = 0; what < 6; what++) {
            Problem p;
            create(&p, 2, 8, 0, 1);
            for (int i = 0; i < 2; i++)
                for (int q = 0; q < 8; q++) {
                    *diagonal(&p, i, q, q) = 4;
                    p.b[8 * i + q] = 8;
                }
            p.set.slide[0] =
                (ContactSlide){.node = 1, .unknown = 6, .radius = what == 3 ? 0 : 0.5, .bound = what == 4 ? 0 : 2, .give = 1e-3, .force = {0.1, 0.1}};
            if (what == 0 || what == 2)
                unit_row(&p, 1, 6, 0.3);
            if (what == 1 || what == 2)
                unit_row(&p, 1, 7, -0.2);
            if (what == 5)
                p.set.slide[0].bound = NAN;
            ContactReport r = solve(&p, form ? CONTACT_POINTWISE : CONTACT_BLOCK, 200, 1e-12);
            const double *f = p.set.slide[0].force, *u = p.u + 14;
            assert_true(r.converged);
            bool s_slips = what == 1 || what == 3, phi_slips = what == 0;
            assert_true(fabs(f[0] - (s_slips ? -2 : 0)) < 1e-12 && fabs(f[1] - (phi_slips ? -2 : 0)) < 1e-12);
            assert_true(fabs(u[0] - (what == 0 || what == 2 ? 0.3 : s_slips ? 1.5 : 2)) < 1e-12);
            assert_true(fabs(u[1] - (what == 1 || what == 2 ? -0.2 : phi_slips ? 1.75 : 2)) < 1e-12);
            destroy(&p);
        }
}

enum { CHAIN = 101 };
static const double chain_spring = 50, chain_bound = 0.11, chain_radius = 0.3, chain_give = 1e-4;

// The displacements of the nodes of a chain that is held at its last node and pulled at its first, and the forces of the slides. From the pulled end on, slides
// slip and reduce the tension by their bounds; the rest of the chain and of the slides are springs, `firm` being the stiffness of all from a node on.
static void pulled_chain(double pull, double *moved, double *force)
{
    const double k = chain_spring, own = chain_bound / chain_give;
    double firm[CHAIN], tension[CHAIN];        // tension of the spring behind a node
    firm[CHAIN - 1] = HUGE_VAL;
    for (int i = CHAIN - 2; i >= 0; i--)
        firm[i] = own + (i + 2 == CHAIN ? k : k * firm[i + 1] / (k + firm[i + 1]));
    moved[CHAIN - 1] = force[CHAIN - 1] = 0;
    int slipping = 0;
    for (double left = pull; slipping + 1 < CHAIN && own * left / firm[slipping] > chain_bound; slipping++)
        tension[slipping] = left -= chain_bound;
    for (int i = slipping; i + 1 < CHAIN; i++) {
        moved[i] = i > slipping ? tension[i - 1] / firm[i] : (i > 0 ? tension[i - 1] : pull) / firm[i];
        force[i] = own * moved[i];
        tension[i] = (i > 0 ? tension[i - 1] : pull) - force[i];
    }
    for (int i = slipping - 1; i >= 0; i--) {
        moved[i] = moved[i + 1] + tension[i] / k;
        force[i] = chain_bound;
    }
}

static void pull_chain(ContactForm form, int size, double angle, double pull, int most[2])
{
    const int at = size - 2;
    const double c = cos(angle), s = sin(angle), radius = chain_radius;
    double moved[CHAIN], force[CHAIN];
    pulled_chain(pull, moved, force);
    Problem p;
    create(&p, CHAIN, size, 0, CHAIN);
    for (int i = 0; i < CHAIN; i++)
        for (int q = 0; q < at; q++)
            *diagonal(&p, i, q, q) = 1;
    for (int i = 0; i + 1 < CHAIN; i++) {
        double g[24] = {0};
        g[at] = -1, g[size + at] = 1;
        add_spring(&p, i, chain_spring, g);
        g[at] = g[size + at] = 0;
        g[at + 1] = -radius, g[size + at + 1] = radius;
        add_spring(&p, i, chain_spring, g);
    }
    unit_row(&p, CHAIN - 1, at, 0);
    unit_row(&p, CHAIN - 1, at + 1, 0);
    for (int i = 0; i < CHAIN; i++)
        p.set.slide[i] = (ContactSlide){.node = i, .unknown = at, .radius = radius, .bound = chain_bound, .give = chain_give};
    for (int sense = 1; sense >= -1; sense -= 2) {
        p.b[at] = sense * pull * c;
        p.b[at + 1] = sense * pull * s * radius;
        bool turned = sense < 0;
        ContactReport r = solve(&p, form, form == CONTACT_POINTWISE ? 400000 : turned ? 200 : 800, 1e-9);
        if (!r.converged)
            print_message("form %d pull %g angle %g: residual %.1e after %d\n", form, pull, angle, r.residual, r.iterations);
        assert_true(r.converged);
        most[turned] = r.iterations > most[turned] ? r.iterations : most[turned];
        for (int i = 0; i < CHAIN; i++) {
            assert_true(fabs(p.u[size * i + at] - sense * moved[i] * c) < 1e-7);
            assert_true(fabs(radius * p.u[size * i + at + 1] - sense * moved[i] * s) < 1e-7);
            assert_true(fabs(p.set.slide[i].force[0] + sense * force[i] * c) < 1e-7);
            assert_true(fabs(p.set.slide[i].force[1] + sense * force[i] * s) < 1e-7);
        }
    }
    destroy(&p);
}

// A tool of springs, held at its far end and pulled (rotated, or both) at the near end, from less than one bound to more than all, from rest in one step, which
// is harder than any hand motion. Then the pull is reversed: from the former slip the solution is found within the iterations of a step.
static void chain_takes_off_bounds(void **state)
{
    (void)state;
    const double pulls[] = {0.05, 0.5, 3.3, 7.777, 10.6, 20};
    int most[2][2] = {{0}};
    for (int t = 0; t < 3; t++)
        for (int direction = WHOLE_OR_SHORT(0, 1); direction < 8; direction += WHOLE_OR_SHORT(1, 2))
            for (size_t n = 0; n < sizeof pulls / sizeof *pulls; n++) {
                pull_chain(CONTACT_BLOCK, sizes[t], direction * PI / 4, pulls[n], most[0]);
                if (direction == 5 && n % WHOLE_OR_SHORT(1, 6) == 0)         // thousands of sweeps
                    pull_chain(CONTACT_POINTWISE, sizes[t], direction * PI / 4, pulls[n], most[1]);
            }
    print_message("chain of 100 slides: up to %d factorisations from rest, %d turned round; %d and %d sweeps\n", most[0][0], most[0][1], most[1][0],
                  most[1][1]);
}

// --- A wire in a spiral, with tools inside ---

// The scene's system as the first six unknowns of a larger one. Tools inside are springs along the wire, stretched by the wire's own strain times
// `coupling`, and pushed and turned at their ends by `drive`.
static void embed(const ChainScene *w, int size, double coupling, double drive, int slides, Problem *p)
{
    const int m = w->nodes;
    create(p, m, size, w->set.count, slides);
    memcpy(p->set.point, w->set.point, (size_t)w->set.count * sizeof *p->set.point);
    for (int i = 0; i < m; i++)
        for (int r = 0; r < 6; r++) {
            p->b[size * i + r] = w->b[6 * i + r];
            for (int c = 0; c < 6; c++) {
                *diagonal(p, i, r, c) = w->chain.diag[36 * i + 6 * r + c];
                if (i + 1 < m)
                    *lower(p, i, r, c) = w->chain.lower[36 * i + 6 * r + c];
            }
        }
    for (int tool = 6; tool < size; tool += 2) {
        for (int i = 0; i < m; i++) {
            *diagonal(p, i, tool, tool) += 1e-2;
            *diagonal(p, i, tool + 1, tool + 1) += 1e-4;
        }
        p->b[size * (m - 1) + tool] += drive * uniform();
        p->b[size * (m / 2) + tool] += drive * uniform();
        p->b[size * (m / 2) + tool + 1] += 0.1 * drive * uniform();
        for (int i = 0; i + 1 < m; i++) {
            Vec3 e = vec3_unit(vec3_sub(w->position[i + 1], w->position[i]));
            const double t[3] = {e.x, e.y, e.z};
            for (int turn = 0; turn < 2; turn++) {
                double g[24] = {0};
                for (int k = 0; k < 3; k++) {
                    int row = 3 * turn + k; // rows of constrained unknowns stay unit rows
                    g[row] = contact_free_dofs(&w->chain, i) >> row & 1 ? -coupling * t[k] : 0;
                    g[size + row] = contact_free_dofs(&w->chain, i + 1) >> row & 1 ? coupling * t[k] : 0;
                }
                g[tool + turn] = 1;
                g[size + tool + turn] = -1;
                add_spring(p, i, turn ? 20 : 2000, g);
            }
        }
    }
}

static void scene_create(ChainScene *w, Vessel **vessel)
{
    ChainSceneOptions o = chain_scene_default_options();
    o.elements = 120;
    o.vessel = *vessel = chain_scene_spiral(0.5, true);
    chain_scene_create(w, &o);
}

static void scene_advance(ChainScene *w, int steps)
{
    ContactOptions o = contact_default_options();
    for (int i = 0; i < steps; i++) {
        chain_scene_prepare(w, 0.05, 0.005);
        assert_true(contact_solve(&(ContactProblem){w->solver, &w->chain, w->factor, w->b, &w->set, &o, w->u}).converged);
        chain_scene_finish(w);
    }
    chain_scene_prepare(w, 0.05, 0.005);
}

// Unknowns that are not coupled to the first six do not change them; if they are coupled, the laws hold.
static void more_unknowns(void **state)
{
    (void)state;
    ChainScene w;
    Vessel *vessel;
    scene_create(&w, &vessel);
    for (int stage = 0; stage < WHOLE_OR_SHORT(5, 3); stage++) {
        scene_advance(&w, 100);
        ContactOptions o = contact_default_options();
        ContactPoint *start = malloc((size_t)w.set.count * sizeof *start);
        memcpy(start, w.set.point, (size_t)w.set.count * sizeof *start);
        for (int form = 0; form < (stage == 2 ? 2 : 1); form++) {
            o.tolerance = 1e-8;
            o.form = form ? CONTACT_POINTWISE : CONTACT_BLOCK;
            o.max_iterations = form ? 100000 : 200;
            for (int t = 0; t < 3; t++) {
                Problem p;
                memcpy(w.set.point, start, (size_t)w.set.count * sizeof *start);
                embed(&w, sizes[t], 0, 0.5, 0, &p);
                ContactReport b = solve(&p, o.form, o.max_iterations, o.tolerance);
                ContactReport a = contact_solve(&(ContactProblem){w.solver, &w.chain, w.factor, w.b, &w.set, &o, w.u});
                assert_true(a.converged && b.converged);
                assert_int_equal(a.iterations, b.iterations);
                assert_int_equal(a.active, b.active);
                assert_true(a.active > 0 || stage == 0);
                double *alone = malloc((size_t)(p.nodes * p.size) * sizeof *alone);
                block_factor_solve(p.factor, p.b, alone);
                for (int i = 0; i < w.nodes; i++)
                    for (int q = 0; q < p.size; q++)
                        assert_true(fabs(p.u[p.size * i + q] - (q < 6 ? w.u[6 * i + q] : alone[p.size * i + q])) < 1e-11);
                for (int k = 0; k < w.set.count; k++)
                    assert_true(vec3_distance(p.set.point[k].force, w.set.point[k].force) <= 1e-8 * a.largest);
                free(alone);
                destroy(&p);
                memcpy(w.set.point, start, (size_t)w.set.count * sizeof *start);
                embed(&w, sizes[t], 0.8, 0.5, 0, &p);
                b = solve(&p, o.form, o.max_iterations, o.tolerance);
                assert_true(b.converged);
                assert_laws(&p, 1e-8);
                destroy(&p);
            }
        }
        // the state before any form was tried
        memcpy(w.set.point, start, (size_t)w.set.count * sizeof *start);
        free(start);
    }
    chain_scene_destroy(&w);
    vessel->destroy(vessel);
}

// Slides of all tools at every third node up to every node, from weak to strong, with contacts of the wall: the laws hold, and both forms give the same result.
static void slides_and_walls(void **state)
{
    (void)state;
    ChainScene w;
    Vessel *vessel;
    scene_create(&w, &vessel);
    int most = 0, solves = 0, sum = 0, warm = 0;
    for (int stage = 0; stage < WHOLE_OR_SHORT(5, 3); stage++) {
        scene_advance(&w, 100);
        for (int trial = 0; trial < WHOLE_OR_SHORT(12, 6); trial++) {
            Problem p;
            int size = sizes[trial % 3], every = 1 + trial / 3 % 3, tools = (size - 6) / 2, places = (w.nodes - 1) / every;
            const double coupling = trial % 2 ? 0.8 : 0.1, bounds[] = {1e-3, 1e-2, 0.1};
            embed(&w, size, coupling, 1, tools * places, &p);
            for (int k = 0; k < p.set.slide_count; k++) // not in the order of the chain
                p.set.slide[k] = (ContactSlide){.node = every * (k % places),
                                                .unknown = 6 + 2 * (k / places),
                                                .radius = 0.1 + 0.05 * (k / places),
                                                .bound = bounds[stage % 3] * (1.1 + uniform()),
                                                .give = 1e-4};
            for (int k = 0; k < p.set.slide_count; k++) {
                ContactSlide *c = &p.set.slide[k];
                c->held[0] = 0.7 * c->bound * uniform(), c->held[1] = 0.7 * c->bound * uniform();
            }
            if (trial == 4) // a tool that is absent from half of the wire
                for (int i = 0; i < w.nodes / 2; i++) {
                    unit_row(&p, i, 6, 0);
                    unit_row(&p, i, 7, 0);
                }
            size_t bytes = (size_t)p.set.slide_count * sizeof *p.set.slide, walls = (size_t)p.set.count * sizeof *p.set.point;
            ContactSlide *start = memcpy(malloc(bytes), p.set.slide, bytes), *first = malloc(bytes);
            ContactPoint *points = memcpy(malloc(walls + 1), p.set.point, walls);
            double *u = malloc((size_t)(p.nodes * size) * sizeof *u);
            ContactReport r = solve(&p, CONTACT_BLOCK, 200, 1e-6);
            most = r.iterations > most ? r.iterations : most;
            sum += r.iterations;
            solves++;
            if (!r.converged)
                print_message("stage %d trial %d: residual %.1e after %d\n", stage, trial, r.residual, r.iterations);
            assert_true(r.converged && r.cone_violation < 1e-9);
            assert_laws(&p, 1e-6);
            memcpy(u, p.u, (size_t)(p.nodes * size) * sizeof *u);
            memcpy(first, p.set.slide, bytes);
            // bit-identical again from the same set and the same expected motion
            memset(p.u, 0, (size_t)(p.nodes * size) * sizeof *u);
            memcpy(p.set.slide, start, bytes);
            memcpy(p.set.point, points, walls);
            solve(&p, CONTACT_BLOCK, 200, 1e-6);
            assert_memory_equal(u, p.u, (size_t)(p.nodes * size) * sizeof *u);
            // a start from its own solution needs few iterations
            r = solve(&p, CONTACT_BLOCK, 200, 1e-6);
            warm = r.iterations > warm ? r.iterations : warm;
            assert_true(r.converged);
            if (stage == 2 && trial < WHOLE_OR_SHORT(3, 1)) {         // tens of thousands of sweeps
                memcpy(p.set.slide, start, bytes);
                memcpy(p.set.point, points, walls);
                r = solve(&p, CONTACT_POINTWISE, 400000, 1e-8);
                assert_true(r.converged);
                assert_laws(&p, 1e-8);
                for (int k = 0; k < p.set.slide_count; k++)
                    assert_true(hypot(first[k].force[0] - p.set.slide[k].force[0], first[k].force[1] - p.set.slide[k].force[1]) < 1e-4 * r.largest);
            }
            free(start);
            free(first);
            free(points);
            free(u);
            destroy(&p);
        }
    }
    print_message("slides with walls: %d solves, %.1f factorisations on average, up to %d, and up to %d from their solution\n", solves, (double)sum / solves,
                  most, warm);
    assert_true(warm <= 3);
    chain_scene_destroy(&w);
    vessel->destroy(vessel);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gives_and_holds), cmocka_unit_test(held_and_frictionless), cmocka_unit_test(chain_takes_off_bounds),
        cmocka_unit_test(more_unknowns),   cmocka_unit_test(slides_and_walls),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
