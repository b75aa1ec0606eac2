// Writes the centrelines of a tree for other programs. Functions without faults return false if out of memory.
#ifndef SELDINGER_RECON_SURFACE_CENTRELINE_WRITE_H
#define SELDINGER_RECON_SURFACE_CENTRELINE_WRITE_H

#include "base/base.h"
#include "geom/geom.h"

#include <stdio.h>

// Writes a file ("-": standard output) in the format of `extension`: ".vtp", ".swc", else markups. Returns false with a fault.
bool centreline_write_file(const char *path, const char *extension, const VesselTree *tree, const char *frame, Faults *faults);

#endif
