// Measures the distance of a fitted model from the true shape to which it was fitted.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_MEASURE_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_MEASURE_H

#include "recon/phantom/phantom.h"

typedef struct MeasureRow {  // statistics of absolute values [mm]
    int count;
    double mean, rms, median, p90, p99, most;
} MeasureRow;

typedef struct ShapeMeasure {
    MeasureRow to_model;     // true surface points to the model of the node whose cell contains them (finds holes, constrictions)
    MeasureRow to_truth;     // points of each local surface inside its node's power cell to the true surface (finds ghost lobes)
    MeasureRow jump;         // difference of distance between neighbouring models at surface points near their cells' border
    double bias;             // [mm] mean signed distance of true points to the model, > 0: the model is too wide
    double least_clearance;  // least ratio of model to true clearance at node centres
    int worst_node;
} ShapeMeasure;

// Returns false if out of memory or if there is no model. The node is one of the file.
bool shape_measure(const Shape *shape, const ModelField *model, ShapeMeasure *out);

#endif
