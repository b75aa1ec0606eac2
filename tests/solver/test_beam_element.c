// Laws of the beam element: no force at rest, force = -dE/dx, invariance, symmetry, tangent compared with the derivative of the force.
#include "base/simd.h"
#include "solver/beam.h"
#include "solver/node_turn.h"
#include "solver/sheath.h"
#include "solver/wire.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static uint64_t seed = 7;

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

typedef struct OneBeam {
    WireSection section;
    WireOptions options;
    Wire wire;
    BeamRest rest;
    double array[BEAM_REST_ARRAYS];
} OneBeam;

// One element of the standard wire.
static void make(OneBeam *beam, double length, double curvature, double plane)
{
    beam->section = (WireSection){
        .length = length, .diameter = 0.36, .young_modulus = 80e3, .poisson_ratio = 0.3, .density = 6.45e-3, .rest_curvature = curvature, .rest_plane = plane};
    beam->options = wire_default_options();
    beam->options.elements = beam->options.section_count = 1;
    beam->options.section = &beam->section;
    char why[256];
    assert_true(wire_create(&beam->wire, &beam->options, why, sizeof why));
    double *a = beam->array;
    beam->rest = (BeamRest){.length = a,
                            .extend = a + 1,
                            .axial = a + 2,
                            .near = a + 3,
                            .far = a + 4,
                            .twist = a + 5,
                            .half_w = a + 6,
                            .half_y = a + 7,
                            .half_z = a + 8,
                            .curvature = a + 9,
                            .bending = a + 10,
                            .shear = a + 11};
    wire_rest(&beam->wire, &beam->options, &beam->rest);
    wire_destroy(&beam->wire);
}

static BeamInput input_of(const BeamRest *r)
{
    return (BeamInput){.length = r->length[0],
                       .extend = r->extend[0],
                       .axial = r->axial[0],
                       .near = r->near[0],
                       .far = r->far[0],
                       .twist = r->twist[0],
                       .half_w = r->half_w[0],
                       .half_y = r->half_y[0],
                       .half_z = r->half_z[0]};
}

// The exact rest arc, from the origin along +x, bent towards e2 rotated by `plane`.
static void at_rest(BeamInput *in, double length, double curvature, double plane)
{
    double angle = curvature * length;
    Vec3 normal = vec3(0, cos(plane), sin(plane)), axis = vec3(0, -sin(plane), cos(plane));
    in->x1 = vec3(0, 0, 0);
    in->q1 = quat_identity();
    in->q2 = quat_from_rotation_vector(vec3_scale(axis, angle));
    in->x2 = curvature == 0 ? vec3(length, 0, 0) : vec3_add_scaled(vec3(sin(angle) / curvature, 0, 0), (1 - cos(angle)) / curvature, normal);
}

static void deform(BeamInput *in, double scale)
{
    in->x2 = vec3_add(in->x2, random_vec(scale * in->length));
    in->q1 = quat_mul(quat_from_rotation_vector(random_vec(scale)), in->q1);
    in->q2 = quat_mul(quat_from_rotation_vector(random_vec(scale)), in->q2);
}

static const struct Shape {
    double length, curvature, plane;
} shape[] = {{1.5, 0, 0}, {0.4, 0, 0}, {1.5, 0.1, 0}, {1.5, 0.3, 1.1}, {3, -0.4, -2.3}};
enum { SHAPES = sizeof shape / sizeof *shape };

static void no_force_at_rest(void **state)
{
    (void)state;
    for (int k = 0; k < SHAPES; k++) {
        OneBeam beam;
        make(&beam, shape[k].length, shape[k].curvature, shape[k].plane);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, shape[k].length, shape[k].curvature, shape[k].plane);
        BeamOutput out;
        beam_element(&in, &out);
        // EA/L is 5e3 to 2e4 N/mm: rounding of a length of 1 mm is 1e-12 N
        assert_true(vec3_norm(out.force2) < 1e-10);
        assert_true(vec3_norm(out.moment1) < 1e-10 && vec3_norm(out.moment2) < 1e-10);
        assert_true(fabs(out.energy) < 1e-20);
    }
}

