// Checks whether the first start can be trusted: how far the vessel lies from the click, how well a cylinder fits, and whether its wall stands out of the
// noise. Impossible results are refused; doubtful ones are tracked with a warning. If the noise of a voxel exceeds the vessel's contrast, a smoothed copy is
// tracked.
#ifndef SELDINGER_RECON_TRACK_RBT_START_CHECK_H
#define SELDINGER_RECON_TRACK_RBT_START_CHECK_H

#include "recon/track/rbt_scan.h"

// Measures the noise at the first start [mm] and sets t->is_noisy if it exceeds the vessel's contrast there. Returns false if no vessel stands out of the
// noise, with t->refusal, or if out of memory. t->volume, t->voxel, t->background and the axes must be set.
bool rbt_look_at_noise(Tracker *t, RbtLevels *levels, const RbtSeed *first);
// Returns true if a tube stands out around the seed, by the same measure. Used for starts no brighter than 0.2 of the volume's range (when a bright band
// spans it).
bool rbt_stands_out(Tracker *t, RbtLevels *levels, const RbtSeed *seed);
// Finds the cylinder at the first start (rbt_estimate_start, or near one of the tubes that stand out). In a noisy volume t->volume becomes the smoothed copy
// that it needs. Returns false if none is found (t->why) or it is refused (t->refusal).
bool rbt_first_start(Tracker *t, RbtLevels *levels, const RbtSeed *seed, Cylinder *out);
// For a first start with radius and direction: t->volume becomes the copy that this tube needs. Returns false if out of memory.
bool rbt_suit_given(Tracker *t, RbtLevels *levels, const Cylinder *given);
// Checks the first node tracked from a start with radius and direction. Returns false if it is refused.
bool rbt_check_given(Tracker *t, RbtLevels *levels, const RbtSeed *seed, const TrackNode *first);
// Adds that the start lies in a sac, and from where the tree was tracked instead.
void rbt_report_sac_start(Tracker *t, Vec3 start, double sac_radius, Vec3 vessel);
// Adds the doubts about the first branch (nodes 0 … count-1 of the tree) to t->check.
void rbt_judge_branch(Tracker *t, RbtLevels *levels, int count);

#endif
