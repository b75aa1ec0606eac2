// Fits a cylinder to points with outliers: RANSAC over circles in the planes perpendicular to given axes, then least squares on the consensus set. Kerrien et
// al. 2017, 3.1.2 and 3.1.3. Random numbers come from the caller's generator, so runs are reproducible.
#ifndef SELDINGER_RECON_TRACK_RANSAC_CYLINDER_H
#define SELDINGER_RECON_TRACK_RANSAC_CYLINDER_H

#include "geom/geom.h"

#include <stdint.h>

enum { MAX_RANSAC_POINTS = 2562 };

typedef struct Cylinder {
    Vec3 center;
    double radius;           // [mm]
    Vec3 axis;               // unit
    double height;           // [mm]
} Cylinder;

Random random_from_seed(uint64_t seed, uint64_t stream);   // streams of the same seed are independent

typedef struct RansacOptions {
    double threshold;        // [mm] distance from the cylinder up to which a point is an inlier
    double radius_min, radius_max;   // [mm]
    double offset_max;       // [mm] largest distance of the axis from `origin`
    double inlier_rate;      // stop at this inlier rate …
    int trials_min, trials_max;      // … but not before trials_min; always stop at trials_max
} RansacOptions;

// Finds the best circle perpendicular to `axis`. Returns the fraction of inliers among the points, or 0 if none was found.
double ransac_circle(const Vec3 *point, int count, Vec3 origin, Vec3 axis, const RansacOptions *options, Random *random, Cylinder *out);
// Finds the points within `threshold` of the cylinder and lists their indices in `inlier` (space for `count`). Returns their number.
int cylinder_inliers(const Cylinder *cylinder, const Vec3 *point, int count, double threshold, int *inlier);
// Minimises the squared distances of the listed points (MAX_RANSAC_POINTS at most) over centre, axis and radius, by Gauss-Newton, or by Powell's method as in the paper. The position of
// the centre along the axis does not change. Returns the root mean square [mm]; *good is false if the fit diverged (the cylinder is then unchanged). Without
// NLopt in the build both methods are Gauss-Newton, so callers check cylinder_refine_has_powell() first.
double cylinder_refine(Cylinder *cylinder, const Vec3 *point, const int *inlier, int inlier_count, bool by_powell, bool *good);
bool cylinder_refine_has_powell(void);
// Fits a sphere to points by least squares. Returns false if the points do not define one.
bool sphere_fit(const Vec3 *point, int count, Vec3 *center, double *radius);

#endif
