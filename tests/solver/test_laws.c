// Laws that hold for any wire: no force at rest, invariance under rigid motion, force and tangent as derivatives, energy, momentum, reciprocity,
// reactions without spikes, damping of strain alone. Laws of the single element are in test_beam_element.c, mirrored runs also in test_step.c.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "base/simd.h"
#include "solver/beam.h"
#include "solver/step_internal.h"
#include "wire_scene.h"

static uint64_t seed = 11;

static double draw_unit(void)          // in [-1, 1]
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) * 0x1p-52 - 1;
}
static Vec3 random_vec(double scale)
{
    double x = draw_unit(), y = draw_unit(), z = draw_unit();
    return vec3(scale * x, scale * y, scale * z);
}
static Quat random_turn(void) { return quat_from_rotation_vector(vec3_scale(vec3_unit(random_vec(1)), 3 * draw_unit())); }

// --- a chain without a stepper ---

enum { E = 40, M = E + 1, PADDED = M + BEAM_PADDING, UNKNOWNS = 6 * M };
typedef struct Chain {
    double array[BEAM_REST_ARRAYS + BEAM_POSE_ARRAYS + BEAM_INERTIA_ARRAYS + 1][PADDED];
    BeamChain beam;
    BlockChain blocks;
    Vec3 x[M];
    Quat q[M];
} Chain;

// Sections: straight, curved in two planes, thin and soft, a tube. Diameter, stiffness, curvature and its plane jump at every border.
static const WireSection motley[] = {
    {.length = 20, .diameter = 0.36, .young_modulus = 80e3, .poisson_ratio = 0.3, .density = 6.45e-3, .friction = -1},
    {.length = 15, .diameter = 0.36, .young_modulus = 80e3, .poisson_ratio = 0.3, .density = 6.45e-3, .rest_curvature = 0.12, .friction = -1},
    {.length = 10,
     .diameter = 0.9,
     .inner_diameter = 0.7,
     .young_modulus = 2e3,
     .poisson_ratio = 0.45,
     .density = 2e-3,
     .rest_curvature = -0.2,
     .rest_plane = 1.1,
     .friction = -1},
    {.length = 8, .diameter = 0.2, .young_modulus = 500, .poisson_ratio = 0.48, .density = 1e-2, .rest_plane = -2, .rest_curvature = 0.3, .friction = -1}};
enum { SECTIONS = sizeof motley / sizeof *motley };

// The rest shape: successive arcs from the origin, with curvatures times `curl`.
static void chain_at_rest(Chain *c, double curl)
{
    *c = (Chain){0};
    BeamRest *r = &c->beam.rest;
    BeamPose *p = &c->beam.pose;
    BeamInertia *m = &c->beam.inertia;
    double **array[] = {&r->length,  &r->extend, &r->axial, &r->near, &r->far, &r->twist, &r->half_w, &r->half_y, &r->half_z,   &r->curvature,
                        &r->bending, &r->shear,  &p->x,     &p->y,    &p->z,   &p->qw,    &p->qx,     &p->qy,     &p->qz,       &m->mass,
                        &m->lateral, &m->excess, &m->ax,    &m->ay,   &m->az,  &m->tx,    &m->ty,     &m->tz,     &c->beam.drag};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++)
        *array[k] = c->array[k];
    WireOptions options = wire_default_options();
    options.elements = E;
    WireSection section[SECTIONS];
    for (int i = 0; i < SECTIONS; i++) {
        section[i] = motley[i];
        section[i].rest_curvature *= curl;
    }
    options.section = section;
    options.section_count = SECTIONS;
    Wire wire;
    char why[256];
    assert_true(wire_create(&wire, &options, why, sizeof why));
    wire_rest(&wire, &options, r);
    c->x[0] = vec3(0, 0, 0);
    c->q[0] = quat_identity();
    for (int i = 0; i < E; i++) {
        const WireSection *s = &section[wire.section[i]];
        double k = s->rest_curvature, length = wire.length[i], angle = k * length;
        Vec3 normal = vec3(0, cos(s->rest_plane), sin(s->rest_plane)), axis = vec3(0, -sin(s->rest_plane), cos(s->rest_plane));
        Vec3 d = k == 0 ? vec3(length, 0, 0) : vec3_add_scaled(vec3(sin(angle) / k, 0, 0), (1 - cos(angle)) / k, normal);
        c->x[i + 1] = vec3_add(c->x[i], quat_rotate(c->q[i], d));
        c->q[i + 1] = quat_unit(quat_mul(c->q[i], quat_from_rotation_vector(vec3_scale(axis, angle))));
    }
    wire_destroy(&wire);
    assert_true(block_chain_create(&c->blocks, M, 6));
}

