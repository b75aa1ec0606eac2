// Invariants of what a step leaves behind, for builds with SELDINGER_VALIDATE (base/assert.h) and for tests. Internal to whoever steps: it sees a stepper's inside.
#ifndef SELDINGER_SOLVER_VALIDATE_H
#define SELDINGER_SOLVER_VALIDATE_H

#include "solver/step.h"

// What holds no more after step_correct(), a text that lives for ever; NULL where all holds:
//   positions, turns and velocities are finite, turns are unit quaternions, elements of a single tool outside the sheath are neither torn nor crushed,
//   contacts stand in the order of the chain, at nodes that it has, with forces that press and stay in their cones.
// Looks at each node and contact once; allocates nothing.
const char *stepper_broken(const Stepper *stepper);

#endif
