// Centrelines of a tree for other programs. False: out of memory.
#ifndef SELDINGER_RECON_SURFACE_CENTRELINE_WRITE_H
#define SELDINGER_RECON_SURFACE_CENTRELINE_WRITE_H

#include "base/base.h"
#include "geom/geom.h"

#include <stdio.h>

// As a file ("-": standard output): ".vtp", ".swc", else markups. False with a fault.
bool centreline_write_file(const char *path, const char *extension, const VesselTree *tree, const char *frame, Faults *faults);

#endif
