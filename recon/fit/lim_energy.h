// The energy of LIM as a function of one moving blob, or of all blobs. Kerrien et al. 2017, eq. (3) to (7).
//
// Points and the sums over the fixed blobs (field, gradient, Hessian) are kept in single precision, structure of arrays, relative
// to the node's centre; loops run over LIM_LANES points at a time with one accumulator per lane, so that every instruction set gives the same
// bits. A point's residual is f - clamp(f, low, high). (low, high) is (0, 0) for data, (m, inf) for a point that must be inside, (-inf, -m) for one outside.
#ifndef SELDINGER_RECON_FIT_LIM_ENERGY_H
#define SELDINGER_RECON_FIT_LIM_ENERGY_H

#include "geom/geom.h"

#include <stddef.h>

enum { LIM_LANES = 16 };

typedef struct LimPoints {
    int count, padded;       // padded: count rounded up to whole lanes by points of weight 0
    float *x, *y, *z;        // (padded) [mm] relative to the node's centre
    float *f;                // (padded) sum over the fixed blobs minus T
    float *g[3], *h[6];      // (padded) its gradient; its Hessian xx xy xz yy yz zz
    float *weight;           // (padded) weight of the squared residual in E_d
    float *bend;             // (padded) weight of kappa^2 in E_a
    float *low, *high;       // (padded) target interval of the field
    float *given[3];         // (padded) [mm] measured positions of the data, for lim_points_approach
    float *memory;           // memory of all of the above
} LimPoints;

typedef struct LimBlob {
    double center[3];        // relative to the node's centre [mm]
    double width;            // rho [mm]
} LimBlob;

// E_d and E_a with their derivatives by (C_x, C_y, C_z, rho) of the moving blob.
typedef struct LimEnergy {
    double distance, bend;
    double distance_slope[4], bend_slope[4];
} LimEnergy;

// Allocates points with all fields zero and bounds (0, 0). The caller then sets the points 0 … count-1. Returns false if out of memory.
bool lim_points_create(LimPoints *points, int count);
void lim_points_free(LimPoints *points);
// Adds the blob's field, gradient and Hessian to the sums (sign 1), or subtracts them (sign -1).
void lim_points_add(LimPoints *points, const LimBlob *blob, double sign);
// Sets the sums to -T and adds all blobs, in one pass.
void lim_points_sum(LimPoints *points, const LimBlob *blobs, int count, double iso_level);
// Computes the signed Taubin distance at each point from the present sums (all blobs added).
void lim_points_taubin(const LimPoints *points, float *distance);

// Moves every point (x, y, z) one step towards the foot of `given` on f = 0: down the gradient by f / |g|, at most by `longest`, then by `slide` times the
// offset to `given` in the tangent plane. The sums must be recomputed afterwards.
void lim_points_approach(LimPoints *points, double longest, double slide);

// To be called after that, with the sums recomputed. Sets offset (padded), the signed distance of `given` from the foot, > 0 inside, 0 if no foot was found
// (further than 0.6 radii, aside of the normal, or off the surface by more than 0.05 radii); slope (padded), |grad f| at the foot, -1 if none was found; and
// low = high = -offset slope. The guards' bounds must be set again afterwards.
void lim_points_feet(LimPoints *points, double radius, float *offset, float *slope);

// Computes the energy of the sums plus `blob`.
LimEnergy lim_energy(const LimPoints *points, const LimBlob *blob);
// Computes E_d and E_a of the present sums.
void lim_energy_total(const LimPoints *points, double *distance, double *bend);
// Computes the Jacobian by one blob's centre and width of the weighted residuals, then (if beta > 0) of sqrt(beta b_i) kappa_i: four columns of `padded`
// entries each, or of 2 `padded`. The sums hold all blobs.
void lim_energy_columns(const LimPoints *points, const LimBlob *blob, double beta, float *column);
// Computes the weighted residuals, then (if beta > 0) sqrt(beta b_i) kappa_i.
void lim_energy_residuals(const LimPoints *points, double beta, float *residual);
// Computes the dot products of four rows with four columns, each `stride` apart and of `length` entries, a multiple of LIM_LANES. dot: (4, dot_stride); the
// first four entries of each row are set.
void lim_energy_gram(const float *rows, const float *columns, size_t stride, int length, double *dot, size_t dot_stride);
// Solves by Cholesky decomposition. factor (size, stride) holds the matrix's upper triangle and is overwritten; step (size) holds the right-hand side on
// entry and the solution on return. Returns false if the matrix is not positive definite.
bool lim_solve(double *factor, int size, int stride, double *step);
// Dot product of two columns of `padded` entries.
double lim_energy_dot(const float *a, const float *b, int padded);

// Returns E_c of blob j against the others, i.e. its part 2 / (N (N - 1)) sum_k of eq. (7), and its derivative by (C, rho) of j in `slope`. 0 for a single
// blob.
double lim_cohesion(const LimBlob *blobs, int count, int j, double s, double slope[4]);
double lim_cohesion_total(const LimBlob *blobs, int count, double s);

#endif
