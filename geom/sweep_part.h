// A segment of a branch of the swept model, and a branch or a sac at a place: what sweep_field.h is made of. Lengths mm.
#ifndef SELDINGER_GEOM_SWEEP_PART_H
#define SELDINGER_GEOM_SWEEP_PART_H

#include "geom/linear.h"
#include "geom/sweep_model.h"

// Polynomials of t - origin on from <= t <= to. A branch has two segments before its start and two beyond its end, the outer ones without end.
typedef struct SweepSegment {
    Vec3 s[4];                           // as in SweepInterval; with the next four, all that the search for t reads
    double origin, rise, from, to;       // rise: w = rise (t - origin); 0: w = 0
    Vec3 n[4], b[4];                     // as in SweepInterval
    double section[SWEEP_TERMS][4];      // the terms' polynomials
    double largest;                      // [mm] upper bound of R on the segment
    double is_shaped;                    // 1: sections of another kind reach into the segment (sweep_stretch.h)
    double around;                       // [mm] the largest `largest` of the branch within its mean radius of the segment
    double harmonics;                    // the highest harmonic whose terms are not 0
} __attribute__((aligned(64))) SweepSegment;

enum { SWEEP_SEGMENT_ROW = sizeof(SweepSegment) / sizeof(double) };

// One branch or sac at X.
typedef struct SweepPart {
    int branch;              // -1: a sac
    double t, n, b, w, rho;  // coordinates of X, see sweep_model.h
    double f;                // [mm]
    Vec3 gradient, t_gradient;
    Sym3 hessian, t_hessian;
    double share;            // dF/df of this part; the shares add up to 1
    int sac;                 // of a sac: the node whose blobs were added
} SweepPart;

#endif
