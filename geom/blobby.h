// A blobby model: a sum of kernels around centres minus a level, f > 0 inside. Two kernels:
// Cauchy (local models): f(X) = sum_j rho_j phi(|X - C_j| / rho_j) - T, phi(x) = (1 + x^2/5)^-2. Kerrien et al. 2017, eq. (3), alpha_j = rho_j.
//   With q = |X-C|^2 / (5 rho^2):
//   grad f = sum -(4/(5 rho)) (1+q)^-3 (X-C)
//   H      = sum -(4/(5 rho)) (1+q)^-3 I + (24/(25 rho^3)) (1+q)^-4 (X-C)(X-C)^T
// Compact (shared blobs): f(X) = sum_j a_j u_j^3 - T, u = max(0, 1 - |X-C|^2 / R^2). Twice continuously differentiable.
//   grad f = sum -(6 a u^2 / R^2) (X-C)
//   H      = sum -(6 a u^2 / R^2) I + (24 a u / R^4) (X-C)(X-C)^T
#ifndef SELDINGER_GEOM_BLOBBY_H
#define SELDINGER_GEOM_BLOBBY_H

#include "geom/linear.h"
#include "geom/vessel_tree.h"

typedef struct Blobby {
    int count;               // number of blobs
    const Vec3 *center;      // (count) [mm]
    const double *width;     // (count) rho, or R, > 0 [mm]
    double iso_level;        // T
    const double *amplitude; // a of compact blobs; NULL: Cauchy kernel
    const int32_t *index;    // (count) the rows of center, width and amplitude that hold the blobs; NULL: the first `count` rows
} Blobby;

static inline int blobby_row(const Blobby *model, int j) { return model->index ? model->index[j] : j; }

// The model of a node of a fitted tree: its local model, or the shared blobs that it sees. Borrows the tree's arrays.
static inline Blobby blobby_of(const VesselTree *tree, int node)
{
    if (vessel_tree_is_shared(tree)) {
        int64_t first = tree->seen_offset[node];
        return (Blobby){
            (int)(tree->seen_offset[node + 1] - first), tree->blob_center, tree->blob_width, tree->iso_level, tree->blob_amplitude, tree->seen + first};
    }
    int64_t first = tree->blob_offset[node];
    return (Blobby){(int)(tree->blob_offset[node + 1] - first), tree->blob_center + first, tree->blob_width + first, tree->iso_level, NULL, NULL};
}

double blobby_field(const Blobby *model, Vec3 x);
double blobby_gradient(const Blobby *model, Vec3 x, Vec3 *gradient);
double blobby_hessian(const Blobby *model, Vec3 x, Vec3 *gradient, Sym3 *hessian);

// Radius of a single blob's surface, rho sqrt(5 (sqrt(rho/T) - 1)); 0 for rho <= T.
double blob_radius(double width, double iso_level);
// Inverse of blob_radius: the width of the blob whose surface is a sphere of radius r > 0.
double blob_width_for_radius(double radius, double iso_level);

typedef struct SurfacePoint {
    Vec3 foot;               // the point on f = 0 that is (locally) closest to the query
    Vec3 normal;             // grad f / |grad f| at the foot: into the lumen
    Sym3 shape;              // Hessian of the signed distance at the foot: P H P / |grad f| [1/mm]
    double distance;         // signed, > 0 inside: (x - foot) . normal, the true distance once converged
    bool converged;          // |f|/|grad f| < 1e-9 mm and x - foot parallel to the normal to 1e-4 (or |x - foot| < 1e-6)
} SurfacePoint;
// The closest surface point, by Newton steps on (f = 0, x - foot parallel to grad f) from `start` (x itself, or the last contact). Where grad f vanishes or the
// field is not close to a distance, falls back to a bracketed search towards the nearest blob. Never returns NaN.
SurfacePoint blobby_project(const Blobby *model, Vec3 x, Vec3 start);

#endif
