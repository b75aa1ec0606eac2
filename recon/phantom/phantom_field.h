// The field of a synthetic shape (phantom.h), whose zero is its surface. Lengths in mm.
#ifndef SELDINGER_RECON_PHANTOM_PHANTOM_FIELD_H
#define SELDINGER_RECON_PHANTOM_PHANTOM_FIELD_H

#include "geom/geom.h"

#include <stdbool.h>

typedef struct Shape Shape;

// Returns the field: 0 on the surface, > 0 inside, gradient of length <= 1, equal to the distance away from joints.
double shape_field(const Shape *shape, Vec3 x, Vec3 *gradient);
// The same with open ends cut flat: the field of the closed body that is meshed.
double shape_field_cut(const Shape *shape, Vec3 x);
// Signed distance to the true surface [mm], > 0 inside; `foot` (may be NULL) is the closest surface point. Near the medial axis it is the distance of a local
// closest point, which projection finds; it is never less than the field.
double shape_distance(const Shape *shape, Vec3 x, Vec3 *foot);
// Returns true if x lies beyond an open end (open-capsule, arc, bifurcation, spiral, phantom, aorta and arch are open at the inlet; open-capsule at both ends). The
// surface there is not compared with a model, because the tube continues.
bool shape_beyond_open_end(const Shape *shape, Vec3 x);
// Axis-aligned box around the surface.
void shape_bounds(const Shape *shape, Vec3 *low, Vec3 *high);

#endif
