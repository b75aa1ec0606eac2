// solver: the tool's mechanics. Beams, the block-tridiagonal system, contact, one time step. Uses base and geom; sees no file, device, clock or OpenGL.
// Inside: mm, g, ms, hence N, MPa, mJ; angles rad.
#ifndef SELDINGER_SOLVER_SOLVER_H
#define SELDINGER_SOLVER_SOLVER_H

#include "solver/wire.h"
#include "solver/beam.h"
#include "solver/contact.h"
#include "solver/step.h"
#include "solver/validate.h"

#endif
