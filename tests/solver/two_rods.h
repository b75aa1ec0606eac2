// Offline reference for slack: a wire and the catheter around it as two rods in a plane, each with its own shape, in contact without friction. Quasi-static.
//
// The catheter's line is a chain of links h that turn by beta_i at its nodes; the wire passes node i at the distance w_i from it, along the bisector, within the
// clearance: |w_i| <= c. That is exact, not linearised in w: link i of the wire is, seen from the catheter's,
//   v_i = (h - w_i sin(beta_i / 2) - w_i+1 sin(beta_i+1 / 2),  w_i+1 cos(beta_i+1 / 2) - w_i cos(beta_i / 2)),   l_i = |v_i|,   delta_i its angle,
// and the wire turns by T_i = beta_i + delta_i - delta_i-1. What is least under the bounds is
//   sum EIc (beta_i - beta0_i)^2 / 2 h  +  sum EIw T_i^2 / (l_i-1 + l_i)  -  F sum l_i
// F > 0: the wire's tip is held back, so that it is pressed; F < 0: drawn. Both are inextensible. c = 0 is the shared centreline.
// Positive w lies on the inside of a bend with positive beta. Lengths mm, forces N, energies mJ.
#ifndef SELDINGER_TESTS_TWO_RODS_H
#define SELDINGER_TESTS_TWO_RODS_H

#include <stdbool.h>

typedef struct TwoRods {
    int links;               // of the catheter
    double h;                // [mm]
    double catheter, wire;   // [N mm2] EI
    double clearance;        // [mm] c
    bool is_held;            // the catheter keeps its shape, as in a vessel that holds it
    double pressed;          // [N] F
    int reach;               // links that the wire goes through, from the hub
    double *rest;            // (links + 1) beta0; the first and the last are 0
    double *x;               // (2 (links + 1)) w_i, beta_i: the answer, and where the search begins
    double *gradient;        // (the same)
} TwoRods;

// A catheter clamped at its hub: straight, an arc, straight. Its node positions are at multiples of `h`; the arc's turn is exact. False when out of memory.
bool two_rods_make(TwoRods *rods, double before, double radius, double angle, double after, double h);
void two_rods_free(TwoRods *rods);
// Energy and gradient at x.
double two_rods_energy(TwoRods *rods);
// From x to the least energy. The iterations it took; -1: none was found.
int two_rods_solve(TwoRods *rods);
double two_rods_length(const TwoRods *rods);               // of the wire within
// The catheter's tip and direction [rad]; of the wire's last link its direction against the catheter's.
void two_rods_tip(const TwoRods *rods, double *x, double *y, double *angle, double *exit);

#endif
