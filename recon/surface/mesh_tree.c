// Boxes are split at the median of their triangles' centroids along their longest axis. Nearest point of a triangle: regions of its plane
// (Ericson 2005, Real-Time Collision Detection, 5.1.5). Ray: Moeller and Trumbore 1997. Solid angle: Van Oosterom and Strackee 1983.
#include "recon/surface/mesh_tree.h"

#include "base/base.h"

#include <stdlib.h>

enum { LEAF = 4, DEPTH = 64 };

typedef struct Box {
    Vec3 low, high;
    int first, count;        // a leaf has triangles order[first …]; an inner box has count 0 and children first, first + 1
} Box;

struct MeshTree {
    const SurfaceMesh *mesh;
    Box *box;
    int box_count;
    int *order;              // (T)
    Vec3 *middle;            // (T) centroids, during construction only
};

static double part(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
// libm's fmin and fmax are function calls, because they handle NaN
static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }
static Vec3 lower(Vec3 a, Vec3 b) { return vec3(least(a.x, b.x), least(a.y, b.y), least(a.z, b.z)); }
static Vec3 upper(Vec3 a, Vec3 b) { return vec3(most(a.x, b.x), most(a.y, b.y), most(a.z, b.z)); }

static bool before(const MeshTree *tree, int a, int b, int axis)
{
    double x = part(tree->middle[a], axis), y = part(tree->middle[b], axis);
    return x < y || (x == y && a < b);
}

// Hoare's selection: moves the smaller half of order[first, last) before `middle`.
static void select_median(MeshTree *tree, int first, int last, int middle, int axis)
{
    int *o = tree->order;
    while (last - first > 1) {
        int pivot = o[first + (last - first) / 2], i = first, j = last - 1;
        while (i <= j) {
            while (before(tree, o[i], pivot, axis))
                i++;
            while (before(tree, pivot, o[j], axis))
                j--;
            if (i <= j) {
                int swap = o[i];
                o[i++] = o[j];
                o[j--] = swap;
            }
        }
        if (middle <= j)
            last = j + 1;
        else if (middle >= i)
            first = i;
        else
            return;
    }
}

static void build(MeshTree *tree, int at, int first, int last)
{
    const SurfaceMesh *mesh = tree->mesh;
    Box *box = &tree->box[at];
    Vec3 low = tree->middle[tree->order[first]], high = low;
    box->low = vec3(INFINITY, INFINITY, INFINITY);
    box->high = vec3_negate(box->low);
    for (int i = first; i < last; i++) {
        int t = tree->order[i];
        for (int k = 0; k < 3; k++) {
            box->low = lower(box->low, mesh->vertex[mesh->triangle[t][k]]);
            box->high = upper(box->high, mesh->vertex[mesh->triangle[t][k]]);
        }
        low = lower(low, tree->middle[t]);
        high = upper(high, tree->middle[t]);
    }
    if (last - first <= LEAF) {
        box->first = first;
        box->count = last - first;
        return;
    }
    Vec3 e = vec3_sub(high, low);
    int axis = e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2, middle = first + (last - first) / 2, child = tree->box_count;
    select_median(tree, first, last, middle, axis);
    box->first = child;
    box->count = 0;
    tree->box_count += 2;
    build(tree, child, first, middle);
    build(tree, child + 1, middle, last);
}

MeshTree *mesh_tree_create(const SurfaceMesh *mesh)
{
    MeshTree *tree = calloc(1, sizeof *tree);
    size_t n = (size_t)mesh->triangle_count;
    if (!tree)
        return NULL;
    tree->mesh = mesh;
    tree->box = calloc(2 * n + 2, sizeof *tree->box);
    tree->order = calloc(n + 1, sizeof *tree->order);
    tree->middle = calloc(n + 1, sizeof *tree->middle);
    if (!tree->box || !tree->order || !tree->middle) {
        mesh_tree_free(tree);
        return NULL;
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        tree->order[t] = t;
        tree->middle[t] = vec3_add(mesh->vertex[v[0]], vec3_add(mesh->vertex[v[1]], mesh->vertex[v[2]]));
    }
    tree->box_count = 1;
    if (n)
        build(tree, 0, 0, mesh->triangle_count);
    free(tree->middle);
    tree->middle = NULL;
    return tree;
}

