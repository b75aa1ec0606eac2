// Tools never pass the wall: tools from soft to stiff and coarse to fine are pushed, pulled, rotated and jammed in closed tubes. No step leaves a node more
// than 0.2 mm outside, 99 of 100 steps no node more than 20 um, and the energy of the wire never exceeds the work of hand and tension. The depth is measured
// twice: by the solver's report and by this file's distance to lines and arcs, which is independent of the vessel's code.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/short_run.h"
#include "wire_scene.h"

enum { PIECES_MAX = 12, STEPS_MAX = 6000 };

// --- the tube, independent of geom ---

typedef struct Part {
    Vec3 start, tangent, normal;     // frame at the start of the part; an arc bends towards normal
    double length, bend, angle;      // line: bend 0
} Part;

typedef struct Tube {
    int count;
    double radius;
    TubePiece piece[PIECES_MAX];
    Part part[PIECES_MAX];
} Tube;

static void tube_lay(Tube *tube)
{
    Vec3 x = vec3(0, 0, 0), t = vec3(1, 0, 0), n = vec3(0, 1, 0);
    for (int i = 0; i < tube->count; i++) {
        const TubePiece *p = &tube->piece[i];
        Part *part = &tube->part[i];
        if (p->angle == 0) {
            *part = (Part){.start = x, .tangent = t, .normal = n, .length = p->length};
            x = vec3_add_scaled(x, p->length, t);
            continue;
        }
        double c = cos(p->plane), s = sin(p->plane), ca = cos(p->angle), sa = sin(p->angle);
        n = vec3_add_scaled(vec3_scale(n, c), s, vec3_cross(t, n));
        *part = (Part){.start = x, .tangent = t, .normal = n, .bend = p->arc_radius, .angle = p->angle};
        Vec3 centre = vec3_add_scaled(x, p->arc_radius, n), turned = vec3_add_scaled(vec3_scale(n, ca), -sa, t);
        x = vec3_add_scaled(centre, -p->arc_radius, turned);
        t = vec3_add_scaled(vec3_scale(t, ca), sa, n);
        n = turned;
    }
}

static double distance_to_part(const Part *p, Vec3 x)
{
    Vec3 y = vec3_sub(x, p->start);
    if (p->bend == 0)
        return vec3_norm(vec3_add_scaled(y, -fmax(0, fmin(p->length, vec3_dot(y, p->tangent))), p->tangent));
    // in the plane of the arc: the nearest angle about its centre, then the distance to the point there
    double along = vec3_dot(y, p->tangent), across = p->bend - vec3_dot(y, p->normal), angle = atan2(along, across);
    if (angle < 0.5 * p->angle - PI)
        angle += 2 * PI;
    angle = fmax(0, fmin(p->angle, angle));
    Vec3 foot = vec3_add_scaled(vec3_scale(p->normal, p->bend * (1 - cos(angle))), p->bend * sin(angle), p->tangent);
    return vec3_norm(vec3_sub(y, foot));
}

static double tube_outside(const Tube *tube, Vec3 x, double tool_radius)
{
    double least = HUGE_VAL;
    for (int i = 0; i < tube->count; i++)
        least = fmin(least, distance_to_part(&tube->part[i], x));
    return least + tool_radius - tube->radius;
}

#define LINE(l)                                                                                                                                                \
    {                                                                                                                                                          \
        .length = (l)                                                                                                                                          \
    }
#define ARC(r, degrees, plane_degrees)                                                                                                                         \
    {                                                                                                                                                          \
        .arc_radius = (r), .angle = (degrees)*PI / 180, .plane = (plane_degrees)*PI / 180                                                                      \
    }

static const Tube capsule = {.count = 1, .radius = 1.25, .piece = {LINE(10)}};
static const Tube bends = {.count = 5, .radius = 1.25, .piece = {LINE(8), ARC(9, 110, 0), ARC(8, 150, 180), ARC(12, 120, 90), LINE(20)}};
static const Tube coil = {.count = 10,
                          .radius = 0.35,
                          .piece = {LINE(5), ARC(5, 100, 12), ARC(4.4, 100, 12), ARC(3.8, 100, 12), ARC(3.3, 100, 12), ARC(2.9, 100, 12), ARC(2.5, 100, 12),
                                    ARC(2.2, 100, 12), ARC(1.9, 100, 12), ARC(1.7, 100, 12)}};
