// A model as a volume of labels, for other programs: 3D Slicer, flow solvers.
#ifndef SELDINGER_RECON_SURFACE_MODEL_MASK_H
#define SELDINGER_RECON_SURFACE_MODEL_MASK_H

#include "base/base.h"
#include "geom/geom.h"

typedef struct ModelMaskOptions {
    const SweepModel *sweep; // NULL: the tree's blobs
    double spacing_mm;       // [mm] edge of a voxel; 0: a sixth of the tree's median radius
    const char *frame;       // "LPS" or "RAS": written into the header; coordinates are not converted
} ModelMaskOptions;

// Writes a .nrrd of int16 labels: 0 outside, 1 + branch (of the swept model, or of vessel_branches.h) inside, 1 + number of branches inside an aneurysm. A voxel
// is inside if the model's own field says so at its centre; the axes are those of the coordinates. The lumen ends at the root's plane. Returns false with faults.
bool model_mask_write(const char *path, const VesselTree *tree, const char *name, const ModelMaskOptions *options, Faults *faults);

#endif
