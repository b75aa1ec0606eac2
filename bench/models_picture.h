// Sections through several models side by side, as SVG, for `bench models --picture`.
#ifndef SELDINGER_BENCH_MODELS_PICTURE_H
#define SELDINGER_BENCH_MODELS_PICTURE_H

#include "bench/vessel_models.h"

// A plane through a tree.
typedef struct PictureView {
    const char *name;
    Vec3 center, right, up;  // right and up: unit vectors, perpendicular
    double half;             // [mm] half of the side
} PictureView;
// Across the vessel at its middle node; through the first fork, in the plane of its vessels; through the first sac and its neck. False if the tree has none.
bool picture_view_across(const VesselTree *tree, PictureView *out);
bool picture_view_fork(const VesselTree *tree, PictureView *out);
bool picture_view_sac(const VesselTree *tree, PictureView *out);

typedef struct ModelsPicture {
    FILE *out;
    int rows;
} ModelsPicture;

// Opens the file and writes its head. False with a fault.
bool models_picture_open(ModelsPicture *picture, const char *path, Faults *faults);
// A row of cells: the wall of each model (line) and the points near the plane (dots). models: (MODEL_KINDS), those whose vessel is NULL are left out.
bool models_picture_row(ModelsPicture *picture, const PictureView *view, const VesselTree *tree, const FittedModel *models, int threads);
// Writes the end. False with a fault if the file could not be written.
bool models_picture_close(ModelsPicture *picture, const char *path, Faults *faults);

#endif
