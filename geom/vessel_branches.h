// The tree divided into branches: at a fork, a branch continues through the widest child; every other child starts a new branch, one order higher than its
// parent branch. Nodes of aneurysms belong to no branch.
#ifndef SELDINGER_GEOM_VESSEL_BRANCHES_H
#define SELDINGER_GEOM_VESSEL_BRANCHES_H

#include "geom/vessel_tree.h"

typedef struct VesselBranch {
    int first, count;        // its nodes: node[first], …, proximal to distal
    int from_node;           // the node it springs from, -1 for the root's branch; its line begins at that node's centre
    int parent;              // branch of from_node (or of its next ancestor on a vessel), -1
    int order;               // 1: the root's
    double length;           // [mm] along the line, from from_node's centre on
    double tortuosity;       // length / distance of the ends, >= 1; 1 where the ends coincide
    double radius_mean;      // [mm] over the nodes
    double radius_least, radius_largest;
} VesselBranch;

typedef struct VesselBranches {
    int count;               // >= 1 if the tree has a vessel node; ordered by the index of the first node, parents before children
    VesselBranch *branch;
    int *node;               // (N) nodes, branch by branch
    double *along;           // (N) [mm] arc length of node[i] along its branch
    int *of_node;            // (N) branch of each node, -1 for nodes of aneurysms
} VesselBranches;

// Returns NULL if out of memory.
VesselBranches *vessel_branches_create(const VesselTree *tree);
void vessel_branches_free(VesselBranches *branches);

#endif
