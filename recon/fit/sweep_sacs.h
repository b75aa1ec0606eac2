// The sacs of a swept model: shared blobs fitted to the points of the tree's aneurysm nodes. Internal to recon.
#ifndef SELDINGER_RECON_FIT_SWEEP_SACS_H
#define SELDINGER_RECON_FIT_SWEEP_SACS_H

#include "geom/geom.h"
#include "recon/fit/sweep_options.h"

// Fills `sac` and `sac_node` of the model; leaves them NULL if the tree has no sac with points. Returns false with faults.
bool sweep_sacs_fit(const VesselTree *tree, const SweepFitOptions *options, SweepModel *model, Faults *faults);

#endif
