// A hand without a limit forces a wire of 0.6 mm and 100 GPa into an S-shaped tube whose lumen is 0.02 mm wider and closed at its end: the wire locks at 850 N.
// Each step must still end after a bounded number of contact iterations without passing the wall, and an iteration may take at most three times as long as a free
// step.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/short_run.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tube_scene.h"

enum { FREE = 100, STEPS = 1500, JAMMED_FROM = 750 };

typedef struct JamFigures {
    double free_us, jammed_us;           // median CPU time of a step
    double iterations, most_iterations;  // of a jammed step: median, most
    double push, deepest;                // [N], [mm]
} JamFigures;

static double cpu_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec * 1e-3;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *value, int count)
{
    qsort(value, (size_t)count, sizeof *value, ascending);
    return value[count / 2];
}

static JamFigures force_in(double friction)
{
    static double time[STEPS], iterations[STEPS];
    TubePiece piece[4] = {line_piece(10), arc_piece(8, 90, 0), arc_piece(8, 90, 180), line_piece(10)};
    TubeOptions options = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = 0.31, .piece_count = 4, .piece = piece, .closed_ends = true};
    Faults faults = {0};
    Vessel *tube = tube_vessel_create(&options, "test", &faults);
    assert_non_null(tube);
    Bench b;
    bench_in_tube(&b, tube, friction, 150, 200, 2, 1);
    b.section[0].diameter = 0.6;
    b.section[0].young_modulus = 100e3;
    b.options.wire.damping_mass = 1e-4;
    b.options.wire.damping_stiffness = 0.2;
    b.options.wire.hand_limit = 0;
    Stepper *s = bench_make(&b);
    JamFigures f = {0};
    for (int i = 0; i < STEPS; i++) {
        double start = cpu_us();
        const StepReport *r = step_once(s, 0.05, 0);
        time[i] = cpu_us() - start;
        iterations[i] = r->iterations;
        assert_int_equal(r->flags & STEP_DIVERGED, 0);
        f.push = fmax(f.push, r->proximal_force);
        f.deepest = fmax(f.deepest, r->penetration);
    }
    f.free_us = median(time, FREE);
    f.jammed_us = median(time + JAMMED_FROM, STEPS - JAMMED_FROM);
    f.iterations = median(iterations + JAMMED_FROM, STEPS - JAMMED_FROM);
    f.most_iterations = iterations[STEPS - 1];
    stepper_destroy(s);
    tube->destroy(tube);
    return f;
}

static void a_jammed_tool_costs_little(void **state)
{
    (void)state;
    for (double friction = 0.3; friction < 0.6; friction += WHOLE_OR_SHORT(0.1, 0.4)) {
        JamFigures f = force_in(friction);
        print_message("friction %.1f: push up to %.0f N; a step %.0f us (free %.0f us), %.0f contact iterations, at most %.0f; deepest %.4f mm\n", friction,
                      f.push, f.jammed_us, f.free_us, f.iterations, f.most_iterations, f.deepest);
        assert_true(f.push > 500);                                           // the wire is jammed
        assert_true(f.iterations <= 35);                                     // 51 to 73 without the limit
        assert_true(f.jammed_us < 3 * f.iterations * f.free_us);             // a jammed step solves for all nodes in each iteration
        assert_true(f.most_iterations <= 200);                                // 289 without the limit
        assert_true(f.deepest < 0.05);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_jammed_tool_costs_little)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
