// Centrelines of a surface alone. Every piece of the wall gets the centre of the sphere that touches it and the wall across from it (the shrinking
// ball of Ma, Bae and Choi 2012, on the mesh itself, contacts within 60 degrees of the first ignored so that facets and noise grow no spurs); pieces
// that share an edge have neighbouring centres. On that graph the cheapest way by length / radius^2 runs along the middle of vessels (Antiga, Ene-Iordache
// and Remuzzi 2003, on the Voronoi diagram). From the root the way to the farthest piece is the first curve; what its tubes cover is done; the farthest
// piece left over gives the next (Sato et al. 2000, TEASAR). Curves are then centred between the walls around them.
#ifndef SELDINGER_RECON_MESH_CENTRELINE_H
#define SELDINGER_RECON_MESH_CENTRELINE_H

#include "recon/import_surface.h"

// Curves with inscribed radii, each but the first beginning at a point of an earlier one; `mesh` is mended. The component of most area is taken, or that
// which is nearest to options->root. NULL with faults: no memory, no tube found.
CurveSet *mesh_centreline(const SurfaceMesh *mesh, const ImportOptions *options, const char *name, Faults *faults);

#endif
