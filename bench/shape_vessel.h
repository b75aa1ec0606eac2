// The true surface of a synthetic shape (phantom.h) as a vessel, the reference for its models. Slow: queries project onto the surface iteratively.
//
// gap: shape_distance. normal: the field's gradient at the foot. hessian: from differences of that normal about the foot. All three without memory of
// the past: locate answers 0, and so does every node. Where the field, which is never more than the distance, is above `reach`: VESSEL_FAR. Beyond an
// open end (VESSEL_BEYOND) the end's section continues as a cylinder: without limit upstream of the inlet, beyond other open ends for five of its
// radii; further out VESSEL_OPEN_END.
#ifndef SELDINGER_BENCH_SHAPE_VESSEL_H
#define SELDINGER_BENCH_SHAPE_VESSEL_H

#include "geom/vessel.h"
#include "recon/phantom/phantom.h"

// Borrows the shape. The inlet is that of shape_sample's node 0. NULL if out of memory.
Vessel *shape_vessel_create(const Shape *shape);

#endif