static void chain_bend(Chain *c, double scale)
{
    for (int i = 0; i < M; i++) {
        c->x[i] = vec3_add(c->x[i], random_vec(scale));
        c->q[i] = quat_unit(quat_mul(quat_from_rotation_vector(random_vec(scale)), c->q[i]));
    }
}

// b = force on the nodes; blocks.
static void chain_force(Chain *c, double *b)
{
    const BeamPose *p = &c->beam.pose;
    for (int i = 0; i < M; i++) {
        p->x[i] = c->x[i].x, p->y[i] = c->x[i].y, p->z[i] = c->x[i].z;
        p->qw[i] = c->q[i].w, p->qx[i] = c->q[i].x, p->qy[i] = c->q[i].y, p->qz[i] = c->q[i].z;
    }
    beam_chain_assemble(&c->beam, 0, E, 1, 0, &c->blocks, b);
}

static double chain_energy(const Chain *c)
{
    const BeamRest *r = &c->beam.rest;
    double energy = 0;
    for (int i = 0; i < E; i++) {
        BeamInput in = {.x1 = c->x[i],
                        .x2 = c->x[i + 1],
                        .q1 = c->q[i],
                        .q2 = c->q[i + 1],
                        .length = r->length[i],
                        .extend = r->extend[i],
                        .axial = r->axial[i],
                        .near = r->near[i],
                        .far = r->far[i],
                        .twist = r->twist[i],
                        .half_w = r->half_w[i],
                        .half_y = r->half_y[i],
                        .half_z = r->half_z[i]};
        BeamOutput out;
        beam_element(&in, &out);
        energy += out.energy;
    }
    return energy;
}

static double largest(const double *a, int first, int step, int count)
{
    double most = 0;
    for (int i = first; i < count; i += step)
        for (int k = 0; k < 3; k++)
            most = fmax(most, fabs(a[i + k]));
    return most;
}

static void no_force_at_rest_nor_at_borders(void **state)
{
    (void)state;
    static Chain c;
    double b[UNKNOWNS], bent[UNKNOWNS];
    chain_at_rest(&c, 1);
    chain_force(&c, b);
    double energy = chain_energy(&c);
    chain_bend(&c, 1e-2);        // the force for a hundredth of a millimetre and radian
    chain_force(&c, bent);
    double force = largest(b, 0, 6, UNKNOWNS) / largest(bent, 0, 6, UNKNOWNS), moment = largest(b, 3, 6, UNKNOWNS) / largest(bent, 3, 6, UNKNOWNS);
    print_message("at rest: force %.1e, moment %.1e of those of a random 0.01 mm and rad; energy %.1e mJ\n", force, moment, energy);
    assert_true(force < 1e-12 && moment < 1e-12 && energy < 1e-20);
    block_chain_destroy(&c.blocks);
}

