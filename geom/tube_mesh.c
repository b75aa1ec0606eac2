// Display surfaces of vessels that are not trees: rings along a tube's centreline, and a square of a plane.
#include "geom/tube_mesh.h"

#include "base/base.h"

#include <stdlib.h>

typedef struct Path {
    int count, capacity;
    Vec3 *point, *tangent;
    bool failed;
} Path;

static void add_station(Path *path, Vec3 point, Vec3 tangent)
{
    if (path->failed)
        return;
    if (path->count == path->capacity) {
        int capacity = path->capacity ? 2 * path->capacity : 256;
        Vec3 *points = capacity > 4000000 ? NULL : realloc(path->point, (size_t)capacity * sizeof *points);
        if (points)
            path->point = points;
        Vec3 *tangents = points ? realloc(path->tangent, (size_t)capacity * sizeof *tangents) : NULL;
        if (!tangents) {
            path->failed = true;
            return;
        }
        path->tangent = tangents;
        path->capacity = capacity;
    }
    path->point[path->count] = point;
    path->tangent[path->count++] = tangent;
}

// Divides straight pieces into parts of the lumen's radius, so that the painter's sort has small triangles. Stations `first` to (parts - `spared`).
static void add_line(Path *path, Vec3 from, Vec3 direction, double length, double part, int first, int spared)
{
    int parts = (int)fmin(fmax(ceil(length / part), 1), 2000);
    for (int k = first; k <= parts - spared; k++)
        add_station(path, vec3_add_scaled(from, length * k / parts, direction), direction);
}

// The same convention as in geom/tube_vessel.c: an arc's plane first rotates the normal about the tangent, then the arc turns towards the normal.
static void lay_pieces(Path *path, const TubeOptions *tube)
{
    Vec3 p = tube->start, t = vec3_unit(tube->direction), n = vec3_add_scaled(tube->normal, -vec3_dot(tube->normal, t), t);
    n = vec3_norm(n) > 1e-9 ? vec3_unit(n) : vec3_normal_to(t);
    for (int i = 0; i < tube->piece_count; i++) {
        const TubePiece *piece = &tube->piece[i];
        if (!(piece->angle > 0)) {
            add_line(path, p, t, piece->length, tube->radius, 0, 0);
            p = vec3_add_scaled(p, piece->length, t);
            continue;
        }
        n = quat_rotate(quat_from_rotation_vector(vec3_scale(t, piece->plane)), n);
        Vec3 center = vec3_add_scaled(p, piece->arc_radius, n), t0 = t, n0 = n;
        int parts = (int)fmin(fmax(ceil(piece->angle / 0.06), 2), 20000);
        for (int k = 0; k <= parts; k++) {
            double a = piece->angle * k / parts;
            t = vec3_add_scaled(vec3_scale(t0, same_cos(a)), same_sin(a), n0);
            n = vec3_add_scaled(vec3_scale(n0, same_cos(a)), -same_sin(a), t0);
            p = vec3_add_scaled(center, -piece->arc_radius, n);
            add_station(path, p, t);
        }
    }
}

// At a slight corner, one ring along the mean of its tangents (two would cross each other on the inner side and appear as a dark line); around a sharp corner,
// a series of rings, which gives the sphere on its outer side.
static void add_corner(Path *path, Vec3 point, Vec3 before, Vec3 after)
{
    double angle = vec3_angle(before, after);
    if (angle < 0.45) {
        add_station(path, point, vec3_unit(vec3_add(before, after)));
        return;
    }
    Vec3 axis = vec3_unit_or(vec3_cross(before, after), vec3_normal_to(before));
    int parts = (int)ceil(angle / 0.2);
    for (int k = 0; k <= parts; k++)
        add_station(path, point, quat_rotate(quat_from_rotation_vector(vec3_scale(axis, angle * k / parts)), before));
}

static void lay_polyline(Path *path, const TubeOptions *tube)
{
    Vec3 before = {0, 0, 0};
    for (int i = 0; i + 1 < tube->point_count; i++) {
        Vec3 step = vec3_sub(tube->point[i + 1], tube->point[i]), t = vec3_unit(step);
        if (i > 0)
            add_corner(path, tube->point[i], before, t);
        add_line(path, tube->point[i], t, vec3_norm(step), tube->radius, i > 0, i + 2 < tube->point_count);
        before = t;
    }
}

