// A sampled signed distance as a vessel: the gap of another vessel on a cubic lattice, with trilinear interpolation, as in the collision models of comparable
// simulators. Only blocks of the lattice near the wall hold values (a narrow band); blocks deeper inside or outside only hold which side they are on.
//
// gap: the interpolated distance, of second order in the cell. (Dividing by the length of its gradient, as for other fields, gives first order: eight times the
// error with cells of r / 10.)
// normal: the direction of the gradient, of first order, discontinuous at the faces of cells. hessian: 0. node: 0, also from `locate`; a point's memory stores
// its block as the node.
// Further inside than the blocks near the wall: VESSEL_FAR, with the band as a lower bound even where `reach` is more. Further outside than the band:
// VESSEL_UNSURE, gap minus the band, and the point's last normal (0 if it had none).
// Open ends: VESSEL_OPEN_END in a block at whose middle `exact` returns it. A point beyond the lattice is beyond an open end if the adjacent block is inside or
// open; otherwise it is outside.
#ifndef SELDINGER_GEOM_GRID_VESSEL_H
#define SELDINGER_GEOM_GRID_VESSEL_H

#include "geom/isosurface.h"

typedef struct GridVesselOptions {
    double cell_mm;          // spacing of the lattice, > 0
    double band_mm;          // half width of the band about the wall, >= 2 cells
    bool has_inlet;
    Vec3 inlet, direction;
} GridVesselOptions;

// Samples `exact` around `surface` (its triangles locate the wall, its nodes are the nodes from which `exact` is queried); keeps neither. primitives: number of
// values held. Returns NULL with a fault if an option is out of range, the surface is empty or broken, out of memory, or more than 4 million blocks of 9 x 9 x
// 9 values are needed.
Vessel *grid_vessel_create(const Vessel *exact, const TriangleMesh *surface, const GridVesselOptions *options, const char *name, Faults *faults);

#endif
