// Options of the swept model's fit (sweep_fit.h).
#ifndef SELDINGER_RECON_FIT_SWEEP_OPTIONS_H
#define SELDINGER_RECON_FIT_SWEEP_OPTIONS_H

#include "geom/geom.h"

typedef struct SweepFitOptions {
    SectionOptions section;  // kind and form of the sections; default: polar, mended
    double spacing;          // of sections along a tube, in local radii; default 1
    double fork_spacing;     // the same at forks; default 0.4
    int harmonics;           // highest harmonic along tubes, 1 to 8; default 8. At forks 8
    int rounds;              // most rounds of the refinement; default 9; 0: sections alone
    double voxel_mm;         // [mm] voxel size of the angiogram, for the sacs' blobs; 0: unknown
    double blend;            // width of the blends relative to the child's radius; default 0.6
    int threads;             // 0: all cores; the result does not depend on it
} SweepFitOptions;

#endif
