// A tree's points to a model: what `seldinger fit` does, with either kind of blobs.
#ifndef SELDINGER_RECON_FIT_TREE_FIT_H
#define SELDINGER_RECON_FIT_TREE_FIT_H

#include "recon/fit/field_fit.h"
#include "recon/fit/lim_fit.h"
#include "recon/tree_file.h"

typedef enum {
    FIT_DEFAULT,             // one field of shared blobs
    FIT_LOCAL,               // a local model for each node
    FIT_PAPER                // the same with the published values and method
} FitPreset;

typedef struct TreeFitOptions {
    FitPreset preset;
    LimFitOptions local;     // the shared field has its target_mm, voxel_mm and threads from these
    bool has_voxel;          // local.voxel_mm is given; else it is what the tree's file says, 0 where that says nothing
    double edge_blur;        // [mm] blur that has moved the points inside the wall; < 0: what the tree's file says
} TreeFitOptions;
TreeFitOptions tree_fit_default_options(void);

typedef struct TreeFit {
    VesselTree *model;       // the caller's to free
    double seconds;
    int64_t left_out;        // points that lie in another vessel's lumen
} TreeFit;

// Takes voxel and blur from what the file of `tree` says, where they are not given.
void tree_fit_complete_options(TreeFitOptions *options, const VesselTree *tree, const TreeFileInfo *info);
// Moves the points of `tree` by the blur, then fits. `path` names it in faults. False with faults.
bool tree_fit(VesselTree *tree, const char *path, const TreeFitOptions *options, const Progress *progress, TreeFit *fit, Faults *faults);
// What was done, as YAML for the model's file, the tree's own parameters below; to be freed.
char *tree_fit_parameters(const TreeFitOptions *options, const TreeFileInfo *tree);

#endif
