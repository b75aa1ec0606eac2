// Rest (solver/step_rest.c): reached by every kind of tool, and left in the same step; never entered by a tool that still creeps, swings or is moved, however
// slowly.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/short_run.h"
#include "tube_scene.h"

static const double IN_CONTACT = 1e-7, FREE = 1e-10, TIME = 500;        // REST_IN_CONTACT, REST_FREE [mm], REST_TIME [ms]
static const StepCommand none[STEP_TOOLS_MAX];
static const int first_case = WHOLE_OR_SHORT(0, 1);      // 0: one tool, 1: two tools, which take the same steps and more

// One step, without a solve if the tool is known to be at rest.
static bool step_or_rest(Stepper *s, const StepCommand *command, unsigned released)
{
    if (step_rests(s, command, released))
        return true;
    step_feed_tools(s, command, released);
    step_solve(s);
    return false;
}

static int steps_to_rest(Stepper *s, int most)
{
    for (int k = 0; k < most; k++) {
        step_or_rest(s, none, 0);
        if (step_report(s)->is_at_rest)
            return k + 1;
    }
    return most;
}

typedef struct Rested {      // a wire of two sections with friction in a bend
    Bench bench;
    Vessel *vessel;
    WireSection inner_section;
    WireOptions inner;
    Stepper *stepper;
} Rested;

static void rested_make(Rested *r, bool two_tools)
{
    r->vessel = bent_tube(10, 15, PI / 2, 40, 0.7);
    bench_in_tube(&r->bench, r->vessel, 0.1, 100, 50, 2, 1);
    WireOptions *w = &r->bench.options.wire;
    w->damping_mass = 1e-4;
    w->damping_stiffness = 0.2;
    r->bench.section[0].rest_curvature = 0.02;
    if (two_tools) {
        r->bench.section[0].diameter = 0.6;
        r->bench.section[0].inner_diameter = 0.45;
        r->bench.section[0].young_modulus = 1e3;
        r->inner_section = standard_section(160);
        r->inner = *w;
        r->inner.section = &r->inner_section;
        r->inner.elements = 80;
        r->inner.inserted = 6;
        r->bench.options.inner_count = 1;
        r->bench.options.inner = &r->inner;
        r->bench.options.inner_friction[0] = 0.1;
    }
    r->stepper = bench_make(&r->bench);
    StepCommand push[STEP_TOOLS_MAX] = {{0.02, 0.001}, {0.03, -0.001}};
    for (int k = 0; k < 1500; k++)
        step_or_rest(r->stepper, push, 0);
}

static void rested_end(Rested *r)
{
    stepper_destroy(r->stepper);
    r->vessel->destroy(r->vessel);
}

static size_t state_bytes(const Stepper *s, char *to)
{
    const WireState *w = stepper_state(s);
    const StepReport *r = step_report(s);
    size_t nodes = (size_t)w->node_count, inner = nodes * (size_t)w->inner_count * sizeof(double);
    const struct {
        const void *data;
        size_t bytes;
    } part[] = {{w->position, nodes * sizeof(Vec3)},
                {w->orientation, nodes * sizeof(Quat)},
                {w->velocity, nodes * sizeof(Vec3)},
                {w->spin, nodes * sizeof(Vec3)},
                {w->slide, inner},
                {w->angle, inner},
                {w->slide_velocity, inner},
                {w->slide_spin, inner},
                {w->slide_force, 3 * inner},
                {&w->inserted, sizeof(double)},
                {&w->twist, sizeof(double)},
                {r->push, sizeof r->push},
                {r->torque, sizeof r->torque},
                {&r->wall_force_max, sizeof(double)},
                {&r->wall_force_sum, sizeof(double)}};
    size_t at = 0;
    for (size_t k = 0; k < sizeof part / sizeof *part; k++)
        if (part[k].bytes > 0) {
            memcpy(to + at, part[k].data, part[k].bytes);
            at += part[k].bytes;
        }
    return at;
}

// Positions and forces are those of the last solution, to the bit; velocities and the works of a step are 0.
static void nothing_changes(void **state)
{
    (void)state;
    for (int two = first_case; two < 2; two++) {
        Rested r = {0};
        rested_make(&r, two);
        Vec3 tip = vec3(0, 0, 0);
        double push = 0, largest = 0;
        int steps = 0;
        do {
            push = step_report(r.stepper)->push[0];
            largest = step_report(r.stepper)->wall_force_max;
            tip = tip_of(r.stepper);
            step_or_rest(r.stepper, none, 0);
        } while (!step_report(r.stepper)->is_at_rest && ++steps < 8000);
        print_message("%d tool(s): at rest after %d steps, push %.4f N, wall %.4f N\n", two + 1, steps, push, largest);
        assert_true(steps >= (int)TIME && steps < 8000 && largest > 1e-3);
        assert_true(step_report(r.stepper)->push[0] == push && step_report(r.stepper)->wall_force_max == largest);
        assert_true(vec3_distance(tip, tip_of(r.stepper)) == 0);
        static char here[1 << 16], there[1 << 16];
        size_t bytes = state_bytes(r.stepper, here);
        double time = stepper_state(r.stepper)->time, elastic = stepper_elastic_energy(r.stepper);
        for (int k = 0; k < 500; k++) {
            assert_true(step_rests(r.stepper, none, 0));
            StepEnergy e = stepper_energy(r.stepper);
            assert_true(e.elastic == elastic && e.kinetic == 0 && e.hand == 0 && e.wall == 0 && e.friction == 0 && e.damping == 0);
        }
        assert_true(fabs(stepper_state(r.stepper)->time - time - 500) < 1e-6);
        assert_int_equal(state_bytes(r.stepper, there), bytes);
        assert_memory_equal(here, there, bytes);
        rested_end(&r);
    }
}

