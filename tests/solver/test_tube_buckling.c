// Buckling of wires confined by walls, and the whip of a curved wire in a curved tube, all without friction, compared with closed forms.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tube_scene.h"
#include "tests/short_run.h"

// A pinned strut at the height h over a wall, pushed against it (Feodosyev's problem; small slopes: h = L/100). k^2 = P/EI.
//   Pcr < P < 4 Pcr    one contact: y = A sin kx + B x up to the middle, y(L/2) = h, y'(L/2) = 0; wall force 2 P B
//   4 Pcr < P < 16 Pcr the middle lies flat, its ends at x = pi/k press with P h k/pi each; shortening 3 h^2 k / (2 pi)
//   16 Pcr             the flat part buckles off the wall: clamped, length L - 2 pi/k
static double strut_wall(double force, double length, double h)
{
    double k = sqrt(force / EI_STANDARD), q = k * length / 2;
    return q > PI ? 2 * force * h * k / PI : -2 * force * k * h * cos(q) / (sin(q) - q * cos(q));
}

static double strut_shortening(double force, double length, double h)
{
    double k = sqrt(force / EI_STANDARD), q = k * length / 2, compressed = force * length / (80e3 * PI / 4 * 0.36 * 0.36);
    if (q > PI)
        return 1.5 * h * h * k / PI + compressed;
    // the integral of (A k cos kx + B)^2 up to the middle
    double a = h / (sin(q) - q * cos(q)), slope = -a * k * cos(q), half = length / 2;
    return a * a * k * k * (half / 2 + sin(2 * q) / (4 * k)) + 2 * a * slope * sin(q) + slope * slope * half + compressed;
}

static void strut_over_a_wall(void **state)
{
    (void)state;
    enum { MOST = 80 };
    const double length = 50, h = 0.5, critical = PI * PI * EI_STANDARD / (length * length);
    static const double ratio[] = {0.9, 1.5, 2.5, 3.5, 5, 8, 12, 15, 17};
    for (int elements = 20; elements <= MOST; elements *= 2) {
        Vessel *plane = plane_vessel_create(vec3(0, -(h + 0.18), 0), vec3(0, 1, 0));
        WireFix fix[MOST + 1];
        Checkpoint *c = NULL;
        for (int k = 0; k < 9; k++) {
            double force = ratio[k] * critical;
            WireLoad load[2] = {{.s = length, .force = vec3(-force, 0, 0)}, {.s = length / 2, .force = vec3(0, -1e-6, 0)}};
            Bench b;
            bench_start(&b, length, elements, QUASI_STATIC);
            b.options.vessel = plane;
            b.options.wire.fix = fix, b.options.wire.fix_count = elements + 1;
            b.options.wire.load = load, b.options.wire.load_count = 2;
            for (int i = 0; i <= elements; i++)
                fix[i] = (WireFix){.s = i * length / elements, .dof = DOF_Z | DOF_RX | DOF_RY};
            fix[0].dof |= DOF_X | DOF_Y;
            fix[elements].dof |= DOF_Y;
            Stepper *s = bench_make(&b);
            if (c)
                stepper_restore(s, c);
            settle(s, 10, 100, 1e-10);
            c = stepper_save(s, c);
            Wall w = wall_of(s);
            char name[64];
            snprintf(name, sizeof name, "strut, %d elements, P/Pcr %.1f", elements, ratio[k]);
            if (ratio[k] < 1 || ratio[k] > 16) {
                print_message("%-34s %s: wall force %.1e N\n", name, ratio[k] < 1 ? "straight" : "off the wall", w.sum);
                assert_true(w.sum == 0);
            } else {
                assert_true(fabs(row(name, "wall force N", strut_wall(force, length, h), w.sum)) < 5e-3);
                // the end of the flat part lies between two nodes
                double error = fabs(row(name, "shortening mm", strut_shortening(force, length, h), length - tip_of(s).x));
                assert_true(error < (elements == 20 ? 1e-2 : 3e-3) && w.deepest < 1e-9);
            }
            stepper_destroy(s);
        }
        checkpoint_free(c);
        plane->destroy(plane);
    }
}