static void force_is_minus_energy_gradient(void **state)
{
    (void)state;
    for (int k = 0; k < SHAPES; k++)
        for (int trial = 0; trial < 20; trial++) {
            OneBeam beam;
            make(&beam, shape[k].length, shape[k].curvature, shape[k].plane);
            BeamInput in = input_of(&beam.rest);
            at_rest(&in, shape[k].length, shape[k].curvature, shape[k].plane);
            deform(&in, trial < 10 ? 0.05 : 0.4);
            BeamOutput out;
            beam_element(&in, &out);
            Vec3 axis = vec3_unit(random_vec(1));
            double h = 1e-5, scale = 1e-8 * (in.axial * in.length + in.near);
            double expected[4] = {-vec3_dot(out.force2, axis), vec3_dot(out.force2, axis), vec3_dot(out.moment1, axis), vec3_dot(out.moment2, axis)};
            for (int dof = 0; dof < 4; dof++) {
                double energy[2];
                for (int side = 0; side < 2; side++) {
                    BeamInput moved = in;
                    Vec3 d = vec3_scale(axis, side ? h : -h);
                    if (dof == 0)
                        moved.x1 = vec3_add(moved.x1, d);
                    if (dof == 1)
                        moved.x2 = vec3_add(moved.x2, d);
                    if (dof == 2)
                        moved.q1 = quat_mul(quat_from_rotation_vector(d), moved.q1);
                    if (dof == 3)
                        moved.q2 = quat_mul(quat_from_rotation_vector(d), moved.q2);
                    BeamOutput o;
                    beam_element(&moved, &o);
                    energy[side] = o.energy;
                }
                assert_true(fabs((energy[1] - energy[0]) / (2 * h) - expected[dof]) < scale);
            }
        }
}

static void rigid_motion_changes_nothing(void **state)
{
    (void)state;
    for (int k = 0; k < SHAPES; k++) {
        OneBeam beam;
        make(&beam, shape[k].length, shape[k].curvature, shape[k].plane);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, shape[k].length, shape[k].curvature, shape[k].plane);
        deform(&in, 0.01);
        BeamOutput here, there;
        beam_element(&in, &here);
        Quat turn = quat_from_rotation_vector(random_vec(2));
        BeamInput moved = in;
        moved.x1 = vec3_add(quat_rotate(turn, in.x1), vec3(3, -2, 5));
        moved.x2 = vec3_add(quat_rotate(turn, in.x2), vec3(3, -2, 5));
        moved.q1 = quat_mul(turn, in.q1);
        moved.q2 = quat_mul(turn, in.q2);
        beam_element(&moved, &there);
        double size = in.axial * in.length;
        assert_true(fabs(there.energy - here.energy) < 1e-10 * here.energy);
        assert_true(vec3_distance(there.force2, quat_rotate(turn, here.force2)) < 1e-12 * size);
        assert_true(vec3_distance(there.moment1, quat_rotate(turn, here.moment1)) < 1e-12 * size);
        assert_true(vec3_distance(there.moment2, quat_rotate(turn, here.moment2)) < 1e-12 * size);
        // no resultant moment either: m1 + m2 + (x2 - x1) x f2 = 0
        Vec3 sum = vec3_add(vec3_add(here.moment1, here.moment2), vec3_cross(vec3_sub(in.x2, in.x1), here.force2));
        assert_true(vec3_norm(sum) < 1e-12 * size);
    }
}

