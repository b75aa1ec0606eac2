// The distance of a point to a triangle: to its plane within the prism over it, else to the nearest side. One text, compiled for each instruction set;
// with -fno-math-errno and -fno-trapping-math, which change no result, so that the selects vectorise.
#include "geom/triangle_groups.h"

#include "geom/simd.h"

#define ALWAYS static inline __attribute__((always_inline))

ALWAYS void distances(const TriangleGroup *restrict g, Vec3 x, double *restrict distance2)
{
    for (int i = 0; i < GROUP_TRIANGLES; i++) {
        double nx = g->normal[0][i], ny = g->normal[1][i], nz = g->normal[2][i], least = HUGE_VAL, most_beyond = -HUGE_VAL;
        double height = nx * (x.x - g->corner[0][0][i]) + ny * (x.y - g->corner[0][1][i]) + nz * (x.z - g->corner[0][2][i]);
        for (int k = 0; k < 3; k++) {
            int next = k == 2 ? 0 : k + 1;
            double ax = g->corner[k][0][i], ay = g->corner[k][1][i], az = g->corner[k][2][i];
            double ex = g->corner[next][0][i] - ax, ey = g->corner[next][1][i] - ay, ez = g->corner[next][2][i] - az;
            double qx = x.x - ax, qy = x.y - ay, qz = x.z - az;
            double t = (qx * ex + qy * ey + qz * ez) * g->inverse[k][i];
            double beyond = nx * (ey * qz - ez * qy) + ny * (ez * qx - ex * qz) + nz * (ex * qy - ey * qx);
            t = t > 0 ? t : 0;
            t = t < 1 ? t : 1;
            double rx = qx - t * ex, ry = qy - t * ey, rz = qz - t * ez, d2 = rx * rx + ry * ry + rz * rz;
            least = d2 < least ? d2 : least;
            most_beyond = beyond > most_beyond ? beyond : most_beyond;
        }
        double over = height * height;
        over = over < least ? over : least;
        distance2[i] = most_beyond <= 0 ? over : least;
    }
}

ALWAYS void boxes(const GroupSurroundings *restrict s, Vec3 x, float *restrict distance2)
{
    Vec3 q = vec3_sub(x, s->origin);
    float px = (float)vec3_dot(q, s->axis[0]), py = (float)vec3_dot(q, s->axis[1]), pz = (float)vec3_dot(q, s->axis[2]);
    for (int i = 0; i < GROUP_NEAR; i++) {
        float a = s->low[0][i] - px, b = px - s->high[0][i], dx = a > b ? a : b;
        float c = s->low[1][i] - py, d = py - s->high[1][i], dy = c > d ? c : d;
        float e = s->low[2][i] - pz, f = pz - s->high[2][i], dz = e > f ? e : f;
        dx = dx > 0 ? dx : 0;
        dy = dy > 0 ? dy : 0;
        dz = dz > 0 ? dz : 0;
        distance2[i] = (dx * dx + dy * dy + dz * dz) * (1 - 1e-6f);
    }
}

#define KERNELS(isa, ...) \
    __VA_ARGS__ static void distances_##isa(const TriangleGroup *g, Vec3 x, double *distance2) { distances(g, x, distance2); } \
    __VA_ARGS__ static void boxes_##isa(const GroupSurroundings *s, Vec3 x, float *distance2) { boxes(s, x, distance2); } \
    static const GroupKernels isa = {#isa, distances_##isa, boxes_##isa};

KERNELS(baseline, )
#if defined(__x86_64__) && defined(__GNUC__)
KERNELS(avx2, __attribute__((target("avx2"))))
KERNELS(avx512, __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512"))))

const GroupKernels *group_kernels(int isa)
{
    static const GroupKernels *const of[SIMD_COUNT] = {&baseline, &avx2, &avx512};
    int wanted = isa > 0 ? isa - 1 : (int)simd_level(), widest = (int)simd_widest();
    return of[wanted < widest ? wanted : widest];
}
#else
const GroupKernels *group_kernels(int isa)
{
    (void)isa;
    return &baseline;
}
#endif

// --- Order: halves by the longest side of the centroids' box, cut where whole groups end ---

static double along(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

static bool stands_before(const Vec3 *centroid, int axis, int a, int b)
{
    double x = along(centroid[a], axis), y = along(centroid[b], axis);
    return x < y || (x == y && a < b);
}

// Puts the `left` lowest of `count` first (Hoare's selection).
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

void group_fill(TriangleGroup *group, int count, const int *triangle, const int (*corner)[3], const Vec3 *vertex, const Vec3 *normal)
{
    for (int i = 0; i < GROUP_TRIANGLES; i++) {
        int t = triangle[i < count ? i : count - 1];
        group->triangle[i] = t;
        for (int axis = 0; axis < 3; axis++) {
            group->normal[axis][i] = along(normal[t], axis);
            for (int k = 0; k < 3; k++)
                group->corner[k][axis][i] = along(vertex[corner[t][k]], axis);
        }
        for (int k = 0; k < 3; k++)
            group->inverse[k][i] = 1 / vec3_norm2(vec3_sub(vertex[corner[t][(k + 1) % 3]], vertex[corner[t][k]]));
    }
}

static Vec3 corner_of(const TriangleGroup *g, int k, int i) { return vec3(g->corner[k][0][i], g->corner[k][1][i], g->corner[k][2][i]); }

// The extent of the group along an axis.
static void extent_of(const TriangleGroup *group, Vec3 origin, Vec3 axis, double *low, double *high)
{
    *low = HUGE_VAL, *high = -HUGE_VAL;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < GROUP_TRIANGLES; i++) {
            double place = vec3_dot(vec3_sub(corner_of(group, k, i), origin), axis);
            *low = fmin(*low, place);
            *high = fmax(*high, place);
        }
}

static Vec3 unit_axis(int axis) { return vec3(axis == 0, axis == 1, axis == 2); }

GroupBox group_box(const TriangleGroup *group, double size)
{
    GroupBox box;
    for (int axis = 0; axis < 3; axis++) {
        double low, high, wider = 5e-7 * size;
        extent_of(group, vec3(0, 0, 0), unit_axis(axis), &low, &high);
        box.low[axis] = (float)(low - wider);
        box.high[axis] = (float)(high + wider);
    }
    return box;
}

void group_set_boxes(GroupSurroundings *around, const TriangleGroup *group)
{
    double low[3][GROUP_NEAR], high[3][GROUP_NEAR], size = 0;
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < around->count; i++) {
            extent_of(&group[around->group[i]], around->origin, around->axis[axis], &low[axis][i], &high[axis][i]);
            size = fmax(size, fmax(-low[axis][i], high[axis][i]));
        }
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < GROUP_NEAR; i++) {
            around->low[axis][i] = i < around->count ? (float)(low[axis][i] - 1e-6 * size) : HUGE_VALF;
            around->high[axis][i] = i < around->count ? (float)(high[axis][i] + 1e-6 * size) : HUGE_VALF;
        }
}
