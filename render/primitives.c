// Tubes are swept along a spline with a frame transported without twist. The projection of the last normal is accurate enough for a picture (double reflection
// would be
// fourth-order). Round ends are rings of decreasing radius on the sphere around the end point.
#include "render/primitives.h"

#include <stdlib.h>
#include <string.h>

enum { USUAL_SIDES = 14, SUBDIVISIONS = 5, CAP_RINGS = 4 };

void primitives_clear(Primitives *primitives) { primitives->vertex_count = primitives->index_count = 0; }

void primitives_free(Primitives *primitives)
{
    free(primitives->vertex);
    free(primitives->index);
    *primitives = (Primitives){0};
}

static bool reserve(Primitives *primitives, int vertices, int indices)
{
    if (primitives->vertex_count > 50000000 - vertices || primitives->index_count > 50000000 - indices) {
        primitives->is_short_of_memory = true;
        return false;
    }
    while (primitives->vertex_count + vertices > primitives->vertex_capacity) {
        int capacity = primitives->vertex_capacity ? 2 * primitives->vertex_capacity : 4096;
        PrimitiveVertex *grown = realloc(primitives->vertex, (size_t)capacity * sizeof *grown);
        if (!grown) {
            primitives->is_short_of_memory = true;
            return false;
        }
        primitives->vertex = grown;
        primitives->vertex_capacity = capacity;
    }
    while (primitives->index_count + indices > primitives->index_capacity) {
        int capacity = primitives->index_capacity ? 2 * primitives->index_capacity : 16384;
        uint32_t *grown = realloc(primitives->index, (size_t)capacity * sizeof *grown);
        if (!grown) {
            primitives->is_short_of_memory = true;
            return false;
        }
        primitives->index = grown;
        primitives->index_capacity = capacity;
    }
    return true;
}

static void add_vertex(Primitives *primitives, Vec3 p, Vec3 n, Color color)
{
    Vec3 d = vec3_sub(p, primitives->origin);
    primitives->vertex[primitives->vertex_count++] = (PrimitiveVertex){{(float)d.x, (float)d.y, (float)d.z}, {(float)n.x, (float)n.y, (float)n.z}, color};
}

// Adds a ring of vertices; `lean` tilts the normals along the tangent (cos and sin of the angle from the radial direction). With `join` it is joined to the
// previous ring.
static void add_ring(Primitives *primitives, Vec3 center, Vec3 tangent, Vec3 normal, double radius, double lean_cos, double lean_sin, Color color, bool join)
{
    int sides = primitives->sides > 2 ? primitives->sides : USUAL_SIDES;
    if (!reserve(primitives, sides, 6 * sides))
        return;
    Vec3 binormal = vec3_cross(tangent, normal);
    uint32_t first = (uint32_t)primitives->vertex_count;
    for (int k = 0; k < sides; k++) {
        double angle = 2 * PI * k / sides;
        Vec3 radial = vec3_add_scaled(vec3_scale(normal, cos(angle)), sin(angle), binormal);
        add_vertex(primitives, vec3_add_scaled(center, radius, radial), vec3_add_scaled(vec3_scale(radial, lean_cos), lean_sin, tangent), color);
    }
    uint32_t count = (uint32_t)sides;
    if (!join || first < count)
        return;
    for (uint32_t k = 0; k < count; k++) {
        uint32_t a = first - count + k, b = first - count + (k + 1) % count, c = first + k, d = first + (k + 1) % count;
        const uint32_t corner[6] = {a, b, c, c, b, d};
        memcpy(primitives->index + primitives->index_count, corner, sizeof corner);
        primitives->index_count += 6;
    }
}

static Vec3 spline(const Vec3 p[4], double t)
{
    Vec3 result = {0, 0, 0};
    const double w[4] = {(-t + 2 * t * t - t * t * t) / 2, (2 - 5 * t * t + 3 * t * t * t) / 2, (t + 4 * t * t - 3 * t * t * t) / 2, (-t * t + t * t * t) / 2};
    for (int k = 0; k < 4; k++)
        result = vec3_add_scaled(result, w[k], p[k]);
    return result;
}

static Vec3 spline_tangent(const Vec3 p[4], double t, Vec3 otherwise)
{
    Vec3 result = {0, 0, 0};
    const double w[4] = {(-1 + 4 * t - 3 * t * t) / 2, (-10 * t + 9 * t * t) / 2, (1 + 8 * t - 9 * t * t) / 2, (-2 * t + 3 * t * t) / 2};
    for (int k = 0; k < 4; k++)
        result = vec3_add_scaled(result, w[k], p[k]);
    return vec3_unit_or(result, otherwise);
}

static Color mix_color(Color a, Color b, double s)
{
    return color_rgb((int)(a.r + s * (b.r - a.r) + 0.5), (int)(a.g + s * (b.g - a.g) + 0.5), (int)(a.b + s * (b.b - a.b) + 0.5));
}

