// The force on the tool's tip from what the shaft carries into it: the elastic force in the element behind the tip. At rest it is the resultant of all
// that the wall does to the tip beyond that element; in motion it leaves out the tip's own inertia and damping (a tip of 5 mm weighs some mg). It costs
// one element's formula, no question to the vessel.
#ifndef SELDINGER_SIM_SCORE_TIP_H
#define SELDINGER_SIM_SCORE_TIP_H

#include "solver/beam_element.h"
#include "solver/wire.h"

typedef struct ScoreTip {
    int element;             // behind the tip; -1: the tool is shorter than its tip
    double s;                // [mm] arc length of the element's proximal node
    BeamInput rest;          // its rest values; the nodes are filled in
} ScoreTip;

// `tip_length` [mm]. Fills `s` (M), the nodes' arc lengths. False where memory lacks.
bool score_tip_create(ScoreTip *tip, const WireOptions *wire, double tip_length, double *s);
// [N]; 0 while the element is not out of the sheath, whose reaction it would carry. `hidden` [mm] of the tool lie in it.
double score_tip_force(ScoreTip *tip, const WireState *state, double hidden);

#endif
