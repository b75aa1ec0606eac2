// Between two points of the tool, the path of a ray through it is the chord of the shadow's cross-section times L / l, where L is their distance in space and
// l that of their shadows, in the same unit: a foreshortened piece is darker, and the sum over the shadow remains mu pi r^2 L. Points whose
// shadows fall within a pixel or within the tool's radius are merged, so that a tool seen along its axis becomes a dark spot and not a row of slivers; a border
// between stretches is kept unless it is foreshortened, so that a marker band has its true length. A tube is an outer circle of its wall and an inner
// one that subtracts the wall and adds the filling of the lumen.
#include "render/fluoroscope_tool.h"

#include <stdlib.h>

enum { PARTS = 4 };                      // between two nodes
static const double margin = 2;          // [pixel] on each side of the shadow: half a pixel and the blur of the detector

typedef struct RibbonPoint {
    double x, y;                         // [pixel]
    double pixel_mm;                     // [mm] size of a pixel at its depth
    double spacing;                      // [pixel] distance in space from the previous point …
    double wall, filling;                // … and the integrals of the wall's attenuation and of the lumen's filling along that distance
    double radius, lumen;                // [mm] of the stretch before it
    bool begins;                         // first point of a stretch
} RibbonPoint;

// --- positions of the points ---

bool ribbon_path_make(RibbonPath *path, int node_count, const double *s, int stretch_count, const TubeStretch *stretch)
{
    const double same = 1e-6;            // [mm] a border at a point is that point
    int capacity = node_count > 1 ? (node_count - 1) * PARTS + stretch_count + 1 : 1, at = 0;
    *path = (RibbonPath){.node_count = node_count, .place = malloc((size_t)capacity * sizeof *path->place)};
    if (!path->place)
        return false;
    double before = 0;
    for (int i = 0; node_count > 1 && i <= (node_count - 1) * PARTS; i++) {
        int node = i / PARTS < node_count - 1 ? i / PARTS : node_count - 2, from = i > 0 ? (i - 1) / PARTS : 0;
        double u = (double)(i - node * PARTS) / PARTS, here = s[node] + u * (s[node + 1] - s[node]);
        for (; at + 1 < stretch_count && stretch[at].end < here - same; at++) {
            const TubeStretch *ends = &stretch[at];
            double part = (ends->end - s[from]) / (s[from + 1] - s[from]);
            if (i > 0 && ends->end > before + same)
                path->place[path->count++] = (RibbonPlace){from, part, true, ends->radius, ends->lumen, ends->attenuation};
            else if (i > 0)
                path->place[path->count - 1].is_border = true;
        }
        path->place[path->count++] = (RibbonPlace){node, u, false, stretch[at].radius, stretch[at].lumen, stretch[at].attenuation};
        before = here;
    }
    return true;
}

void ribbon_path_free(RibbonPath *path)
{
    free(path->place);
    *path = (RibbonPath){0};
}

// --- the ribbon ---

// Adds one side of the ribbon's end at p, with the tube of the piece that ends at `of`.
static bool add_vertex(Ribbon *ribbon, const RibbonPoint *p, const RibbonPoint *of, const double normal[2], double side, const double density[2])
{
    if (ribbon->count == ribbon->capacity) {
        int capacity = ribbon->capacity ? 2 * ribbon->capacity : 2048;
        RibbonVertex *grown = realloc(ribbon->vertex, (size_t)capacity * sizeof *grown);
        if (!grown)
            return false;
        ribbon->vertex = grown;
        ribbon->capacity = capacity;
    }
    double radius = of->radius / p->pixel_mm, across = side * (radius + margin);
    ribbon->vertex[ribbon->count++] = (RibbonVertex){.place = {(float)(p->x + across * normal[0]), (float)(p->y + across * normal[1])},
                                                     .across = (float)across,
                                                     .radius = (float)radius,
                                                     .lumen = (float)(of->lumen / p->pixel_mm),
                                                     .density = {(float)density[0], (float)density[1]}};
    return true;
}