static Vec3 carry(Vec3 normal, Vec3 tangent)
{
    Vec3 n = vec3_add_scaled(normal, -vec3_dot(normal, tangent), tangent);
    return vec3_norm(n) > 1e-9 ? vec3_unit(n) : vec3_normal_to(tangent);
}

// Rings of the hemisphere at an end: from the pole to the equator at the start (sign -1), from the equator to the pole at the end (+1).
static void add_cap(Primitives *primitives, Vec3 center, Vec3 tangent, Vec3 normal, double radius, Color color, int sign)
{
    for (int k = 0; k < CAP_RINGS; k++) {
        double angle = PI / 2 * (sign < 0 ? CAP_RINGS - k : k + 1) / CAP_RINGS, c = cos(angle), s = sin(angle);
        add_ring(primitives, vec3_add_scaled(center, sign * radius * s, tangent), tangent, normal, radius * c, c, sign * s, color, sign > 0 || k > 0);
    }
}

void primitives_tube(Primitives *primitives, int count, const Vec3 *point, const double *radius, const Color *color)
{
    if (count < 2)
        return;
    Vec3 tangent = {1, 0, 0}, normal = {0, 0, 0};
    for (int i = 0; i + 1 < count; i++) {
        // points mirrored beyond the ends
        Vec3 p[4] = {i > 0 ? point[i - 1] : vec3_sub(vec3_scale(point[0], 2), point[1]), point[i], point[i + 1],
                     i + 2 < count ? point[i + 2] : vec3_sub(vec3_scale(point[i + 1], 2), point[i])};
        for (int k = 0; k < SUBDIVISIONS + (i + 2 == count); k++) {
            double t = (double)k / SUBDIVISIONS, r = radius[i] + t * (radius[i + 1] - radius[i]);
            Vec3 x = spline(p, t);
            tangent = spline_tangent(p, t, tangent);
            normal = carry(normal, tangent);
            Color c = mix_color(color[i], color[i + 1], t);
            if (i == 0 && k == 0)
                add_cap(primitives, x, tangent, normal, r, c, -1);
            add_ring(primitives, x, tangent, normal, r, 1, 0, c, true);
        }
    }
    add_cap(primitives, point[count - 1], tangent, normal, radius[count - 1], color[count - 1], +1);
}

// --- pipes ---

typedef struct PipeRing {      // first vertices of a ring
    uint32_t outer, inner, cut;
} PipeRing;

// Joins two rows of `count` vertices to a strip. Its front is the side from which row 0, row 1, next 0 run counter-clockwise; with `flip` the other side.
static void sew(Primitives *primitives, uint32_t row, uint32_t next, uint32_t count, bool flip)
{
    for (uint32_t k = 0; k + 1 < count; k++) {
        uint32_t a = row + k, b = a + 1, c = next + k, d = c + 1;
        const uint32_t corner[2][6] = {{a, b, c, c, b, d}, {a, c, b, c, d, b}};
        memcpy(primitives->index + primitives->index_count, corner[flip], sizeof corner[flip]);
        primitives->index_count += 6;
    }
}

// Adds an arc of vertices with normals along `facing` or, if that is zero, away from the axis (`side` 1) or towards it (-1).
static uint32_t add_arc(Primitives *primitives, Vec3 center, const Vec3 axis[2], double radius, const double angle[2], int sides, Vec3 facing, double side,
                        Color color)
{
    uint32_t first = (uint32_t)primitives->vertex_count;
    for (int k = 0; k <= sides; k++) {
        double a = angle[0] + (angle[1] - angle[0]) * k / sides;
        Vec3 radial = vec3_add_scaled(vec3_scale(axis[0], cos(a)), sin(a), axis[1]);
        add_vertex(primitives, vec3_add_scaled(center, radius, radial), vec3_norm2(facing) > 0 ? facing : vec3_scale(radial, side), color);
    }
    return first;
}

