// Symmetric positive definite band matrices. Internal to recon.
// a[j * (width + 1) + d] is entry (j + d, j), d = 0 … width: the lower half, column by column; entries beyond row `n` are not used.
#ifndef SELDINGER_RECON_FIT_BAND_MATRIX_H
#define SELDINGER_RECON_FIT_BAND_MATRIX_H

#include <stdbool.h>

// Cholesky's factor in place. Returns false if the matrix is not positive definite.
bool band_factor(double *a, int n, int width);
// Solves with the factor, in place.
void band_solve(const double *factor, int n, int width, double *x);
// The entries of the inverse within the band (Takahashi et al. 1973). `inverse` has the layout of the factor.
void band_inverse(const double *factor, int n, int width, double *inverse);
// y = a x
void band_multiply(const double *a, int n, int width, const double *x, double *y);

#endif
