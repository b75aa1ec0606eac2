// The sheath: a frictionless straight guide that ends at the mouth. Behind the mouth the wire is a chain of axial and torsional springs; the element across
// the mouth bends only with its part outside. Equations in sheath.c.
#ifndef SELDINGER_SOLVER_SHEATH_H
#define SELDINGER_SOLVER_SHEATH_H

#include "solver/beam.h"

typedef struct SheathElement {       // the element across the mouth
    double outside;          // [mm] l, rest length of the part outside, > 0
    double axial_gradient;   // [N] derivative of the energy with respect to the axial coordinate of the node inside
    double twist_gradient;   // [N mm] … and to its rotation about the line
    double energy;           // [mJ]
    BeamInput beam;          // the part outside …
    BeamOutput out;          // … and its result: force2 and moment2 are the gradients for the node outside
    Vec3 curvature;          // [1/mm] curvature vector of the part outside, with the opposite sign
    double bending;          // [N mm2] EI of the part outside
    double border;           // [N/mm] >= 0, change of the straightening force per length while a border of the rest shape passes the mouth
} SheathElement;

// The sheath holds a node until it is this share of its element's length past the mouth, so that the part outside has a defined direction. Over this distance
// a border of the rest shape passes the mouth: the straightening force changes from that of one element to that of the other.
extern const double sheath_border_share;

// Rest length outside [mm] of an element of `length` whose inner node is at `coordinate`; at least a hundredth of the element's length.
double sheath_outside(double length, double coordinate);

// `index`: the element. `coordinate` [mm]: position of its inner node along the line, 0 at the mouth, negative inside (slightly past the mouth is allowed).
// q1: frame of that node, aligned with the line. x2, q2: outer node. `ahead` [mm]: predicted displacement of the inner node in this step; lengths, and hence
// stiffnesses, are those at the end of the step, because they change rapidly near the mouth.
void sheath_element(const BeamRest *rest, int index, Vec3 mouth, Vec3 direction, double coordinate, Quat q1, Vec3 x2, Quat q2, double ahead,
                    SheathElement *element);

// Force [N] that straightening the wire exerts at the mouth, EI k0^2 / 2 (energy per length), with the inner node at `coordinate`.
double sheath_straightening(const BeamRest *rest, int index, double coordinate);

// Rest curvature vector [1/mm] of an element in space, along the axis of rotation; q: frame of its node.
Vec3 sheath_rest_curvature(const BeamRest *rest, int index, Quat q);

// Tangent with the unknowns of the inner node (axial displacement, rotation about the line) at places 0 and 3 of its block and zeros elsewhere: k11 and k22
// are to be added, k21 is to be written. `length_column` (12: inner block, outer block): part of the axial unknown's column that acts through l, without
// scale; in it displacements of the inner node count from `ahead`.
void sheath_tangent(const BeamRest *rest, int index, Vec3 direction, const SheathElement *element, double scale, BeamTangent *tangent, double *length_column);

#endif
