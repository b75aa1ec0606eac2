// The position and velocity of a point of a tool, and the wall's force on the tool's distal part, for observers that follow a run step by step. Makes no vessel
// query.
#include "solver/tools_internal.h"

#include "base/base.h"

static bool is_carrier(const Stepper *s, int c, int k) { return s->tools.count == 1 || s->tools.carrier[c] == k; }
static double material_at(const Stepper *s, int c, int k) { return is_carrier(s, c, k) ? s->wire.s[c] : slide_at(s, c, k); }
static bool lies_at(const Stepper *s, int c, int k) { return is_carrier(s, c, k) || c < s->tools.tool[k].inside; }

// The element that contains `at` of tool k: the first one whose distal node lies beyond it, or the last one that the tool reaches into.
static int element_of(const Stepper *s, int k, double at)
{
    SEL_ASSERT(k >= 0 && k < s->tools.count && s->state.node_count > 1, "the tool is one of the chain");
    int c = 0;
    while (c + 2 < s->state.node_count && lies_at(s, c + 1, k) && material_at(s, c + 1, k) <= at)
        c++;
    return c;
}

// The velocity of tool k's material at node c: the node's own, except along the line, where the tool slides.
static Vec3 velocity_at(const Stepper *s, int c, int k, Vec3 along)
{
    SEL_ASSERT(c >= 0 && c < s->state.node_count, "the node is one of the chain's");
    Vec3 v = s->state.velocity[c];
    if (is_carrier(s, c, k) || !lies_at(s, c, k))
        return v;
    return vec3_add_scaled(v, s->state.slide_velocity[c * s->state.inner_count + k - 1] - vec3_dot(v, along), along);
}

ToolPlace stepper_tool_place(const Stepper *s, int k, double at)
{
    const WireState *w = &s->state;
    int c = element_of(s, k, at), end = c + 1;
    // a tool that ends inside the element is as long there as the tool around it; one that ends just beyond another's tip has no node there yet
    bool ends = !lies_at(s, end, k);
    double from = material_at(s, c, k), span = ends ? tools_span_length(s, c) : material_at(s, end, k) - from;
    SEL_ASSERT(span > 0, "an element has a length");
    double part = (at - from) / span;
    ToolPlace place = {.along = vec3_unit(vec3_sub(w->position[end], w->position[c]))};
    Vec3 near = velocity_at(s, c, k, place.along), far = ends ? near : velocity_at(s, end, k, place.along);
    if (part < 0) {              // behind the hub: on the straight line through it
        place.along = quat_rotate(w->orientation[c], vec3(1, 0, 0));
        place.position = vec3_add_scaled(w->position[c], at - from, place.along);
        place.velocity = near;
        return place;
    }
    place.position = part != 1 ? vec3_mix(w->position[c], w->position[end], part) : w->position[end];
    place.velocity = vec3_mix(near, far, fmin(part, 1));
    return place;
}

double stepper_tool_length(const Stepper *s, int k)
{
    SEL_ASSERT(k >= 0 && k < s->tools.count, "the tool is one of the chain");
    const Wire *own = s->tools.count > 1 ? &s->tools.tool[k].wire : &s->wire;
    return own->s[own->node_count - 1];
}

Vec3 stepper_tool_wall_force(const Stepper *s, int k, double from)
{
    SEL_ASSERT(k >= 0 && k < s->tools.count, "the tool is one of the chain");
    Vec3 sum = {0, 0, 0};
    int count = s->state.node_count, first = count;
    while (first > 0 && !(is_carrier(s, first - 1, k) && s->wire.s[first - 1] < from))     // nothing proximal to that node counts
        first--;
    for (int c = first; c < count; c++) {
        if (!is_carrier(s, c, k))
            continue;
        if (s->wire.s[c] >= from)
            sum = vec3_add(sum, s->points.force[c]);
        for (int i = c > 0 ? s->points.slot_start[c - 1] : 0; c > 0 && i < s->points.slot_start[c]; i++)
            if (s->wire.s[c] - (1 - s->points.slot[i].xi) * s->wire.length[c - 1] >= from)
                sum = vec3_add(sum, s->points.force[count + i]);
    }
    return sum;
}