// The same beam seen from its other end (e1 reversed, rotated about e3 by pi), and in the mirror z -> -z.
static void reversed_and_mirrored(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        OneBeam beam;
        make(&beam, shape[k].length, 0, 0);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, shape[k].length, 0, 0);
        deform(&in, 0.2);
        BeamOutput here, there;
        beam_element(&in, &here);
        BeamInput other = in;
        Quat half_turn = {0, 0, 0, 1};
        other.x1 = in.x2, other.x2 = in.x1;
        other.q1 = quat_mul(in.q2, half_turn), other.q2 = quat_mul(in.q1, half_turn);
        beam_element(&other, &there);
        double size = 1e-12 * in.axial * in.length;
        assert_true(fabs(there.energy - here.energy) < 1e-12 * here.energy);
        assert_true(vec3_norm(vec3_add(there.force2, here.force2)) < size);
        assert_true(vec3_distance(there.moment1, here.moment2) < size && vec3_distance(there.moment2, here.moment1) < size);

        BeamInput mirror = in;
        mirror.x1.z *= -1, mirror.x2.z *= -1;
        mirror.q1 = (Quat){in.q1.w, -in.q1.x, -in.q1.y, in.q1.z};
        mirror.q2 = (Quat){in.q2.w, -in.q2.x, -in.q2.y, in.q2.z};
        beam_element(&mirror, &there);
        assert_true(vec3_distance(there.force2, vec3(here.force2.x, here.force2.y, -here.force2.z)) < size);
        assert_true(vec3_distance(there.moment1, vec3(-here.moment1.x, -here.moment1.y, here.moment1.z)) < size);
    }
}

// Twist and constant curvature together are exact: the relative rotation of a helix' ends.
static void twist_is_exact(void **state)
{
    (void)state;
    OneBeam beam;
    make(&beam, 1.5, 0, 0);
    BeamInput in = input_of(&beam.rest);
    at_rest(&in, 1.5, 0, 0);
    for (double angle = 0.001; angle < 1.6; angle *= 2) {
        in.q2 = quat_from_rotation_vector(vec3(angle, 0, 0));
        BeamOutput out;
        beam_element(&in, &out);
        assert_true(fabs(out.moment2.x / (in.twist * angle) - 1) < 2e-7);
        in.q1 = quat_identity();
    }
}

// Central differences of the gradient. The tangent neglects the contribution of moments, so it is compared at rest and under pure tension.
static void tangent_is_the_derivative(void **state)
{
    (void)state;
    for (int k = 0; k < SHAPES; k++) {
        OneBeam beam;
        make(&beam, shape[k].length, k < 2 ? shape[k].curvature : 0, shape[k].plane);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, shape[k].length, 0, 0);
        if (k >= 2)
            in.x2.x *= 1.01;
        BeamOutput out;
        beam_element(&in, &out);
        BeamTangent t;
        beam_tangent(&in, &out, 1, &t);
        double h = 1e-6, largest = in.axial + in.near;
        for (int dof = 0; dof < 12; dof++) {
            double gradient[2][12];
            for (int side = 0; side < 2; side++) {
                BeamInput moved = in;
                double step = side ? h : -h;
                Vec3 d = vec3(dof % 3 == 0 ? step : 0, dof % 3 == 1 ? step : 0, dof % 3 == 2 ? step : 0);
                Vec3 *x = dof < 6 ? &moved.x1 : &moved.x2;
                Quat *q = dof < 6 ? &moved.q1 : &moved.q2;
                if (dof % 6 < 3)
                    *x = vec3_add(*x, d);
                else
                    *q = quat_mul(quat_from_rotation_vector(d), *q);
                BeamOutput o;
                beam_element(&moved, &o);
                Vec3 g[4] = {vec3_negate(o.force2), o.moment1, o.force2, o.moment2};
                for (int i = 0; i < 4; i++)
                    gradient[side][3 * i] = g[i].x, gradient[side][3 * i + 1] = g[i].y, gradient[side][3 * i + 2] = g[i].z;
            }
            for (int row = 0; row < 12; row++) {
                double number = (gradient[1][row] - gradient[0][row]) / (2 * h), closed;
                if (row < 6 && dof < 6)
                    closed = t.k11[row * 6 + dof];
                else if (row >= 6 && dof >= 6)
                    closed = t.k22[(row - 6) * 6 + dof - 6];
                else
                    closed = row >= 6 ? t.k21[(row - 6) * 6 + dof] : t.k21[(dof - 6) * 6 + row];
                // under tension the chord is 1 % longer than L: the contribution of the bow follows L
                assert_true(fabs(number - closed) < (k < 2 ? 1e-6 : 2e-3) * largest);
            }
        }
    }
}

