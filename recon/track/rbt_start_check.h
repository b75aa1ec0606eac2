// Whether the first start can be trusted: how far the vessel lies from the click, how well a cylinder fits, whether its wall stands out of the noise.
// Impossible results are refused; doubtful ones are tracked with a warning. Where single voxels are noisier than the vessel is bright, a smoothed
// copy is tracked.
#ifndef SELDINGER_RECON_TRACK_RBT_START_CHECK_H
#define SELDINGER_RECON_TRACK_RBT_START_CHECK_H

#include "recon/track/rbt_scan.h"

// Measures the noise and looks at the first start [mm]: is it noisier than the vessel there is bright (t->is_noisy)? False if no vessel stands out of
// the noise, with t->refusal, or out of memory. t->volume, t->voxel, t->background and the axes must be set.
bool rbt_look_at_noise(Tracker *t, RbtLevels *levels, const RbtSeed *first);
// Whether a tube stands out around x, by the same measure: for starts no brighter than 0.2 of the volume's range (when a bright band spans it).
bool rbt_stands_out(Tracker *t, RbtLevels *levels, const RbtSeed *seed);
// The cylinder at the first start (rbt_estimate_start, or about one of the tubes that stand out); in a noisy volume t->volume becomes the smoothed
// copy that it needs. False if none is found (t->why) or it is refused (t->refusal).
bool rbt_first_start(Tracker *t, RbtLevels *levels, const RbtSeed *seed, Cylinder *out);
// If the first start is fully given: t->volume becomes the copy that this tube needs. False: out of memory.
bool rbt_suit_given(Tracker *t, RbtLevels *levels, const Cylinder *given);
// Checks the first node tracked from a fully given start. False: refused.
bool rbt_check_given(Tracker *t, RbtLevels *levels, const RbtSeed *seed, const TrackNode *first);
// Adds the doubts about the first branch (nodes 0 … count-1 of the tree) to t->check.
void rbt_judge_branch(Tracker *t, RbtLevels *levels, int count);

#endif
