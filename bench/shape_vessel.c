// See shape_vessel.h. A shape's straight pieces beyond its open ends are six radii long and closed by a cap, so a point further upstream than LENGTH radii is
// moved to LENGTH radii upstream before the query.
#include "bench/shape_vessel.h"

#include "recon/phantom/phantom_parts.h"

#include <stdlib.h>

static const double LENGTH = 5;              // [radii]
static const double NUDGE = 1e-6;            // [radii] off the centreline
static const double ASIDE = 0.02;            // [radii] of starts beside x
static const double STEP = 1e-4;             // [radii] of the differences

typedef struct ShapeVessel {
    Vessel vessel;           // first: a Vessel * to us is a ShapeVessel *
    const Shape *shape;
} ShapeVessel;

// Distance beyond an open end of the section that is used at x, in radii; 0: x is not beyond an open end. `is_inlet`: the end is that of the root.
static double beyond_end(const Shape *shape, Vec3 x, bool *is_inlet, Station *section)
{
    int which;
    double at;
    shape_field_of_part(shape, x, &which, &at);
    const Part *part = &shape->part[which];
    double last = part->at[part->knot_count - 1];
    *is_inlet = which == 0 && part->open_start && at < 0;
    *section = part_at(part, at);
    double before = part->open_start ? -at : 0, after = part->open_end ? at - last : 0;
    return fmax(0, fmax(before, after)) / section->radius;
}

static Vec3 normal_at(const Shape *shape, Vec3 x)
{
    Vec3 g;
    shape_field(shape, x, &g);
    return vec3_unit_or(g, vec3(0, 0, 0));
}

// S (I + gap S)^-1 in the tangent plane, S the derivative of the normal at the foot.
static Sym3 hessian_at(const Shape *shape, Vec3 foot, Vec3 n, double gap, double step)
{
    Vec3 e[2] = {vec3_normal_to(n)}, d[2];
    e[1] = vec3_cross(n, e[0]);
    for (int k = 0; k < 2; k++) {
        Vec3 up = normal_at(shape, vec3_add_scaled(foot, step, e[k])), down = normal_at(shape, vec3_add_scaled(foot, -step, e[k]));
        d[k] = vec3_scale(vec3_sub(up, down), 0.5 / step);
    }
    double a = vec3_dot(d[0], e[0]), b = 0.5 * (vec3_dot(d[0], e[1]) + vec3_dot(d[1], e[0])), c = vec3_dot(d[1], e[1]);
    // (I + gap S)^-1 S of a symmetric 2 x 2 matrix, by Cayley and Hamilton
    double determinant = a * c - b * b, scale = 1 + gap * (a + c) + gap * gap * determinant;
    if (!(fabs(scale) > 1e-9))
        return (Sym3){0, 0, 0, 0, 0, 0};     // a focal point
    double p = (a + gap * determinant) / scale, q = b / scale, r = (c + gap * determinant) / scale;
    Vec3 u = vec3_add(vec3_scale(e[0], p), vec3_scale(e[1], q)), v = vec3_add(vec3_scale(e[0], q), vec3_scale(e[1], r));
    return (Sym3){e[0].x * u.x + e[1].x * v.x, e[0].x * u.y + e[1].x * v.y, e[0].x * u.z + e[1].x * v.z,
                  e[0].y * u.y + e[1].y * v.y, e[0].y * u.z + e[1].y * v.z, e[0].z * u.z + e[1].z * v.z};
}

// The closest point of x on the wall, and the side of x. On a part's centreline, and between two, the gradient of the field vanishes or leads to a point that is
// not the nearest. If the distance to the point found is much larger than the field (which never exceeds the distance), starts beside x are tried too.
static double closest_foot(const Shape *shape, Vec3 x, const Station *section, Vec3 *foot)
{
    Vec3 along = vec3_unit(section->tangent), u = vec3_normal_to(along), v = vec3_cross(along, u);
    const Vec3 aside[5] = {{0, 0, 0}, u, v, vec3_negate(u), vec3_negate(v)};
    double field = shape_field(shape, x, NULL), least = HUGE_VAL, r = section->radius;
    bool on_axis = vec3_distance(x, section->center) < NUDGE * r;
    for (int k = on_axis; k < 5 && !(least < fabs(field) + 0.05 * r); k++) {
        Vec3 p;
        shape_distance(shape, vec3_add_scaled(x, on_axis ? NUDGE * r : ASIDE * r, aside[k]), &p);
        if (fabs(shape_field(shape, p, NULL)) < 1e-9 * fmax(1, r) && vec3_distance(x, p) < least) {
            least = vec3_distance(x, p);
            *foot = p;
        }
    }
    if (least == HUGE_VAL)
        shape_distance(shape, x, foot);
    return field < 0 ? -1 : 1;
}