// With bending the tangent is J' C J with J linearised: positive semi-definite, and the axial part exact to first order in the angles.
static void tangent_is_positive(void **state)
{
    (void)state;
    for (int trial = 0; trial < 100; trial++) {
        OneBeam beam;
        make(&beam, 1.5, 0.1, 0.3);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, 1.5, 0.1, 0.3);
        deform(&in, 0.3);
        BeamOutput out;
        beam_element(&in, &out);
        BeamTangent t;
        beam_tangent(&in, &out, 1, &t);
        double u[12], q = 0;
        for (int i = 0; i < 12; i++)
            u[i] = draw_unit();
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++) {
                q += u[i] * t.k11[i * 6 + j] * u[j] + u[6 + i] * t.k22[i * 6 + j] * u[6 + j] + 2 * u[6 + i] * t.k21[i * 6 + j] * u[j];
                assert_true(fabs(t.k11[i * 6 + j] - t.k11[j * 6 + i]) < 1e-9 && fabs(t.k22[i * 6 + j] - t.k22[j * 6 + i]) < 1e-9);
            }
        assert_true(q > 0);
    }
}

static double energy_spun(const BeamInput *in, Vec3 axis1, Vec3 axis2, double angle)
{
    BeamInput spun = *in;
    BeamOutput out;
    spun.q1 = quat_mul(quat_from_rotation_vector(vec3_scale(axis1, angle)), in->q1);
    spun.q2 = quat_mul(quat_from_rotation_vector(vec3_scale(axis2, angle)), in->q2);
    beam_element(&spun, &out);
    return out.energy;
}

// An element of rest curvature k0 that is held at k in the same plane resists a spin about its own tangent by EI k k0 per length; J' C J has EI k0^2. If the
// tangent has less than half of the true stiffness, a Newton step overshoots and oscillates without end: tools with a strong rest shape in a bend never came
// to rest.
static void spin_of_a_bent_rest_shape(void **state)
{
    (void)state;
    const double length = 1.5, rest = 0.05, step = 1e-3;
    for (double times = 1.5; times < 7; times *= 2) {
        OneBeam beam;
        make(&beam, length, rest, 0);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, length, times * rest, 0);
        Vec3 a[2] = {quat_rotate(in.q1, vec3(1, 0, 0)), quat_rotate(in.q2, vec3(1, 0, 0))};
        double real = (energy_spun(&in, a[0], a[1], step) - 2 * energy_spun(&in, a[0], a[1], 0) + energy_spun(&in, a[0], a[1], -step)) / (step * step);
        BeamOutput out;
        beam_element(&in, &out);
        BeamTangent t;
        beam_tangent(&in, &out, 1, &t);
        double u[12] = {0, 0, 0, a[0].x, a[0].y, a[0].z, 0, 0, 0, a[1].x, a[1].y, a[1].z}, q = 0;
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                q += u[i] * t.k11[i * 6 + j] * u[j] + u[6 + i] * t.k22[i * 6 + j] * u[6 + j] + 2 * u[6 + i] * t.k21[i * 6 + j] * u[j];
        double exact = beam.rest.bending[0] * times * rest * rest * length;
        print_message("held at %.1f times its rest curvature: E'' %.5f, EI k k0 L %.5f, tangent %.5f N mm\n", times, real, exact, q);
        assert_true(fabs(real / exact - 1) < 0.01);
        assert_true(fabs(q / real - 1) < 0.02);
    }
}

// --- the chain's kernels ---

enum { E = 23, PADDED = E + 1 + BEAM_PADDING };
typedef struct Chain {
    double array[BEAM_REST_ARRAYS + BEAM_POSE_ARRAYS + BEAM_INERTIA_ARRAYS + 1][PADDED];
    BeamChain beam;
    BlockChain blocks;
    double b[(E + 1) * 6];
} Chain;

