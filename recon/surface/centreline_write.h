// Centrelines of a tree for other programs. False: out of memory.
#ifndef SELDINGER_RECON_SURFACE_CENTRELINE_WRITE_H
#define SELDINGER_RECON_SURFACE_CENTRELINE_WRITE_H

#include "base/faults.h"
#include "geom/vessel_tree.h"

#include <stdio.h>

bool centreline_print_vtp(FILE *out, const VesselTree *tree);
bool centreline_print_swc(FILE *out, const VesselTree *tree);
// Markups of 3D Slicer, a curve a branch; `frame`: "RAS" or "LPS".
bool centreline_print_markups(FILE *out, const VesselTree *tree, const char *frame);
// As a file ("-": standard output): ".vtp", ".swc", else markups. False with a fault.
bool centreline_write_file(const char *path, const char *extension, const VesselTree *tree, const char *frame, Faults *faults);

#endif