static void rigid_motion_of_a_bent_chain(void **state)
{
    (void)state;
    static Chain c, moved;
    double b[UNKNOWNS], there[UNKNOWNS];
    chain_at_rest(&c, 1);
    chain_at_rest(&moved, 1);
    chain_bend(&c, 0.05);
    chain_force(&c, b);
    double energy = chain_energy(&c), worst = 0;
    for (int trial = 0; trial < 20; trial++) {
        Quat turn = random_turn();
        Vec3 shift = random_vec(100);
        for (int i = 0; i < M; i++) {
            moved.x[i] = vec3_add(shift, quat_rotate(turn, c.x[i]));
            moved.q[i] = quat_mul(turn, c.q[i]);
        }
        chain_force(&moved, there);
        worst = fmax(worst, fabs(chain_energy(&moved) / energy - 1));
        double force = largest(b, 0, 6, UNKNOWNS), moment = largest(b, 3, 6, UNKNOWNS);
        for (int i = 0; i < 2 * M; i++) {
            Vec3 here = quat_rotate(turn, vec3(b[3 * i], b[3 * i + 1], b[3 * i + 2]));
            worst = fmax(worst, vec3_distance(here, vec3(there[3 * i], there[3 * i + 1], there[3 * i + 2])) / (i % 2 ? moment : force));
        }
    }
    print_message("rigid motion: energy and forces differ by %.1e\n", worst);
    assert_true(worst < 1e-10);
    block_chain_destroy(&c.blocks);
    block_chain_destroy(&moved.blocks);
}

static void move_by(Chain *c, const double *u, double scale)
{
    for (int i = 0; i < M; i++) {
        c->x[i] = vec3_add_scaled(c->x[i], scale, vec3(u[6 * i], u[6 * i + 1], u[6 * i + 2]));
        c->q[i] = quat_mul(quat_from_rotation_vector(vec3_scale(vec3(u[6 * i + 3], u[6 * i + 4], u[6 * i + 5]), scale)), c->q[i]);
    }
}

static void force_is_the_derivative_of_energy(void **state)
{
    (void)state;
    static Chain c, side;
    double b[UNKNOWNS], u[UNKNOWNS], before = 0;
    chain_at_rest(&c, 1);
    chain_bend(&c, 0.05);
    chain_force(&c, b);
    double power = 0;
    for (int k = 0; k < UNKNOWNS; k++) {
        u[k] = draw_unit();
        power -= b[k] * u[k];
    }
    for (double h = 4e-3; h > 4e-4; h /= 2) {
        double energy[2];
        for (int s = 0; s < 2; s++) {
            side = c;
            move_by(&side, u, s ? h : -h);
            energy[s] = chain_energy(&side);
        }
        double error = fabs((energy[1] - energy[0]) / (2 * h) / power - 1);
        print_message("dE/dx against the force: h %.0e error %.2e\n", h, error);
        if (before > 0)
            assert_true(before / error > 3.8 && before / error < 4.2);       // second order
        before = error;
    }
    assert_true(before < 1e-4);
    block_chain_destroy(&c.blocks);
}

// The largest difference of the tangent at rest from central differences of the force with step h, over the largest entry of the product.
static double tangent_error(double curl, double h)
{
    static Chain c, side;
    double b[UNKNOWNS], u[UNKNOWNS], product[UNKNOWNS], force[2][UNKNOWNS], error = 0;
    chain_at_rest(&c, curl);
    chain_at_rest(&side, curl);
    chain_force(&c, b);
    seed = 5;
    for (int k = 0; k < UNKNOWNS; k++)
        u[k] = draw_unit();
    block_chain_multiply(&c.blocks, u, product);
    double size = fmax(largest(product, 0, 6, UNKNOWNS), largest(product, 3, 6, UNKNOWNS));
    for (int s = 0; s < 2; s++) {
        memcpy(side.x, c.x, sizeof c.x);
        memcpy(side.q, c.q, sizeof c.q);
        move_by(&side, u, s ? h : -h);
        chain_force(&side, force[s]);
    }
    for (int k = 0; k < UNKNOWNS; k++)
        error = fmax(error, fabs((force[0][k] - force[1][k]) / (2 * h) - product[k]) / size);
    block_chain_destroy(&c.blocks);
    block_chain_destroy(&side.blocks);
    return error;
}

