// Measures how well a model fits its points: the figures of Kerrien et al. 2017, tables 3 and 4, as text and as JSON.
#ifndef SELDINGER_RECON_FIT_FIT_FIGURES_H
#define SELDINGER_RECON_FIT_FIT_FIGURES_H

#include "geom/geom.h"
#include "recon/fit/sweep_fit.h"

#include <cJSON.h>
#include <stdio.h>

typedef struct FitFigures {
    long blobs, left_out;            // left_out: number of points not fitted
    int blobs_median, blobs_most;    // per node
    double error_median, error_worst;        // [mm] d_a of the nodes
    double class_percent[4], seconds;        // [%] of nodes with d_a below half a voxel, one voxel, two voxels, and the rest; duration of the fit [s]
    int worst_node;                  // in the file
} FitFigures;

// Computes the figures; seconds 0: not printed. The classes are computed if `voxel` [mm] > 0.
FitFigures fit_figures(const ModelField *model, double voxel, double seconds);
void fit_figures_print(FILE *out, const ModelField *model, const FitFigures *figures, double voxel);
void fit_figures_add(cJSON *root, const ModelField *model, const FitFigures *figures, double voxel);
// What the fit of a swept model found.
void sweep_figures_print(FILE *out, const SweepModel *model, SectionKind kind, const SweepFitFigures *figures);
void sweep_figures_add(cJSON *root, const SweepModel *model, SectionKind kind, const SweepFitFigures *figures);

#endif
