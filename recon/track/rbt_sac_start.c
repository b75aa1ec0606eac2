// Limits: a vessel tapers slowly and a fork's parent is at most 1.3 times as wide as its wider child (Murray: 2^(1/3)); a sac that a click meets is much wider than
// its vessel, and not much longer than wide.
#include "recon/track/rbt_sac_start.h"

#include <stdlib.h>

static const double WIDE = 0.75;         // of the largest radius: belongs to the sac
static const double NARROW = 0.65;       // of the largest radius, at most: the vessel beside it
static const double LONGEST = 3;         // radii, along the axis: a longer part is a vessel
enum { WINDOW = 64 };                    // nodes of the vessel beside the sac that are looked at, within a few radii of the sac

typedef enum { SIDE_VESSEL, SIDE_END, SIDE_WIDE } SideKind;

typedef struct Side {
    SideKind kind;
    double wide;             // [mm] way from the start to the last wide node
    double radius;           // [mm] of the vessel, median
    int count, node[SAC_STARTS];   // on the vessel, 1, 2, … radii of the sac beyond it
} Side;

static double distance_to_border(const Volume *v, Vec3 x)
{
    Vec3 c = volume_voxel_of(v, x);
    const double at[3] = {c.x, c.y, c.z};
    double least = HUGE_VAL;
    for (int i = 0; i < 3; i++)
        least = fmin(least, vec3_norm(v->axis[i]) * fmin(at[i], v->size[i] - 1 - at[i]));
    return least;
}

// From the start's node in one direction along the branch.
static Side side_of(const Tracker *t, int from, int step, double radius)
{
    Side side = {.kind = SIDE_END};
    double way = 0, edge = -1, near[WINDOW];
    int count = 0;
    bool at_border = false;
    for (int i = from; i >= 0 && i < t->tree.count; i += step) {
        const Cylinder *c = &t->tree.node[i].cylinder;
        way += i == from ? 0 : vec3_distance(c->center, t->tree.node[i - step].cylinder.center);
        if (edge < 0 && c->radius >= WIDE * radius) {
            side.wide = way;
            if (distance_to_border(t->volume, c->center) < 2 * radius)
                side.kind = SIDE_WIDE;       // cut by the border: there is no saying where it leads
            continue;
        }
        edge = edge < 0 ? way : edge;
        if (way > edge + (SAC_STARTS + 0.5) * radius || count == WINDOW)
            break;
        if (distance_to_border(t->volume, c->center) < 2 * radius)
            at_border = true;
        near[count++] = c->radius;
        if (side.count < SAC_STARTS && way >= edge + (side.count + 1) * radius)
            side.node[side.count++] = i;
    }
    // what ends within a radius of the sac is the sac's own end, as narrow as its nodes may be there
    if (side.count == 0 && !at_border)
        return side;
    if (count == 0)
        return side;
    sort_doubles(near, (size_t)count);
    side.radius = near[count / 2];
    if (side.radius > NARROW * radius)
        side.kind = SIDE_WIDE;
    else if (side.kind == SIDE_END && side.count > 0)
        side.kind = SIDE_VESSEL;
    return side;
}

// The direction of the largest bright patch on a sphere around the sac that the sac's middle sees: a vessel leaves there. Larger and larger spheres, until the sac
// itself fills little of it.
static void exits_of_sac(const Tracker *t, Vec3 middle, double radius, SacStart *sac)
{
    static const double size[] = {1.3, 1.6, 2, 2.5, 3, 3.5};
    const double most = 0.12, patch = 0.94;      // part of the sphere; cosine of a patch's half angle, 20 degrees
    const double level = 0.5 * (t->background + tracker_brightness(t, middle));
    bool is_bright[MAX_RAYS];
    for (size_t k = 0; k < sizeof size / sizeof *size && sac->count < SAC_STARTS; k++) {
        int bright = 0, best = -1, largest = 0;
        for (int i = 0; i < t->ray_count; i++) {
            Vec3 at = vec3_add_scaled(middle, size[k] * radius, t->ray[i]);
            is_bright[i] = tracker_is_inside(t->volume, at) && tracker_darkest(t, middle, at) > level;
            bright += is_bright[i];
        }
        if (bright > most * t->ray_count)
            continue;
        for (int i = 0; i < t->ray_count; i++) {
            int count = 0;
            for (int j = 0; is_bright[i] && j < t->ray_count; j++)
                count += is_bright[j] && vec3_dot(t->ray[i], t->ray[j]) > patch;
            if (count > largest)
                largest = count, best = i;
        }
        if (best >= 0)
            sac->vessel[sac->count++] = vec3_add_scaled(middle, size[k] * radius, t->ray[best]);
    }
}

bool rbt_starts_in_sac(const Tracker *t, Vec3 start, SacStart *sac)
{
    int at = 0;
    for (int i = 1; i < t->tree.count; i++)
        if (vec3_distance(start, t->tree.node[i].cylinder.center) < vec3_distance(start, t->tree.node[at].cylinder.center))
            at = i;
    if (t->tree.count == 0)
        return false;
    // the widest place that the start belongs to, unless it lies in a vessel beside it
    const double there = t->tree.node[at].cylinder.radius;
    int widest = at;
    for (int step = -1; step <= 1; step += 2)
        for (int i = at; i >= 0 && i < t->tree.count && t->tree.node[i].cylinder.radius >= WIDE * there; i += step)
            widest = t->tree.node[i].cylinder.radius > t->tree.node[widest].cylinder.radius ? i : widest;
    const double radius = t->tree.node[widest].cylinder.radius;
    if (there <= NARROW * radius)
        return false;
    const Side side[2] = {side_of(t, widest, -1, radius), side_of(t, widest, 1, radius)};
    if (side[0].wide + side[1].wide > LONGEST * radius)
        return false;
    *sac = (SacStart){.radius = radius};
    if (side[0].kind == SIDE_END && side[1].kind == SIDE_END) {
        exits_of_sac(t, t->check.cylinder.center, radius, sac);
        return sac->count > 0;
    }
    int best = side[0].kind == SIDE_VESSEL && !(side[1].kind == SIDE_VESSEL && side[1].radius > side[0].radius) ? 0 : 1;
    if (side[best].kind != SIDE_VESSEL || side[1 - best].kind == SIDE_WIDE)
        return false;
    for (int i = 0; i < side[best].count; i++)
        sac->vessel[sac->count++] = t->tree.node[side[best].node[i]].cylinder.center;
    return true;
}

bool rbt_is_vessel_of_sac(const Tracker *t, const SacStart *sac) { return t->check.cylinder.radius <= NARROW * sac->radius; }
