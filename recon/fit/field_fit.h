// Fits one field of shared blobs to the wall of a whole tree: f = sum a (1 - |x-c|^2/R^2)^3 - 1, f > 0 in the lumen (geom/blobby.h, vessel_tree.h).
//
// 1. Base: blobs of R = 2 r every 0.75 r along the tree (1.5 r in sacs), and upstream of an open inlet.
// 2. Levels of ever smaller blobs, R = 1.4 r to 0.35 r: a blob is added where the residual, averaged over its support, exceeds the tolerance and the noise.
// 3. After each level amplitudes, centres and radii of all blobs are fitted to all rows by Levenberg and Marquardt's method, region by region; each region
//    accepts its own steps, so that no part of a tree delays or degrades another.
//    Where an angiogram gives many points for each voxel, all sweeps but the last two fit to a selection of them (field_rows.h).
// Rows are the data (distance f / |grad f|), their slope (|grad f| near 2/r keeps the field near a scaled distance) and one-sided guards: inside the
// lumen along the tree and between axis and wall, outside where there is neither a tube nor data. A link longer than the sum of its two radii is not lumen
// and stays closed.
#ifndef SELDINGER_RECON_FIT_FIELD_FIT_H
#define SELDINGER_RECON_FIT_FIELD_FIT_H

#include "base/base.h"
#include "geom/geom.h"

typedef struct FieldFitOptions {
    // No blob is added below this mean residual: a fifth of target_mm if that is given, else the larger of tolerance_voxels and tolerance; tolerance_unknown
    // if the voxel size is unknown
    double target_mm;        // [mm] largest distance of points from the wall that is sought; 0: not given
    double voxel_mm;         // [mm] voxel size of the angiogram; 0: unknown (for example, a mesh)
    double tolerance_voxels; // in voxels; default 0.05
    double tolerance;        // in local radii; default 0.004
    double tolerance_unknown;   // in local radii; default 0.02
    double least_reach_voxels;  // smallest reach of a blob, in voxels (image resolution); default 0.8
    double significance;     // least mean residual for a new blob, in standard deviations of the mean's noise; default 6.5
    int levels;              // number of refinement levels, 0 to 8; default 8
    int threads;             // 0: all cores; the result does not depend on it
    int64_t *left_out;       // receives the number of points in another vessel's lumen, which are not fitted; may be NULL
} FieldFitOptions;

FieldFitOptions field_fit_default_options(void);

// Returns a new tree: the input's nodes and points, with shared blobs. Returns NULL with faults (options out of range, no points, out of memory). The input
// must be linked.
VesselTree *field_fit(const VesselTree *tree, const FieldFitOptions *options, const Progress *progress, Faults *faults);

#endif
