// Invariants of the state after a step, for builds with SELDINGER_VALIDATE (base/assert.h) and for tests. Internal: it reads the stepper's private data.
#ifndef SELDINGER_SOLVER_VALIDATE_H
#define SELDINGER_SOLVER_VALIDATE_H

#include "solver/step.h"

// Returns the text of the first invariant that is violated after step_correct() (static storage), or NULL if all of these hold:
//   positions, rotations and velocities are finite, quaternions have unit length, elements of a single tool outside the sheath are neither torn nor crushed,
//   contacts are sorted along the chain, at existing nodes, and their forces are compressive and within the friction cones.
// Visits each node and contact once; allocates nothing.
const char *stepper_broken(const Stepper *stepper);

#endif
