// The tip of a wire, bent by hand around a mandrel while the wire is outside: the bend that its core keeps when released. A steel core yields and
// keeps a bend; a nitinol core springs back. Units mm, N, rad.
#ifndef SELDINGER_SIM_TIP_SHAPING_H
#define SELDINGER_SIM_TIP_SHAPING_H

#include "solver/solver.h"

#include <stddef.h>

extern const double tip_yield_strain;        // of a core of hard-drawn stainless steel; source: tip_shaping.c

typedef struct TipShaping {
    double length;           // [mm] > 0: from the tip back to where the bend begins. What lies distal to the bend is straight
    double angle;            // [rad] > 0: angle that the tip keeps after it has sprung back
    double mandrel;          // [mm] > 0: radius of the mandrel
} TipShaping;

typedef struct TipShaped {   // the bending by hand, and what remains
    double bent_angle;       // [rad] round the mandrel, before it springs back
    double arc;              // [mm] of the wire that is bent
    double rest_radius;      // [mm] of the bend that remains, at its distal end
} TipShaped;

// Ratio of the bending moment to the moment at which the outermost fibre yields, for a round section of an elastic, perfectly plastic material bent to
// `curvature` times that fibre's yield curvature (>= 0): equal to `curvature` up to 1, then rising to 16 / (3 pi).
double tip_core_moment(double curvature);
// [1/mm] curvature that a core of this diameter [mm] keeps after bending to a curvature [1/mm] >= 0; 0 if it does not yield.
double tip_kept_curvature(double curvature, double core_diameter);
// [mm] diameter of a solid steel core with the bending stiffness of the section.
double tip_core_diameter(const WireSection *section);
// Copies the sections with the last `length` straight except for the bend, in the direction of plane angle 0. The caller frees them. NULL with a message in
// `why` if the wire cannot keep that shape: too short, a mandrel too thick to make it yield, or too little length for the angle.
WireSection *tip_shaped_sections(const WireSection *section, int count, const TipShaping *shaping, int *shaped_count, TipShaped *shaped, char *why,
                                 size_t capacity);

#endif
