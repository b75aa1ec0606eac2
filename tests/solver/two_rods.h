// Offline reference for slack: a wire and the catheter around it as two rods in a plane, each with its own shape, in contact without friction. Quasi-static.
//
// The catheter's line is a chain of links h that turn by beta_i at its nodes; the wire passes node i at the distance w_i from it, along the bisector, within
// the clearance: |w_i| <= c. This is exact, not linearised in w. Relative to link i of the catheter, link i of the wire is
//   v_i = (h - w_i sin(beta_i / 2) - w_i+1 sin(beta_i+1 / 2),  w_i+1 cos(beta_i+1 / 2) - w_i cos(beta_i / 2)),   l_i = |v_i|,   delta_i its angle,
// and the wire bends by T_i = beta_i + delta_i - delta_i-1. The energy to be minimised within the bounds is
//   sum EIc (beta_i - beta0_i)^2 / 2 h  +  sum EIw T_i^2 / (l_i-1 + l_i)  -  F sum l_i
// F > 0: the wire's tip is held back, so that the wire is compressed; F < 0: it is pulled. Both rods are inextensible. c = 0 is the shared centreline.
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
    int reach;               // links through which the wire passes, from the hub
    double *rest;            // (links + 1) beta0; the first and the last are 0
    double *x;               // (2 (links + 1)) w_i, beta_i: start value and solution
    double *gradient;        // (the same)
} TwoRods;

// A catheter clamped at its hub: straight, an arc, straight. Its nodes are at multiples of `h`; the angle of the arc is exact. False if out of memory.
bool two_rods_make(TwoRods *rods, double before, double radius, double angle, double after, double h);
void two_rods_free(TwoRods *rods);
// Energy and gradient at x.
double two_rods_energy(TwoRods *rods);
// Minimises the energy from x. Returns the number of iterations; -1: no minimum was found.
int two_rods_solve(TwoRods *rods);
double two_rods_length(const TwoRods *rods);               // length of the wire in the catheter
// The catheter's tip and direction [rad]; the direction of the wire's last link relative to the catheter.
void two_rods_tip(const TwoRods *rods, double *x, double *y, double *angle, double *exit);

#endif
