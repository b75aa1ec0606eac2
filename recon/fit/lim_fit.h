// LIM: fits a local blobby model to every node of a tree. Kerrien et al. 2017, section 4, with the departures listed in LimFitOptions.
//
// For each node: concatenate the points up to topological distance 2, start from two blobs along the vessel, then
// select (worst point, its nearest blob), split, optimise (Polak-Ribiere, centre then width) until every point lies within the
// target distance or the number of blobs is reached; clean up. Where neighbours differ, fit again from there, also to the wall on which they agree.
// One job per node on all cores, the largest first; results do not depend on `threads`.
#ifndef SELDINGER_RECON_FIT_LIM_FIT_H
#define SELDINGER_RECON_FIT_LIM_FIT_H

#include "base/base.h"
#include "geom/geom.h"
#include "recon/fit/lim_model.h"

LimFitOptions lim_fit_default_options(void);
LimFitOptions lim_fit_paper_options(void);   // as published: Table 1, Taubin's distance, no extensions

// Returns a new tree: the input's nodes and points, with a model. Returns NULL with faults (options out of range, a node whose neighbourhood has too few
// points).
VesselTree *lim_fit(const VesselTree *tree, const LimFitOptions *options, const Progress *progress, Faults *faults);

#endif