// A point of the curve through the nodes of the tool (Catmull-Rom), so that a bend seen edge-on is smooth.
static Vec3 between_nodes(int count, const Vec3 *position, int node, double u)
{
    Vec3 p[4];
    for (int k = 0; k < 4; k++) {
        int i = node - 1 + k;
        p[k] = position[i < 0 ? 0 : i < count ? i : count - 1];
    }
    // straight if a neighbour is missing
    if (u <= 0 || u >= 1 || !vec3_is_finite(p[0]) || !vec3_is_finite(p[3]))
        return u <= 0 ? p[1] : vec3_mix(p[1], p[2], u);
    Vec3 from = vec3_scale(vec3_sub(p[2], p[0]), node > 0 ? 0.5 : 1), to = vec3_scale(vec3_sub(p[3], p[1]), node + 2 < count ? 0.5 : 1);
    Vec3 x = vec3_scale(p[1], (1 + 2 * u) * (1 - u) * (1 - u));
    x = vec3_add_scaled(x, u * (1 - u) * (1 - u), from);
    x = vec3_add_scaled(x, u * u * (3 - 2 * u), p[2]);
    return vec3_add_scaled(x, u * u * (u - 1), to);
}

// Least length [pixel] of a piece: shorter pieces would overlap where the shadow turns back.
static double least_length(const RibbonPoint *p) { return fmax(1, 1.5 * p->radius / p->pixel_mm); }
static double shadow_length(const RibbonPoint *a, const RibbonPoint *b) { return hypot(b->x - a->x, b->y - a->y); }
// True if seen at more than 60 degrees from the side.
static bool is_foreshortened(const RibbonPoint *a, const RibbonPoint *b) { return shadow_length(a, b) < 0.5 * b->spacing; }

static double filling_at(const float *filling, const RibbonPlace *place)
{
    return (double)filling[place->node] + place->u * ((double)filling[place->node + 1] - (double)filling[place->node]);
}

// Projects the points and merges close ones. Returns their number. `filling` NULL: none.
static int project_points(RibbonPoint *out, const CArm *c_arm, int side, const RibbonPath *path, const Vec3 *position, const float *filling)
{
    int points = 0;
    bool is_broken = true;
    double spacing = 0, wall = 0, filled = 0, last_filling = 0;
    Vec3 before = {0, 0, 0};
    for (int i = 0; i < path->count; i++) {
        const RibbonPlace *place = &path->place[i];
        Vec3 x = between_nodes(path->node_count, position, place->node, place->u), p = c_arm_project(c_arm, x);
        double distance = C_ARM_SOURCE_MM + p.z;
        if (!vec3_is_finite(p) || !(distance > C_ARM_NEAREST_MM) || fabs(p.x) > 1e3 || fabs(p.y) > 1e3) {
            is_broken = true;
            continue;
        }
        double pixel_mm = c_arm->field_mm / side * distance / C_ARM_SOURCE_MM, length = is_broken ? 0 : vec3_distance(x, before);
        spacing = is_broken ? 0 : spacing + length / pixel_mm;
        wall = is_broken ? 0 : wall + length * place->attenuation;
        double here = filling ? filling_at(filling, place) : 0;
        filled = is_broken ? 0 : filled + length * (last_filling + here) / 2;
        last_filling = here;
        before = x;
        RibbonPoint point = {(p.x + 0.5) * side, (p.y + 0.5) * side, pixel_mm, spacing, wall, filled, place->radius, place->lumen, is_broken};
        // merged with the previous point: lengths and wall integrals are added, the last position is kept
        bool is_near = !is_broken && shadow_length(&out[points - 1], &point) < least_length(&point);
        bool is_joined = is_near && i + 1 < path->count && (!place->is_border || is_foreshortened(&out[points - 1], &point));
        is_broken = false;
        if (is_joined)
            continue;
        out[points++] = point;
        spacing = wall = filled = 0;
    }
    return points;
}

// Unit normal of the shadow from a to b; `otherwise` if they coincide.
static void shadow_normal(const RibbonPoint *a, const RibbonPoint *b, double normal[2])
{
    double dx = b->x - a->x, dy = b->y - a->y, l = hypot(dx, dy);
    normal[0] = l > 1e-9 ? -dy / l : 0;
    normal[1] = l > 1e-9 ? dx / l : 1;
}