// At rest no part of the tangent is neglected: it is the derivative of the force, for straight and curved wires.
static void tangent_is_the_derivative_of_force(void **state)
{
    (void)state;
    double before = 0;
    for (double h = 4e-4; h > 4e-5; h /= 2) {
        double error = tangent_error(0, h);
        print_message("tangent against the force's derivative: straight, h %.0e error %.2e\n", h, error);
        if (before > 0)
            assert_true(before / error > 3.6 && before / error < 4.4);
        before = error;
    }
    for (double curl = 1; curl > 0.2; curl /= 2) {
        double error = tangent_error(curl, 1e-6);
        print_message("tangent against the force's derivative: curvature x %.2f error %.2e\n", curl, error);
        assert_true(error < 1e-8);       // rounding of the difference
    }
}

// --- runs ---

static void bench_motley(Bench *b, int elements, double dt)
{
    bench_start(b, 1, elements, dt);
    memcpy(b->section, motley, sizeof motley);
    b->options.wire.section_count = SECTIONS;
}

static double energy_of(const Stepper *s) { return stepper_elastic_energy(s) + stepper_kinetic_energy(s); }

// Returns the largest growth in a step, over the energy at the start.
static double growth(Stepper *s, int steps, double *lost)
{
    double first = energy_of(s), last = first, most = 0;
    for (int k = 0; k < steps; k++) {
        step_once(s, 0, 0);
        double now = energy_of(s);
        most = fmax(most, (now - last) / first);
        last = now;
    }
    *lost = 1 - last / first;
    stepper_destroy(s);
    return most;
}

// Loaded until it is at rest, then released.
static Stepper *plucked(Bench *b, Vec3 force, double dt)
{
    WireOptions *w = &b->options.wire;
    double damping = w->damping_stiffness;
    b->options.dt = QUASI_STATIC;
    w->damping_stiffness = 0;
    double total = 0;
    for (int i = 0; i < w->section_count; i++)
        total += b->section[i].length;
    bench_load(b, total, force, vec3(0, 0, 0), 20 * QUASI_STATIC);
    Stepper *loaded = bench_make(b);
    settle(loaded, 25, 120, 1e-9);
    b->options.dt = dt;
    w->load_count = 0;
    w->damping_stiffness = damping;
    Stepper *s = bench_make(b);
    Checkpoint *bent = stepper_save(loaded, NULL);
    stepper_restore(s, bent);
    checkpoint_free(bent);
    stepper_destroy(loaded);
    return s;
}

static void energy_never_grows(void **state)
{
    (void)state;
    for (int damped = 0; damped < 2; damped++)
        for (int kind = 0; kind < 4; kind++)
            for (int hard = 0; hard < 2; hard++) {
                static const char *const name[] = {"straight", "curved", "sections", "in a sheath"};
                Bench b;
                if (kind < 2) {
                    bench_start(&b, 60, 40, 1);
                    b.section[0].rest_curvature = kind * 0.03;
                } else {
                    bench_motley(&b, 60, 1);
                }
                if (kind == 3) {
                    b.options.wire.fix_count = 0;
                    b.options.wire.has_sheath = true;
                    b.options.wire.inserted = 33.4;
                }
                b.options.wire.damping_stiffness = damped * 0.2;
                double size = kind < 2 ? 0.2 : 1e-3, most[2], lost[2];
                for (int fine = 0; fine < 2; fine++) {
                    Bench own = b;
                    own.options.wire.section = own.section, own.options.wire.fix = own.fix, own.options.wire.load = own.load;
                    Stepper *s = plucked(&own, vec3(0, hard ? -0.6 * size : 0.02 * size, hard ? size : 0), fine ? 0.1 : 1);
                    most[fine] = growth(s, 100 * (fine ? 10 : 1), &lost[fine]);
                }
                print_message("energy: %-11s plucked %-6s %-8s grows in a step of 1 and 0.1 ms by %.0e, %.0e at most; gone in 0.1 s %.3f, %.3f\n", name[kind],
                              hard ? "hard" : "softly", damped ? "damped" : "undamped", most[0], most[1], lost[0], lost[1]);
                assert_true(most[0] < 1e-8 && most[1] < 1e-8);
            }
}

