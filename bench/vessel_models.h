// The vessel models that `bench models` compares: one way to fit and to evaluate each.
#ifndef SELDINGER_BENCH_VESSEL_MODELS_H
#define SELDINGER_BENCH_VESSEL_MODELS_H

#include "bench/bench.h"

#include "recon/fit/sweep_fit.h"

typedef struct ModelKind {
    const char *name;
    bool is_swept, is_printed;       // printed: the published method
    SectionKind section;
} ModelKind;
enum { MODEL_KINDS = 9 };
extern const ModelKind model_kind[MODEL_KINDS];

typedef struct FittedModel {
    const ModelKind *kind;
    VesselTree *lim;         // NULL: swept
    SweepModel *sweep;
    SweepField *field;
    Vessel *vessel;          // contact
    SweepFitFigures figures; // swept
    int64_t numbers;         // stored
    double seconds;          // of the fit
} FittedModel;

// `sweep`: options of the mended swept models; their sections, voxel and threads are replaced. Returns false with faults.
bool fitted_model_create(const ModelKind *kind, const VesselTree *tree, double voxel_mm, int threads, const SweepFitOptions *sweep, FittedModel *out,
                         Faults *faults);
void fitted_model_free(FittedModel *model);

// A wall point x that belongs to a node of the tree: signed distance from the model's wall [mm], > 0 inside, the unit normal into the lumen, and the mean curvature
// [1/mm] of the level there, > 0 where the wall is convex.
typedef struct WallView {
    double gap, curvature;
    Vec3 normal;
} WallView;
WallView fitted_model_look(const FittedModel *model, const VesselTree *tree, int node, Vec3 x);

#endif
