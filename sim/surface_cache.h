// Surfaces for drawing that take half a second to make, kept in the user's cache folder (base/folders.h), in files surface-KEY.mesh (recon/surface/mesh_pack.h).
// The key covers everything that the surface is made of, and the program. A result is that of the function named, bit for bit. A problem with the cache is never
// an error: the surface is then made. Files are complete when they appear, so that several programs may use one folder; the files used least recently are
// removed above SURFACE_CACHE_MB.
#ifndef SELDINGER_SIM_SURFACE_CACHE_H
#define SELDINGER_SIM_SURFACE_CACHE_H

#include "geom/geom.h"

enum { SURFACE_CACHE_MB = 256 };

TriangleMesh *cached_isosurface_of_tree(const VesselTree *tree, double cell_mm);     // isosurface_of_tree
TriangleMesh *cached_decimation(const TriangleMesh *mesh, int triangles);            // mesh_decimate without a limit on the movement of edges

#endif