// A pinned wire lies at the bottom of a horizontal tube of radial clearance r under its weight w, with thrust F. A small transverse load q sin(px) moves it by
//   q / (EI p^4 - F p^2 + w / r),  unbounded at Dawson and Paslay's F = 2 sqrt(EI w / r) for p = (w / (EI r))^(1/4)
static void sinusoidal_buckling_under_weight(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    enum { MOST = 80 };
    const double bending = EI_STANDARD / 80, weight = 6.45e-3 * PI / 4 * 0.36 * 0.36 * 9.81e-3, r = 1;      // 1 GPa
    const double p = pow(weight / (bending * r), 0.25), length = PI / p, critical = 2 * sqrt(bending * weight / r), q = 1e-5 * weight;
    static const double ratio[] = {0, 0.5, 0.9, 0.98, 1.02};
    TubePiece piece = line_piece(200);
    TubeOptions o = {.start = {-50, 0, 0}, .direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = r + 0.18, .piece_count = 1, .piece = &piece};
    Faults faults = {0};
    Vessel *tube = tube_vessel_create(&o, "test", &faults);
    assert_non_null(tube);
    for (int elements = 10; elements <= MOST; elements *= 2) {
        WireLoad load[MOST + 1];
        Checkpoint *c = NULL;
        double inverse[5];
        for (int k = 0; k < 5; k++) {
            double force = ratio[k] * critical;
            Bench b;
            bench_start(&b, length, elements, QUASI_STATIC);
            b.section[0].young_modulus = 1e3;
            b.options.vessel = tube;
            b.options.contact.tolerance = 1e-9;
            b.options.wire.start = vec3(0, 0, -r);
            b.options.wire.gravity = vec3(0, 0, -9.81e-3);
            b.fix[0] = (WireFix){.s = 0, .dof = DOF_POSITION | DOF_RX};
            b.fix[1] = (WireFix){.s = length, .dof = DOF_Y | DOF_Z};
            b.options.wire.fix_count = 2;
            b.options.wire.load = load, b.options.wire.load_count = elements + 1;
            for (int i = 0; i < elements; i++)
                load[i] = (WireLoad){.s = i * length / elements, .force = vec3(0, q * sin(PI * i / elements) * length / elements, 0)};
            load[elements] = (WireLoad){.s = length, .force = vec3(-force, 0, 0)};
            Stepper *s = bench_make(&b);
            if (c)
                stepper_restore(s, c);
            settle(s, 10, 1000, 1e-13);         // thrust is explicit: the error falls by F/Fcr per step
            c = stepper_save(s, c);
            double amplitude = stepper_state(s)->position[elements / 2].y;
            inverse[k] = q / amplitude;
            char name[64];
            snprintf(name, sizeof name, "under weight, %d el., F/Fcr %.2f", elements, ratio[k]);
            if (ratio[k] < 1)
                assert_true(fabs(row(name, "deflection mm", q / (bending * p * p * p * p - force * p * p + weight / r), amplitude)) <
                            (ratio[k] < 0.95 ? 2e-3 : 1e-2));
            else {
                print_message("%-34s buckled: %.3f mm\n", name, amplitude);
                assert_true(amplitude > 0.05);
            }
            stepper_destroy(s);
        }
        // Southwell: the load at which 1/amplitude becomes zero
        double zero = 0.9 + inverse[2] * 0.4 / (inverse[1] - inverse[2]);
        assert_true(fabs(row("under weight", "buckling load N", critical, zero * critical)) < 1e-3);
        checkpoint_free(c);
    }
    tube->destroy(tube);
}

