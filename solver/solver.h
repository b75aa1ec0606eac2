// solver: mechanics of the tool (beams, block-tridiagonal system, contact, one time step). Uses base and geom; independent of files, devices, clocks and
// OpenGL.
// Internal units: mm, g, ms, hence N, MPa, mJ; angles in rad.
#ifndef SELDINGER_SOLVER_SOLVER_H
#define SELDINGER_SOLVER_SOLVER_H

#include "solver/wire.h"
#include "solver/beam.h"
#include "solver/contact.h"
#include "solver/step.h"
#include "solver/validate.h"

#endif
