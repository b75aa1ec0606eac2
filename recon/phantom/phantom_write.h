// Writes a synthetic shape to files: its points, its surface or a noisy volume, and with the last two the exact shape.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_WRITE_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_WRITE_H

#include "recon/phantom/phantom.h"

#include <stdio.h>

typedef struct PhantomFiles {
    const char *name;                // name of the shape
    int option_count;                // options with which it was created; recorded in the trees' files
    const char (*option)[2][64];     // (option_count) key and value
    double cell_mm;                  // [mm] grid spacing for a surface's triangles
    VolumeOptions volume;            // its noise has the shape's seed and one more, whatever `seed` says
} PhantomFiles;

// The extension of `path` selects the contents: .h5 points, .stl or .ply the surface, .nrrd a volume. Beside the last two it also writes F-truth.h5 with the
// true centreline and exact surface points, and F-neighbour.h5 if the shape has a neighbour that is not part of it. `out` (NULL: none) gets a line about each
// file. Returns false with faults.
bool phantom_write(const PhantomFiles *files, const Shape *shape, const char *path, FILE *out, Faults *faults);

#endif
