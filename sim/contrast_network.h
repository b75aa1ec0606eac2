// The flow network for contrast agent: branches between forks, divided into cells of equal transit time, with sacs attached. Volumes mm3, flows
// mm3/s.
#ifndef SELDINGER_SIM_CONTRAST_NETWORK_H
#define SELDINGER_SIM_CONTRAST_NETWORK_H

#include "geom/geom.h"

typedef struct ContrastOptions {
    double step_s;           // [s] the cells are this long in transit time, 0.001 to 0.1, default 0.005
    double inlet_flow_ml_s;  // [ml/s] mean; 0 (default): from the inlet's radius
    int inlet_node;          // an end of the tree where the blood enters; -1 (default): contrast_find_inlet
    double pulsation;        // 0 (steady) to 1 (default: as measured)
    double heart_rate_min;   // [1/min] 30 to 200, default 65
    double sac_residence_s;  // [s] volume of a sac / flow through its neck, 0.1 to 100, default 1.5
} ContrastOptions;

// Where the blood enters: the root, or the end of the widest end branch where that is wider by a tenth and longer than 1.5 radii (the ascending
// aorta, where the tool comes from the leg). -1 without a tree.
int contrast_find_inlet(const VesselTree *tree);

// From behind one fork to the next, or to an end. Upstream branches come before downstream ones; children of one branch are consecutive.
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

// Where a node's concentration is read: cells `first` and `second` with the weight of `second`, or a sac.
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

// `options` within their ranges, inlet_node a node. False if out of memory; free it in any case.
bool flow_network_build(FlowNetwork *network, const VesselTree *tree, const ContrastOptions *options);
void flow_network_free(FlowNetwork *network);

#endif