static VesselHit hit_at(const Shape *shape, Vec3 x, double reach, VesselMemory *memory)
{
    VesselHit hit = {.node = 0};
    *memory = (VesselMemory){.node = 0};
    if (!(vec3_norm2(x) < 1e100)) {
        hit.flags = VESSEL_UNSURE;
        return hit;
    }
    bool is_inlet;
    Station section;
    const Vec3 place = x;
    const Part *root = &shape->part[0];
    if (root->open_start) {
        // far upstream, within reach of the inlet's cylinder
        Station start = part_at(root, 0);
        Vec3 along = vec3_unit(start.tangent), from = vec3_sub(x, start.center);
        double height = vec3_dot(from, along), most = -LENGTH * start.radius;
        if (height < most && beyond_end(shape, vec3_add_scaled(x, most - height, along), &is_inlet, &section) > 0 && is_inlet)
            x = vec3_add_scaled(x, most - height, along);
    }
    double beyond = beyond_end(shape, x, &is_inlet, &section);
    if (beyond > LENGTH && !is_inlet) {
        hit.gap = HUGE_VAL;
        hit.flags = VESSEL_OPEN_END;
        return hit;
    }
    double field = shape_field(shape, x, NULL);
    hit.flags = beyond > 0 ? VESSEL_BEYOND : 0;
    if (field > reach) {                     // the field never exceeds the distance
        hit.gap = field;
        hit.flags |= VESSEL_FAR;
        return hit;
    }
    Vec3 foot;
    double sign = closest_foot(shape, x, &section, &foot);
    hit.gap = sign * vec3_distance(x, foot);
    hit.normal = normal_at(shape, foot);
    hit.hessian = hessian_at(shape, foot, hit.normal, hit.gap, STEP * section.radius);
    if (vec3_norm2(hit.normal) == 0)
        hit.flags |= VESSEL_UNSURE;
    memory->has_foot = true;
    memory->foot = vec3_add(foot, vec3_sub(place, x));
    return hit;
}

static void shape_query(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    for (int i = 0; i < count; i++)
        hit[i] = hit_at(((const ShapeVessel *)vessel)->shape, point[i], reach, &memory[i]);
}

static int shape_locate(const Vessel *vessel, Vec3 point, int from)
{
    (void)vessel, (void)point, (void)from;
    return 0;
}

static bool shape_inlet(const Vessel *vessel, Vec3 *point, Vec3 *direction)
{
    Station start = part_at(&((const ShapeVessel *)vessel)->shape->part[0], 0);
    *point = start.center;
    *direction = vec3_unit(start.tangent);
    return true;
}

static void shape_destroy(Vessel *vessel) { free(vessel); }

Vessel *shape_vessel_create(const Shape *shape)
{
    ShapeVessel *v = calloc(1, sizeof *v);
    if (!v)
        return NULL;
    v->shape = shape;
    v->vessel = (Vessel){.kind = "shape",
                         .query = shape_query,
                         .locate = shape_locate,
                         .inlet = shape_inlet,
                         .destroy = shape_destroy,
                         .primitives = shape->part_count,
                         .bytes = sizeof *v};
    for (int p = 0; p < shape->part_count; p++) {
        const Part *part = &shape->part[p];
        v->vessel.bytes += sizeof *part + (size_t)part->sample_count * (sizeof(Vec3) + 2 * sizeof(double)) +
                           (size_t)part->block_count * (sizeof(Vec3) + sizeof(int) + 3 * sizeof(double));
    }
    return &v->vessel;
}
