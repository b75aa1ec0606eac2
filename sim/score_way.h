// The way through the tree from the sheath's mouth to a target, and how far every node is from it and from the target. All along links of the tree,
// centre to centre [mm]. Made once; asking allocates nothing.
#ifndef SELDINGER_SIM_SCORE_WAY_H
#define SELDINGER_SIM_SCORE_WAY_H

#include "geom/vessel_tree.h"

typedef struct ScoreWay {
    const VesselTree *tree;      // NULL: none, everything is straight
    Vec3 target;
    int entry, goal;             // nodes of mouth and target
    double *off;                 // (N) beyond the mouth of the branch that leads off the way, >= 0; 0 on the way and in the sac that holds the target
    double *left;                // (N) from the node's centre to the target
    int *toward;                 // (N) next node towards the target; the goal's is itself
} ScoreWay;

// `tree` may be NULL. A branch's mouth lies one radius of the way's vessel from its centreline; what goes on past the target begins `target_radius` or
// the vessel's radius behind it, whichever is more. False where memory lacks.
bool score_way_create(ScoreWay *way, const VesselTree *tree, Vec3 mouth, Vec3 target, double target_radius);
void score_way_destroy(ScoreWay *way);
// [mm] from x, whose node is `node`, to the target; straight without tree.
double score_way_left(const ScoreWay *way, Vec3 x, int node);

#endif
