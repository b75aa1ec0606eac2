// Cubic B-splines over breaks that need not be uniform, with fourfold knots at both ends: `breaks` - 1 intervals, `breaks` + 2 functions, of which functions
// q … q+3 live on interval q. Internal to recon.
#ifndef SELDINGER_RECON_FIT_SWEEP_SPLINE_H
#define SELDINGER_RECON_FIT_SWEEP_SPLINE_H

// Values and derivatives of the four functions of t's interval; returns the interval, which is also the first function. t outside counts as the end.
int sweep_spline(const double *at, int breaks, double t, double value[4], double slope[4], double bend[4]);
// Adds, for interval q, the integrals of N_a'' N_b'' (rough) and of N_a N_b (size).
void sweep_spline_integrals(const double *at, int breaks, int q, double rough[4][4], double size[4][4]);

#endif
