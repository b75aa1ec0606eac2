// Sacs that the trace names (section 3.4). Internal to recon.
#ifndef SELDINGER_RECON_TRACK_RBT_ANEURYSM_H
#define SELDINGER_RECON_TRACK_RBT_ANEURYSM_H

#include "base/faults.h"
#include "recon/track/rbt_tracker.h"

// Captures a sac as branch `number`; false where it is none (a fault) or memory lacks.
bool track_aneurysm(Tracker *t, const RbtAneurysm *aneurysm, const Vec3 *center, int number, int threads, Faults *faults, const char *path);

#endif
