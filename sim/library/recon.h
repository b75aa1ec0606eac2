// The handles of reconstruction.
#ifndef SELDINGER_SIM_LIBRARY_RECON_H
#define SELDINGER_SIM_LIBRARY_RECON_H

#include "recon/recon.h"
#include "seldinger/recon.h"
#include "sim/library/context.h"

struct SelVolume {
    Volume *volume;
    char *path;              // for the tree's file
};

struct SelTree {
    VesselTree *tree;
    TreeFileInfo info;       // what its file says of it
    Vessel *vessel;          // of a model; else NULL
};

// Takes the tree and the texts of `info`; breaks off where memory lacks.
SelTree *tree_handle(VesselTree *tree, TreeFileInfo info);

#endif