// A whole run of a wire with all sections, pushed, rotated and loaded; the same moved rigidly and mirrored.
static Stepper *wandering(Quat turn, Vec3 shift, double mirror)
{
    Bench b;
    bench_motley(&b, 50, 1);
    WireOptions *w = &b.options.wire;
    for (int i = 0; i < SECTIONS; i++)
        b.section[i].rest_plane *= mirror;
    w->fix_count = 0;
    w->has_sheath = true;
    w->inserted = 20;
    w->damping_stiffness = 0.2;
    w->start = shift;
    w->direction = quat_rotate(turn, vec3(1, 0, 0));
    w->normal = quat_rotate(turn, vec3(0, 1, 0));
    w->gravity = quat_rotate(turn, vec3(1e-3, -5e-3, mirror * 4e-3));
    bench_load(&b, 50.3, quat_rotate(turn, vec3(0, 1e-4, mirror * 2e-4)), quat_rotate(turn, vec3(mirror * 1e-4, 0, 1e-4)), 50);
    return bench_make(&b);
}

static void runs_move_rigidly_and_mirror(void **state)
{
    (void)state;
    double worst = 0, force = 0, mirrored = 0;
    for (int trial = 0; trial < 3; trial++) {
        Quat turn = random_turn();
        Vec3 shift = random_vec(50);
        Stepper *plain = wandering(quat_identity(), vec3(0, 0, 0), 1), *moved = wandering(turn, shift, 1),
                *mirror = wandering(quat_identity(), vec3(0, 0, 0), -1);
        for (int k = 0; k < 300; k++) {
            double advance = k < 200 ? 0.05 : -0.05, twist = k < 100 ? 0.01 : -0.006;
            const StepReport *a = step_once(plain, advance, twist), *c = step_once(moved, advance, twist), *m = step_once(mirror, advance, -twist);
            Vec3 here = tip_of(plain), there = vec3_add(shift, quat_rotate(turn, here)), other = tip_of(mirror);
            worst = fmax(worst, vec3_distance(there, tip_of(moved)));
            mirrored = fmax(mirrored, vec3_distance(here, vec3(other.x, other.y, -other.z)));
            force = fmax(force, fmax(fabs(a->proximal_force - c->proximal_force), fabs(a->proximal_torque - c->proximal_torque)));
            force = fmax(force, fmax(fabs(a->proximal_force - m->proximal_force), fabs(a->proximal_torque + m->proximal_torque)));
        }
        stepper_destroy(plain);
        stepper_destroy(moved);
        stepper_destroy(mirror);
    }
    print_message("runs: moved rigidly the tip is %.1e mm off, mirrored %.1e mm, reactions %.1e N and N mm\n", worst, mirrored, force);
    assert_true(worst < 1e-7 && mirrored < 1e-9 && force < 1e-6);
}

// --- a wire that flies ---

static Vec3 momentum(const Stepper *s, const Wire *wire, Vec3 *angular)
{
    const WireState *w = stepper_state(s);
    Vec3 linear = vec3(0, 0, 0), about = vec3(0, 0, 0);
    for (int i = 0; i < w->node_count; i++) {
        Vec3 p = vec3_scale(w->velocity[i], wire->mass[i]), axis = quat_rotate(w->orientation[i], vec3(1, 0, 0));
        linear = vec3_add(linear, p);
        about = vec3_add(about, vec3_cross(w->position[i], p));
        about = vec3_add_scaled(about, wire->inertia_lateral[i], w->spin[i]);
        about = vec3_add_scaled(about, (wire->inertia_axial[i] - wire->inertia_lateral[i]) * vec3_dot(axis, w->spin[i]), axis);
    }
    *angular = about;
    return linear;
}