void mesh_tree_free(MeshTree *tree)
{
    if (!tree)
        return;
    free(tree->box);
    free(tree->order);
    free(tree->middle);
    free(tree);
}

static Vec3 nearest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c)
{
    Vec3 ab = vec3_sub(b, a), ac = vec3_sub(c, a), ap = vec3_sub(p, a), bp = vec3_sub(p, b), cp = vec3_sub(p, c);
    double d1 = vec3_dot(ab, ap), d2 = vec3_dot(ac, ap), d3 = vec3_dot(ab, bp), d4 = vec3_dot(ac, bp), d5 = vec3_dot(ab, cp), d6 = vec3_dot(ac, cp);
    if (d1 <= 0 && d2 <= 0)
        return a;
    if (d3 >= 0 && d4 <= d3)
        return b;
    if (d6 >= 0 && d5 <= d6)
        return c;
    double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3)
        return vec3_add_scaled(a, d1 / (d1 - d3), ab);
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6)
        return vec3_add_scaled(a, d2 / (d2 - d6), ac);
    if (va <= 0 && d4 >= d3 && d5 >= d6 && d4 - d3 + d5 - d6 > 0)
        return vec3_add_scaled(b, (d4 - d3) / (d4 - d3 + d5 - d6), vec3_sub(c, b));
    double sum = va + vb + vc;
    return sum > 0 ? vec3_add(a, vec3_add(vec3_scale(ab, vb / sum), vec3_scale(ac, vc / sum))) : a;
}

double mesh_triangle_nearest(const SurfaceMesh *mesh, int triangle, Vec3 point, Vec3 *foot)
{
    const int *v = mesh->triangle[triangle];
    *foot = nearest_on_triangle(point, mesh->vertex[v[0]], mesh->vertex[v[1]], mesh->vertex[v[2]]);
    return vec3_distance(*foot, point);
}

static double beyond(double low, double high, double x) { return x < low ? low - x : x > high ? x - high : 0; }

static double box_distance2(const Box *box, Vec3 p)
{
    double x = beyond(box->low.x, box->high.x, p.x), y = beyond(box->low.y, box->high.y, p.y), z = beyond(box->low.z, box->high.z, p.z);
    return x * x + y * y + z * z;
}

double mesh_tree_nearest(const MeshTree *tree, Vec3 point, double reach, Vec3 *foot, int *triangle)
{
    const SurfaceMesh *mesh = tree->mesh;
    int stack[DEPTH * 2], height = 0;
    double away[DEPTH * 2], best = reach * reach;
    bool found = false;
    if (mesh->triangle_count) {
        away[0] = box_distance2(tree->box, point);
        stack[height++] = 0;
    }
    while (height) {
        if (away[--height] > best)
            continue;
        const Box *box = &tree->box[stack[height]];
        for (int i = 0; i < box->count; i++) {
            int t = tree->order[box->first + i];
            Vec3 q = nearest_on_triangle(point, mesh->vertex[mesh->triangle[t][0]], mesh->vertex[mesh->triangle[t][1]], mesh->vertex[mesh->triangle[t][2]]);
            double d2 = vec3_norm2(vec3_sub(q, point));
            if (d2 < best || (d2 == best && (!found || t < *triangle))) {
                best = d2;
                found = true;
                *foot = q;
                *triangle = t;
            }
        }
        if (box->count == 0) {
            double first = box_distance2(&tree->box[box->first], point), second = box_distance2(&tree->box[box->first + 1], point);
            // the nearer one is put on top of the stack
            int nearer = box->first + (first >= second), farther = box->first + (first < second);
            if ((first < second ? second : first) <= best) {
                away[height] = first < second ? second : first;
                stack[height++] = farther;
            }
            away[height] = first < second ? first : second;
            stack[height++] = nearer;
        }
    }
    return found ? sqrt(best) : INFINITY;
}