// A straight and a curved section, whose border is in the middle of a group of lanes, randomly bent, with random inertia.
static void make_chain(Chain *c)
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
    WireSection section[2] = {
        {.length = 10, .diameter = 0.36, .young_modulus = 80e3, .poisson_ratio = 0.3, .density = 6.45e-3},
        {.length = 10, .diameter = 0.3, .young_modulus = 5e3, .poisson_ratio = 0.3, .density = 6.45e-3, .rest_curvature = 0.2, .rest_plane = 0.4}};
    WireOptions options = wire_default_options();
    options.elements = E;
    options.section_count = 2;
    options.section = section;
    Wire wire;
    char why[256];
    assert_true(wire_create(&wire, &options, why, sizeof why));
    wire_rest(&wire, &options, r);
    for (int i = 0; i <= E; i++) {
        Vec3 x = vec3_add(vec3(wire.s[i], 0, 0), random_vec(0.05)), a = random_vec(1), t = random_vec(1);
        Quat q = quat_from_rotation_vector(random_vec(0.2));
        p->x[i] = x.x, p->y[i] = x.y, p->z[i] = x.z;
        p->qw[i] = q.w, p->qx[i] = q.x, p->qy[i] = q.y, p->qz[i] = q.z;
        m->mass[i] = 1 + draw_unit(), m->lateral[i] = 1 + draw_unit(), m->excess[i] = draw_unit();
        m->ax[i] = a.x, m->ay[i] = a.y, m->az[i] = a.z, m->tx[i] = t.x, m->ty[i] = t.y, m->tz[i] = t.z;
    }
    wire_destroy(&wire);
    assert_true(block_chain_create(&c->blocks, E + 1, 6));
}

static BeamInput chain_input(const Chain *c, int i)
{
    BeamInput in = {0};
    const BeamPose *p = &c->beam.pose;
    const BeamRest *r = &c->beam.rest;
    in.x1 = vec3(p->x[i], p->y[i], p->z[i]), in.x2 = vec3(p->x[i + 1], p->y[i + 1], p->z[i + 1]);
    in.q1 = (Quat){p->qw[i], p->qx[i], p->qy[i], p->qz[i]}, in.q2 = (Quat){p->qw[i + 1], p->qx[i + 1], p->qy[i + 1], p->qz[i + 1]};
    in.length = r->length[i], in.extend = r->extend[i], in.axial = r->axial[i], in.near = r->near[i], in.far = r->far[i], in.twist = r->twist[i];
    in.half_w = r->half_w[i], in.half_y = r->half_y[i], in.half_z = r->half_z[i];
    return in;
}

static void add3(double *at, double sign, Vec3 v) { at[0] += sign * v.x, at[1] += sign * v.y, at[2] += sign * v.z; }

// The same system element by element, node by node.
static void plain_assembly(const Chain *c, int first, double scale, double rate, double *diag, double *lower, double *b)
{
    for (int i = first; i <= E; i++) {
        const BeamInertia *m = &c->beam.inertia;
        const BeamPose *p = &c->beam.pose;
        Vec3 axis = quat_rotate((Quat){p->qw[i], p->qx[i], p->qy[i], p->qz[i]}, vec3(1, 0, 0)), t = vec3(m->tx[i], m->ty[i], m->tz[i]);
        double a[3] = {axis.x, axis.y, axis.z}, *d = diag + 36 * i;
        for (int k = 0; k < 3; k++) {
            d[7 * k] += m->mass[i] * rate;
            for (int j = 0; j < 3; j++)
                d[6 * (3 + k) + 3 + j] += rate * (m->excess[i] * a[k] * a[j] + (k == j ? m->lateral[i] : 0));
        }
        add3(b + 6 * i, m->mass[i], vec3(m->ax[i], m->ay[i], m->az[i]));
        add3(b + 6 * i + 3, 1, vec3_add_scaled(vec3_scale(t, m->lateral[i]), m->excess[i] * vec3_dot(axis, t), axis));
    }
    for (int i = first; i < E; i++) {
        BeamInput in = chain_input(c, i);
        BeamOutput out;
        BeamTangent t;
        beam_element(&in, &out);
        beam_tangent(&in, &out, scale, &t);
        for (int k = 0; k < 36; k++) {
            diag[36 * i + k] += t.k11[k];
            diag[36 * (i + 1) + k] += t.k22[k];
            lower[36 * i + k] = t.k21[k];
        }
        add3(b + 6 * i, 1, out.force2);
        add3(b + 6 * i + 3, -1, out.moment1);
        add3(b + 6 * i + 6, -1, out.force2);
        add3(b + 6 * i + 9, -1, out.moment2);
    }
}

