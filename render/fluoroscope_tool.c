// Between two points of the tool the ray's way through it is the chord of the shadow's cross-section times L / l, with L their distance in space and l that of
// their shadows, both in the same measure: what is seen foreshortened is darker, and the sum over the shadow stays mu pi r^2 L. Points whose shadows fall
// within a pixel or the tool's radius are joined, so that a tool seen along its axis becomes a dark spot and no row of slivers.
#include "render/fluoroscope_tool.h"

#include <stdlib.h>

enum { PARTS = 4 };                      // between two nodes
static const double margin = 2;          // [pixel] beside the shadow: half a pixel and the detector's blur

typedef struct RibbonPoint {
    double x, y;                         // [pixel]
    double radius;                       // [pixel]
    double attenuation;                  // for each pixel of way
    double length;                       // [pixel] in space, from the point before
    bool begins;                         // nothing before it
} RibbonPoint;

static bool add_vertex(Ribbon *ribbon, const RibbonPoint *p, double nx, double ny, double side, double density)
{
    if (ribbon->count == ribbon->capacity) {
        int capacity = ribbon->capacity ? 2 * ribbon->capacity : 2048;
        RibbonVertex *grown = realloc(ribbon->vertex, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        ribbon->vertex = grown;
        ribbon->capacity = capacity;
    }
    double across = side * (p->radius + margin);
    ribbon->vertex[ribbon->count++] =
        (RibbonVertex){{(float)(p->x + across * nx), (float)(p->y + across * ny)}, (float)across, (float)p->radius, (float)density};
    return true;
}

// Along the tool's nodes: a curve through them (Catmull and Rom's), so that a bend seen edge-on is no row of corners.
static Vec3 between_nodes(int count, const Vec3 *position, int node, double u)
{
    Vec3 p[4];
    for (int k = 0; k < 4; k++) {
        int i = node - 1 + k;
        p[k] = position[i < 0 ? 0 : i < count ? i : count - 1];
    }
    // straight where a neighbour has no place
    if (u <= 0 || u >= 1 || !vec3_is_finite(p[0]) || !vec3_is_finite(p[3]))
        return u <= 0 ? p[1] : vec3_mix(p[1], p[2], u);
    Vec3 from = vec3_scale(vec3_sub(p[2], p[0]), node > 0 ? 0.5 : 1), to = vec3_scale(vec3_sub(p[3], p[1]), node + 2 < count ? 0.5 : 1);
    Vec3 x = vec3_scale(p[1], (1 + 2 * u) * (1 - u) * (1 - u));
    x = vec3_add_scaled(x, u * (1 - u) * (1 - u), from);
    x = vec3_add_scaled(x, u * u * (3 - 2 * u), p[2]);
    return vec3_add_scaled(x, u * u * (u - 1), to);
}

// Pieces shorter than they are thick would lie across each other where the shadow turns back.
static double least_length(double radius) { return fmax(1, 1.5 * radius); }

// The projected points, closer ones joined. Returns how many.
static int project_points(RibbonPoint *out, const CArm *c_arm, int side, int count, const Vec3 *position, const double *radius, const double *attenuation)
{
    int points = 0, last = (count - 1) * PARTS;
    bool broken = true;
    double length = 0;
    Vec3 before = {0, 0, 0};
    for (int i = 0; i <= last; i++) {
        int node = i / PARTS;
        double u = (double)(i % PARTS) / PARTS;
        Vec3 x = between_nodes(count, position, node, u), p = c_arm_project(c_arm, x);
        double distance = C_ARM_SOURCE_MM + p.z;
        if (!vec3_is_finite(p) || !(distance > C_ARM_NEAREST_MM) || fabs(p.x) > 1e3 || fabs(p.y) > 1e3) {
            broken = true;
            continue;
        }
        double pixel_mm = c_arm->field_mm / side * distance / C_ARM_SOURCE_MM;
        int next = node + 1 < count ? node + 1 : node;
        double r = (1 - u) * radius[node] + u * radius[next], a = (1 - u) * attenuation[node] + u * attenuation[next];
        length = broken ? 0 : length + vec3_distance(x, before) / pixel_mm;
        before = x;
        RibbonPoint point = {(p.x + 0.5) * side, (p.y + 0.5) * side, r / pixel_mm, a * pixel_mm, length, broken};
        // joined to the point before: the length adds up, the last place counts
        bool is_near = !broken && hypot(point.x - out[points - 1].x, point.y - out[points - 1].y) < least_length(r / pixel_mm);
        broken = false;
        if (is_near && i < last)
            continue;
        out[points++] = point;
        length = 0;
    }
    return points;
}

// Unit normal of the shadow from a to b; of `otherwise` where they fall together.
static void shadow_normal(const RibbonPoint *a, const RibbonPoint *b, double normal[2])
{
    double dx = b->x - a->x, dy = b->y - a->y, l = hypot(dx, dy);
    normal[0] = l > 1e-9 ? -dy / l : 0;
    normal[1] = l > 1e-9 ? dx / l : 1;
}

// The mitre at b between a-b and b-c, as long as both sides need; their own normal where the way turns so sharply that the inner corner would lie behind the
// other end of a piece.
static void mitre(const RibbonPoint *a, const RibbonPoint *b, const RibbonPoint *c, const double own[2], double out[2])
{
    double n[2][2];
    shadow_normal(a, b, n[0]);
    shadow_normal(b, c, n[1]);
    double sum[2] = {n[0][0] + n[1][0], n[0][1] + n[1][1]}, square = sum[0] * sum[0] + sum[1] * sum[1];
    double inner = (b->radius + margin) * sqrt(fmax(4 - square, 0)), shorter = fmin(hypot(b->x - a->x, b->y - a->y), hypot(c->x - b->x, c->y - b->y));
    if (square < 1 || inner > 0.5 * shorter * sqrt(square)) {
        out[0] = own[0], out[1] = own[1];
        return;
    }
    out[0] = 2 * sum[0] / square;
    out[1] = 2 * sum[1] / square;
}

static bool lay_piece(Ribbon *ribbon, const RibbonPoint *before, const RibbonPoint *a, const RibbonPoint *b, const RibbonPoint *after)
{
    double own[2], n[2][2], l = hypot(b->x - a->x, b->y - a->y);
    RibbonPoint end[2] = {*a, *b};
    double least = least_length(b->radius);
    if (l < least) {
        // all of it within one spot: spread over that
        double ux = l > 1e-9 ? (b->x - a->x) / l : 1, uy = l > 1e-9 ? (b->y - a->y) / l : 0, mx = (a->x + b->x) / 2, my = (a->y + b->y) / 2;
        end[0].x = mx - least * ux / 2, end[0].y = my - least * uy / 2;
        end[1].x = mx + least * ux / 2, end[1].y = my + least * uy / 2;
        l = least;
        before = after = NULL;
    }
    shadow_normal(&end[0], &end[1], own);
    n[0][0] = n[1][0] = own[0];
    n[0][1] = n[1][1] = own[1];
    if (before)
        mitre(before, a, b, own, n[0]);
    if (after)
        mitre(a, b, after, own, n[1]);
    double stretch = b->length / l, density[2] = {a->attenuation * stretch, b->attenuation * stretch};
    static const int order[6][2] = {{0, -1}, {1, -1}, {0, 1}, {0, 1}, {1, -1}, {1, 1}};
    for (int k = 0; k < 6; k++) {
        int e = order[k][0];
        if (!add_vertex(ribbon, &end[e], n[e][0], n[e][1], order[k][1], density[e]))
            return false;
    }
    return true;
}

static void find_box(Ribbon *ribbon, int side)
{
    double low[2] = {side, side}, high[2] = {0, 0};
    for (int i = 0; i < ribbon->count; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], ribbon->vertex[i].place[k]);
            high[k] = fmax(high[k], ribbon->vertex[i].place[k]);
        }
    for (int k = 0; k < 2; k++) {
        ribbon->low[k] = (int)fmax(floor(low[k]) - 1, 0);
        ribbon->high[k] = (int)fmin(ceil(high[k]) + 1, side);
    }
}

bool ribbon_lay(Ribbon *ribbon, const CArm *c_arm, int side, int count, const Vec3 *position, const double *radius, const double *attenuation)
{
    ribbon->count = 0;
    RibbonPoint *point = malloc(((size_t)count * PARTS + 1) * sizeof *point);
    if (!point)
        return false;
    int points = project_points(point, c_arm, side, count, position, radius, attenuation);
    bool good = true;
    for (int i = 1; good && i < points; i++) {
        if (point[i].begins)
            continue;
        const RibbonPoint *before = i > 1 && !point[i - 1].begins ? &point[i - 2] : NULL;
        const RibbonPoint *after = i + 1 < points && !point[i + 1].begins ? &point[i + 1] : NULL;
        good = lay_piece(ribbon, before, &point[i - 1], &point[i], after);
    }
    find_box(ribbon, side);
    free(point);
    return good;
}

void ribbon_free(Ribbon *ribbon)
{
    free(ribbon->vertex);
    *ribbon = (Ribbon){0};
}
