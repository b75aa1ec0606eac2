// RANSAC-based tracking: from a volume and a few start points to a vessel tree of cylinders (C, r, d, h), each with its points on the wall. Kerrien et al.
// 2017, section 3. Lengths in mm, in the volume's frame. A run is reproducible bit for bit: random numbers depend only on `seed` and the branch's number, and
// threads only share the aneurysms' rays.
#ifndef SELDINGER_RECON_TRACK_RBT_TRACK_H
#define SELDINGER_RECON_TRACK_RBT_TRACK_H

#include "base/base.h"
#include "geom/geom.h"
#include "recon/track/rbt_parameters.h"
#include "recon/track/rbt_report.h"
#include "recon/volume/volume.h"

// Tracks the seeds in order, then the aneurysms. The first seed gives the root and its direction (`toward`). Without a direction the vessel is tracked in
// both directions, and one of its ends becomes the root (rbt_start.h). Each further seed is projected to the tree tracked so far (section 3.3). If it has a
// `toward`, it is instead tracked from its start in both directions, back to the parent. Returns NULL with faults (`path` is the trace file's) if a seed is
// unsuitable or nothing could be tracked from it; a branch that ends early is not a fault. `report` may be NULL.
VesselTree *rbt_track(const Volume *volume, const RbtParameters *parameters, const RbtSeed *seed, int seed_count, const RbtAneurysm *aneurysm,
                      int aneurysm_count, int threads, const Progress *progress, RbtReport *report, const char *path, Faults *faults);

#endif
