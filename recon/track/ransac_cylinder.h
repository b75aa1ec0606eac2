// A cylinder among points with outliers: RANSAC over circles in the planes across given axes, then least squares on the consensus set. Kerrien et al.
// 2017, 3.1.2 and 3.1.3. Random numbers come from the caller's generator, so runs are reproducible.
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
    double inlier_rate;      // stops early above this inlier rate …
    int trials_min, trials_max;      // … but not before trials_min; stops at trials_max
} RansacOptions;

// The best circle across `axis`; the share of inliers among the points, 0 if none was found.
double ransac_circle(const Vec3 *point, int count, Vec3 origin, Vec3 axis, const RansacOptions *options, Random *random, Cylinder *out);
// Points within `threshold` of the cylinder, listed by index in `inlier` (holds count); returns their number.
int cylinder_inliers(const Cylinder *cylinder, const Vec3 *point, int count, double threshold, int *inlier);
// Least squares of the distance over centre, axis and radius, for the listed points: by Gauss-Newton, or by Powell's method as in the paper. The
// centre stays where it is along the axis. Returns the root mean square [mm]; *good is false if it diverged (the cylinder is then unchanged).
// Without NLopt in the build both are Gauss-Newton: callers ask cylinder_refine_has_powell() first.
double cylinder_refine(Cylinder *cylinder, const Vec3 *point, const int *inlier, int inlier_count, bool by_powell, bool *good);
bool cylinder_refine_has_powell(void);
// The sphere of least squares through points; false if they do not define one.
bool sphere_fit(const Vec3 *point, int count, Vec3 *center, double *radius);

#endif
