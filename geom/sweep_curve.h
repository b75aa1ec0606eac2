// The centreline of a branch of the swept model (sweep_model.h): a natural cubic spline through the knots with a frame that does not rotate about the curve.
//
// S(t): t is the length of the chords from the first knot [mm]; beyond both ends the curve continues as a straight line. N(t), B(t): on each interval between
// knots two cubic polynomials (Hermite) through rotation-minimising frames at the knots, with their exact derivatives there: N' = -(S''.N) S' / |S'|^2.
// Between knots N and B are unit vectors, perpendicular to each other and to S' except for terms of fourth order in the interval; the derivatives below are
// those of the polynomials, so they are exact.
//
// A mirrored or cyclically permuted curve has the mirrored or permuted N; B = T x N at the knots. Owns its arrays; immutable after creation.
#ifndef SELDINGER_GEOM_SWEEP_CURVE_H
#define SELDINGER_GEOM_SWEEP_CURVE_H

#include "geom/linear.h"

// Polynomials of t - origin on from <= t <= to.
typedef struct SweepInterval {
    double origin, from, to; // [mm]; the first interval lies before the curve (from = -HUGE_VAL), the last one beyond it (to = HUGE_VAL)
    Vec3 s[4], n[4], b[4];   // S, N, B: s[0] + s[1] (t - origin) + …
} SweepInterval;

typedef struct SweepCurve {
    int knot_count;          // K >= 2
    double length;           // t of the last knot [mm]
    double *knot_t;          // (K) t of the knots, increasing from 0
    SweepInterval *interval; // (K+1)
} SweepCurve;

// S and its first three derivatives, N and B and their first two derivatives, with respect to t.
typedef struct SweepJet {
    Vec3 s, s1, s2, s3;
    Vec3 n, n1, n2;
    Vec3 b, b1, b2;
} SweepJet;

// `knot`: (knot_count >= 2) [mm], consecutive ones apart. Returns NULL if out of memory.
SweepCurve *sweep_curve_create(int knot_count, const Vec3 *knot);
void sweep_curve_free(SweepCurve *curve);
// Index of the interval that holds t.
int sweep_curve_interval(const SweepCurve *curve, double t);
SweepJet sweep_interval_at(const SweepInterval *interval, double t);
SweepJet sweep_curve_at(const SweepCurve *curve, double t);

// The factor D = |S'|^2 - u.S'' of Newton's step is limited to at least this times |S'|^2: beyond the curve's focal line D is negative.
#define SWEEP_LEAST_D 0.02
// Relative to the square of a distance: an increase that may be rounding.
#define SWEEP_ROUNDING 1e-12
// t of the point of the curve nearest to x, (x - S).S' = 0, by Newton from t = from; `longest`: bound of a step [mm] > 0. Beyond the focal line, a point where
// the distance does not decrease further.
double sweep_curve_project(const SweepCurve *curve, Vec3 x, double from, double longest);
// The same without a start: from the nearest point of the chords between knots.
double sweep_curve_nearest(const SweepCurve *curve, Vec3 x, double longest);

#endif
