// Slots (slot.h).
//
// Between contact points a distance h apart, a convex wall of radius R intrudes by h^2 / (8 R): a spacing of 0.6 mm keeps this below 0.02 mm on the inner
// side of a bend of 3 mm radius. Elements longer than 10 mm would need more than 15 slots, but tools with such elements do not bend that sharply.
#include "solver/slot.h"

#include "base/base.h"

static const double SPACING = 0.6;       // [mm] largest distance between contact points
enum { SLOTS_MAX = 15 };                 // per element
// Share of the length outside the sheath: closer to the mouth than this, the wire deviates negligibly from the line.
static const double MOUTH_PART = 0.1;

int slot_count_of(double length)
{
    double count = ceil(length / SPACING - 1e-9) - 1;
    return count < 0 ? 0 : count > SLOTS_MAX ? SLOTS_MAX : (int)count;
}

static void set_shape(Slot *s, double xi, double length)
{
    SEL_ASSERT(xi >= 0 && xi <= 1 && length > 0, "a slot lies on its element");
    s->xi = xi;
    s->weight = xi * xi * (3 - 2 * xi);
    s->near = length * xi * (1 - xi) * (1 - xi);
    s->far = length * xi * xi * (xi - 1);
}

Slot slot_make(int element, double length, int k, int count, double radius, double friction)
{
    SEL_ASSERT(k >= 0 && k < count && count <= SLOTS_MAX, "the index of a slot is within its element");
    Slot s = {.element = element, .radius = radius, .friction = friction};
    set_shape(&s, (double)(k + 1) / (count + 1), length);
    return s;
}

Slot slot_shifted(const Slot *slot, double length, double xi)
{
    Slot s = *slot;
    set_shape(&s, xi, length);
    return s;
}

SlotPlace slot_place(const Slot *s, double length, Vec3 x1, Vec3 t1, Vec3 x2, Vec3 t2)
{
    SEL_ASSERT(length > 0, "an element has a length");
    SlotPlace p = {.weight = s->weight, .lever = {vec3_scale(t1, s->near), vec3_scale(t2, s->far)}};
    Vec3 chord = vec3_sub(x2, x1);
    p.position = vec3_add(vec3_add_scaled(x1, s->weight, chord), vec3_add(p.lever[0], p.lever[1]));
    double xi = s->xi, slope = 6 * xi * (1 - xi) / length;
    Vec3 tangent = vec3_add_scaled(vec3_scale(t1, (1 - xi) * (1 - 3 * xi)), xi * (3 * xi - 2), t2);
    p.tangent = vec3_unit_or(vec3_add_scaled(tangent, slope, chord), t1);
    return p;
}

bool slot_place_beyond(const Slot *slot, double length, double behind, Vec3 x1, Vec3 t1, Vec3 x2, Vec3 t2, SlotPlace *place)
{
    double outside = length - behind, xi = outside > 0 ? (slot->xi * length - behind) / outside : 0;
    if (!(xi > MOUTH_PART && xi < 1))
        return false;
    Slot s = slot_shifted(slot, outside, xi);
    *place = slot_place(&s, outside, x1, t1, x2, t2);
    return true;
}

bool slot_place_at_mouth(const Slot *slot, double length, double coordinate, Vec3 mouth, Vec3 direction, Vec3 x2, Vec3 t2, SlotPlace *place)
{
    return slot_place_beyond(slot, length, -coordinate, mouth, direction, x2, t2, place);
}
