// A closed contour in a section's plane as the Fourier terms of a row (geom/sweep_model.h). Internal to recon.
#ifndef SELDINGER_RECON_EDIT_CONTOUR_TERMS_H
#define SELDINGER_RECON_EDIT_CONTOUR_TERMS_H

#include "geom/geom.h"

// Least squares of R(theta_i) = rho_i, each point weighted by the angle between its neighbours; so points that are equally far apart in angle, 17 or more, give
// their discrete Fourier transform. If neighbours are more than a 24th of a turn apart, more points are taken from the cubic curve rho(theta) through the contour.
// `point`: (count >= 3) (n, b, 0), in either direction. `misfit` [mm]: the largest |R(theta_i) - rho_i|. Returns NULL, or what is wrong and what is valid.
const char *contour_terms(int count, const Vec3 *point, double term[SWEEP_TERMS], double *misfit);
// Smoothing towards a circle, or the ellipse of the same moments, by `strength` 0 to 1; the area stays.
void terms_smooth(double term[SWEEP_TERMS], bool ellipse, double strength);
// Whether R stays above a twentieth of the mean radius.
bool terms_are_open(const double term[SWEEP_TERMS]);

#endif
