// A wire is pushed into a bent tube of triangles (flat, with curvature, with smooth normals) and into the exact tube; it stays inside. With smooth normals it
// moves as in the exact tube. On flat triangles, whose change of direction a step cannot foresee, its tip swings from face to face and penetrates deeper than
// in a smooth wall.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../geom/small_meshes.h"
#include "geom/mesh_vessel.h"
#include "tube_scene.h"

static const double RADIUS = 0.6, STRAIGHT = 6, BEND = 8, ANGLE = PI / 2, AFTER = 14, TOOL_RADIUS = 0.18;

typedef struct Passage {
    double push;             // [N] mean of the second half
    double deepest;          // [mm] of the tool beyond the exact tube
    unsigned flags;
} Passage;

// [mm] distance of x beyond the wall of the exact tube, from lines and arc.
static double outside(Vec3 x, double tool_radius)
{
    Vec3 y = vec3_sub(x, vec3(STRAIGHT, BEND, 0));
    double d;
    if (x.x < STRAIGHT)
        d = hypot(x.y, x.z);
    else if (y.y < 0)
        d = hypot(hypot(y.x, y.y) - BEND, x.z);
    else
        d = hypot(y.x - BEND, x.z);
    return d + tool_radius - RADIUS;
}

static Passage push_through(const Vessel *vessel)
{
    Bench b;
    bench_in_tube(&b, vessel, 0, 30, 60, 1, 1);
    b.options.wire.damping_mass = 0.01;
    Stepper *s = bench_make(&b);
    Passage p = {0};
    int steps = 400;
    for (int k = 0; k < steps; k++) {
        const StepReport *r = step_once(s, 0.05, 0);
        p.flags |= r->flags;
        p.push += k >= steps / 2 ? r->proximal_force / (steps - steps / 2) : 0;
        const WireState *w = stepper_state(s);
        for (int i = 0; i < w->node_count; i++)
            if (w->position[i].x > 0)
                p.deepest = fmax(p.deepest, outside(w->position[i], TOOL_RADIUS));
    }
    stepper_destroy(s);
    return p;
}

static void stays_inside_a_meshed_tube(void **state)
{
    (void)state;
    if (!mesh_vessel_available()) {
        print_message("skipped: built without Embree\n");
        skip();
    }
    Vessel *exact = bent_tube(STRAIGHT, BEND, ANGLE, AFTER, RADIUS);
    Passage reference = push_through(exact);
    print_message("exact tube:   push %8.5f N, deepest %.4f mm\n", reference.push, reference.deepest);
    TriangleMesh mesh = bent_tube_mesh(RADIUS, -2, STRAIGHT, BEND, ANGLE, AFTER, 0.15, 32);
    for (int normals = MESH_FACES; normals <= MESH_SMOOTH; normals++) {
        MeshVesselOptions options = mesh_vessel_default_options();
        options.normals = (MeshNormals)normals;
        Faults faults = {0};
        Vessel *vessel = mesh_vessel_create(&mesh, &options, "test", &faults);
        assert_non_null(vessel);
        Passage p = push_through(vessel);
        print_message("%-12s  push %8.5f N, deepest %.4f mm\n", vessel->kind, p.push, p.deepest);
        assert_false(p.flags & (STEP_DIVERGED | STEP_OUT_OF_VESSEL | STEP_DEEP | STEP_DETECTION_UNSURE));
        // flat: no centre of a node may leave. Others: the distance of a 32-sided polygon from the circle, 2.9 um, and as much for the rotation in a step
        assert_true(p.deepest < (normals == MESH_FACES ? TOOL_RADIUS : 2 * RADIUS * (1 - cos(PI / 32))));
        assert_true(fabs(p.push / reference.push - 1) < (normals == MESH_FACES ? 0.2 : 0.01));
        vessel->destroy(vessel);
    }
    exact->destroy(exact);
    mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(stays_inside_a_meshed_tube)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
