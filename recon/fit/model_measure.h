// Measures how well the walls that the nodes of a model (geom/model_field.h) see agree with each other where a tool passes from one to the next and, if known, with the truth.
//
// Places: a link of the tree is a tube, unless a sac, a bifurcation or an end is near it along the tree. A join is a point on the wall at the border of
// two nodes' power cells and in no third cell. Raw: jumps between the fields of the two nodes (the paper's switch). As met: jumps between vessel queries
// (geom/vessel.h) just before and just after a point passes the border. Cold: the same, but the query after the border searches from scratch.
#ifndef SELDINGER_RECON_FIT_MODEL_MEASURE_H
#define SELDINGER_RECON_FIT_MODEL_MEASURE_H

#include "recon/phantom/phantom.h"

typedef enum { PLACE_TUBE, PLACE_BIFURCATION, PLACE_SAC, PLACE_END, PLACES } ModelPlace;
extern const char *const model_place_name[PLACES];   // "tube", "bifurcation", "sac", "end"

typedef struct JumpRow {     // statistics of absolute values, over the joins of a place
    int count;
    double gap_median, gap_p99, gap_most;            // [mm]
    double normal_median, normal_p99, normal_most;   // [rad]
    int worst_node, worst_other;                     // the pair of nodes of gap_most; -1 without joins
} JumpRow;
typedef struct WallRow {     // signed distances [mm] of the wall as met from the true wall, > 0: the model is too wide
    int count;
    double bias, rms, p99, most;                     // p99 and most are of absolute values
    int worst_node;
} WallRow;
typedef struct ModelMeasure {
    JumpRow raw[PLACES], met[PLACES], cold[PLACES];
    WallRow wall[PLACES];    // counts are 0 if the true shape is not given
    // Walls that no data point supports: further than 0.6 r from all points around. Bare: a wall that closes the lumen over a hole in the data (caps at ends
    // are not counted). Ghost: a second sheet outside that wall, inside the node's power cell and within 3 r of its centre.
    int bare_nodes, ghost_nodes;                     // number of nodes with these walls
    int bare_worst, ghost_worst;                     // the node with the point furthest from data; -1: none
    double bare_most_mm, ghost_most_mm;
    // Links between a node and its parent, sampled at 5 places: clearance of the wall as met, relative to the radius there.
    int links, narrow_links;                         // narrow: less than half the radius somewhere
    double least_clearance;
    int narrowest_node;
} ModelMeasure;

// Measures a model. Returns false if out of memory or if there is no model. Nodes are those of the file. `truth` may be NULL. The result does not depend on `threads` (0: all cores).
bool model_measure(const ModelField *model, const Shape *truth, int threads, ModelMeasure *out);

#endif
