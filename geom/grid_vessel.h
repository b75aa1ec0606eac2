// A sampled signed distance as a vessel: the gap of another vessel on a cubic lattice, trilinear between its points, as peers' collision models keep it.
// Only blocks of the lattice near the wall hold values (a narrow band); those deeper inside say so, those outside too.
//
// gap: the interpolated distance, of second order in the cell. (Over the length of its gradient, as for other fields: of first order, eight times the error at
// cells of r / 10.) normal: the gradient's direction, of first order, which steps at the faces of cells. hessian: 0. node: 0, and so says locate; what a
// point remembers as its node is its block.
// Further inside than the blocks near the wall: VESSEL_FAR, with the band as a bound even where `reach` is more. Further outside than the band:
// VESSEL_UNSURE, gap minus the band, the last normal the point had (0 where it had none).
// Open ends: where `exact` says so at the middle of a block, VESSEL_OPEN_END; beyond the lattice a point is out of an open end where the block next to it is
// inside or open, else outside.
#ifndef SELDINGER_GEOM_GRID_VESSEL_H
#define SELDINGER_GEOM_GRID_VESSEL_H

#include "geom/isosurface.h"

typedef struct GridVesselOptions {
    double cell_mm;          // spacing of the lattice, > 0
    double band_mm;          // half width of the band about the wall, >= 2 cells
    bool has_inlet;
    Vec3 inlet, direction;
} GridVesselOptions;

// Samples `exact` about `surface` (its triangles say where the wall is, its nodes where `exact` is asked from); keeps neither. primitives: values held.
// NULL with a fault where an option is out of range, the surface is empty or broken, memory lacks or 4 million blocks of 9 x 9 x 9 values would not do.
Vessel *grid_vessel_create(const Vessel *exact, const TriangleMesh *surface, const GridVesselOptions *options, const char *name, Faults *faults);

#endif
