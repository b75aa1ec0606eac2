//
// 1. Curves: the branches' node centres (vessel_branches.h), smoothed and thinned; each knot is then moved to the middle of its section.
// 2. Sections: R(theta, t) of each branch by linear least squares from its own points: cubic B-splines along t, Fourier terms around. Penalties on the second
//    derivative along t and on the size of harmonics; their strengths and the noise come from the points (restricted maximum likelihood, by the iteration of
//    Wood and Fasiolo 2017), so that exact points are followed closely and noisy ones are smoothed.
// 3. Refinement of all rows of all branches together: Gauss and Newton's method on the distance F/|grad F| of every point from the blended wall.
// 4. Sections of another kind than polar, if they are asked for, and where the lumen is not star-shaped (sweep_stretches.h).
// Points far from the wall count less (1 / (1 + (e/s)^4)): those in another vessel's lumen, and outliers.
#ifndef SELDINGER_RECON_FIT_SWEEP_FIT_H
#define SELDINGER_RECON_FIT_SWEEP_FIT_H

#include "base/base.h"
#include "geom/geom.h"
#include "recon/fit/sweep_options.h"

SweepFitOptions sweep_fit_default_options(void);
// The published methods, Kretschmer et al. 2013 (raster), Hong et al. 2018 (rbf) and 2012 (pas): sections alone, without refinement, every radius, as printed.
// Curve and frame remain those of sweep_model.h; branches are joined by the plain maximum, from which the published blends differ by 0.148 of their width
// at most. kind: not polar.
SweepFitOptions sweep_fit_paper_options(SectionKind kind);

typedef struct SweepFitFigures {
    double mean, p99, most;  // [mm] distance of the vessels' points from the wall, those left out excepted
    int64_t points, left_out;        // left out: further than 0.5 radii from the wall: in another vessel's lumen, or outliers
    int64_t folded;          // points beyond the focal line of their branch's curve, where a bend is tighter than the lumen is wide
    int64_t not_star_shaped; // points of sections that a ray from the middle meets more than once
    int64_t numbers;         // stored: knots, breaks, coefficients that are not held at 0 or the numbers of sections of another kind, blobs
    int shaped;              // stations whose sections are not polar
    int mended;              // as printed: stations whose points give no contour around the curve (sweep_stretches.h)
    double noise;            // [mm] standard deviation of the points, as the fit found it
    double seconds;
} SweepFitFigures;

// `tree`: linked, with points. `figures` may be NULL. The model is valid. Returns NULL with faults (options out of range, too few points, no vessel nodes, points
// that give no valid model, out of memory).
SweepModel *sweep_fit(const VesselTree *tree, const SweepFitOptions *options, SweepFitFigures *figures, Faults *faults);

#endif
