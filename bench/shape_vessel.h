// The true surface of a synthetic shape (phantom.h) as a vessel, the reference for its models. Slow: queries project onto the surface iteratively.
//
// gap: shape_distance. normal: the field's gradient at the foot (the closest point of the wall). hessian: from differences of that normal around the foot. All
// three do not depend on earlier queries: locate returns 0, and the node is always 0. If the field, which never exceeds the distance, is above `reach`:
// VESSEL_FAR. Beyond an open end (VESSEL_BEYOND) the end's section continues as a cylinder: without limit upstream of the inlet, beyond other open ends for
// five of its radii; further out VESSEL_OPEN_END.
#ifndef SELDINGER_BENCH_SHAPE_VESSEL_H
#define SELDINGER_BENCH_SHAPE_VESSEL_H

#include "geom/vessel.h"
#include "recon/phantom/phantom.h"

// Borrows the shape. The inlet is at node 0 of shape_sample. NULL if out of memory.
Vessel *shape_vessel_create(const Shape *shape);

#endif