typedef struct Flight {
    double linear, angular, energy;      // relative losses
} Flight;

// A free wire that flies for `time` and rotates at `rate` [rad/ms] about its centre.
static Flight fly(const Bench *bench, double rate, double time)
{
    Bench b = *bench;
    b.options.wire.section = b.section;
    b.options.wire.fix = b.fix;
    b.options.wire.load = b.load;
    Stepper *s = bench_make(&b);
    Wire wire;
    char why[256];
    assert_true(wire_create(&wire, &b.options.wire, why, sizeof why));
    // velocities are those of the state; the start must not depend on elements
    WireState *w = (WireState *)(uintptr_t)stepper_state(s);
    Vec3 centre = vec3(wire.total_length / 2, 0, 0), axis = vec3(0, 0.6 * rate, 0.8 * rate);
    for (int i = 0; i < w->node_count; i++) {
        w->velocity[i] = vec3_add(vec3(0.3, 0.1, -0.2), vec3_cross(axis, vec3_sub(w->position[i], centre)));
        w->spin[i] = axis;
    }
    Vec3 angular, later, linear = momentum(s, &wire, &angular);
    double energy = energy_of(s);
    for (int k = 0; k < (int)(time / b.options.dt + 0.5); k++)
        step_once(s, 0, 0);
    // about the centre of mass, which moves with the linear momentum
    Vec3 after = momentum(s, &wire, &later);
    Flight f = {.linear = vec3_distance(after, linear) / vec3_norm(linear),
                .angular = vec3_distance(later, angular) / vec3_norm(angular),
                .energy = 1 - energy_of(s) / energy};
    wire_destroy(&wire);
    stepper_destroy(s);
    return f;
}

static void momentum_of_a_flying_wire(void **state)
{
    (void)state;
    Flight before = {0};
    for (double h = 1; h > 0.2; h /= 2) {
        Bench b;
        bench_start(&b, 60, 30, h);
        b.options.wire.fix_count = 0;
        Flight f = fly(&b, 0.02, 100);
        print_message("flying: h %.2f ms, 100 ms: linear momentum off by %.1e, angular by %.3e, energy by %.3e\n", h, f.linear, f.angular, f.energy);
        assert_true(f.linear < 1e-7);
        // implicit Euler: the motion is along a chord of the circle, and the velocity across it is lost: first order in h
        if (before.angular > 0)
            assert_true(before.angular / f.angular > 1.8 && before.angular / f.angular < 2.2);
        before = f;
    }
}

// Stiffness damping acts only on strain: the loss of a rotating wire is the same with and without it, to first order in h.
static void damping_leaves_rigid_rotation_alone(void **state)
{
    (void)state;
    for (double rate = 0.02; rate < 1.3; rate *= 8) {
        for (double h = 1; h > 0.2; h /= 2) {
            Flight f[2];
            for (int damped = 0; damped < 2; damped++) {
                Bench b;
                bench_start(&b, 20, 20, h);
                b.options.wire.fix_count = 0;
                b.options.wire.damping_stiffness = damped * 0.2;
                f[damped] = fly(&b, rate, 5 / rate);
            }
            print_message("spinning at %.2f rad/ms, h %.2f ms, 5 rad: energy lost %.5f, damped %.5f\n", rate, h, f[0].energy, f[1].energy);
            assert_true(fabs(f[1].energy - f[0].energy) < 0.02 * rate * h);
        }
    }
}

