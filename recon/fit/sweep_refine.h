// Refines all rows of all branches of the swept model together, from the distance F/|grad F| of every point from the blended wall. Internal to recon.
#ifndef SELDINGER_RECON_FIT_SWEEP_REFINE_H
#define SELDINGER_RECON_FIT_SWEEP_REFINE_H

#include "recon/fit/sweep_rows.h"

// The system's distances are those of the refined model. rounds: at most so many; 0 only measures. Fits the sacs again, if there are any. Returns false if out of memory, or with faults.
bool sweep_refine(SweepDraft *draft, SweepSystem *system, int rounds, Faults *faults);

#endif
