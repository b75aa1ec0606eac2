// Fits a model to a tree's points, as `seldinger fit` does, with shared or local blobs.
#ifndef SELDINGER_RECON_FIT_TREE_FIT_H
#define SELDINGER_RECON_FIT_TREE_FIT_H

#include "recon/fit/field_fit.h"
#include "recon/fit/lim_fit.h"
#include "recon/fit/sweep_fit.h"
#include "recon/tree_file.h"

typedef enum {
    FIT_DEFAULT,             // one field of shared blobs
    FIT_LOCAL,               // a local model for each node
    FIT_PAPER                // the published values and method
} FitPreset;

typedef enum { FIT_MODEL_LIM, FIT_MODEL_SWEEP, FIT_MODEL_RASTER, FIT_MODEL_RBF, FIT_MODEL_PAS } FitModel;  // swept models in the order of SectionKind
static inline bool fit_model_is_swept(FitModel model) { return model != FIT_MODEL_LIM; }
static inline SectionKind fit_model_section(FitModel model) { return (SectionKind)(model - FIT_MODEL_SWEEP); }

typedef struct TreeFitOptions {
    FitModel model;
    SweepFitOptions sweep;   // takes the sections from `model` and `preset`, voxel_mm and threads from `local`
    FitPreset preset;
    LimFitOptions local;     // options of local models; the shared field takes its target_mm, voxel_mm and threads from them
    bool has_voxel;          // local.voxel_mm is given; else it is taken from the tree's file, 0 if the file does not give it
    double edge_blur;        // [mm] blur (standard deviation) that has moved the points inside the wall; < 0: taken from the tree's file
    bool is_corrected;       // the tree's points were moved back by edge_blur before: another model was fitted to them
} TreeFitOptions;
TreeFitOptions tree_fit_default_options(void);

typedef struct TreeFit {
    VesselTree *model;       // owned by the caller; NULL for a swept model
    SweepModel *sweep;       // owned by the caller; NULL for LIM
    SweepFitFigures figures; // of the swept model
    double seconds;
    int64_t left_out;        // number of points that lie in another vessel's lumen and were not fitted
} TreeFit;

// Takes voxel size and blur from the file of `tree` if they are not given.
void tree_fit_complete_options(TreeFitOptions *options, const VesselTree *tree, const TreeFileInfo *info);
// Corrects the points of `tree` for the blur, then fits. `path` is used in faults. Returns false with faults.
bool tree_fit(VesselTree *tree, const char *path, const TreeFitOptions *options, const Progress *progress, TreeFit *fit, Faults *faults);
// Returns the options of the fit as YAML for the model's file, with the tree's own parameters after them. The caller frees it.
char *tree_fit_parameters(const TreeFitOptions *options, const TreeFileInfo *tree);

#endif
