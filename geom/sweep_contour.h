// The contour of a branch's section as the swept model has it: polar rows, or within a stretch the sections of another kind, faded as in sweep_model.h. Without
// the blends at forks.
#ifndef SELDINGER_GEOM_SWEEP_CONTOUR_H
#define SELDINGER_GEOM_SWEEP_CONTOUR_H

#include "geom/sweep_field.h"

typedef struct SweepContour {
    SectionKind kind;        // SECTION_POLAR outside stretches
    int count;               // closed, counter-clockwise about the lumen
    SectionPoint *point;     // (count) [mm] in the plane of t: S + n p + b q, see below
    SectionPoint *way;       // (count) unit tangents
} SweepContour;

// The plane of t: points with the coordinates (n, b) of sweep_model.h lie at s + n p + b q, p and q dual to N and B. (They are N and B except for terms of fourth
// order in the interval between knots.)
typedef struct SweepPlane {
    Vec3 s, normal, p, q;
} SweepPlane;
SweepPlane sweep_plane(const SweepField *field, int branch, double t);

// The stretch that shapes the section at t; NULL: the rows alone do.
const SweepStretch *sweep_stretch_at(const SweepModel *model, int branch, double t);
enum { SWEEP_CONTOUR = 384 };
// `t` in 0 … length. `around` points (SWEEP_CONTOUR for figures); more where the contour of a stretch is longer than the rows' circle. Returns false if out of memory, or if no closed contour is found
// (published sections may have none); nothing is owned then.
bool sweep_contour_create(const SweepField *field, int branch, double t, int around, SweepContour *out);
// `count` points of a contour that has points, and their tangents unless `way` is NULL: of a polar one at equal angles if count divides `around`, of others at equal
// distances along the contour; the first in the direction n.
void sweep_contour_sample(const SweepContour *contour, int count, SectionPoint *point, SectionPoint *way);
void sweep_contour_free(SweepContour *contour);

#endif
