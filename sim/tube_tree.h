// An exact tube as a tree with surface samples, so that the local blobby models can be compared with the exact result in the same scene.
#ifndef SELDINGER_SIM_TUBE_TREE_H
#define SELDINGER_SIM_TUBE_TREE_H

#include "geom/geom.h"

// Nodes half a radius apart along the axis, 48 samples per node (and on closed ends), all exactly on the surface. `tube` is a tube vessel of `options`. Returns
// NULL with a fault if the axis cannot be followed or if out of memory.
VesselTree *tube_tree(const Vessel *tube, const TubeOptions *options, const char *file, Faults *faults);

#endif
