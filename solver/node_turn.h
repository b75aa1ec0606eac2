// Applies rotation vectors to many frames: q_i = exp(r_i / 2) q_i. Internal to solver.
#ifndef SELDINGER_SOLVER_NODE_TURN_H
#define SELDINGER_SOLVER_NODE_TURN_H

#include "geom/geom.h"

#define NODE_TURN_MAX 2.5

// Arrays of `count`; components of r in rad, |r| at most NODE_TURN_MAX. Unit quaternions stay unit. Identical bits at every SIMD level.
void node_turn(int count, const double *rx, const double *ry, const double *rz, Quat *q);

#endif
