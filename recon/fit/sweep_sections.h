// Sections of single branches, each from its own points, and curves through their middles: the first two steps of the swept model's fit. Internal to recon.
#ifndef SELDINGER_RECON_FIT_SWEEP_SECTIONS_H
#define SELDINGER_RECON_FIT_SWEEP_SECTIONS_H

#include "recon/fit/sweep_rows.h"

// Moves the knots of all curves to the middle of their sections, and closed ends to where their points say. Returns false if out of memory.
bool sweep_sections_lay_curves(SweepDraft *draft, SweepSystem *system);
// Fits all rows to the branches' own points; if not `tuned`, roughly, with every third point and the strengths of the start. Makes `system` anew, with the
// strengths that it has. Returns false if out of memory.
bool sweep_sections_fit(SweepDraft *draft, SweepSystem *system, bool tuned);

// How a point depends on the branch of `part`; `share`: derivative of its distance by the section there.
SweepSight sweep_sight_of(const SweepField *field, const SweepPart *part, double share);
// Trust of a point at the distance e [mm], 0 … 1; `least`: least distance at which it falls to a half.
double sweep_trust_of(double e, double noise, double least);
// Returns whether t lies at a fork, where sections alone lean towards the other vessel.
bool sweep_is_at_fork(const SweepDraft *draft, int branch, double t);

#endif