static TriangleMesh *create_mesh(int vertices, int triangles)
{
    TriangleMesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh)
        return NULL;
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    mesh->vertex = calloc((size_t)vertices, sizeof *mesh->vertex);
    mesh->normal = calloc((size_t)vertices, sizeof *mesh->normal);
    mesh->node = calloc((size_t)vertices, sizeof *mesh->node);
    mesh->triangle = calloc((size_t)triangles, sizeof *mesh->triangle);
    if (!mesh->vertex || !mesh->normal || !mesh->node || !mesh->triangle) {
        triangle_mesh_free(mesh);
        return NULL;
    }
    return mesh;
}

static TriangleMesh *sweep(const Path *path, double radius)
{
    enum { SIDES = 40 };
    TriangleMesh *mesh = create_mesh(path->count * SIDES, (path->count - 1) * SIDES * 2);
    if (!mesh)
        return NULL;
    Vec3 normal = vec3_normal_to(path->tangent[0]);
    int triangle = 0;
    for (int i = 0; i < path->count; i++) {
        Vec3 t = path->tangent[i];
        normal = vec3_add_scaled(normal, -vec3_dot(normal, t), t);
        normal = vec3_norm(normal) > 1e-9 ? vec3_unit(normal) : vec3_normal_to(t);
        Vec3 binormal = vec3_cross(t, normal);
        for (int k = 0; k < SIDES; k++) {
            double a = 2 * PI * k / SIDES;
            Vec3 out = vec3_add_scaled(vec3_scale(normal, same_cos(a)), same_sin(a), binormal);
            mesh->vertex[i * SIDES + k] = vec3_add_scaled(path->point[i], radius, out);
            mesh->normal[i * SIDES + k] = out;
        }
        for (int k = 0; i > 0 && k < SIDES; k++) {
            int here = (i - 1) * SIDES + k, beside = (i - 1) * SIDES + (k + 1) % SIDES;
            const int corner[2][3] = {{here, beside, here + SIDES}, {here + SIDES, beside, beside + SIDES}};
            for (int j = 0; j < 2; j++, triangle++)
                for (int c = 0; c < 3; c++)
                    mesh->triangle[triangle][c] = corner[j][c];
        }
    }
    return mesh;
}

TriangleMesh *triangle_mesh_of_tube(const TubeOptions *tube)
{
    if (!tube || !(tube->radius > 0) || !isfinite(tube->radius))
        return NULL;
    Path path = {0};
    if (tube->piece_count > 0 && tube->piece)
        lay_pieces(&path, tube);
    else if (tube->point_count > 1 && tube->point)
        lay_polyline(&path, tube);
    TriangleMesh *mesh = path.count > 1 && !path.failed ? sweep(&path, tube->radius) : NULL;
    free(path.point);
    free(path.tangent);
    return mesh;
}

TriangleMesh *triangle_mesh_of_plane(Vec3 point, Vec3 normal, double half_width)
{
    enum { PARTS = 24 };
    if (!(half_width > 0) || !(vec3_norm(normal) > 0))
        return NULL;
    TriangleMesh *mesh = create_mesh((PARTS + 1) * (PARTS + 1), 2 * PARTS * PARTS);
    if (!mesh)
        return NULL;
    // outwards is opposite to the plane's normal, which points into the lumen
    Vec3 out = vec3_negate(vec3_unit(normal)), u = vec3_normal_to(out), v = vec3_cross(out, u);
    int triangle = 0;
    for (int j = 0; j <= PARTS; j++)
        for (int i = 0; i <= PARTS; i++) {
            int here = j * (PARTS + 1) + i;
            mesh->vertex[here] = vec3_add_scaled(vec3_add_scaled(point, half_width * (2.0 * i / PARTS - 1), u), half_width * (2.0 * j / PARTS - 1), v);
            mesh->normal[here] = out;
            if (i == PARTS || j == PARTS)
                continue;
            const int corner[2][3] = {{here, here + 1, here + PARTS + 1}, {here + PARTS + 1, here + 1, here + PARTS + 2}};
            for (int k = 0; k < 2; k++, triangle++)
                for (int c = 0; c < 3; c++)
                    mesh->triangle[triangle][c] = corner[k][c];
        }
    return mesh;
}
