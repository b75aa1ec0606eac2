// geom: shapes. Vectors, the vessel tree, blobby fields, and the one interface through which the solver sees a vessel.
// Depends on nothing; never sees a file, a device, a clock or OpenGL. Lengths mm, angles rad.
#ifndef SELDINGER_GEOM_GEOM_H
#define SELDINGER_GEOM_GEOM_H

#include "base/faults.h"
#include "base/simd.h"
#include "geom/blobby.h"
#include "geom/isosurface.h"
#include "geom/linear.h"
#include "geom/power_walk.h"
#include "geom/tree_surface.h"
#include "geom/vessel.h"
#include "geom/vessel_branches.h"
#include "geom/vessel_findings.h"
#include "geom/vessel_tree.h"

#endif
