// Computes centrelines from a surface alone (Sato et al. 2000, TEASAR, with local radii). The inside of the closed surface is divided into voxels
// (mesh_lumen.h). From one end the cheapest paths with the cost length / distance to the wall^2 run along the middle (Antiga, Ene-Iordache and Remuzzi 2003
// use 1 / radius). The path to the farthest voxel is the first curve. Every other local maximum of distance may be the end of a branch; it is one if its path
// leaves the inscribed spheres of the existing curves by the length of a tube, not only of a bump or corner. A vessel that closes a loop is reached from both
// sides: its curve passes through, unless it is pinched there (touching vessels). Curves are then smoothed, centred between the walls of the surface itself,
// and extended to flat lids.
#ifndef SELDINGER_RECON_SURFACE_MESH_CENTRELINE_H
#define SELDINGER_RECON_SURFACE_MESH_CENTRELINE_H

#include "recon/surface/import_curves.h"

// Returns curves with inscribed radii; each except the first begins at a point of an earlier one; the first begins at the widest end, or at the end nearest
// to options->root. `mesh` must be repaired. Of several lumens the largest is used, or the one nearest to options->root. Pinched loops are added to the
// report's. Returns NULL with faults: out of memory, no lumen found.
CurveSet *mesh_centreline(const SurfaceMesh *mesh, const ImportOptions *options, ImportReport *report, const char *name, Faults *faults);

#endif
