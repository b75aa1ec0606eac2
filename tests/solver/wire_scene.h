// Small scenes for the tests of the solver: a stepper from a few lines, stepping it, settling it.
#ifndef SELDINGER_TESTS_WIRE_SCENE_H
#define SELDINGER_TESTS_WIRE_SCENE_H

#include "solver/solver.h"

#define EI_STANDARD 65.958366            // [N mm2] of the standard wire (docs/references.md)
#define GJ_STANDARD 50.7372

static const double QUASI_STATIC = 1e6;  // [ms] a step so long that inertia is negligible: a step is a Newton iteration of statics

typedef struct Bench {
    WireSection section[4];
    WireFix fix[4];
    WireLoad load[4];
    StepperOptions options;
} Bench;

static inline WireSection standard_section(double length)
{
    return (WireSection){.length = length, .diameter = 0.36, .young_modulus = 80e3, .poisson_ratio = 0.3, .density = 6.45e-3, .friction = -1};
}

// The standard wire from the origin along +x, e2 = +y, node 0 fixed, nothing damped.
static inline void bench_start(Bench *b, double length, int elements, double dt)
{
    *b = (Bench){0};
    b->section[0] = standard_section(length);
    b->options = (StepperOptions){.wire = wire_default_options(), .contact = contact_default_options(), .dt = dt};
    WireOptions *w = &b->options.wire;
    w->elements = elements;
    w->section = b->section;
    w->section_count = 1;
    w->damping_mass = w->damping_stiffness = 0;
    w->normal = vec3(0, 1, 0);
    w->fix = b->fix;
    w->load = b->load;
    b->fix[w->fix_count++] = (WireFix){.s = 0, .dof = DOF_ALL};
}

static inline void bench_load(Bench *b, double s, Vec3 force, Vec3 moment, double ramp)
{
    b->load[b->options.wire.load_count++] = (WireLoad){.s = s, .force = force, .moment = moment, .ramp = ramp};
}

static inline Stepper *bench_make(const Bench *b)
{
    char why[256];
    Stepper *s = stepper_create(&b->options, why, (int)sizeof why);
    if (!s)
        fail_msg("%s", why);
    return s;
}

static inline const StepReport *step_once(Stepper *s, double advance, double twist)
{
    step_feed(s, (StepCommand){.advance = advance, .twist = twist});
    step_solve(s);
    return step_report(s);
}

static inline Vec3 tip_of(const Stepper *s)
{
    const WireState *w = stepper_state(s);
    return w->position[w->node_count - 1];
}

// Steps without command until no node moves by more than `least` in a step, at least `first` steps. Returns all flags that occurred.
static inline unsigned settle(Stepper *s, int first, int most, double least)
{
    unsigned flags = 0;
    for (int k = 0; k < most; k++) {
        flags |= step_once(s, 0, 0)->flags;
        const WireState *w = stepper_state(s);
        double fastest = 0;
        for (int i = 0; i < w->node_count; i++)
            fastest = fmax(fastest, vec3_norm2(w->velocity[i]));
        if (k >= first && sqrt(fastest) < least / (w->time / (k + 1)))
            break;
    }
    return flags;
}

#endif
