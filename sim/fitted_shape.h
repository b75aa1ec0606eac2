// Shapes and samples fitted on the fly, for scenes without a fitted model.
#ifndef SELDINGER_SIM_FITTED_SHAPE_H
#define SELDINGER_SIM_FITTED_SHAPE_H

#include "base/base.h"
#include "recon/recon.h"
#include "sim/scene.h"

// The scene's shape as a model, from the user's cache ($SELDINGER_CACHE, else below $XDG_CACHE_HOME or ~/.cache) if this program has fitted it
// before. `threads` 0: all cores; `progress` may be NULL. NULL with faults; the caller frees.
// `sweep` not NULL: receives the swept model, and the tree has no blobs.
VesselTree *fitted_shape(const Scene *scene, int threads, const Progress *progress, SweepModel **sweep, Faults *faults);
// Fits shared blobs, or a local model for each node if the contact requires these. Returns NULL with faults; the caller frees.
VesselTree *fit_samples(const VesselTree *sampled, ContactKind contact, const LimFitOptions *options, const Progress *progress, Faults *faults);
// Fits the swept model. Returns NULL with faults; the caller frees.
SweepModel *sweep_samples(const VesselTree *sampled, SectionKind kind, double voxel_mm, int threads, Faults *faults);

#endif
