// Contrast agent in a vessel tree: agent injected at the tip travels with the blood and washes out.
//
// Blood flows from the inlet to the ends, steady but for the heart's pulse. At a fork it splits by Murray's law, as r^3 of the branches (Murray, PNAS
// 12:207, 1926); with speed Q / (pi r^2) each piece of a branch has a transit time. The inlet's mean flow is 250 mm/s over its section, which matches
// flows measured in internal carotid and middle cerebral arteries (275 ml/min: Ford et al., Physiol Meas 26:477, 2005; 1.8 ml a beat: Enzmann et al., AJNR
// 15:123, 1994), and at most the heart's 5 l/min. The pulse is 1.6 times the mean at systole and 0.7 times at its minimum (Ford). The injected agent displaces
// blood from upstream, because the resistance lies beyond the tree, in the small vessels: the concentration below the tip is injected / (injected + what still
// comes from upstream). If more is injected than flows, the rest goes upstream, into the branches of the forks above and out of the inlet. Sacs are well mixed
// and exchange with the vessel at their neck.
//
// Deterministic: the same calls give the same bits. No call after create allocates. One thread at a time.
#ifndef SELDINGER_SIM_CONTRAST_H
#define SELDINGER_SIM_CONTRAST_H

#include "sim/contrast_network.h"

ContrastOptions contrast_default_options(void);

typedef struct Contrast Contrast;

// Copies what it needs of the tree. `tree` may be NULL (injected agent then leaves at once), `options` NULL (default); values out of range are clamped. Returns
// NULL if out of memory.
Contrast *contrast_create(const VesselTree *tree, const ContrastOptions *options);
void contrast_free(Contrast *contrast);
// Both made of the same tree with the same options.
void contrast_copy(Contrast *to, const Contrast *from);

// Advances by `dt_s` (usually 1 ms to 1 s; negative values are ignored), while `rate_ml_s` (0 to 100) flows out of a tip at `tip_node`; an invalid
// node (tip in the sheath) stands for the root, where the tool enters.
void contrast_advance(Contrast *contrast, double dt_s, int tip_node, double rate_ml_s);

int contrast_node_count(const Contrast *contrast);                 // N
const float *contrast_concentration(const Contrast *contrast);     // (N) 0 to 1, mean over the lumen at each node
double contrast_injected_ml(const Contrast *contrast);
double contrast_within_ml(const Contrast *contrast);               // injected = within + gone
double contrast_gone_ml(const Contrast *contrast);
bool contrast_is_clear(const Contrast *contrast);                  // no agent is left
// For tests and charts: mean flow of the vessel at a node [ml/s] (0 in a sac), and the blood's mean transit time from the inlet to it [s].
double contrast_flow_ml_s(const Contrast *contrast, int node);
double contrast_transit_s(const Contrast *contrast, int node);

#endif
