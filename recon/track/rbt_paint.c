#include "recon/track/rbt_paint.h"

#include <stdlib.h>

RbtPaint *rbt_paint_create(const Volume *volume)
{
    RbtPaint *paint = calloc(1, sizeof *paint);
    size_t voxels = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    if (paint)
        *paint = (RbtPaint){volume, calloc(voxels, sizeof *paint->owner)};
    if (paint && !paint->owner) {
        free(paint);
        return NULL;
    }
    return paint;
}

void rbt_paint_free(RbtPaint *paint)
{
    if (paint)
        free(paint->owner);
    free(paint);
}

RbtBox rbt_box_of_ball(const Volume *v, Vec3 center, double radius)
{
    Vec3 c = volume_voxel_of(v, center);
    double at[3] = {c.x, c.y, c.z};
    RbtBox box;
    for (int i = 0; i < 3; i++) {
        // extent of the ball along the voxel axis: the row of the inverse gives it for oblique grids too
        Vec3 row = vec3(v->to_voxel.m[i][0], v->to_voxel.m[i][1], v->to_voxel.m[i][2]);
        double half = radius * vec3_norm(row);
        box.low[i] = (int)fmax(0, ceil(at[i] - half));
        box.high[i] = (int)fmin(v->size[i] - 1, floor(at[i] + half));
    }
    return box;
}

double rbt_rim_of(const Volume *v, double radius) { return 1.15 * radius + volume_voxel_size(v); }

static void paint_ball(RbtPaint *paint, const Track *tree, int node, Vec3 center, double radius)
{
    const Volume *v = paint->volume;
    double rim = rbt_rim_of(v, radius);
    RbtBox box = rbt_box_of_ball(v, center, rim);
    int at[3];
    for (at[2] = box.low[2]; at[2] <= box.high[2]; at[2]++)
        for (at[1] = box.low[1]; at[1] <= box.high[1]; at[1]++)
            for (at[0] = box.low[0]; at[0] <= box.high[0]; at[0]++) {
                Vec3 x = volume_point_of(v, vec3(at[0], at[1], at[2]));
                double d2 = vec3_norm2(vec3_sub(x, center));
                if (d2 > rim * rim)
                    continue;
                int32_t *owner = &paint->owner[rbt_voxel_index(v, at)];
                if (*owner > 0) {
                    const Cylinder *other = &tree->node[*owner - 1].cylinder;
                    if (vec3_norm2(vec3_sub(x, other->center)) / (other->radius * other->radius) <=
                        vec3_norm2(vec3_sub(x, tree->node[node].cylinder.center)) / (radius * radius))
                        continue;
                }
                *owner = node + 1;
            }
}

void rbt_paint_nodes(RbtPaint *paint, const Track *tree, int first, int end)
{
    for (int i = first; i < end; i++) {
        const TrackNode *n = &tree->node[i];
    // an aneurysm is not a ball: parts of the ball outside it are not painted
        paint_ball(paint, tree, i, n->cylinder.center, (n->kind == NODE_ANEURYSM ? 0.8 : 1) * n->cylinder.radius);
        if (n->parent < 0)
            continue;
        const Cylinder *p = &tree->node[n->parent].cylinder;
        double radius = fmin(n->cylinder.radius, p->radius), gap = vec3_distance(p->center, n->cylinder.center);
        int steps = (int)(gap / fmax(radius, 0.5 * volume_voxel_size(paint->volume)));
        for (int k = 1; k < steps && k < 1000; k++)
            paint_ball(paint, tree, i, vec3_mix(n->cylinder.center, p->center, (double)k / steps), radius);
    }
}

int rbt_paint_node(const RbtPaint *paint, Vec3 x)
{
    const Volume *v = paint->volume;
    Vec3 c = volume_voxel_of(v, x);
    int at[3] = {(int)floor(c.x + 0.5), (int)floor(c.y + 0.5), (int)floor(c.z + 0.5)};
    for (int i = 0; i < 3; i++)
        if (at[i] < 0 || at[i] >= v->size[i])
            return -1;
    return paint->owner[rbt_voxel_index(v, at)] - 1;
}

int tracker_node_around(const Tracker *t, Vec3 x, double share)
{
    if (t->paint) {   // a voxel's owner is the nearest node in units of its radius; near the voxel's border x may belong to a neighbouring node
        int owner = rbt_paint_node(t->paint, x);
        for (int i = owner > 0 ? owner - 1 : owner; i >= 0 && i <= owner + 1 && i < t->tree.count; i++)
            if (vec3_distance(x, t->tree.node[i].cylinder.center) < share * t->tree.node[i].cylinder.radius)
                return i;
        return -1;
    }
    for (int i = 0; i < t->tree.count; i++)
        if (vec3_distance(x, t->tree.node[i].cylinder.center) < share * t->tree.node[i].cylinder.radius)
            return i;
    return -1;
}
