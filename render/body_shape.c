// With p = M (source - center) and v = M direction, a point at t of the ray is inside where |p + t v|^2 <= 1:
//   t = -p.v / v.v -+ sqrt((1 - |p - (p.v / v.v) v|^2) / v.v)
// Starting from the point nearest to the centre avoids the difference of large numbers. Each plane cuts the interval of t; the solid is convex, so what is left
// is one interval.
#include "render/body_shape.h"

#include <stdlib.h>

void body_free(Body *body)
{
    free(body->shape);
    *body = (Body){0};
}

static BodyShape *new_shape(Body *body)
{
    if (body->count == body->capacity) {
        int capacity = body->capacity ? 2 * body->capacity : 256;
        BodyShape *more = realloc(body->shape, (size_t)capacity * sizeof *more);
        if (!more) {
            body->is_out_of_memory = true;
            return NULL;
        }
        body->shape = more;
        body->capacity = capacity;
    }
    BodyShape *shape = &body->shape[body->count++];
    *shape = (BodyShape){0};
    return shape;
}

static void set_row(Mat3 *m, int row, Vec3 v) { m->m[row][0] = v.x, m->m[row][1] = v.y, m->m[row][2] = v.z; }
static Vec3 get_row(const Mat3 *m, int row) { return vec3(m->m[row][0], m->m[row][1], m->m[row][2]); }

BodyShape *body_add_ellipsoid(Body *body, const BodyEllipsoid *ellipsoid)
{
    BodyShape *shape = new_shape(body);
    if (!shape)
        return NULL;
    Quat turn = ellipsoid->turn;
    bool is_turned = turn.w != 0 || turn.x != 0 || turn.y != 0 || turn.z != 0;
    const Vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double semi[3] = {ellipsoid->semi.x, ellipsoid->semi.y, ellipsoid->semi.z};
    shape->center = ellipsoid->center;
    shape->wall = ellipsoid->attenuation;
    for (int k = 0; k < 3; k++) {
        Vec3 axis = is_turned ? quat_rotate(turn, unit[k]) : unit[k];
        set_row(&shape->to_unit, k, vec3_scale(axis, 1 / semi[k]));
        shape->reach[k] = vec3_scale(axis, semi[k]);
    }
    return shape;
}

void body_shape_clip(BodyShape *shape, int which, Vec3 normal, double offset)
{
    if (!shape)
        return;
    shape->plane[which] = normal;
    shape->offset[which] = offset;
}

void body_shape_hollow(BodyShape *shape, double hollow, double filling)
{
    if (!shape)
        return;
    shape->hollow = hollow;
    shape->filling = filling;
}

static Vec3 direction_of(const BodyTube *tube, int count, const Vec3 *point, int i)
{
    int next = tube->is_closed ? (i + 1) % count : i + 1;
    return vec3_unit(vec3_sub(point[next], point[i]));
}

// A straight piece from point i to the next, between the planes that halve its angles to its neighbours.
static void add_piece(Body *body, const BodyTube *tube, int count, const Vec3 *point, const TubeSize *semi, int i)
{
    int next = (i + 1) % count, pieces = tube->is_closed ? count : count - 1;
    Vec3 along = direction_of(tube, count, point, i), normal[2] = {along, along};
    if (i > 0 || tube->is_closed)
        normal[0] = vec3_unit(vec3_add(along, direction_of(tube, count, point, (i + count - 1) % count)));
    if (i < pieces - 1 || tube->is_closed)
        normal[1] = vec3_unit(vec3_add(along, direction_of(tube, count, point, next)));
    Vec3 width = vec3_unit_or(vec3_add_scaled(tube->width, -vec3_dot(tube->width, along), along), vec3_normal_to(along));
    Vec3 across = vec3_cross(along, width);
    double a = (semi[i].along + semi[next].along) / 2, b = (semi[i].across + semi[next].across) / 2, longest = vec3_distance(point[i], point[next]) / 2;
    BodyShape *shape = new_shape(body);
    if (!shape)
        return;
    shape->center = vec3_mix(point[i], point[next], 0.5);
    set_row(&shape->to_unit, 0, vec3_scale(width, 1 / a));
    set_row(&shape->to_unit, 1, vec3_scale(across, 1 / b));
    shape->wall = tube->wall;
    body_shape_hollow(shape, tube->hollow, tube->filling);
    body_shape_clip(shape, 0, vec3_negate(normal[0]), -vec3_dot(normal[0], point[i]));
    body_shape_clip(shape, 1, normal[1], vec3_dot(normal[1], point[next]));
    // the mitre reaches further than the corner by the tangent of half the angle
    double slope = 0;
    for (int k = 0; k < 2; k++)
        slope = fmax(slope, vec3_norm(vec3_cross(normal[k], along)) / fmax(vec3_dot(normal[k], along), 0.01));
    shape->reach[0] = vec3_scale(width, a);
    shape->reach[1] = vec3_scale(across, b);
    shape->reach[2] = vec3_scale(along, longest + slope * fmax(a, b));
}

void body_add_tube(Body *body, const BodyTube *tube, int count, const Vec3 *point, const TubeSize *semi)
{
    int pieces = tube->is_closed ? count : count - 1;
    for (int i = 0; i < pieces; i++)
        add_piece(body, tube, count, point, semi, i);
}

static Vec3 mirrored(Vec3 v) { return vec3(-v.x, v.y, v.z); }

void body_mirror(Body *body, int first)
{
    for (int i = first, last = body->count; i < last; i++) {
        BodyShape *shape = new_shape(body);
        if (!shape)
            return;
        *shape = body->shape[i];
        shape->center = mirrored(shape->center);
        for (int k = 0; k < 3; k++) {
            set_row(&shape->to_unit, k, mirrored(get_row(&shape->to_unit, k)));
            shape->reach[k] = mirrored(shape->reach[k]);
        }
        for (int k = 0; k < 2; k++)
            shape->plane[k] = mirrored(shape->plane[k]);
    }
}

double body_shape_along(const BodyShape *shape, Vec3 source, Vec3 direction)
{
    Vec3 p = mat3_mul_vec(&shape->to_unit, vec3_sub(source, shape->center)), v = mat3_mul_vec(&shape->to_unit, direction);
    double a = fmax(vec3_norm2(v), 1e-18), middle = -vec3_dot(p, v) / a;
    p = vec3_add_scaled(p, middle, v);
    double nearest = vec3_norm2(p), low = 0, high = HUGE_VAL;
    if (!(nearest < 1))
        return 0;
    for (int k = 0; k < 2; k++) {
        double slope = vec3_dot(shape->plane[k], direction), above = vec3_dot(shape->plane[k], source) - shape->offset[k];
        if (slope > 0)
            high = fmin(high, -above / slope);
        else if (slope < 0)
            low = fmax(low, -above / slope);
        else if (above > 0)
            return 0;
    }
    double half = sqrt((1 - nearest) / a), length = fmax(fmin(middle + half, high) - fmax(middle - half, low), 0), inner = 0;
    if (shape->hollow * shape->hollow > nearest) {
        half = sqrt((shape->hollow * shape->hollow - nearest) / a);
        inner = fmax(fmin(middle + half, high) - fmax(middle - half, low), 0);
    }
    return shape->wall * length + (shape->filling - shape->wall) * inner;
}
