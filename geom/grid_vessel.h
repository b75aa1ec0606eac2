// A sampled signed distance as a vessel: the gap of another vessel on a cubic lattice, trilinear between its points, as peers' collision models keep it.
// Only blocks of the lattice near the wall hold values (a narrow band); those deeper inside say so, those outside too.
//
// gap: the interpolated distance over the length of its gradient. normal: the gradient's direction, which steps at the faces of cells. hessian: 0.
// Deeper inside than the band: VESSEL_FAR with the band as a bound. Further outside than the band: VESSEL_UNSURE, gap minus the band.
#ifndef SELDINGER_GEOM_GRID_VESSEL_H
#define SELDINGER_GEOM_GRID_VESSEL_H

#include "geom/isosurface.h"

typedef struct GridVesselOptions {
    double cell_mm;          // spacing of the lattice, > 0
    double band_mm;          // half width of the band about the wall, >= 2 cells
    bool has_inlet;
    Vec3 inlet, direction;
} GridVesselOptions;

// Samples `exact` about `surface` (its triangles say where the wall is, its nodes where `exact` is asked from); keeps neither. NULL with a fault where an
// option is out of range or memory lacks.
Vessel *grid_vessel_create(const Vessel *exact, const TriangleMesh *surface, const GridVesselOptions *options, const char *name, Faults *faults);

#endif
