// Adds aneurysms given in the trace file (Kerrien et al. 2017, section 3.4). Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_ANEURYSM_H
#define SELDINGER_RECON_TRACK_RBT_ANEURYSM_H

#include "base/base.h"
#include "recon/track/rbt_tracker.h"

// Adds an aneurysm as branch `number`. Returns false with a fault if no wall is found around it or if out of memory.
bool track_aneurysm(Tracker *t, const RbtAneurysm *aneurysm, const Vec3 *center, int number, int threads, Faults *faults, const char *path);

#endif