static void assert_near(const double *a, const double *b, int count)
{
    double largest = 0;
    for (int k = 0; k < count; k++)
        largest = fmax(largest, fabs(b[k]));
    for (int k = 0; k < count; k++)
        assert_true(fabs(a[k] - b[k]) <= 1e-13 * largest);
}

// The kernel gives the same result as element by element, from any first node on, writes nothing outside, and is bit-identical at every SIMD level.
static void chain_equals_elements(void **state)
{
    (void)state;
    static Chain c, wide;
    make_chain(&c);
    for (int first = 0; first <= E; first++) {
        double diag[36 * (E + 1)] = {0}, lower[36 * (E + 1)] = {0}, b[6 * (E + 1)] = {0};
        plain_assembly(&c, first, 1.2, 0.7, diag, lower, b);
        double energy = 0;
        for (int i = first; i < E; i++) {
            BeamInput in = chain_input(&c, i);
            BeamOutput out;
            beam_element(&in, &out);
            energy += out.energy;
        }
        for (int level = (int)simd_widest(); level >= 0; level--) {
            simd_force((SimdLevel)level);
            for (int k = 0; k < 36 * (E + 1); k++)
                c.blocks.diag[k] = k < 36 * E ? (c.blocks.lower[k] = -7) : -7;
            for (int k = 0; k < 6 * (E + 1); k++)
                c.b[k] = -7;
            beam_chain_assemble(&c.beam, first, E, 1.2, 0.7, &c.blocks, c.b);
            assert_true(beam_chain_energy(&c.beam, first, E) == energy && (energy > 0 || first == E));
            for (int k = 0; k < 36 * first; k++)
                assert_true(c.blocks.diag[k] == -7 && (k >= 36 * E || c.blocks.lower[k] == -7) && (k >= 6 * first || c.b[k] == -7));
            assert_near(c.blocks.diag + 36 * first, diag + 36 * first, 36 * (E + 1 - first));
            assert_near(c.blocks.lower + 36 * first, lower + 36 * first, 36 * (E - first));
            assert_near(c.b + 6 * first, b + 6 * first, 6 * (E + 1 - first));
            if (level == (int)simd_widest()) {
                BlockChain own = wide.blocks;
                wide = c;
                if (!own.diag)
                    assert_true(block_chain_create(&own, E + 1, 6));
                wide.blocks = own;
                memcpy(own.diag, c.blocks.diag, sizeof diag);
                memcpy(own.lower, c.blocks.lower, 36 * E * sizeof(double));
            }
            assert_memory_equal(wide.blocks.diag, c.blocks.diag, sizeof diag);
            assert_memory_equal(wide.blocks.lower, c.blocks.lower, 36 * E * sizeof(double));
            assert_memory_equal(wide.b, c.b, sizeof b);
        }
        simd_force(simd_widest());
    }
    block_chain_destroy(&c.blocks);
    block_chain_destroy(&wide.blocks);
}

static SheathElement across(const BeamRest *rest, double coordinate, Quat q1, Vec3 x2, Quat q2)
{
    SheathElement e;
    sheath_element(rest, 0, vec3(0, 0, 0), vec3(1, 0, 0), coordinate, q1, x2, q2, 0, &e);
    return e;
}

