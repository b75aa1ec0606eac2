// What `seldinger export` was asked for, and its part for trees and models.
#ifndef SELDINGER_CLI_EXPORT_TREE_H
#define SELDINGER_CLI_EXPORT_TREE_H

#include "base/base.h"
#include "recon/recon.h"

typedef enum { WHAT_SURFACE, WHAT_CENTRELINE, WHAT_CENTERLINE } What;

typedef struct ExportOptions {
    const char *in, *out, *mask;     // out or mask may be NULL
    int what;                // -1: by the file's extension
    int model;               // index in model_names; -1: the first that the file has
    int frame;               // index in `frames`
    int threads;
    double spacing;          // of the mask's voxels [mm]; 0: by the radius
    ModelSurfaceOptions surface;
    bool quiet;
} ExportOptions;

extern const char *const export_frames[];
// Writes the surface or centreline that `extension`, of options->out, stands for, and the mask. Returns false with faults.
bool export_tree(const ExportOptions *options, const char *extension, Faults *faults);

#endif