// Reciprocity: a small force at A moves B as much as the same force at B moves A.
static void reciprocity(void **state)
{
    (void)state;
    double moved[2];
    for (int k = 0; k < 2; k++) {
        Bench b;
        bench_motley(&b, 50, QUASI_STATIC);
        double at[2] = {52, 31.7};
        Vec3 force[2] = {vec3(0, 1e-9, 0), vec3(0, 0, 1e-9)};
        // first bent at rest: the reference without the force
        Stepper *s = bench_make(&b);
        settle(s, 30, 200, 1e-13);
        Checkpoint *rest = stepper_save(s, NULL);
        stepper_destroy(s);
        bench_load(&b, at[k], force[k], vec3(0, 0, 0), 0);
        Stepper *loaded = bench_make(&b);
        stepper_restore(loaded, rest);
        const WireState *w = stepper_state(loaded);
        Wire wire;
        char why[256];
        assert_true(wire_create(&wire, &b.options.wire, why, sizeof why));
        int node = 0;
        while (node + 2 < w->node_count && wire.s[node + 1] <= at[1 - k])
            node++;
        double share = (at[1 - k] - wire.s[node]) / wire.length[node];
        Vec3 before = vec3_mix(w->position[node], w->position[node + 1], share);
        settle(loaded, 10, 60, 1e-14);
        Vec3 d = vec3_sub(vec3_mix(w->position[node], w->position[node + 1], share), before);
        moved[k] = vec3_dot(d, vec3_scale(force[1 - k], 1e9));
        checkpoint_free(rest);
        wire_destroy(&wire);
        stepper_destroy(loaded);
    }
    print_message("reciprocity: %.9e and %.9e mm\n", moved[0], moved[1]);
    assert_true(fabs(moved[0]) > 1e-9 && fabs(moved[0] / moved[1] - 1) < 1e-5);
}

// --- reactions while nodes pass the mouth ---

typedef struct Trace {
    double force_mean, torque_mean;      // of the absolute values
    double force_jump, torque_jump;      // largest in a step
    double beyond;                       // spike: distance of a force from the range of its neighbours 20 steps before and after
} Trace;

// Fed at `speed` [mm/ms] after the loads are applied.
static Trace feed(Stepper *s, double speed, double twist, int steps)
{
    enum { AWAY = 20 };
    double *force = malloc((size_t)steps * sizeof *force), torque = 0;
    assert_non_null(force);
    for (int k = 0; k < 1500; k++)
        step_once(s, 0, 0);
    for (int k = 0; k < 200; k++)
        step_once(s, speed, twist);
    Trace t = {0};
    for (int k = 0; k < steps; k++) {
        const StepReport *r = step_once(s, speed, twist);
        force[k] = r->proximal_force;
        t.force_mean += fabs(force[k]) / steps;
        t.torque_mean += fabs(r->proximal_torque) / steps;
        if (k > 0) {
            t.force_jump = fmax(t.force_jump, fabs(force[k] - force[k - 1]));
            t.torque_jump = fmax(t.torque_jump, fabs(r->proximal_torque - torque));
        }
        torque = r->proximal_torque;
    }
    for (int k = AWAY; k + AWAY < steps; k++)
        t.beyond = fmax(t.beyond, fmax(force[k] - fmax(force[k - AWAY], force[k + AWAY]), fmin(force[k - AWAY], force[k + AWAY]) - force[k]));
    free(force);
    return t;
}

static void no_spike_as_nodes_pass_the_mouth(void **state)
{
    (void)state;
    static const char *const name[] = {"straight", "J", "J, turned", "soft tip", "soft J"};
    for (int kind = 0; kind < 5; kind++)
        for (int pull = 0; pull < 2; pull++) {
            Bench b;
            bench_start(&b, 60, 60, 1);
            WireOptions *w = &b.options.wire;
            w->fix_count = 0;
            w->has_sheath = true;
            w->inserted = 20;
            w->damping_stiffness = 0.2;
            w->damping_mass = 1e-4;
            if (kind > 0) {
                b.section[0].length = 45;
                b.section[1] = standard_section(15);
                b.section[1].rest_curvature = kind == 3 ? 0 : 0.1;
                b.section[1].young_modulus = kind >= 3 ? 8e3 : 80e3;
                w->section_count = 2;
            }
            bool border = kind >= 3;         // a border passes the mouth, at 15 mm
            if (border)
                w->inserted = pull ? 17 : 13;
            bench_load(&b, 60, vec3(0, -0.002, 0.001), vec3(0, 0, 0.5), 200);
            Stepper *s = bench_make(&b);
            Trace t = feed(s, pull ? -0.001 : 0.001, kind == 2 ? 0.001 : 0, 4000);
            print_message("%s at 1 mm/s, %-9s: force %.2e N, jumps %.3f %% in a step, spikes %.3f %%; torque %.2e N mm, jumps %.3f %%\n",
                          pull ? "pull" : "push", name[kind], t.force_mean, 100 * t.force_jump / t.force_mean, 100 * t.beyond / t.force_mean, t.torque_mean,
                          100 * t.torque_jump / t.torque_mean);
            assert_true(t.beyond < 0.02 * t.force_mean);
            // where the stiffness at the mouth changes, the configurational push -M^2 / 2 EI really jumps
            if (!border)
                assert_true(t.force_jump < 0.01 * t.force_mean);
            if (kind > 0)
                assert_true(t.torque_jump < 0.01 * t.torque_mean);
            stepper_destroy(s);
        }
}