static void sheath_gradient(void **state)
{
    (void)state;
    for (int k = 0; k < SHAPES; k++)
        for (int trial = 0; trial < 10; trial++) {
            OneBeam beam;
            make(&beam, shape[k].length, shape[k].curvature, shape[k].plane);
            double length = shape[k].length, a = -length * (0.05 + 0.09 * trial), outside = length + a;
            Quat q1 = quat_from_rotation_vector(vec3(0.3, 0, 0)), q2 = quat_from_rotation_vector(vec3_add(vec3(0.3, 0, 0), random_vec(0.2)));
            Vec3 x2 = vec3_add(vec3(outside, 0, 0), random_vec(0.1 * outside));
            SheathElement e = across(&beam.rest, a, q1, x2, q2);
            double h = 1e-6, scale = 1e-6 * (beam.rest.axial[0] * length + beam.rest.bending[0] / outside);
            double number = (across(&beam.rest, a + h, q1, x2, q2).energy - across(&beam.rest, a - h, q1, x2, q2).energy) / (2 * h);
            assert_true(fabs(number - e.axial_gradient) < scale);
            Quat ahead = quat_from_rotation_vector(vec3(h, 0, 0)), back = quat_conjugate(ahead);
            number = (across(&beam.rest, a, quat_mul(ahead, q1), x2, q2).energy - across(&beam.rest, a, quat_mul(back, q1), x2, q2).energy) / (2 * h);
            assert_true(fabs(number - e.twist_gradient) < scale);
            Vec3 d = random_vec(h);
            number = across(&beam.rest, a, q1, vec3_add(x2, d), q2).energy - across(&beam.rest, a, q1, vec3_sub(x2, d), q2).energy;
            assert_true(fabs(number / 2 - vec3_dot(e.out.force2, d)) < scale * h);
        }
}

// At l = L the element across the mouth equals the ordinary one. It computes the arc length from sine and cosine, the ordinary element from a polynomial: at
// 0.6 rad (the last shape) they differ by 1e-9 of the bow, that is 1e-10 mm of an extension of 0.1 mm.
static void sheath_joins_the_chain(void **state)
{
    (void)state;
    for (int k = 0; k < SHAPES; k++) {
        OneBeam beam;
        make(&beam, shape[k].length, shape[k].curvature, shape[k].plane);
        BeamInput in = input_of(&beam.rest);
        at_rest(&in, shape[k].length, shape[k].curvature, shape[k].plane);
        in.q1 = quat_from_rotation_vector(vec3(0.2, 0, 0));
        in.x2 = vec3_add(in.x2, random_vec(0.1));
        BeamOutput out;
        beam_element(&in, &out);
        SheathElement e = across(&beam.rest, 0, in.q1, in.x2, in.q2);
        assert_true(fabs(e.energy - out.energy) < 1e-7 * out.energy);
        assert_true(vec3_distance(e.out.force2, out.force2) < 1e-7 * vec3_norm(out.force2));
        assert_true(vec3_distance(e.out.moment2, out.moment2) < 1e-7 * vec3_norm(out.moment2));
    }
}

// exp(r/2) by its series against cosine and sine, up to the largest angle; the terms that are left out are below 1e-16.
static void turns_are_exact(void **state)
{
    (void)state;
    for (int i = 1; i <= 50; i++) {
        double angle = NODE_TURN_MAX * i / 50;
        Vec3 axis = vec3_unit(random_vec(1)), r = vec3_scale(axis, angle);
        Quat q = {1, 0, 0, 0};
        node_turn(1, &r.x, &r.y, &r.z, &q);
        assert_true(fabs(q.w - cos(0.5 * angle)) < 1e-15);
        assert_true(vec3_distance(vec3(q.x, q.y, q.z), vec3_scale(axis, sin(0.5 * angle))) < 1e-15);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_force_at_rest),
        cmocka_unit_test(force_is_minus_energy_gradient),
        cmocka_unit_test(rigid_motion_changes_nothing),
        cmocka_unit_test(reversed_and_mirrored),
        cmocka_unit_test(twist_is_exact),
        cmocka_unit_test(tangent_is_the_derivative),
        cmocka_unit_test(tangent_is_positive),
        cmocka_unit_test(spin_of_a_bent_rest_shape),
        cmocka_unit_test(chain_equals_elements),
        cmocka_unit_test(sheath_gradient),
        cmocka_unit_test(sheath_joins_the_chain),
        cmocka_unit_test(turns_are_exact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
