// A synthetic shape as files: its points, its surface or a noisy volume of it, and beside the last two the truth.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_WRITE_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_WRITE_H

#include "recon/phantom/phantom.h"

#include <stdio.h>

typedef struct PhantomFiles {
    const char *name;                // of the shape
    int option_count;                // that made it, kept in the trees' files
    const char (*option)[2][64];     // (option_count) key and value
    double cell_mm;                  // grid of a surface's triangles
    VolumeOptions volume;            // its noise has the shape's seed and one more, whatever `seed` says
} PhantomFiles;

// `path` says by its extension what: .h5 points, .stl or .ply the surface, .nrrd a volume; beside the last two F-truth.h5 with the true centreline and exact
// surface points, and F-neighbour.h5 where the shape has a neighbour that is no part of it. `out` (NULL: none) gets a line about it. False with faults.
bool phantom_write(const PhantomFiles *files, const Shape *shape, const char *path, FILE *out, Faults *faults);

#endif
