// Figures of one section of a swept model (sweep_model.h).
#ifndef SELDINGER_GEOM_SWEEP_SECTION_H
#define SELDINGER_GEOM_SWEEP_SECTION_H

#include "geom/sweep_field.h"

typedef struct SweepSection {
    int branch;
    double t;                // [mm]
    Vec3 centre, normal;     // S, and the unit tangent
    double area;             // [mm2]
    double mean, least, largest;     // radii about the centre [mm]; mean over the angle
    double perimeter;        // [mm]
    double circularity;      // 4 pi area / perimeter^2: 1 for a circle
} SweepSection;

// The branch's own section at t in 0 … length, without blends, from the polar rows: where sections of another kind are used, the nearest polar one.
//   area = (1/2) integral of R^2 = pi (c_0^2 + sum |c_k|^2 / 2),   perimeter = integral of sqrt(R^2 + R'^2), by the trapezoidal rule at 512 angles.
SweepSection sweep_section_at(const SweepField *field, int branch, double t);

#endif