static const Tube dead_end = {.count = 3, .radius = 0.48, .piece = {LINE(15), ARC(15, 70, 0), LINE(10)}};
static const Tube wide = {.count = 3, .radius = 4, .piece = {LINE(30), ARC(30, 90, 0), LINE(60)}};

// --- a tool and its motion ---

typedef struct Move {
    int steps;
    double push, twist;              // [mm/s], turns a second
} Move;

typedef struct Case {
    const char *name;
    const Tube *tube;
    double modulus, diameter;        // [GPa], [mm]
    int elements;
    double length;                   // [mm] of an element
    double friction, tip_curvature;  // [1/mm] of the last 10 mm
    Move move[4];
} Case;

static const Case cases[] = {
    {"capsule, 10 mm/s", &capsule, 100, 0.3, 60, 0.5, 0.1, 0, {{WHOLE_OR_SHORT(1500, 600), 10, 0}}},
    {"capsule, 50 mm/s", &capsule, 100, 0.3, 120, 0.5, 0.1, 0, {{700, 50, 0}}},
    {"capsule, 200 mm/s", &capsule, 100, 0.3, 120, 0.5, 0.1, 0, {{200, 200, 0}}},
    {"bends, 100 mm/s and pull", &bends, 100, 0.36, 160, 0.5, 0.2, 0.1, {{600, 100, 0}, {280, -200, 0}}},
    {"coil, push and pull", &coil, 100, 0.2, 120, 0.4, 0.2, 0, {{600, 50, 0}, {130, -200, 0}}},
    {"coil, without friction", &coil, 100, 0.2, 120, 0.4, 0, 0, {{200, 200, 0}}},
    {"spin in the wide", &wide, 80, 0.36, 60, 1, 0.1, 0.1, {{600, 50, 0}, {WHOLE_OR_SHORT(4000, 600), 0, 1}}},
    {"spin in bends, mu 0.5", &bends, 80, 0.36, 100, 0.5, 0.5, 0.3, {{600, 50, 0}, {WHOLE_OR_SHORT(1000, 400), 0, 1}, {WHOLE_OR_SHORT(300, 150), 0, -3}}},
    {"jam, mu 0.1", &dead_end, 100, 0.36, 80, 0.75, 0.1, 0, {{1000, 50, 0}, {100, 0, 0}}},
    {"jam, mu 1", &dead_end, 100, 0.36, 80, 0.75, 1, 0, {{WHOLE_OR_SHORT(1000, 600), 50, 0}, {100, -50, 0}}},
    {"noodle", &bends, 0.05, 0.36, 160, 0.5, 0.3, 0, {{350, 200, 0}, {200, -200, 0}}},
    {"hair", &bends, 20, 0.1, 160, 0.5, 0.1, 0.3, {{400, 100, 0}}},
    {"rod of 1 mm", &bends, 20, 1, 100, 0.7, 0.2, 0, {{400, 100, 0}, {150, -200, 0}}},
    {"20 elements of 4 mm", &wide, 80, 0.36, 20, 4, 0.5, 0, {{300, 200, 0}}},
    {"800 elements of 0.05 mm", &bends, 100, 0.36, 800, 0.05, 0.5, 0, {{WHOLE_OR_SHORT(300, 150), 100, 0}, {WHOLE_OR_SHORT(100, 50), -100, 0}}},
};

