// The path through the tree from the sheath's mouth to a target, and the distance of every node from it and from the target, along the tree's links
// from centre to centre [mm]. Computed once; queries allocate nothing.
#ifndef SELDINGER_SIM_SCORE_PATH_H
#define SELDINGER_SIM_SCORE_PATH_H

#include "geom/geom.h"

typedef struct ScorePath {
    const VesselTree *tree;      // NULL: none, distances are straight
    Vec3 target;
    int entry, goal;             // nodes of mouth and target
    double *off;                 // (N) distance beyond the mouth of the branch that leaves the path, >= 0; 0 on the path and in the sac that holds the target
    double *left;                // (N) from the node's centre to the target
    int *toward;                 // (N) next node towards the target; itself for the target's node
} ScorePath;

// `tree` may be NULL. A branch's mouth lies one radius of the path's vessel from its centreline; a vessel that continues past the target begins `target_radius`
// or the vessel's radius behind it, whichever is more. Returns false if out of memory.
bool score_path_create(ScorePath *path, const VesselTree *tree, Vec3 mouth, Vec3 target, double target_radius);
void score_path_destroy(ScorePath *path);
// [mm] from x, whose node is `node`, to the target; straight without a tree.
double score_path_left(const ScorePath *path, Vec3 x, int node);

#endif
