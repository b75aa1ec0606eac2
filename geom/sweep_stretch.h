// Sections of another kind in a swept model: see "Sections of another kind" in sweep_model.h. Internal to geom.
#ifndef SELDINGER_GEOM_SWEEP_STRETCH_H
#define SELDINGER_GEOM_SWEEP_STRETCH_H

#include "geom/sweep_curve.h"
#include "geom/sweep_part.h"

// Replaces f and its derivatives, which are those of the rows, by those of the branch with its stretches. The part's t, n, b and their derivatives are filled.
// `curve`: (branches).
void sweep_stretch_apply(const SweepModel *model, SweepCurve *const *curve, int branch, Vec3 x, SweepPart *part);
// Marks a segment into which a stretch of the branch reaches, and enlarges its bound.
void sweep_stretch_mark(const SweepModel *model, int branch, SweepSegment *segment);
// m and its first two derivatives at t.
typedef struct SweepStretchShare {
    double m, m1, m2;
} SweepStretchShare;
SweepStretchShare sweep_stretch_share(const SweepModel *model, const SweepStretch *stretch, double t);

#endif