// Whip. A wire of rest curvature k0 in a ring of radius R that it fills is rotated at its base: the angle phi between its plane and the ring's obeys
//   GJ phi'' = EI k0/R sin phi,  phi'(S) = 0 at the tip;  a straight part l0 before it twists by its torque;  base angle = phi(0) + l0 |phi'(0)|
// (the pendulum; integrated from the tip at 1e-12 with scipy). If S sqrt(EI k0 / (R GJ)) > pi/2, the base angle has a largest value, beyond which the tip
// snaps. The first wire (k0 0.05, S 20: 1.317) folds only because of the twist of its straight part, at 181.17 deg; the other (2.793) at 278.13 deg.
// With a clearance c each end of the curved part is free over a length of order sqrt(c R): the error falls with sqrt(c).
typedef struct WhipCase {
    double k0, ring, curved, snap;
    int count;
    struct {
        double base, tip, torque;        // [deg], [deg], over GJ [1/mm]
    } point[6];
} WhipCase;
static const WhipCase WHIP[] = {
    {0.05, 15, 20, 181.1746, 4, {{45, 17.83615, 0.03418676}, {90, 37.87811, 0.06410942}, {120, 54.39612, 0.07858114}, {150, 77.21460, 0.08374464}}},
    {0.1,
     15,
     30,
     278.1325,
     6,
     {{45, 3.79652, 0.04921640},
      {90, 7.85135, 0.09581644},
      {150, 14.31289, 0.14835018},
      {200, 21.88031, 0.17614101},
      {230, 28.75088, 0.18033995},
      {260, 40.74134, 0.16671464}}},
};

static double whip_tip(const Stepper *s, double end)
{
    const WireState *w = stepper_state(s);
    Vec3 e2 = quat_rotate(w->orientation[w->node_count - 1], vec3(0, 1, 0));
    return atan2(e2.z, vec3_dot(e2, vec3(-sin(end), cos(end), 0))) * 180 / PI;
}

static void whip(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    static const double clearance[] = {0.04, 0.02, 0.01};
    for (int q = 0; q < 2; q++) {
        const WhipCase *c = &WHIP[q];
        double worst[3] = {0};
        for (int k = 0; k < 3; k++) {
            double before = 5, length = before + c->curved, end = c->curved / c->ring, last = 0, snap = 0;
            Vessel *tube = bent_tube(before, c->ring, 2.6, 10, 0.18 + clearance[k]);
            Bench b;
            bench_in_tube(&b, tube, 0, length, (int)(4 * length + 0.5), 0, QUASI_STATIC);
            b.section[0].length = before;
            b.section[1] = standard_section(c->curved);
            b.section[1].rest_curvature = c->k0;
            b.options.wire.section_count = 2;
            Stepper *s = bench_make(&b);
            feed(s, length, (int)(10 * length));
            settle(s, 5, 100, 1e-10);
            char name[64];
            snprintf(name, sizeof name, "whip k0 %g, clearance %g mm", c->k0, clearance[k]);
            for (int degree = 1, next = 0; degree <= 300 && snap == 0; degree++) {
                step_once(s, 0, PI / 180);
                settle(s, 3, 200, 1e-8);
                double tip = whip_tip(s, end);
                if (fabs(tip - last) > 40 && last != 0)
                    snap = degree;
                last = tip;
                if (next < c->count && degree == (int)c->point[next].base) {
                    char what[32];
                    snprintf(what, sizeof what, "torque at %d deg N mm", degree);
                    worst[k] = fmax(worst[k], fabs(row(name, what, c->point[next].torque * GJ_STANDARD, step_report(s)->proximal_torque)));
                    snprintf(what, sizeof what, "tip at %d deg", degree);
                    row(name, what, c->point[next++].tip, tip);
                }
            }
            row(name, "base at the snap deg", c->snap, snap);
            assert_true(fabs(snap / c->snap - 1) < 0.015);
            stepper_destroy(s);
            tube->destroy(tube);
        }
        double order = log2(worst[0] / worst[2]) / 2;
        print_message("whip k0 %g: error of the torque falls with clearance^%.2f\n", c->k0, order);
        assert_true(worst[2] < 0.06 && order > 0.3);
    }
}

