// Figures of one section of a swept model (sweep_model.h).
#ifndef SELDINGER_GEOM_SWEEP_SECTION_H
#define SELDINGER_GEOM_SWEEP_SECTION_H

#include "geom/sweep_contour.h"

typedef struct SweepSection {
    int branch;
    double t;                // [mm]
    Vec3 centre, normal;     // S, and the unit tangent
    SectionKind kind;        // SECTION_POLAR outside stretches
    double area;             // [mm2]
    double mean;             // [mm] mean over the angle of the ray's length within the lumen, from the centre: of a star-shaped section the mean radius
    double least, largest;   // [mm] distance of the contour from the centre
    double least_diameter, largest_diameter;     // [mm] distance of two parallel tangents
    double perimeter;        // [mm]
    double circularity;      // 4 pi area / perimeter^2: 1 for a circle
} SweepSection;

// The branch's own section at t in 0 … length, without blends, as the model has it (sweep_contour.h). Returns false if out of memory, or if the section has no
// closed contour, which published sections may lack.
bool sweep_section_at(const SweepField *field, int branch, double t, SweepSection *out);
// The same of a contour alone: all but branch, t, centre and normal. Returns false if it has no points.
bool sweep_section_of(const SweepContour *contour, SweepSection *out);

#endif
