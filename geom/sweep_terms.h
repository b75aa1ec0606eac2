// The terms of one polar section (a row of sweep_model.h): R(theta) = c_0 + sum_k (a_k cos k theta + b_k sin k theta) [mm], about the curve.
#ifndef SELDINGER_GEOM_SWEEP_TERMS_H
#define SELDINGER_GEOM_SWEEP_TERMS_H

#include "geom/sweep_model.h"

double sweep_terms_radius(const double term[SWEEP_TERMS], double theta);
double sweep_terms_area(const double term[SWEEP_TERMS]);     // [mm^2] pi (c_0^2 + sum |c_k|^2 / 2)
// The contour at `count` equal angles from the direction n.
void sweep_terms_contour(const double term[SWEEP_TERMS], int count, SectionPoint *contour);
// The terms of radii at `count` > 2 SWEEP_HARMONICS equal angles: their discrete Fourier transform.
void sweep_terms_of_radii(int count, const double *radius, double term[SWEEP_TERMS]);

#endif