static Stepper *make(const Case *c, const Vessel *vessel, Bench *b)
{
    double total = c->elements * c->length, tip = c->tip_curvature > 0 ? fmin(10, total / 3) : 0;
    bench_start(b, total - tip, c->elements, 1);
    WireOptions *w = &b->options.wire;
    b->section[1] = b->section[0];
    b->section[1].length = tip;
    b->section[1].rest_curvature = c->tip_curvature;
    w->section_count = tip > 0 ? 2 : 1;
    for (int i = 0; i < 2; i++) {
        b->section[i].diameter = c->diameter;
        b->section[i].young_modulus = 1e3 * c->modulus;
    }
    b->options.vessel = vessel;
    b->options.wall_friction = c->friction;
    w->fix_count = 0;
    w->has_sheath = true;
    w->inserted = 1;
    w->damping_mass = 1e-4;
    w->damping_stiffness = 0.2;
    return bench_make(b);
}

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

typedef struct Outcome {
    int steps, limited, unconverged, linearised_again;
    unsigned flags;
    double reported, outside;        // [mm] worst
    double p99;                      // [mm] depth of the deepest node of each step, measured by this file
    double push, energy;             // largest, [N], [mJ]
} Outcome;

static Outcome run(const Case *c)
{
    static double deepest[STEPS_MAX];
    Tube tube = *c->tube;
    tube_lay(&tube);
    TubeOptions options = {
        .direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = tube.radius, .piece_count = tube.count, .piece = tube.piece, .closed_ends = true};
    Faults faults = {0};
    Vessel *vessel = tube_vessel_create(&options, "test", &faults);
    assert_non_null(vessel);
    Bench b;
    Stepper *s = make(c, vessel, &b);
    const WireState *w = stepper_state(s);
    Outcome o = {0};
    for (int m = 0; m < 4; m++)
        for (int k = 0; k < c->move[m].steps; k++) {
            const StepReport *r = step_once(s, c->move[m].push * 1e-3, c->move[m].twist * 2e-3 * PI);
            double depth = 0;
            for (int i = 0; i < w->node_count; i++) {
                assert_true(vec3_is_finite(w->position[i]));
                if (w->position[i].x > 0 || fabs(w->position[i].y) > 0 || fabs(w->position[i].z) > 0)     // not on the sheath's line
                    depth = fmax(depth, tube_outside(&tube, w->position[i], c->diameter / 2));
            }
            o.flags |= r->flags;
            o.limited += (r->flags & STEP_LIMITED) != 0;
            o.unconverged += (r->flags & STEP_NOT_CONVERGED) != 0;
            o.linearised_again += r->newton > 0;
            o.reported = fmax(o.reported, r->penetration);
            o.outside = fmax(o.outside, depth);
            o.push = fmax(o.push, fabs(r->proximal_force));
            o.energy = fmax(o.energy, stepper_elastic_energy(s));
            assert_true(o.steps < STEPS_MAX);
            deepest[o.steps++] = depth;
        }
    qsort(deepest, (size_t)o.steps, sizeof *deepest, rising);
    o.p99 = deepest[(int)(0.99 * o.steps)];
    stepper_destroy(s);
    vessel->destroy(vessel);
    return o;
}

static void never_through_the_wall(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const Case *c = &cases[i];
        Outcome o = run(c);
        double area = PI / 4 * c->diameter * c->diameter, ea = 1e3 * c->modulus * area, length = c->elements * c->length;
        print_message("%-26s %4d steps: outside p99 %.4f worst %.4f (reported %.4f) mm; linearised again %d, cut %d, unconverged %d; push %.3g N, "
                      "%.3g mJ\n",
                      c->name, o.steps, o.p99, o.outside, o.reported, o.linearised_again, o.limited, o.unconverged, o.push, o.energy);
        assert_int_equal(o.flags & (STEP_DIVERGED | STEP_DEEP | STEP_OUT_OF_VESSEL), 0);
        assert_true(o.outside < 0.2 && o.reported < 0.2);
        assert_true(o.p99 < 0.02);
        // bound: compressed along its whole length by 3 % (where the hand stops) plus the last step, and coiled as tightly as the lumen is wide
        double strain = 0.04, turn = c->diameter / (4 * c->tube->radius);
        assert_true(o.energy < 0.5 * ea * length * (strain * strain + turn * turn));
        assert_true(o.push < strain * ea);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(never_through_the_wall)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