// A tool that is solved for in each step stays where it rests, within the motion that counts as rest in each REST_TIME.
static void as_if_solved(void **state)
{
    (void)state;
    for (int two = first_case; two < 2; two++) {
        Rested r = {0};
        rested_make(&r, two);
        assert_true(steps_to_rest(r.stepper, 8000) < 8000);
        Vec3 tip = tip_of(r.stepper);
        double push = step_report(r.stepper)->push[0], farthest = 0, force = 0;
        for (int k = 0; k < 2 * (int)TIME; k++) {
            step_feed_tools(r.stepper, none, 0);
            step_solve(r.stepper);
            farthest = fmax(farthest, vec3_distance(tip, tip_of(r.stepper)));
            force = fmax(force, fabs(step_report(r.stepper)->push[0] - push));
        }
        print_message("%d tool(s): solved for %g ms, the tip moved by %.1e mm, the push changed by %.1e N\n", two + 1, 2 * TIME, farthest, force);
        assert_true(farthest < 2 * IN_CONTACT && force < 1e-6);
        rested_end(&r);
    }
}

// A run that is taken up again from checkpoints is the same bit for bit, at rest and before.
static void taken_up_again(void **state)
{
    (void)state;
    for (int two = first_case; two < 2; two++) {
        Rested r[2] = {0};
        int known = 0, solved = 0;
        for (int k = 0; k < 2; k++)
            rested_make(&r[k], two);
        Checkpoint *kept = NULL;
        uint64_t seed = 1;
        StepCommand command[STEP_TOOLS_MAX] = {{0}};
        unsigned released = 0;
        for (int i = 0; i < 6000; i++) {
            if (i % 1500 == 0) {
                seed = seed * UINT64_C(6364136223846793005) + 1442695040888963407;
                command[0].advance = 1e-3 * ((double)(seed >> 40) / (1 << 24) - 0.5);
                command[two].twist = command[0].advance;
                released = two && i >= 3000 ? 2 : 0;
            } else if (i % 1500 == 30) {
                memset(command, 0, sizeof command);
            }
            *(step_or_rest(r[0].stepper, command, released) ? &known : &solved) += 1;
            if (i % 37 == 0) {
                kept = stepper_save(r[1].stepper, kept);
                for (int k = 0; k < 3; k++)
                    step_or_rest(r[1].stepper, command, released);
                stepper_restore(r[1].stepper, kept);
            }
            step_or_rest(r[1].stepper, command, released);
            assert_true(stepper_hash(r[1].stepper) == stepper_hash(r[0].stepper));
        }
        print_message("%d tool(s): %d steps solved, %d at rest\n", two + 1, solved, known);
        assert_true(known > 500 && solved > 4 * (int)TIME);
        checkpoint_free(kept);
        for (int k = 0; k < 2; k++)
            rested_end(&r[k]);
    }
}

// The slowest command moves the tool in the same step; so does letting go.
static void woken_at_once(void **state)
{
    (void)state;
    Rested r = {0};
    rested_make(&r, false);
    assert_true(steps_to_rest(r.stepper, 8000) < 8000);
    assert_true(step_rests(r.stepper, none, 0));
    assert_false(step_rests(r.stepper, none, 1));
    double inserted = stepper_state(r.stepper)->inserted;
    const StepCommand slow[STEP_TOOLS_MAX] = {{.advance = 1e-13}}, turn[STEP_TOOLS_MAX] = {{.twist = 1e-13}};
    assert_false(step_rests(r.stepper, slow, 0) || step_rests(r.stepper, turn, 0));
    step_or_rest(r.stepper, slow, 0);
    assert_false(step_report(r.stepper)->is_at_rest);
    assert_true(stepper_state(r.stepper)->inserted > inserted);
    assert_true(steps_to_rest(r.stepper, 8000) < 8000);
    rested_end(&r);
}

