// Quantities derived from the iterate's pose, and the return to the step's start.
#include "solver/tools_internal.h"

#include "base/base.h"

#include <string.h>

double stepper_sheath_coordinate(const Stepper *s, int node)
{
    SEL_ASSERT(node >= 0 && node < s->state.node_count, "the node is one of the chain's");
    return vec3_dot(vec3_sub(s->state.position[node], s->entry.mouth), s->entry.axis[0]);
}

void stepper_go_back(Stepper *s)
{
    size_t nodes = (size_t)s->state.node_count, inner = nodes * (size_t)s->state.inner_count * sizeof(double);
    memcpy(s->state.position, s->start.position, nodes * sizeof *s->start.position);
    memcpy(s->state.orientation, s->start.orientation, nodes * sizeof *s->start.orientation);
    memcpy(s->state.slide, s->start.slide, inner);
    memcpy(s->state.angle, s->start.angle, inner);
}

BeamInput stepper_beam(const Stepper *s, int i)
{
    SEL_ASSERT(i >= 0 && i + 1 < s->state.node_count, "the element is one of the chain's");
    const BeamRest *r = &s->beam.rest;
    const WireState *w = &s->state;
    return (BeamInput){.x1 = w->position[i],
                       .x2 = w->position[i + 1],
                       .q1 = w->orientation[i],
                       .q2 = w->orientation[i + 1],
                       .length = r->length[i],
                       .extend = r->extend[i],
                       .axial = r->axial[i],
                       .near = r->near[i],
                       .far = r->far[i],
                       .twist = r->twist[i],
                       .half_w = r->half_w[i],
                       .half_y = r->half_y[i],
                       .half_z = r->half_z[i]};
}

double tools_span_length(const Stepper *s, int c)
{
    SEL_ASSERT(c >= 0 && c + 1 < s->state.node_count, "the element is one of the chain's");
    int k = s->tools.carrier[c + 1];
    return s->wire.s[c + 1] - (s->tools.carrier[c] == k ? s->wire.s[c] : slide_at(s, c, k));
}

double tools_twist(const Stepper *s, int c)
{
    SEL_ASSERT(c >= 0 && c + 1 < s->state.node_count, "the element is one of the chain's");
    // whole turns of the tool that continues beyond a tip count
    double turned = is_at_tip(s, c) ? angle_at(s, c, s->tools.carrier[c + 1]) : 0;
    Quat q = quat_mul(s->state.orientation[c], quat_from_rotation_vector(vec3(remainder(turned, 2 * PI), 0, 0)));
    Quat p = quat_mul(quat_conjugate(q), s->state.orientation[c + 1]);
    return turned + 2 * same_atan(p.x / p.w);
}
