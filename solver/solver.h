// solver: the tool's mechanics. Beams, the block-tridiagonal system, contact. Uses geom only; no file, device, clock or OpenGL.
// Inside: mm, g, ms, hence N, MPa, mJ; angles rad.
#ifndef SELDINGER_SOLVER_SOLVER_H
#define SELDINGER_SOLVER_SOLVER_H

#include "solver/block_chain.h"
#include "solver/contact.h"
#include "solver/contact_solve.h"
#include "solver/step.h"
#include "solver/wire.h"

#endif
