// The squared distance of a point from a triangle: height over its plane and, if the projection is outside, the distance in the plane to the closest side. One
// source, compiled for each instruction set with -fno-math-errno and -fno-trapping-math, which change no result but allow the selects to be vectorised.
#include "geom/triangle_groups.h"

#include "base/base.h"

#define KERNEL_TEXT "geom/triangle_groups_kernel.inc"
#include "base/each_simd.inc"
#define KERNEL_TABLE(set)                                                                                                                                      \
    {                                                                                                                                                          \
#set, distances_##set, bounds_##set                                                                                                                    \
    }
static const GroupKernels kernel_table[SIMD_COUNT] = SIMD_EACH(KERNEL_TABLE);

const GroupKernels *group_kernels(int isa) { return &kernel_table[simd_choose(isa)]; }

// --- Order: recursive halving along the longest side of the centroids' box, at multiples of a group ---

static double along(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

static bool stands_before(const Vec3 *centroid, int axis, int a, int b)
{
    double x = along(centroid[a], axis), y = along(centroid[b], axis);
    return x < y || (x == y && a < b);
}

// Moves the `left` lowest of `count` to the front (Hoare's selection algorithm).
static void select_lowest(int *order, int count, int left, const Vec3 *centroid, int axis)
{
    int low = 0, high = count - 1;
    while (low < high) {
        int middle = order[low + (high - low) / 2], i = low, k = high;
        while (i <= k) {
            while (stands_before(centroid, axis, order[i], middle))
                i++;
            while (stands_before(centroid, axis, middle, order[k]))
                k--;
            if (i <= k) {
                int t = order[i];
                order[i++] = order[k];
                order[k--] = t;
            }
        }
        if (left <= k)
            high = k;
        else if (left >= i)
            low = i;
        else
            return;
    }
}

static void order_part(int *order, int count, const Vec3 *centroid)
{
    if (count <= GROUP_TRIANGLES)
        return;
    Vec3 low = centroid[order[0]], high = low;
    for (int i = 1; i < count; i++) {
        Vec3 c = centroid[order[i]];
        low = vec3(fmin(low.x, c.x), fmin(low.y, c.y), fmin(low.z, c.z));
        high = vec3(fmax(high.x, c.x), fmax(high.y, c.y), fmax(high.z, c.z));
    }
    Vec3 extent = vec3_sub(high, low);
    int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    int left = (group_count(count) + 1) / 2 * GROUP_TRIANGLES;
    select_lowest(order, count, left, centroid, axis);
    order_part(order, left, centroid);
    order_part(order + left, count - left, centroid);
}

void group_order(int triangle_count, const Vec3 *centroid, int *order)
{
    for (int t = 0; t < triangle_count; t++)
        order[t] = t;
    order_part(order, triangle_count, centroid);
}

// The extent of the group along an axis.
static void extent_of(const TriangleGroup *group, const GroupMesh *mesh, Vec3 origin, Vec3 axis, double *low, double *high)
{
    *low = HUGE_VAL, *high = -HUGE_VAL;
    for (int i = 0; i < GROUP_TRIANGLES; i++)
        for (int k = 0; k < 3; k++) {
            double place = vec3_dot(vec3_sub(mesh->vertex[mesh->corner[group->triangle[i]][k]], origin), axis);
            *low = place < *low ? place : *low;
            *high = place > *high ? place : *high;
        }
}

static Vec3 unit_axis(int axis) { return vec3(axis == 0, axis == 1, axis == 2); }

static void put(double (*to)[GROUP_TRIANGLES], int lane, Vec3 v) { to[0][lane] = v.x, to[1][lane] = v.y, to[2][lane] = v.z; }

TriangleFrame triangle_frame(const Vec3 *vertex, const int *corner)
{
    TriangleFrame f = {.first = 0};
    double longest2 = -1;
    for (int k = 0; k < 3; k++) {
        double length2 = vec3_norm2(vec3_sub(vertex[corner[(k + 1) % 3]], vertex[corner[k]]));
        if (length2 > longest2) {
            longest2 = length2;
            f.first = k;
        }
    }
    Vec3 a = vertex[corner[f.first]], b = vec3_sub(vertex[corner[(f.first + 1) % 3]], a), c = vec3_sub(vertex[corner[(f.first + 2) % 3]], a);
    f.length = vec3_norm(b);
    f.along = vec3_scale(b, 1 / f.length);
    f.top[0] = vec3_dot(c, f.along);
    f.across = vec3_add_scaled(c, -f.top[0], f.along);
    f.top[1] = vec3_norm(f.across);
    f.across = vec3_unit(f.across);
    f.across = vec3_unit(vec3_add_scaled(f.across, -vec3_dot(f.across, f.along), f.along));      // repeated to remove rounding errors of thin triangles
    f.normal = vec3_cross(f.across, f.along);
    return f;
}

void group_fill(TriangleGroup *group, int count, const int *triangle, const GroupMesh *mesh)
{
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < GROUP_TRIANGLES; i++) {
        int t = triangle[i < count ? i : count - 1];
        TriangleFrame f = triangle_frame(mesh->vertex, mesh->corner[t]);
        group->triangle[i] = t;
        put(group->origin, i, mesh->vertex[mesh->corner[t][f.first]]);
        put(group->along, i, f.along);
        put(group->across, i, f.across);
        put(group->normal, i, f.normal);
        group->length[i] = f.length;
        group->top[0][i] = f.top[0];
        group->top[1][i] = f.top[1];
        group->inverse[0][i] = 1 / ((f.top[0] - f.length) * (f.top[0] - f.length) + f.top[1] * f.top[1]);
        group->inverse[1][i] = 1 / (f.top[0] * f.top[0] + f.top[1] * f.top[1]);
        sum = vec3_add(sum, f.normal);
    }
    group->facing = vec3_unit(sum);
    extent_of(group, mesh, vec3(0, 0, 0), group->facing, &group->low, &group->high);
}

GroupBox group_box(const TriangleGroup *group, const GroupMesh *mesh)
{
    GroupBox box;
    for (int axis = 0; axis < 3; axis++) {
        double low, high, wider = 5e-7 * mesh->size;
        extent_of(group, mesh, vec3(0, 0, 0), unit_axis(axis), &low, &high);
        box.low[axis] = (float)(low - wider);
        box.high[axis] = (float)(high + wider);
    }
    return box;
}

void group_set_bounds(GroupSurroundings *around, const TriangleGroup *group, const GroupMesh *mesh)
{
    double low[3][GROUP_NEAR], high[3][GROUP_NEAR], size = 0;
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < around->count; i++) {
            extent_of(&group[around->group[i]], mesh, around->origin, around->axis[axis], &low[axis][i], &high[axis][i]);
            size = fmax(size, fmax(-low[axis][i], high[axis][i]));
        }
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < GROUP_NEAR; i++) {
            around->low[axis][i] = i < around->count ? (float)(low[axis][i] - 1e-6 * size) : HUGE_VALF;
            around->high[axis][i] = i < around->count ? (float)(high[axis][i] + 1e-6 * size) : HUGE_VALF;
        }
    for (int i = 0; i < around->count; i++) {
        const TriangleGroup *g = &group[around->group[i]];
        double middle = vec3_dot(around->origin, g->facing);
        for (int axis = 0; axis < 3; axis++)
            around->facing[axis][i] = (float)vec3_dot(around->axis[axis], g->facing);
        around->facing_low[i] = (float)(g->low - middle - 1e-6 * size);
        around->facing_high[i] = (float)(g->high - middle + 1e-6 * size);
    }
}
