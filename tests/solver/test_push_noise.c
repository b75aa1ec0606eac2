// The change of the push at the hand from step to step, and with the step size: the phantom scene's wire on the phantom's exact wall.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "bench/shape_vessel.h"
#include "recon/phantom/phantom.h"
#include "tests/short_run.h"
#include "tube_scene.h"

static const double TURN_S = 1, QUIET_S = 2, END_S = 6, SPEED = 0.02;     // [s], [mm/ms]: it rotates until 1 s and is measured from 2 s on

typedef struct Push {
    double mean;             // [N]
    double change;           // rms of the change in a step, divided by the mean
    double work;             // [mJ] of the hand
} Push;

static Vessel *phantom(Shape **shape)
{
    Faults faults = {0};
    *shape = shape_create("phantom", 0, NULL, "test", &faults);
    Vessel *wall = *shape ? shape_vessel_create(*shape) : NULL;
    assert_non_null(wall);
    return wall;
}

static Push push_in(const Vessel *wall, double friction, double dt)
{
    Bench b;
    bench_in_tube(&b, wall, friction, 300, 200, 2, dt);
    b.section[0].length = 270;
    b.section[1] = standard_section(30), b.section[1].young_modulus = 5e3, b.section[1].rest_curvature = 0.1;
    b.options.wire.section_count = 2;
    assert_true(wall->inlet(wall, &b.options.wire.start, &b.options.wire.direction));
    b.options.wire.normal = vec3_normal_to(b.options.wire.direction);
    b.options.wire.damping_stiffness = 0.2, b.options.wire.damping_mass = 1e-4;
    b.options.follows_touch = true;
    Stepper *s = bench_make(&b);
    Push p = {0, 0, 0};
    double last = 0;
    int turn = (int)(1000 * TURN_S / dt + 0.5), quiet = (int)(1000 * QUIET_S / dt + 0.5), end = (int)(1000 * END_S / dt + 0.5);
    for (int i = 0; i < end; i++) {
        double force = step_once(s, i < turn ? 0 : SPEED * dt, i < turn ? PI / 1000 * dt : 0)->proximal_force;
        p.work += i < turn ? 0 : force * SPEED * dt;
        p.mean += i < quiet ? 0 : force / (end - quiet);
        p.change += i < quiet ? 0 : (force - last) * (force - last) / (end - quiet);
        last = force;
    }
    p.change = sqrt(p.change) / p.mean;
    stepper_destroy(s);
    return p;
}

// With contact points that did not follow the place of contact, the change was 2.6 (mu 0) and 1.4 % (0.04) per step, and the
// work was 5.6 % larger at 2 ms than at 1 ms.
static void push_does_not_go_to_and_fro(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();
    static const double friction[] = {0, 0.04}, most[] = {0.0187, 0.011};
    Shape *shape;
    Vessel *wall = phantom(&shape);
    double work = 0;
    for (int k = 0; k < 2; k++) {
        Push push = push_in(wall, friction[k], 1);
        print_message("mu %.2f: mean push %.4f N, changes by %.2f %% of it a step of 1 ms; work %.2f mJ\n", friction[k], push.mean, 100 * push.change,
                      push.work);
        assert_true(push.mean > 0.4 && push.change < most[k]);
        work = push.work;
    }
    double coarse = push_in(wall, friction[1], 2).work;
    print_message("work %.2f mJ at 2 ms, %.2f %% more\n", coarse, 100 * (coarse / work - 1));
    assert_true(fabs(coarse / work - 1) < 0.025);
    wall->destroy(wall);
    shape_free(shape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(push_does_not_go_to_and_fro)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
