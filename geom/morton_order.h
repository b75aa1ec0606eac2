// An order of the triangles of a mesh in which neighbours in the list are near each other in space: that of their middles along Morton's curve (1966).
#ifndef SELDINGER_GEOM_MORTON_ORDER_H
#define SELDINGER_GEOM_MORTON_ORDER_H

#include "geom/isosurface.h"

// The triangles' indices in this order; equal places are in the order of the mesh. The caller frees. NULL if out of memory or without triangles.
int *morton_order(const TriangleMesh *mesh);

#endif
