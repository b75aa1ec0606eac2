// Wires in exact tubes for the tests of contact mechanics: tubes from a list of pieces, quasi-static feeding, resultants of the wall's forces.
#ifndef SELDINGER_TESTS_TUBE_SCENE_H
#define SELDINGER_TESTS_TUBE_SCENE_H

#include "wire_scene.h"

static inline TubePiece line_piece(double length) { return (TubePiece){.length = length}; }
static inline TubePiece arc_piece(double radius, double degrees, double plane_degrees)
{
    return (TubePiece){.arc_radius = radius, .angle = degrees * PI / 180, .plane = plane_degrees * PI / 180};
}

// From the origin along +x, arcs of plane 0 towards +y.
static inline Vessel *tube_of(const TubePiece *piece, int count, double radius)
{
    TubeOptions options = {.direction = {1, 0, 0}, .normal = {0, 1, 0}, .radius = radius, .piece_count = count, .piece = piece};
    Faults faults = {0};
    Vessel *vessel = tube_vessel_create(&options, "test", &faults);
    assert_non_null(vessel);
    return vessel;
}

static inline Vessel *bent_tube(double straight, double bend, double angle, double after, double radius)
{
    TubePiece piece[3] = {line_piece(straight), arc_piece(bend, angle * 180 / PI, 0), line_piece(after)};
    return tube_of(piece, 3, radius);
}

// The standard wire behind a sheath at the origin, undamped.
static inline void bench_in_tube(Bench *b, const Vessel *vessel, double friction, double length, int elements, double inserted, double dt)
{
    bench_start(b, length, elements, dt);
    b->options.vessel = vessel;
    b->options.wall_friction = friction;
    b->options.wire.fix_count = 0;
    b->options.wire.has_sheath = true;
    b->options.wire.inserted = inserted;
}

// Bending stiffness EI [N mm2] by Young's modulus.
static inline void section_stiffness(WireSection *section, double bending)
{
    double d = section->diameter;
    section->young_modulus = bending / (PI / 64 * d * d * d * d);
}

static inline unsigned feed(Stepper *s, double distance, int steps)
{
    unsigned flags = 0;
    for (int k = 0; k < steps; k++)
        flags |= step_once(s, distance / steps, 0)->flags;
    return flags;
}

// One row of a test's table; the relative error.
static inline double row(const char *name, const char *what, double reference, double result)
{
    double error = result / reference - 1;
    print_message("%-34s %-26s reference %12.7g  result %12.7g  error %+8.3f %%\n", name, what, reference, result, 100 * error);
    return error;
}

typedef struct Wall {        // action of the wall on the wire
    Vec3 force;              // [N] resultant
    Vec3 moment;             // [N mm] about the origin
    double sum;              // [N] of magnitudes
    double deepest;          // [mm]
    int contacts;
} Wall;

static inline Wall wall_of(Stepper *s)
{
    Wall w = {0};
    int nodes = stepper_state(s)->node_count;
    NodeReport *node = calloc((size_t)nodes, sizeof *node);
    stepper_node_report(s, node);
    for (int i = 0; i < nodes; i++) {
        double force = vec3_norm(node[i].force);
        w.force = vec3_add(w.force, node[i].force);
        w.moment = vec3_add(w.moment, vec3_cross(stepper_state(s)->position[i], node[i].force));
        w.sum += force;
        w.contacts += force > 0;
        w.deepest = isfinite(node[i].gap) ? fmax(w.deepest, -node[i].gap) : w.deepest;
    }
    free(node);
    return w;
}

#endif
