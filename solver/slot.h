// Contact points between the nodes of long elements. A slot is a material point of the tool: like a node it keeps its contact data and force from step to
// step.
//
// It lies on the cubic through the nodes' positions x with tangents t (the bent shape of beam_element.c); with xi = s / L of the rest length,
//   P = (1 - w) x1 + w x2 + L (a t1 + b t2),   w = xi^2 (3 - 2 xi),  a = xi (1 - xi)^2,  b = xi^2 (xi - 1)
//   dP = (1 - w) dx1 + w dx2 + theta1 x (L a t1) + theta2 x (L b t2)
// which is exact, because a rotated tangent changes by theta x t: w is the weight and L a t1, L b t2 are the levers of contact.h.
#ifndef SELDINGER_SOLVER_SLOT_H
#define SELDINGER_SOLVER_SLOT_H

#include "geom/geom.h"

typedef struct Slot {
    int element;
    double xi;               // (0, 1) of the element's rest length
    double weight;           // w
    double near, far;        // [mm] L a > 0, L b < 0
    double radius;           // [mm] outer radius of the tool
    double friction;         // < 0: the coefficient of the wall applies
} Slot;

typedef struct SlotPlace {   // position, and its dependence on the two nodes
    Vec3 position, tangent;  // tangent is a unit vector
    double weight;
    Vec3 lever[2];
} SlotPlace;

// Number of slots of an element of this length [mm]; 0 if its nodes are close enough.
int slot_count_of(double length);
// The k-th of `count` slots.
Slot slot_make(int element, double length, int k, int count, double radius, double friction);
// The slot moved to another place xi on its element, 0 <= xi <= 1.
Slot slot_shifted(const Slot *slot, double length, double xi);
// Slot on an element whose nodes have positions x1, x2 and unit tangents t1, t2.
SlotPlace slot_place(const Slot *slot, double length, Vec3 x1, Vec3 t1, Vec3 x2, Vec3 t2);
// Slot on the element across the sheath's mouth, whose inner node is at `coordinate` <= 0 [mm] behind it (sheath.c): on the cubic of the part outside, from
// the mouth, clamped along `direction`, to the outer node. Returns false if the slot is inside. lever[0] belongs to the clamp.
bool slot_place_at_mouth(const Slot *slot, double length, double coordinate, Vec3 mouth, Vec3 direction, Vec3 x2, Vec3 t2, SlotPlace *place);

// Slot on an element whose first `behind` mm lie inside another tool: on the cubic of the part beyond that tool's tip, which takes the place of node 1.
// Returns false if the slot is inside.
bool slot_place_beyond(const Slot *slot, double length, double behind, Vec3 x1, Vec3 t1, Vec3 x2, Vec3 t2, SlotPlace *place);

#endif