static double ray_triangle(Vec3 from, Vec3 d, Vec3 a, Vec3 b, Vec3 c)
{
    Vec3 ab = vec3_sub(b, a), ac = vec3_sub(c, a), h = vec3_cross(d, ac), s = vec3_sub(from, a);
    double det = vec3_dot(ab, h);
    if (det == 0)
        return INFINITY;
    double u = vec3_dot(s, h) / det;
    Vec3 q = vec3_cross(s, ab);
    double v = vec3_dot(d, q) / det, t = vec3_dot(ac, q) / det;
    // a small tolerance: rays through an edge must not slip between its triangles
    return u >= -1e-9 && v >= -1e-9 && u + v <= 1 + 1e-9 && t > 0 ? t : INFINITY;
}

// Distance along the ray to the box; INFINITY if it misses the box.
static double ray_enters(const Box *box, const double from[3], const double direction[3], const double inverse[3], double reach)
{
    const double low[3] = {box->low.x, box->low.y, box->low.z}, high[3] = {box->high.x, box->high.y, box->high.z};
    double enter = 0, leave = reach;
    for (int axis = 0; axis < 3; axis++) {
        if (direction[axis] == 0) {
            if (from[axis] < low[axis] || from[axis] > high[axis])
                return INFINITY;
            continue;
        }
        double a = (low[axis] - from[axis]) * inverse[axis], b = (high[axis] - from[axis]) * inverse[axis];
        enter = most(enter, least(a, b));
        leave = least(leave, most(a, b));
    }
    // the tolerance keeps a flat box from being missed by rounding
    return enter <= leave * (1 + 1e-12) + 1e-12 ? enter : INFINITY;
}

double mesh_tree_ray(const MeshTree *tree, Vec3 from, Vec3 direction, double reach, int *triangle)
{
    const SurfaceMesh *mesh = tree->mesh;
    const double start[3] = {from.x, from.y, from.z}, d[3] = {direction.x, direction.y, direction.z}, inverse[3] = {1 / d[0], 1 / d[1], 1 / d[2]};
    int stack[DEPTH * 2], height = 0, hit = -1;
    double enters[DEPTH * 2], best = INFINITY;
    if (mesh->triangle_count && isfinite(enters[0] = ray_enters(tree->box, start, d, inverse, reach)))
        stack[height++] = 0;
    while (height) {
        if (enters[--height] > best * (1 + 1e-12) + 1e-12)
            continue;
        const Box *box = &tree->box[stack[height]];
        for (int i = 0; i < box->count; i++) {
            int t = tree->order[box->first + i];
            const int *v = mesh->triangle[t];
            double at = ray_triangle(from, direction, mesh->vertex[v[0]], mesh->vertex[v[1]], mesh->vertex[v[2]]);
            if (at <= reach && (at < best || (at == best && t < hit))) {
                best = at;
                hit = t;
            }
        }
        if (box->count == 0) {
            double first = ray_enters(&tree->box[box->first], start, d, inverse, least(best, reach));
            double second = ray_enters(&tree->box[box->first + 1], start, d, inverse, least(best, reach));
            // the nearer one is put on top of the stack
            int nearer = box->first + (first >= second), farther = box->first + (first < second);
            if (isfinite(most(first, second))) {
                enters[height] = most(first, second);
                stack[height++] = farther;
            }
            if (isfinite(least(first, second))) {
                enters[height] = least(first, second);
                stack[height++] = nearer;
            }
        }
    }
    if (triangle && hit >= 0)
        *triangle = hit;
    return best;
}

double mesh_winding(const SurfaceMesh *mesh, Vec3 point)
{
    double sum = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        Vec3 a = vec3_sub(mesh->vertex[mesh->triangle[t][0]], point), b = vec3_sub(mesh->vertex[mesh->triangle[t][1]], point),
             c = vec3_sub(mesh->vertex[mesh->triangle[t][2]], point);
        double la = vec3_norm(a), lb = vec3_norm(b), lc = vec3_norm(c);
        double under = la * lb * lc + vec3_dot(a, b) * lc + vec3_dot(b, c) * la + vec3_dot(a, c) * lb;
        sum += 2 * same_atan2(vec3_dot(a, vec3_cross(b, c)), under);
    }
    return sum / (4 * PI);
}
