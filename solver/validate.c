#include "solver/validate.h"

#include "solver/step_internal.h"

// The strain is small: a tool's own stiffness keeps an element's length to within a few percent, unless a load of a test rig is larger than what a tenth of
// strain takes. The chord of a bent element is shorter than its arc.
static const double TORN = 1.1, CRUSHED = 0.3;
static const double CUT = 1e-6;          // of a force: tolerance for rounding at the cone

static const char *broken_state(const WireState *w)
{
    if (!isfinite(w->time) || !isfinite(w->inserted) || !isfinite(w->twist))
        return "time, inserted length and twist are finite";
    for (int i = 0; i < w->node_count; i++) {
        if (!vec3_is_finite(w->position[i]))
            return "nodes have finite positions";
        if (!quat_is_unit(w->orientation[i]))
            return "frames are unit quaternions";
        if (!vec3_is_finite(w->velocity[i]) || !vec3_is_finite(w->spin[i]))
            return "nodes have finite velocities";
    }
    for (int i = 0; i < w->node_count * w->inner_count; i++)
        if (!isfinite(w->slide[i]) || !isfinite(w->angle[i]))
            return "tools inside others have finite places";
    return NULL;
}

static double most_load(const Stepper *s)
{
    double most = 0;
    for (int k = 0; k < s->rig.load_count; k++)
        most = fmax(most, vec3_norm(s->rig.load[k].load.force));
    return most;
}

static const char *broken_elements(const Stepper *s)
{
    const double load = most_load(s);
    for (int i = s->first_free; s->tools.count == 1 && i + 1 < s->state.node_count; i++) {    // with several tools, chain ends appear and disappear
        double chord = vec3_distance(s->state.position[i], s->state.position[i + 1]), rest = s->wire.length[i];
        bool strain_is_small = load < (TORN - 1) * s->beam.rest.axial[i] * rest;
        if (strain_is_small && !(chord < TORN * rest && chord > CRUSHED * rest))
            return "elements are about as long as at rest";
    }
    return NULL;
}

static bool is_in_cone(Vec3 force, Vec3 normal, double friction)
{
    double pressure = vec3_dot(force, normal), allowed = CUT * (vec3_norm(force) + 1e-6);
    double tangential = vec3_norm(vec3_add_scaled(force, -pressure, normal));
    return pressure >= -allowed && tangential <= friction * pressure + allowed;
}

static const char *broken_contacts(const Stepper *s)
{
    const ContactSet *set = &s->system.set;
    if (set->count < 0 || set->count > set->capacity)
        return "there is room for all contacts";
    for (int i = 0; i < set->count; i++) {
        const ContactPoint *p = &set->point[i], *before = i > 0 ? p - 1 : p;
        if (p->node < 0 || p->node >= s->system.chain.count || !(p->xi >= 0 && p->xi < 1))
            return "contacts are at nodes of the chain";
        if (p->node < before->node)
            return "contacts stand in the order of the chain";
        if (fabs(vec3_norm2(p->normal) - 1) > 1e-6)
            return "contacts have unit normals";
        if (!is_in_cone(p->force, p->normal, p->friction))
            return "forces of contacts press and stay in their cones";
    }
    for (int i = 0; i < set->pair_count; i++)
        if (!is_in_cone(set->pair[i].force, set->pair[i].normal, set->pair[i].friction))
            return "forces of self-contacts press and stay in their cones";
    return NULL;
}

const char *stepper_broken(const Stepper *s)
{
    const char *broken = broken_state(&s->state);
    broken = broken ? broken : broken_elements(s);
    return broken ? broken : broken_contacts(s);
}