// The mitre at b between a-b and b-c, with the length that both sides need; their own normals where the path turns so sharply that the inner corner would lie
// behind the other end of a piece.
static void mitre(const RibbonPoint *a, const RibbonPoint *b, const RibbonPoint *c, const double own[2], double out[2])
{
    double n[2][2];
    shadow_normal(a, b, n[0]);
    shadow_normal(b, c, n[1]);
    double sum[2] = {n[0][0] + n[1][0], n[0][1] + n[1][1]}, square = sum[0] * sum[0] + sum[1] * sum[1];
    double inner = (b->radius / b->pixel_mm + margin) * sqrt(fmax(4 - square, 0)), shorter = fmin(shadow_length(a, b), shadow_length(b, c));
    if (square < 1 || inner > 0.5 * shorter * sqrt(square)) {
        out[0] = own[0], out[1] = own[1];
        return;
    }
    out[0] = 2 * sum[0] / square;
    out[1] = 2 * sum[1] / square;
}

static bool lay_piece(Ribbon *ribbon, const RibbonPoint *before, const RibbonPoint *a, const RibbonPoint *b, const RibbonPoint *after, double attenuation)
{
    double own[2], n[2][2], l = shadow_length(a, b), least = least_length(b);
    RibbonPoint end[2] = {*a, *b};
    if (l < least && is_foreshortened(a, b)) {
        // all points are within one spot: spread over that spot
        double ux = l > 1e-9 ? (b->x - a->x) / l : 1, uy = l > 1e-9 ? (b->y - a->y) / l : 0, mx = (a->x + b->x) / 2, my = (a->y + b->y) / 2;
        end[0].x = mx - least * ux / 2, end[0].y = my - least * uy / 2;
        end[1].x = mx + least * ux / 2, end[1].y = my + least * uy / 2;
        l = least;
        before = after = NULL;
    }
    if (!(l > 0))
        return true;
    shadow_normal(&end[0], &end[1], own);
    n[0][0] = n[1][0] = own[0];
    n[0][1] = n[1][1] = own[1];
    if (before)
        mitre(before, a, b, own, n[0]);
    if (after)
        mitre(a, b, after, own, n[1]);
    const double density[2] = {b->wall / l, (attenuation * b->filling - b->wall) / l};
    static const int order[6][2] = {{0, -1}, {1, -1}, {0, 1}, {0, 1}, {1, -1}, {1, 1}};
    for (int k = 0; k < 6; k++) {
        int e = order[k][0];
        if (!add_vertex(ribbon, &end[e], b, n[e], order[k][1], density))
            return false;
    }
    return true;
}

void ribbon_begin(Ribbon *ribbon) { ribbon->count = 0; }

bool ribbon_add(Ribbon *ribbon, const CArm *c_arm, int side, const RibbonPath *path, const Vec3 *position, const float *filling, double attenuation)
{
    if (path->count > ribbon->point_capacity) {
        RibbonPoint *grown = realloc(ribbon->point, (size_t)path->count * sizeof *grown);
        if (!grown)
            return false;
        ribbon->point = grown;
        ribbon->point_capacity = path->count;
    }
    const RibbonPoint *point = ribbon->point;
    int points = project_points(ribbon->point, c_arm, side, path, position, filling);
    bool good = true;
    for (int i = 1; good && i < points; i++) {
        if (point[i].begins)
            continue;
        const RibbonPoint *before = i > 1 && !point[i - 1].begins ? &point[i - 2] : NULL;
        const RibbonPoint *after = i + 1 < points && !point[i + 1].begins ? &point[i + 1] : NULL;
        good = lay_piece(ribbon, before, &point[i - 1], &point[i], after, attenuation);
    }
    return good;
}

void ribbon_end(Ribbon *ribbon, int side)
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

void ribbon_free(Ribbon *ribbon)
{
    free(ribbon->vertex);
    free(ribbon->point);
    *ribbon = (Ribbon){0};
}