// A long wire under the thrust F in a straight tube of radial clearance r forms a helix: F = 2 EI sin^2 psi cos psi / r^2, pitch 2 pi r / tan psi, wall
// pressure EI sin^4 psi / r^3 per length. With friction, 1/F_tip = 1/F_prox + mu r L / (4 EI) (small psi; the wire is off the wall near its ends). A small
// transverse load, removed before the measurement, determines the handedness. The helix does not reach the ends by a pitch or two: the middle 40 % is measured.
typedef struct Coil {
    double pitch, pressure;
} Coil;

static Coil coil_of(Stepper *s, double length, double r)
{
    const WireState *w = stepper_state(s);
    NodeReport *node = calloc((size_t)w->node_count + 1, sizeof *node);
    stepper_node_report(s, node);
    double turn = 0, force = 0, from = 0, to = 0;
    for (int i = 1, count = 0; i < w->node_count; i++) {
        Vec3 p = w->position[i], q = w->position[i - 1];
        if (p.x < 0.3 * length || p.x > 0.7 * length)
            continue;
        if (count++ == 0)
            from = q.x;
        to = p.x;
        turn += atan2(q.y * p.z - q.z * p.y, q.y * p.y + q.z * p.z);
        force -= (node[i].force.y * p.y + node[i].force.z * p.z) / r;
    }
    free(node);
    return (Coil){2 * PI * (to - from) / fabs(turn), force / (to - from)};
}

static void helix_in_a_cylinder(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    enum { LENGTH = 200, BEHIND = 20, ELEMENTS = LENGTH + BEHIND };
    const double r = 0.5, psi = 0.15, sine = sin(psi), force = 2 * EI_STANDARD * sine * sine * cos(psi) / (r * r), pitch = 2 * PI * r / tan(psi), mu = 0.1;
    TubePiece piece = line_piece(2 * LENGTH);
    Vessel *tube = tube_of(&piece, 1, r + 0.18);
    WireLoad load[ELEMENTS + 1];
    Bench b;
    bench_in_tube(&b, tube, 0, ELEMENTS, ELEMENTS, LENGTH, 1);
    b.options.wire.load = load;
    b.options.wire.damping_mass = 0.02, b.options.wire.damping_stiffness = 0.2;
    Stepper *s = NULL;
    Checkpoint *c = NULL;
    for (int k = 1; k <= 60; k++) {
        load[0] = (WireLoad){.s = ELEMENTS, .force = vec3(-force * fmin(k / 40.0, 1), 0, 0)};
        for (int i = 0; i < ELEMENTS; i++)
            load[i + 1] = (WireLoad){.s = i, .force = vec3(0, 0.02 * cos(2 * PI * i / pitch), 0.02 * sin(2 * PI * i / pitch))};
        b.options.wire.load_count = k < 45 ? ELEMENTS + 1 : 1;
        stepper_destroy(s);
        s = bench_make(&b);
        if (c)
            stepper_restore(s, c);
        settle(s, 100, k < 58 ? 100 : 500, 0);
        c = stepper_save(s, c);
    }
    Coil coil = coil_of(s, LENGTH, r);
    double angle = atan(2 * PI * r / coil.pitch);
    assert_true(fabs(row("helix", "pitch mm", pitch, coil.pitch)) < 0.01);
    assert_true(fabs(row("helix", "thrust from its angle N", force, 2 * EI_STANDARD * sin(angle) * sin(angle) * cos(angle) / (r * r))) < 0.02);
    assert_true(fabs(row("helix", "pressure N/mm", EI_STANDARD * sine * sine * sine * sine / (r * r * r * cos(psi)), coil.pressure)) < 0.03);
    stepper_destroy(s);
    b.options.wall_friction = mu;
    s = bench_make(&b);
    stepper_restore(s, c);
    feed(s, 3, 600);
    assert_true(fabs(row("helix, mu 0.1", "push N", 1 / (1 / force - mu * r * LENGTH / (4 * EI_STANDARD)), step_report(s)->proximal_force)) < 0.04);
    checkpoint_free(c);
    stepper_destroy(s);
    tube->destroy(tube);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(strut_over_a_wall),
        cmocka_unit_test(sinusoidal_buckling_under_weight),
        cmocka_unit_test(helix_in_a_cylinder),
        cmocka_unit_test(whip),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
