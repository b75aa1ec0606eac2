// The wire in contact with walls: exact solutions of docs/references.md "Wire and walls" and the incline.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "wire_scene.h"

static Vessel *bent_tube(double straight, double bend, double angle, double after, double radius)
{
    TubePiece piece[3] = {{.length = straight}, {.arc_radius = bend, .angle = angle}, {.length = after}};
    TubeOptions options = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = radius, .piece_count = 3, .piece = piece};
    Faults faults = {0};
    Vessel *vessel = tube_vessel_create(&options, "test", &faults);
    assert_non_null(vessel);
    return vessel;
}

static void bench_pushed(Bench *b, const Vessel *vessel, double friction, double length, int elements, double inserted)
{
    bench_start(b, length, elements, 1);
    b->options.vessel = vessel;
    b->options.wall_friction = friction;
    b->options.wire.fix_count = 0;
    b->options.wire.has_sheath = true;
    b->options.wire.inserted = inserted;
    b->options.wire.damping_stiffness = 0.2;
    b->options.wire.damping_mass = 1e-4;
}

static void incline(void **state)
{
    (void)state;
    // a wire along the slope of a plane whose normal is +z; gravity is rotated instead of the plane
    static const struct {
        double angle, moved;
    } slope[] = {{11.2, 0}, {15, 3.25154}};
    for (int k = 0; k < 2; k++) {
        Vessel *plane = plane_vessel_create(vec3(0, 0, 0), vec3(0, 0, 1));
        double a = slope[k].angle * PI / 180;
        Bench b;
        bench_start(&b, 20, 20, 1);
        b.options.vessel = plane;
        b.options.wall_friction = 0.2;
        b.options.wire.fix_count = 0;
        b.options.wire.start = vec3(0, 0, 0.18);
        b.options.wire.gravity = vec3(9.81e-3 * sin(a), 0, -9.81e-3 * cos(a));
        Stepper *s = bench_make(&b);
        int steps = k == 0 ? 1000 : 100;
        for (int i = 0; i < steps; i++)
            step_once(s, 0, 0);
        double moved = tip_of(s).x - 20;
        print_message("incline %.1f deg: moved %.6f mm (%.5f)\n", slope[k].angle, moved, slope[k].moved);
        assert_true(fabs(moved - slope[k].moved) < (k == 0 ? 1e-3 : 1e-3 * slope[k].moved));
        assert_true(fabs(tip_of(s).z - 0.18) < 1e-6);
        stepper_destroy(s);
        plane->destroy(plane);
    }
}

// The wire fills the tube except for 0.02 mm: F = EI / (2 R^2) while the tip is in the bend.
static void frictionless_push_through_a_bend(void **state)
{
    (void)state;
    static const double radius[] = {10, 15, 30};
    for (int k = 0; k < 3; k++) {
        double bend = radius[k], expected = EI_STANDARD / (2 * bend * bend), quarter = bend * PI / 2;
        Vessel *tube = bent_tube(10, bend, PI / 2, 100, 0.20);
        Bench b;
        bench_pushed(&b, tube, 0, 10 + quarter + 5, (int)(2 * (15 + quarter)), 10);
        Stepper *s = bench_make(&b);
        double speed = 0.01, sum = 0, deepest = 0, u0 = 0, u1 = 0;
        int count = 0, steps = (int)(0.8 * quarter / speed);
        for (int i = 0; i < steps; i++) {
            const StepReport *r = step_once(s, speed, 0);
            deepest = fmax(deepest, r->penetration);
            assert_int_equal(r->flags, 0);
            if (i == steps / 2)
                u0 = stepper_elastic_energy(s);
            if (i > steps / 2) {
                sum += r->proximal_force;
                count++;
            }
        }
        u1 = stepper_elastic_energy(s);
        print_message("bend R %g: mean push %.5f N, EI/2R^2 %.5f (%+.2f %%); dU/dL %+.2f %%; deepest %.1e mm\n", bend, sum / count, expected,
                      100 * (sum / count / expected - 1), 100 * ((u1 - u0) / (count * speed) / expected - 1), deepest);
        // 10 mm/s: Rayleigh damping accounts for half a per cent
        assert_true(fabs(sum / count / expected - 1) < 0.01 && fabs((u1 - u0) / (count * speed) / expected - 1) < 0.005);
        assert_true(deepest < 1e-3);
        stepper_destroy(s);
        tube->destroy(tube);
    }
}

