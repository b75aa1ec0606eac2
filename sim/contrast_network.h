// The vessel tree as contrast agent sees it: branches between forks, cut into cells of equal transit time, and sacs that hang on them.
// Internal to sim/contrast.c. Volumes mm3, flows mm3/s.
#ifndef SELDINGER_SIM_CONTRAST_NETWORK_H
#define SELDINGER_SIM_CONTRAST_NETWORK_H

#include "sim/contrast.h"

// From behind one fork to the next, or to an end. Upstream branches stand before downstream ones, children of one branch beside each other.
typedef struct FlowBranch {
    int parent;                  // -1: the inlet's
    int first_child, child_count;
    int first_cell, cell_count;  // >= 1
    int first_sac, sac_count;
    double flow;                 // mean
    double cell_volume;          // of each of its cells, >= 0
    double transit;              // [s] through it
} FlowBranch;

typedef struct FlowSac {
    int branch, cell;            // of its neck
    double volume;
    double exchange_flow;        // through the neck
} FlowSac;

// Where a node's concentration is read: weight of cell `second` beside `first`; or a sac.
typedef struct FlowPlace {
    int branch, first, second, sac;   // sac -1: a vessel; of a sac's node, branch and cells are its neck's
    float weight;
    double transit;              // [s] from the inlet
} FlowPlace;

typedef struct FlowNetwork {
    int node_count, branch_count, cell_count, sac_count;
    FlowBranch *branch;
    FlowSac *sac;                // by branches, downstream within each
    FlowPlace *place;            // (node_count)
} FlowNetwork;

// `options` within their ranges, inlet_node a node. False where memory lacks; free it in any case.
bool flow_network_build(FlowNetwork *network, const VesselTree *tree, const ContrastOptions *options);
void flow_network_free(FlowNetwork *network);

#endif
