// The energies of a state, and the work of a step's motion: each force at the step's end times the motion, as in implicit Euler.
#include "solver/self_contact.h"
#include "base/base.h"
#include "solver/tools_internal.h"

// Of the elements up to the mouth.
static double held_energy(const Stepper *s, int i)
{
    const BeamRest *r = &s->beam.rest;
    const WireState *w = &s->state;
    if (i + 1 < s->first_free) {
        double k0 = r->curvature[i], strain = stepper_sheath_coordinate(s, i + 1) - stepper_sheath_coordinate(s, i) - r->length[i];
        Quat p = quat_mul(quat_conjugate(w->orientation[i]), w->orientation[i + 1]);
        double twist = 2 * same_atan2(p.x, p.w);
        return 0.5 * (r->axial[i] * strain * strain + r->twist[i] * twist * twist + r->bending[i] * k0 * k0 * r->length[i]);
    }
    SheathElement e;
    sheath_element(r, i, s->entry.mouth, s->entry.axis[0], stepper_sheath_coordinate(s, i), w->orientation[i], w->position[i + 1], w->orientation[i + 1], 0,
                   &e);
    return e.energy;
}

static double tool_energy(const Stepper *s)
{
    int elements = s->wire.element_count, held = s->first_free < elements ? s->first_free : elements;
    double energy = 0;
    for (int i = 0; i < held; i++)
        energy += held_energy(s, i);
    stepper_load_pose(s->state.position, s->state.orientation, held, elements + 1, &s->beam.pose);
    return energy + beam_chain_energy(&s->beam, held, elements);
}

double stepper_elastic_energy(const Stepper *s)
{
    double energy = s->tools.count > 1 ? tools_elastic_energy(s) : tool_energy(s);
    if (s->first_free == s->state.node_count)
        energy -= stepper_tip_straightening(s) * fmax(stepper_sheath_coordinate(s, s->first_free - 1), 0);
    return energy;
}

double stepper_kinetic_energy(const Stepper *s)
{
    if (s->tools.count > 1)
        return tools_kinetic_energy(s);
    double twice = 0;
    for (int i = 0; i < s->state.node_count; i++) {
        Vec3 spin = s->state.spin[i], axis = quat_rotate(s->state.orientation[i], vec3(1, 0, 0));
        double about = vec3_dot(spin, axis);
        twice += s->wire.mass[i] * vec3_norm2(s->state.velocity[i]) + s->wire.inertia_lateral[i] * vec3_norm2(spin) +
                 (s->wire.inertia_axial[i] - s->wire.inertia_lateral[i]) * about * about;
    }
    return 0.5 * twice;
}

// The displacement of a node in this step, translation or rotation, in space axes.
static Vec3 done_in_space(const Stepper *s, int node, int from)
{
    SEL_ASSERT(from == 0 || from == 3, "`from` is the row of translation or rotation");
    const double *u = s->iterate.moved + row_of(s, node) + from;
    return node < s->first_free ? vec3_scale(s->entry.axis[0], u[0]) : vec3(u[0], u[1], u[2]);
}

double stepper_load_work(const Stepper *s)
{
    double work = 0;
    for (int i = 0; i < s->state.node_count; i++)
        work += s->wire.mass[i] * vec3_dot(s->rig.gravity, done_in_space(s, i, 0));
    for (int k = 0; k < s->rig.load_count; k++)
        for (int e = 0; e < 2; e++) {
            Vec3 force, moment;
            int node = s->rig.load[k].node + e;
            if (stepper_load(s, &s->rig.load[k], e, s->state.time, &force, &moment))
                work += vec3_dot(force, done_in_space(s, node, 0)) + vec3_dot(moment, done_in_space(s, node, 3));
        }
    return work;
}

static double of_mass_damping(const Stepper *s)
{
    double sum = 0;
    for (int i = 0; i < s->state.node_count; i++) {
        Vec3 move = done_in_space(s, i, 0), turn = done_in_space(s, i, 3), axis = quat_rotate(s->state.orientation[i], vec3(1, 0, 0));
        double about = vec3_dot(turn, axis);
        sum += s->wire.mass[i] * vec3_norm2(move) + s->wire.inertia_lateral[i] * vec3_norm2(turn) +
               (s->wire.inertia_axial[i] - s->wire.inertia_lateral[i]) * about * about;
    }
    return s->damping_mass / s->dt * sum;
}

StepEnergy stepper_energy(Stepper *s)
{
    StepEnergy e = {.elastic = stepper_elastic_energy(s), .kinetic = stepper_kinetic_energy(s)};
    if (s->progress.has_failed || s->report.is_at_rest)
        return e;
    e.hand = hands_work(s);
    e.load = stepper_load_work(s);
    e.damping = of_mass_damping(s) + stepper_stiffness_damping(s);
    stepper_wall_work(s, &e.wall, &e.friction);
    e.friction += hands_valve_work(s);
    e.hand_start = hands_start_work(s, false);
    e.contact_start = stepper_start_work(s) - tools_friction_start_work(s) + hands_start_work(s, true);
    double pairs[2] = {0, 0};
    self_contact_work(s, &pairs[0], &pairs[1]);
    e.contact_start += pairs[0] - pairs[1];
    return e;
}