// Arc R = 15, 90 degrees after 10 mm; clearance 0.5; length 30 clamped at the inlet; EI = 1.
static void equilibrium_in_an_arc(void **state)
{
    (void)state;
    Vessel *tube = bent_tube(10, 15, PI / 2, 50, 0.5 + 0.18);
    Bench b;
    bench_pushed(&b, tube, 0, 30, 60, 0);
    b.section[0].young_modulus = 80e3 / EI_STANDARD;
    Stepper *s = bench_make(&b);
    for (int i = 0; i < 3000; i++)
        step_once(s, 0.01, 0);
    for (int i = 0; i < 3000; i++)
        step_once(s, 0, 0);
    NodeReport node[61];
    stepper_node_report(s, node);
    double inner = 0, tip = vec3_norm(node[60].force), deepest = 0, energy = stepper_elastic_energy(s);
    for (int i = 0; i < 60; i++)
        inner += vec3_norm(node[i].force);
    for (int i = 0; i <= 60; i++)
        deepest = fmax(deepest, isfinite(node[i].gap) ? -node[i].gap : 0);
    print_message("arc: energy %.6f (0.026998), inner wall %.8f (0.00845749), tip force %.8f (0.00782224), tip (%.3f, %.3f), deepest %.1e, push %.6f\n", energy,
                  inner, tip, tip_of(s).x, tip_of(s).y, deepest, step_report(s)->proximal_force);
    assert_true(fabs(energy / 0.026998 - 1) < 0.005);
    assert_true(fabs(inner / 0.00845749 - 1) < 0.02 && fabs(tip / 0.00782224 - 1) < 0.02);
    assert_true(vec3_distance(tip_of(s), vec3(25.149, 11.720, 0)) < 0.02 && deepest < 0.005);
    stepper_destroy(s);
    tube->destroy(tube);
}

// A J-tip is pushed and rotated in a tube, then pulled out fast: it stays inside, and no step fails.
static void stays_inside(void **state)
{
    (void)state;
    Vessel *tube = bent_tube(10, 8, PI, 60, 1.25);
    Bench b;
    bench_pushed(&b, tube, 0.1, 60, 60, 5);
    b.section[0].length = 52;
    b.section[1] = standard_section(8), b.section[1].rest_curvature = 0.15, b.section[1].young_modulus = 20e3;
    b.options.wire.section_count = 2;
    Stepper *s = bench_make(&b);
    double deepest = 0;
    unsigned flags = 0;
    for (int i = 0; i < 1000; i++) {
        const StepReport *r = step_once(s, 0.05, 0.02);
        deepest = fmax(deepest, r->penetration), flags |= r->flags;
    }
    for (int i = 0; i < 270; i++) {
        const StepReport *r = step_once(s, -0.2, 0);
        deepest = fmax(deepest, r->penetration), flags |= r->flags;
    }
    print_message("J tip through a U and out: deepest %.4f mm, flags %u\n", deepest, flags);
    assert_true(deepest < 0.2);
    assert_int_equal(flags & (STEP_DIVERGED | STEP_OUT_OF_VESSEL), 0);
    stepper_destroy(s);
    tube->destroy(tube);
}

static void restored_runs_repeat_in_contact(void **state)
{
    (void)state;
    Vessel *tube = bent_tube(10, 15, PI / 2, 50, 0.5);
    Bench b;
    bench_pushed(&b, tube, 0.1, 60, 60, 20);
    Stepper *s = bench_make(&b);
    for (int i = 0; i < 200; i++)
        step_once(s, 0.05, 0.01);
    Checkpoint *c = stepper_save(s, NULL);
    for (int i = 0; i < 100; i++)
        step_once(s, 0.05, 0.01);
    uint64_t there = stepper_hash(s);
    Stepper *other = bench_make(&b);
    stepper_restore(other, c);
    for (int i = 0; i < 100; i++)
        step_once(other, 0.05, 0.01);
    assert_true(stepper_hash(other) == there);
    checkpoint_free(c);
    stepper_destroy(s);
    stepper_destroy(other);
    tube->destroy(tube);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(incline),      cmocka_unit_test(frictionless_push_through_a_bend), cmocka_unit_test(equilibrium_in_an_arc),
        cmocka_unit_test(stays_inside), cmocka_unit_test(restored_runs_repeat_in_contact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
