// The state after a step satisfies all invariants in a run with friction through a bend; a deliberate violation of each is found.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>

#include "solver/step_internal.h"
#include "solver/validate.h"
#include "tube_scene.h"

static Stepper *pushed_in(const Vessel *tube, int steps)
{
    Bench b;
    bench_in_tube(&b, tube, 0.2, 60, 60, 5, 1);
    b.options.wire.damping_mass = 1e-3;
    Stepper *s = bench_make(&b);
    for (int i = 0; i < steps; i++) {
        step_once(s, i < 3 * steps / 4 ? 0.1 : -0.1, 0.01);
        const char *broken = stepper_broken(s);
        if (broken)
            fail_msg("step %d: no more holds that %s", i, broken);
    }
    return s;
}

static void a_run_keeps_its_invariants(void **state)
{
    (void)state;
    Vessel *tube = bent_tube(10, 12, PI / 2, 20, 0.6);
    Stepper *s = pushed_in(tube, 500);
    stepper_destroy(s);
    tube->destroy(tube);
}

static void expect_broken(const Stepper *s, const char *wanted)
{
    const char *broken = stepper_broken(s);
    assert_non_null(broken);
    assert_string_equal(broken, wanted);
}

static void what_is_broken_is_found(void **state)
{
    (void)state;
    Vessel *tube = bent_tube(10, 12, PI / 2, 20, 0.6);
    Stepper *s = pushed_in(tube, 300);
    int tip = s->state.node_count - 1;
    Vec3 place = s->state.position[tip], speed = s->state.velocity[tip];
    Quat turn = s->state.orientation[tip];
    s->state.position[tip].y = NAN;
    expect_broken(s, "nodes have finite positions");
    s->state.position[tip] = vec3_add_scaled(place, 5, vec3_unit(vec3_sub(place, s->state.position[tip - 1])));
    expect_broken(s, "elements are about as long as at rest");
    s->state.position[tip] = place;
    s->state.orientation[tip].w *= 1 + 1e-6;
    expect_broken(s, "frames are unit quaternions");
    s->state.orientation[tip] = turn;
    s->state.velocity[tip].x = INFINITY;
    expect_broken(s, "nodes have finite velocities");
    s->state.velocity[tip] = speed;
    assert_null(stepper_broken(s));
    assert_true(s->system.set.count > 1);
    ContactPoint *last = &s->system.set.point[s->system.set.count - 1], kept = *last;
    last->force = vec3_scale(last->normal, -1);
    expect_broken(s, "forces of contacts press and stay in their cones");
    last->force = vec3_add(last->normal, vec3_normal_to(last->normal));
    expect_broken(s, "forces of contacts press and stay in their cones");
    *last = kept;
    last->node = 0;
    expect_broken(s, "contacts stand in the order of the chain");
    last->node = s->system.chain.count;
    expect_broken(s, "contacts are at nodes of the chain");
    *last = kept;
    last->normal = vec3_scale(kept.normal, 1.01);
    expect_broken(s, "contacts have unit normals");
    *last = kept;
    assert_null(stepper_broken(s));
    stepper_destroy(s);
    tube->destroy(tube);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_run_keeps_its_invariants), cmocka_unit_test(what_is_broken_is_found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
