// The sheath: a frictionless straight guide that ends at the mouth. Behind the mouth the wire is a chain of axial and torsional
// springs; the element that lies across the mouth bends with the part that is outside. Equations in sheath.c.
#ifndef SELDINGER_SOLVER_SHEATH_H
#define SELDINGER_SOLVER_SHEATH_H

#include "solver/beam.h"

typedef struct SheathElement {       // the element across the mouth
    double outside;          // [mm] l, rest length of the part outside, > 0
    double axial_gradient;   // [N] derivative of the energy with the axial coordinate of the node inside
    double twist_gradient;   // [N mm] … with its rotation about the line
    double energy;           // [mJ]
    BeamInput beam;          // the part outside …
    BeamOutput out;          // … and what it gives: force2 and moment2 are the gradients for the node outside
    Vec3 curvature;          // [1/mm] of the part outside, as a vector along its axis of turning, negative
    double bending;          // [N mm2] EI of the part outside
    double border;           // [N/mm] slope of what straightening takes, >= 0, where a border of the rest shape passes the mouth
} SheathElement;

// A node is held by the sheath until it is this share of its element past the mouth, so that the piece outside has a direction. On this way a border of
// the rest shape passes the mouth: what it takes to straighten the wire goes from the one element's to the other's.
extern const double sheath_border_share;

// [mm] rest length outside of an element of `length` whose inner node is at `coordinate`, kept above a hundredth of the element.
double sheath_outside(double length, double coordinate);

// `index`: the element. `coordinate` [mm] of its inner node along the line, 0 at the mouth, negative inside (a little past the mouth
// is allowed); q1 of that node (aligned with the line); x2, q2 of the outer one. `ahead` [mm]: by how much the inner node will have moved
// at the step's end; lengths, hence stiffness, are taken there, because near the mouth they change fast.
void sheath_element(const BeamRest *rest, int index, Vec3 mouth, Vec3 direction, double coordinate, Quat q1, Vec3 x2, Quat q2, double ahead,
                    SheathElement *element);

// [N] what straightening a length of wire takes, EI k0^2 / 2, at the mouth, where the inner node is at `coordinate`.
double sheath_straightening(const BeamRest *rest, int index, double coordinate);

// [1/mm] rest curvature of an element in space, along the axis about which it turns; q: frame of its node.
Vec3 sheath_rest_curvature(const BeamRest *rest, int index, Quat q);

// Tangent with the inner node's unknowns (axial displacement, rotation about the line) in places 0 and 3 of its block, the rest
// of it zero: k11 and k22 to be added, k21 to be written. `length_column` (12: inner block, outer block): the part of the axial
// unknown's column that comes through l (without scale); displacements of the inner node count from `ahead` there.
void sheath_tangent(const BeamRest *rest, int index, Vec3 direction, const SheathElement *element, double scale, BeamTangent *tangent, double *length_column);

#endif
