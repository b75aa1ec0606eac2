// RANSAC-based tracking: from a volume and a few start points to a vessel tree of cylinders (C, r, d, h), each with its points on the wall.
// Kerrien et al. 2017, section 3. Lengths mm, in the volume's frame. A run repeats bit for bit: random numbers come from `seed` and the branch's number
// alone, and threads only share out the aneurysms' rays.
#ifndef SELDINGER_RECON_TRACK_RBT_TRACK_H
#define SELDINGER_RECON_TRACK_RBT_TRACK_H

#include "base/base.h"
#include "geom/geom.h"
#include "recon/track/rbt_parameters.h"
#include "recon/track/rbt_report.h"
#include "recon/volume/volume.h"

// Seeds first to last, then the aneurysms. The first seed gives the root and its direction (toward). Without a direction the vessel is tracked both
// ways from it, and one of its ends becomes the root (rbt_start.h). A further one is projected to the tree tracked so far (section 3.3) unless it has
// a `toward`: then it is tracked from its start in both directions, back to the parent. NULL with faults (`path` is the trace file's) if a seed is
// unsuitable or nothing could be tracked from it; a branch that just ends early is no fault. `report` may be NULL.
VesselTree *rbt_track(const Volume *volume, const RbtParameters *parameters, const RbtSeed *seed, int seed_count, const RbtAneurysm *aneurysm,
                      int aneurysm_count, int threads, const Progress *progress, RbtReport *report, const char *path, Faults *faults);

#endif
