// A closed cross-section of a vessel, as an implicit curve C(n, b) = 0 in its plane. C > 0 inside, and at the curve C is close to the signed distance [mm].
// Four kinds, each made from a closed contour:
//   polar    C = R(theta) - rho, R = Re sum_k c_k zeta^k, zeta = e^(i theta): Fourier terms about the origin (ours; the sections of sweep_model.h)
//   raster   the signed distance to the contour on 64 x 64 points, interpolated (Kretschmer et al. 2013, "templates")
//   rbf      radial functions and a quadratic that is an ellipse (Hong et al. 2018, section 3)
//   pas      the contour's inside, smoothed by a piecewise polynomial kernel (Hong et al. 2012, section 3: piecewise algebraic splines)
// The papers leave details open; the files of the kinds say what was added. SECTION_AS_PRINTED selects the published form, in which a kind may be unfit for
// contact: a gradient that jumps (raster), a curve through every noisy point (rbf), a flat field off the curve and a curve that lies too far inside (pas).
#ifndef SELDINGER_GEOM_SECTION_H
#define SELDINGER_GEOM_SECTION_H

#include "geom/linear.h"

typedef enum { SECTION_POLAR, SECTION_RASTER, SECTION_RBF, SECTION_PAS, SECTION_KINDS } SectionKind;
extern const char *const section_kind_name[SECTION_KINDS + 1];       // "polar", "raster", "rbf", "pas", NULL

typedef enum { SECTION_MENDED, SECTION_AS_PRINTED } SectionForm;

typedef struct SectionPoint {
    double n, b;             // [mm]
} SectionPoint;

typedef struct SectionOptions {
    SectionKind kind;        // default SECTION_POLAR
    SectionForm form;        // default SECTION_MENDED
    int harmonics;           // polar: terms up to cos and sin of this multiple of theta, 0 to 16; default 8
    double stiffness;        // rbf: mu, the weight of the smoothing, >= 0; 0: the curve passes through the points; default 0.001, as printed 0
    double delta_mm;         // pas: width of the kernel [mm], > 0; 0: 0.05 of the contour's mean radius (default), as printed 0.8 of `voxel_mm`
    double voxel_mm;         // pas, as printed: voxel size of the angiogram [mm]; default 1
} SectionOptions;
SectionOptions section_default_options(SectionKind kind, SectionForm form);

// C with its first and second derivatives.
typedef struct SectionJet {
    double value, n, b, nn, nb, bb;
} SectionJet;

typedef struct Section Section;      // immutable; may be shared by threads

// Makes a section from a closed polygon of 3 to 4096 points, in either direction, which must not cross itself. Returns NULL if the polygon has no area, if a
// number is not finite or out of range, or if out of memory.
Section *section_create(const SectionOptions *options, int count, const SectionPoint *contour);
void section_free(Section *section);
SectionJet section_evaluate(const Section *section, double n, double b);
// Numbers that the kind has to store, for tables.
int section_numbers(const Section *section);

// The curve in polar form about (n0, b0), which must be inside: radius[i] [mm] at theta = 2 pi i / count. Returns the number of rays on which the curve is met
// more than once: 0 for a curve that is star-shaped about the point; there the outermost radius is given. -1: the point is outside.
int section_radii(const Section *section, double n0, double b0, int count, double *radius);

// Of a closed polygon: signed area [mm^2], > 0 if counter-clockwise; centre of its area; and whether a point is inside.
double polygon_area(int count, const SectionPoint *contour);
SectionPoint polygon_centre(int count, const SectionPoint *contour);
bool polygon_contains(int count, const SectionPoint *contour, double n, double b);
// A closed polygon through `steps` points of each span of the Catmull-Rom curve of the given tension through the contour (0.5: the common curve, 0.7: Kretschmer
// et al.); `curve` holds count * steps points.
void polygon_smooth(int count, const SectionPoint *contour, double tension, int steps, SectionPoint *curve);

#endif
