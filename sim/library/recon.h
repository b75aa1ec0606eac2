// The handles of reconstruction.
#ifndef SELDINGER_SIM_LIBRARY_RECON_H
#define SELDINGER_SIM_LIBRARY_RECON_H

#include "recon/recon.h"
#include "seldinger/recon.h"
#include "sim/library/context.h"

struct SelVolume {
    Volume *volume;
    char *path;              // used when the tree is saved
};

struct SelTree {
    VesselTree *tree;
    TreeFileInfo info;       // metadata of its file
    Vessel *vessel;          // of a model; else NULL
};

// Takes ownership of the tree and of the texts of `info`; aborts the call if out of memory.
SelTree *tree_handle(VesselTree *tree, TreeFileInfo info);
SelTreeNode tree_node(const VesselTree *tree, int index);

#endif
