// The energy of LIM as seen by one moving blob, or by all. Kerrien et al. 2017, eq. (3) to (7).
//
// Points and the sums over the blobs that stand still (field, gradient, Hessian) are kept in single precision, structure of arrays, relative
// to the node's centre; loops run over LIM_LANES points at a time with one accumulator a lane, so that every instruction set gives the same
// bits. A point's residual is f - clamp(f, low, high): 0, 0 for data; (m, inf) for a point that must be inside; (-inf, -m) for one outside.
#ifndef SELDINGER_RECON_FIT_LIM_ENERGY_H
#define SELDINGER_RECON_FIT_LIM_ENERGY_H

#include "geom/geom.h"

#include <stddef.h>

enum { LIM_LANES = 16 };

typedef struct LimPoints {
    int count, padded;       // padded to whole lanes by points of weight 0
    float *x, *y, *z;        // (padded) [mm] relative to the node's centre
    float *f;                // (padded) sum of the still blobs less T
    float *g[3], *h[6];      // (padded) its gradient; its Hessian xx xy xz yy yz zz
    float *weight;           // (padded) of the residual's square in E_d
    float *bend;             // (padded) of kappa^2 in E_a
    float *low, *high;       // (padded) target interval of the field
    float *given[3];         // (padded) the data where they were measured, for lim_points_approach
    float *memory;           // all of the above
} LimPoints;

typedef struct LimBlob {
    double center[3];        // relative to the node's centre [mm]
    double width;            // rho [mm]
} LimBlob;

// One moving blob's view: E_d and E_a with derivatives by (C_x, C_y, C_z, rho).
typedef struct LimEnergy {
    double distance, bend;
    double distance_slope[4], bend_slope[4];
} LimEnergy;

// All fields zero but bounds (0, 0). False if out of memory. Points are to be set by the caller up to `count`.
bool lim_points_create(LimPoints *points, int count);
void lim_points_free(LimPoints *points);
// Adds the blob's field, gradient and Hessian to the sums (sign 1), or subtracts them (sign -1).
void lim_points_add(LimPoints *points, const LimBlob *blob, double sign);
// Sets the sums to -T, then lim_points_add of all blobs, in one pass.
void lim_points_sum(LimPoints *points, const LimBlob *blobs, int count, double iso_level);
// Signed Taubin distance at each point from the sums as they are (all blobs added).
void lim_points_taubin(const LimPoints *points, float *distance);

// One step of every point (x, y, z) towards the foot of `given` on f = 0: down the gradient by f / |g|, no further than `longest`, then by `slide`
// times the offset to `given` in the tangent plane. The sums must be recomputed afterwards.
void lim_points_approach(LimPoints *points, double longest, double slide);

// After that, with the sums recomputed: offset (padded), the signed distance of `given` from the foot, > 0 inside, 0 if no foot was found (further
// than 0.6 radii, aside of the normal, or off the surface by more than 0.05 radii); slope (padded), |grad f| at the foot, -1 if none was found; sets
// low = high = -offset slope. The guards' bounds must be set again.
void lim_points_feet(LimPoints *points, double radius, float *offset, float *slope);

// With `blob` on top of the sums.
LimEnergy lim_energy(const LimPoints *points, const LimBlob *blob);
// E_d and E_a of the sums as they are.
void lim_energy_total(const LimPoints *points, double *distance, double *bend);
// Jacobian by one blob's centre and width of the weighted residuals, then (beta > 0) of sqrt(beta b_i) kappa_i: four columns of `padded` entries
// each, or of twice as many; the sums hold all blobs.
void lim_energy_columns(const LimPoints *points, const LimBlob *blob, double beta, float *column);
// The weighted residuals themselves, then (beta > 0) sqrt(beta b_i) kappa_i.
void lim_energy_residuals(const LimPoints *points, double beta, float *residual);
// Dot products of four rows with four columns that stand `stride` apart, all of `length` entries, a multiple of LIM_LANES: dot (4, dot_stride), the
// first four of each row are set.
void lim_energy_gram(const float *rows, const float *columns, size_t stride, int length, double *dot, size_t dot_stride);
// Solves by Cholesky: the matrix's upper triangle in factor (size, stride), lost; step (size): in the right-hand side, out the solution. False if it
// is not positive definite.
bool lim_solve(double *factor, int size, int stride, double *step);
// Dot product of two columns of `padded` entries.
double lim_energy_dot(const float *a, const float *b, int padded);

// E_c of blob j against the others, i.e. its share 2 / (N (N - 1)) sum_k of eq. (7); slope by (C, rho) of j. 0 for one blob.
double lim_cohesion(const LimBlob *blobs, int count, int j, double s, double slope[4]);
double lim_cohesion_total(const LimBlob *blobs, int count, double s);

#endif
