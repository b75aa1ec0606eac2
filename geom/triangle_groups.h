// A mesh's triangles in groups of eight adjacent ones, for closest-point searches: a group is evaluated at once and knows the groups around it.
//
// Each group o has a neighbourhood N(o) (itself first, then the nearest groups, at most GROUP_NEAR in all) and balls on the lumen's side, each as large as fits
// between the triangles that are not in N(o): no such triangle is closer to the ball's centre c than its radius r. So if d is the distance from X to the
// nearest triangle of N(o) and |X - c| + d < r, the ball of radius d about X lies within the other ball, nothing outside N(o) reaches into it, and d is the
// distance to the whole mesh. This holds for every X, whatever its history; only o has to be remembered. The balls touch the wall at the group's middle, with
// radii from a fraction of the group's size to many times it; which of them helps depends on d.
//
// Coordinates are relative to the mesh's middle. Immutable once filled. All instruction sets give the same bits.
#ifndef SELDINGER_GEOM_TRIANGLE_GROUPS_H
#define SELDINGER_GEOM_TRIANGLE_GROUPS_H

#include "geom/linear.h"

#include <stddef.h>

enum { GROUP_TRIANGLES = 8, GROUP_NEAR = 16, GROUP_BALLS = 6 };

// A triangle's longest side runs from (0, 0) to (length, 0); its third corner is (top[0], top[1]), top[1] > 0. Orthonormal to rounding, however thin the
// triangle.
typedef struct TriangleFrame {
    int first;               // the corner where the longest side starts
    Vec3 along, across, normal;      // normal: into the lumen; the corners run clockwise seen from its tip
    double length, top[2];
} TriangleFrame;
TriangleFrame triangle_frame(const Vec3 *vertex, const int *corner);

typedef struct TriangleGroup {           // lanes beyond the last triangle repeat it
    // Each triangle in its frame (TriangleFrame), from `origin`.
    _Alignas(64) double origin[3][GROUP_TRIANGLES];
    double along[3][GROUP_TRIANGLES], across[3][GROUP_TRIANGLES], normal[3][GROUP_TRIANGLES];
    double length[GROUP_TRIANGLES], top[2][GROUP_TRIANGLES];
    double inverse[2][GROUP_TRIANGLES];          // 1 / squared length of the sides to the top, from (length, 0) and from (0, 0)
    int triangle[GROUP_TRIANGLES];
    Vec3 facing;             // unit, mean of the normals (which point into the lumen): the group is thin along it, …
    double low, high;        // … and x . facing of all its points is within these bounds
} TriangleGroup;

typedef struct GroupBox {                // in float, enlarged by more than the rounding of box and point
    float low[3], high[3];
} GroupBox;

typedef struct GroupSurroundings {
    // Boxes of N(o) in the group's own frame, (x - origin) . axis: neighbours lie nearly in one plane, and boxes aligned with it are flat. In float, enlarged
    // by more than the rounding; boxes beyond `count` are at infinity.
    _Alignas(64) float low[3][GROUP_NEAR], high[3][GROUP_NEAR];
    float facing[3][GROUP_NEAR], facing_low[GROUP_NEAR], facing_high[GROUP_NEAR];    // slabs that hold the groups, in that frame
    Vec3 origin, axis[3];
    int group[GROUP_NEAR];
    int count, balls;
    struct {
        Vec3 center;
        double radius;
    } ball[GROUP_BALLS];
} GroupSurroundings;

typedef struct GroupKernels {
    const char *name;
    // distance2 (8) [mm2] from x to each triangle. Returns true if one is at most `least`.
    bool (*distances)(const TriangleGroup *group, Vec3 x, double least, double *distance2);
    // distance2 (GROUP_NEAR): lower bounds of the squared distance from x to each group, by its box and by its slab. In a concave wall the slabs are tighter:
    // the planes of all other groups are further away than the closest one's.
    void (*bounds)(const GroupSurroundings *around, Vec3 x, float *distance2);
} GroupKernels;
// isa: as LimVesselOptions.isa (geom/vessel.h).
const GroupKernels *group_kernels(int isa);

static inline int group_count(int triangle_count) { return (triangle_count + GROUP_TRIANGLES - 1) / GROUP_TRIANGLES; }
// Orders the triangles (order (T), a permutation) so that eight consecutive ones are close together. centroid (T).
void group_order(int triangle_count, const Vec3 *centroid, int *order);
// Returns whether the group is certainly further from x than sqrt(distance2). size: the largest coordinate of the mesh [mm].
static inline bool group_is_beyond(const TriangleGroup *group, Vec3 x, double distance2, double size)
{
    double height = vec3_dot(x, group->facing), under = group->low - height, over = height - group->high, out = under > over ? under : over;
    out -= 1e-12 * (fabs(x.x) + fabs(x.y) + fabs(x.z) + size);
    return out > 0 && out * out > distance2;
}

typedef struct GroupMesh {               // the mesh that the groups are built from
    const Vec3 *vertex;
    const int (*corner)[3];
    double size;             // [mm] largest coordinate
} GroupMesh;
void group_fill(TriangleGroup *group, int count, const int *triangle, const GroupMesh *mesh);
GroupBox group_box(const TriangleGroup *group, const GroupMesh *mesh);
// Sets boxes and slabs from `origin`, `axis`, `group` and `count`. group: all groups of the mesh.
void group_set_bounds(GroupSurroundings *around, const TriangleGroup *group, const GroupMesh *mesh);

#endif
