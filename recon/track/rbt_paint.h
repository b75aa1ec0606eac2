// Labels each voxel of the volume with the node whose tube contains it.
#ifndef SELDINGER_RECON_TRACK_RBT_PAINT_H
#define SELDINGER_RECON_TRACK_RBT_PAINT_H

#include "recon/track/rbt_tracker.h"

// For each voxel of a tube and of its blurred rim: the number + 1 of the node that is nearest in units of the node's radius; 0: no node. Memory pages without
// tubes are never touched, so memory use grows with the tree, not with the volume.
typedef struct RbtPaint {
    const Volume *volume;
    int32_t *owner;          // (size[2], size[1], size[0])
} RbtPaint;

static inline size_t rbt_voxel_index(const Volume *v, const int at[3])
{
    return ((size_t)at[2] * (size_t)v->size[1] + (size_t)at[1]) * (size_t)v->size[0] + (size_t)at[0];
}

typedef struct RbtBox {
    int low[3], high[3];
} RbtBox;
// Box of the voxels that a ball may intersect; empty (high < low) if the ball lies outside the volume.
RbtBox rbt_box_of_ball(const Volume *v, Vec3 center, double radius);
double rbt_rim_of(const Volume *v, double radius);   // [mm] radius of a tube with its blurred rim

RbtPaint *rbt_paint_create(const Volume *volume);   // returns NULL if out of memory
void rbt_paint_free(RbtPaint *paint);
// Labels the tubes of nodes first … end-1 and of their links.
void rbt_paint_nodes(RbtPaint *paint, const Track *tree, int first, int end);
// Returns the node whose tube contains x, or -1.
int rbt_paint_node(const RbtPaint *paint, Vec3 x);

// Returns a node of the finished tree whose centre is nearer to x than `share` of its radius, or -1.
int tracker_node_around(const Tracker *t, Vec3 x, double share);

#endif
