// The kinds of sections, for section_create.c and the files of the kinds.
#ifndef SELDINGER_GEOM_SECTION_KINDS_H
#define SELDINGER_GEOM_SECTION_KINDS_H

#include "geom/section.h"

struct Section {
    SectionKind kind;
    double radius;           // [mm] mean distance of the contour from the origin
    int numbers;             // that the kind stores
    bool is_distance;        // C is near to the signed distance, not only at the curve
    SectionJet (*evaluate)(const Section *section, double n, double b);
    double values[];         // of the kind
};

// A section with room for `values` numbers; NULL if out of memory.
Section *section_allocate(SectionKind kind, size_t values, double radius);
// Each makes a section from a counter-clockwise contour; NULL if out of memory or if the contour determines no curve.
Section *section_polar_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius);
Section *section_raster_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius);
Section *section_rbf_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius);
Section *section_pas_create(const SectionOptions *options, int count, const SectionPoint *contour, double radius);

// The step H_3 of Hong et al. 2012, eq. 4: 0 below -3, 1 above 3, C2, cubic between the knots -3, -1, 1, 3; and its first three derivatives.
void section_step(double x, double h[4]);
// Factors a symmetric positive definite matrix (size, size) in place, lower triangle; false if it is not positive definite.
bool cholesky_factor(int size, double *matrix);
// Solves with the factor, in place.
void cholesky_solve(int size, const double *factor, double *vector);

#endif
