// How well a model fits its points: the figures of the paper's tables 3 and 4, for people and as JSON.
#ifndef SELDINGER_RECON_FIT_FIT_FIGURES_H
#define SELDINGER_RECON_FIT_FIT_FIGURES_H

#include "geom/geom.h"

#include <cJSON.h>
#include <stdio.h>

typedef struct FitFigures {
    long blobs, left_out;            // left_out: points
    int blobs_median, blobs_most;    // of a node
    double error_median, error_worst;        // [mm] d_a of a node
    double class_percent[4], seconds;        // nodes with d_a below half a voxel, one, two, and the rest
    int worst_node;
} FitFigures;

// `voxel` [mm] > 0 makes the classes.
FitFigures fit_figures(const VesselTree *model, double voxel, double seconds);
void fit_figures_print(FILE *out, const VesselTree *model, const FitFigures *figures, double voxel);
void fit_figures_add(cJSON *root, const VesselTree *model, const FitFigures *figures, double voxel);

#endif