void primitives_pipe(Primitives *primitives, int count, const Vec3 *point, const double *radius, const double *lumen, const Color *color, Color inside,
                     const Vec3 *open_towards)
{
    int all = primitives->sides > 2 ? primitives->sides : USUAL_SIDES, sides = open_towards ? (all + 1) / 2 : all, rings = (count - 1) * SUBDIVISIONS + 1;
    uint32_t row = (uint32_t)sides + 1;
    const double angle[2] = {open_towards ? PI / 2 : 0, open_towards ? 3 * PI / 2 : 2 * PI};
    if (count < 2 || !reserve(primitives, rings * (2 * (sides + 1) + 4) + 4 * (sides + 1), (rings * (2 * sides + 2) + 2 * sides) * 6))
        return;
    Vec3 tangent = {1, 0, 0}, normal = {0, 0, 0};
    PipeRing before = {0};
    for (int i = 0; i < rings; i++) {
        int from = i / SUBDIVISIONS < count - 1 ? i / SUBDIVISIONS : count - 2;
        double t = (double)(i - from * SUBDIVISIONS) / SUBDIVISIONS;
        // points mirrored beyond the ends
        Vec3 p[4] = {from > 0 ? point[from - 1] : vec3_sub(vec3_scale(point[0], 2), point[1]), point[from], point[from + 1],
                     from + 2 < count ? point[from + 2] : vec3_sub(vec3_scale(point[from + 1], 2), point[from])};
        Vec3 x = spline(p, t);
        tangent = spline_tangent(p, t, tangent);
        normal = carry(normal, tangent);
        if (open_towards)
            normal = vec3_unit_or(vec3_add_scaled(*open_towards, -vec3_dot(*open_towards, tangent), tangent), normal);
        const Vec3 axis[2] = {normal, vec3_cross(tangent, normal)}, none = {0, 0, 0};
        double out = radius[from] + t * (radius[from + 1] - radius[from]), in = lumen[from] + t * (lumen[from + 1] - lumen[from]);
        Color c = mix_color(color[from], color[from + 1], t);
        PipeRing ring = {.outer = add_arc(primitives, x, axis, out, angle, sides, none, 1, c),
                         .inner = add_arc(primitives, x, axis, in, angle, sides, none, -1, inside)};
        ring.cut = (uint32_t)primitives->vertex_count;
        for (int k = 0; k < 4 && open_towards; k++)          // first cut: outer, inner; second: inner, outer
            add_vertex(primitives, vec3_add_scaled(x, (k < 2 ? 1 : -1) * (k % 3 == 0 ? out : in), axis[1]), normal, c);
        if (i > 0) {
            sew(primitives, before.outer, ring.outer, row, false);
            sew(primitives, before.inner, ring.inner, row, true);
            if (open_towards) {
                sew(primitives, before.cut, ring.cut, 2, true);
                sew(primitives, before.cut + 2, ring.cut + 2, 2, true);
            }
        }
        if (i == 0 || i == rings - 1) {
            Vec3 facing = vec3_scale(tangent, i == 0 ? -1 : 1);
            uint32_t rim = add_arc(primitives, x, axis, out, angle, sides, facing, 0, c), hole = add_arc(primitives, x, axis, in, angle, sides, facing, 0, c);
            sew(primitives, rim, hole, row, i == 0);
        }
        before = ring;
    }
}

void primitives_arrow(Primitives *primitives, Vec3 tail, Vec3 tip, double radius, Color color)
{
    Vec3 along = vec3_sub(tip, tail);
    double length = vec3_norm(along);
    if (!(length > 0))
        return;
    Vec3 t = vec3_scale(along, 1 / length), n = vec3_normal_to(t);
    double head = fmin(8 * radius, 0.6 * length), wide = 3.2 * radius;
    Vec3 neck = vec3_add_scaled(tip, -head, t);
    add_ring(primitives, tail, t, n, 0, 0, -1, color, false);
    add_ring(primitives, tail, t, n, radius, 0, -1, color, true);
    add_ring(primitives, tail, t, n, radius, 1, 0, color, true);
    add_ring(primitives, neck, t, n, radius, 1, 0, color, true);
    add_ring(primitives, neck, t, n, radius, 0, -1, color, true);
    add_ring(primitives, neck, t, n, wide, 0, -1, color, true);
    double slope = hypot(head, wide), lean_cos = head / slope, lean_sin = wide / slope;
    add_ring(primitives, neck, t, n, wide, lean_cos, lean_sin, color, true);
    add_ring(primitives, tip, t, n, 0, lean_cos, lean_sin, color, true);
}

void primitives_sphere(Primitives *primitives, Vec3 center, double radius, Color color)
{
    const Vec3 t = {0, 0, 1}, n = {1, 0, 0};
    enum { RINGS = 16 };
    for (int k = 0; k <= RINGS; k++) {
        double angle = PI * ((double)k / RINGS - 0.5), c = cos(angle), s = sin(angle);
        add_ring(primitives, vec3_add_scaled(center, radius * s, t), t, n, radius * c, c, s, color, k > 0);
    }
}

void primitives_circle(Primitives *primitives, Vec3 center, Vec3 axis, double radius, double thickness, Color color)
{
    Vec3 u = vec3_normal_to(axis), v = vec3_cross(axis, u);
    enum { PARTS = 72 };
    for (int k = 0; k <= PARTS; k++) {
        double angle = 2 * PI * k / PARTS;
        Vec3 out = vec3_add_scaled(vec3_scale(u, cos(angle)), sin(angle), v);
        add_ring(primitives, vec3_add_scaled(center, radius, out), vec3_cross(axis, out), axis, thickness, 1, 0, color, k > 0);
    }
}