// A push of 1e-4 and of 1e-7 mm/s, far below the motion of a resting step: the tip of a free wire advances as far as the hand.
static void a_slow_push(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    for (double speed = 1e-4; speed > 1e-8; speed *= 1e-3) {
        Bench b;
        bench_in_tube(&b, NULL, 0, 100, 20, 10, 1);
        Stepper *s = bench_make(&b);
        assert_true(steps_to_rest(s, 600) < 600);
        double x = tip_of(s).x;
        enum { SECONDS = 10 };
        for (int k = 0; k < 1000 * SECONDS; k++) {
            step_once(s, speed / 1000, 0);
            assert_false(step_report(s)->is_at_rest);
        }
        double moved = tip_of(s).x - x;
        print_message("pushed by %.3e mm, moved by %.9e\n", speed * SECONDS, moved);
        assert_true(fabs(moved - speed * SECONDS) < 1e-15 * 1000 * SECONDS);      // the inserted length of 10 mm is rounded in each step
        stepper_destroy(s);
    }
}

// A stretched bar with stiffness damping only (Kelvin-Voigt) creeps to F L / EA with the time constant of its damping. Implicit Euler: 1 - (1 + h / T)^-n.
static void a_slow_relaxation(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    const double length = 100, force = 1;
    for (double constant = 100; constant < 2e3; constant *= 10) {
        Bench b;
        bench_start(&b, length, 4, 1);
        b.section[0].density = 1e-7;         // hardly any inertia
        b.options.wire.damping_stiffness = constant;
        bench_load(&b, length, vec3(force, 0, 0), vec3(0, 0, 0), 0);
        Stepper *s = bench_make(&b);
        double end = force * length / (PI / 4 * 0.36 * 0.36 * 80e3), worst = 0, exact = 0, bound = FREE / (exp(TIME / constant) - 1);
        int rest = 0;
        for (int k = 1; k <= 20 * constant + 2 * TIME; k++) {
            step_or_rest(s, none, 0);
            exact = end * (1 - pow(1 + 1 / constant, -k));
            worst = fmax(worst, fabs(tip_of(s).x - length - exact));
            if (!rest && step_report(s)->is_at_rest)
                rest = k;
        }
        print_message("time constant %g ms: end %.6e mm, worst %.1e mm from exact, bound %.1e; at rest after %d ms\n", constant, end, worst, bound, rest);
        assert_true(rest > 3 * constant && worst < bound * 1.01 + 1e-12);
        stepper_destroy(s);
    }
}

// A cantilever under a small load swings and ends within FREE of its deflection; a rest at a turning point would end far from it. The load sags it by 1e-3 and 1e-5 mm.
static void a_small_swing(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    const double length = 100;
    for (double sag = 1e-3; sag > 1e-6; sag *= 1e-2) {
        Bench b;
        bench_start(&b, length, 20, 1);
        b.options.wire.damping_mass = 1e-3;
        bench_load(&b, length, vec3(0, 0, 3 * EI_STANDARD * sag / (length * length * length)), vec3(0, 0, 0), 0);
        Stepper *s = bench_make(&b);
        int rest = steps_to_rest(s, 40000);
        double off = fabs(tip_of(s).z / sag - 1) * sag;
        print_message("sag %.0e mm: at rest after %d ms, %.1e mm off; bound %.1e mm\n", sag, rest, off, FREE);
        assert_true(rest > 100 && rest < 40000 && off < FREE + 2e-5 * sag);      // shear adds 1e-5
        stepper_destroy(s);
    }
}

// A load that grows so slowly that nothing moves by more than FREE / 20 in REST_TIME.
static void a_slow_load(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    enum { STEPS = 100000 };
    const double length = 20, sag = 0.05 * FREE / TIME * STEPS;
    Bench b;
    bench_start(&b, length, 4, 1);
    b.options.wire.damping_stiffness = 0.2;
    bench_load(&b, length, vec3(0, 0, 3 * EI_STANDARD * sag / (length * length * length)), vec3(0, 0, 0), STEPS);
    Stepper *s = bench_make(&b);
    for (int k = 0; k < STEPS; k++)
        step_or_rest(s, none, 0);
    double lags = fabs(tip_of(s).z / sag - 1);
    print_message("sag of %.1e mm in %d steps: %.1e off\n", sag, STEPS, lags);
    assert_true(lags < 1e-3);
    assert_true(steps_to_rest(s, 2000) < 2000);
    stepper_destroy(s);
}

// Short steps move less, and are no rest for that: under gravity, in steps of 1 us, a wire falls.
static void a_short_step(void **state)
{
    (void)state;
    Bench b;
    bench_start(&b, 100, 10, 1e-3);
    b.options.wire.gravity = vec3(0, 0, -9.81e-6);       // a thousandth of the earth's
    Stepper *s = bench_make(&b);
    for (int k = 0; k < 1000; k++)
        step_or_rest(s, none, 0);
    double exact = -0.5 * 9.81e-6;       // after 1 ms the clamp has not yet been felt at the tip
    print_message("fell by %.4e mm, freely %.4e\n", tip_of(s).z, exact);
    assert_true(fabs(tip_of(s).z / exact - 1) < 0.01);
    stepper_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_changes), cmocka_unit_test(as_if_solved), cmocka_unit_test(taken_up_again),
        cmocka_unit_test(woken_at_once),   cmocka_unit_test(a_slow_push),  cmocka_unit_test(a_slow_relaxation),
        cmocka_unit_test(a_small_swing),   cmocka_unit_test(a_slow_load),  cmocka_unit_test(a_short_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
