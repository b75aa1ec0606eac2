// The tree cut into branches, as people count them: a branch goes on at a fork through the widest child, every other child starts a branch of its
// own, one order higher than what it springs from. Nodes of aneurysms belong to no branch.
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
    int count;               // >= 1 where the tree has a vessel node; by index of their first nodes, parents before children
    VesselBranch *branch;
    int *node;               // (N) nodes by branches
    double *along;           // (N) [mm] way of node[i] along its branch
    int *of_node;            // (N) branch of each node, -1 for nodes of aneurysms
} VesselBranches;

// NULL where memory lacks.
VesselBranches *vessel_branches_create(const VesselTree *tree);
void vessel_branches_free(VesselBranches *branches);

#endif
