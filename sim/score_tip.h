// The force on a tool's tip. For a single tool it is what the shaft transmits to the tip: the elastic force in the element behind it. At rest that is the
// resultant of all wall forces on the tip beyond that element; in motion it leaves out the tip's own inertia and damping (a tip of 5 mm has a mass of a few
// mg). For coaxial tools the shaft transmits the wall forces on all of them; there it is the resultant of the wall's forces on the tip itself, where no other
// tool is around it. Neither makes a vessel query.
#ifndef SELDINGER_SIM_SCORE_TIP_H
#define SELDINGER_SIM_SCORE_TIP_H

#include "solver/solver.h"

typedef struct ScoreTip {
    double from;             // [mm] arc length at which the tip begins
    bool is_single;          // the only tool: the following fields are used
    int element;             // behind the tip; -1: the tool is shorter than its tip
    double s;                // [mm] arc length of the element's proximal node
    BeamInput rest;          // its rest values; the nodes are filled in
} ScoreTip;

// For tool `tool` with options `wire`; `tip_length` [mm]. Returns false if out of memory.
bool score_tip_create(ScoreTip *tip, const Stepper *stepper, int tool, const WireOptions *wire, double tip_length);
// [N]; 0 while the tip is not out of the sheath.
double score_tip_force(ScoreTip *tip, const Stepper *stepper, int tool);

#endif