// --- times ---

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Printed, not checked: median CPU time of the two stages, for a moving wire of 220 mm with a curved tip. The hash of the state must not depend on the SIMD
// level.
static void times_of_assembly_and_correction(void **state)
{
    (void)state;
    enum { TIMES = 101 };
    for (int n = 50; n <= 800; n *= 2) {
        uint64_t hash = 0;
        for (int level = 0; level <= (int)simd_widest(); level++) {
            Bench b;
            bench_start(&b, 200, n, 1);
            b.section[1] = standard_section(20);
            b.section[1].rest_curvature = 0.05;
            b.options.wire.section_count = 2;
            b.options.wire.fix_count = 0;
            b.options.wire.has_sheath = true;
            b.options.wire.inserted = 200;
            b.options.wire.damping_stiffness = 0.2;
            bench_load(&b, 220, vec3(0, 0.002, 0.001), vec3(0, 0, 0), 0);
            Stepper *s = bench_make(&b);
            simd_force((SimdLevel)level);
            double assembly[TIMES], correction[TIMES], clock = HUGE_VAL;
            for (int k = 0; k < TIMES; k++) {
                step_feed(s, (StepCommand){.advance = 0.01, .twist = 0.002});
                double t0 = now_us(), t1 = now_us();
                clock = fmin(clock, t1 - t0);
                for (int i = 0; i < 5; i++)
                    step_assemble(s);
                assembly[k] = (now_us() - t1) / 5;
                step_factor(s);
                ContactProblem problem = step_contacts(s);
                ContactReport solved = contact_solve(&problem);
                assert_true(stepper_take_contacts(s, &solved));
                t0 = now_us();
                step_correct(s);
                correction[k] = now_us() - t0;
            }
            qsort(assembly, TIMES, sizeof *assembly, ascending);
            qsort(correction, TIMES, sizeof *correction, ascending);
            print_message("%-6s %3d elements: assembly %6.2f us, correction %5.2f us\n", simd_name[level], n, assembly[TIMES / 2] - clock / 5,
                          correction[TIMES / 2] - clock);
            if (level == 0)
                hash = stepper_hash(s);
            assert_true(stepper_hash(s) == hash);
            stepper_destroy(s);
        }
        simd_force(simd_widest());
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_force_at_rest_nor_at_borders),
        cmocka_unit_test(rigid_motion_of_a_bent_chain),
        cmocka_unit_test(force_is_the_derivative_of_energy),
        cmocka_unit_test(tangent_is_the_derivative_of_force),
        cmocka_unit_test(energy_never_grows),
        cmocka_unit_test(runs_move_rigidly_and_mirror),
        cmocka_unit_test(momentum_of_a_flying_wire),
        cmocka_unit_test(damping_leaves_rigid_rotation_alone),
        cmocka_unit_test(reciprocity),
        cmocka_unit_test(no_spike_as_nodes_pass_the_mouth),
        cmocka_unit_test(times_of_assembly_and_correction),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
