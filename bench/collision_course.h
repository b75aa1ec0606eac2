// Points that move slowly along a wall like those of a wire: recorded once on an exact vessel, then queried from any representation, for time and error.
#ifndef SELDINGER_BENCH_COLLISION_COURSE_H
#define SELDINGER_BENCH_COLLISION_COURSE_H

#include "geom/isosurface.h"

// In each step each point moves 0.05 mm along the wall, 0.05 to 0.15 mm inside it.
typedef struct Course {
    int points, steps;
    bool in_line;            // each point is near its predecessor, which is the start of its search
    Vec3 *place;             // (steps, points) [mm]
    VesselHit *truth;        // (steps, points) the exact vessel's results there
} Course;

// A track along the wall of `exact` from `start` (moved to the wall; where `exact` is a LIM of `nodes`, near its node `from`; -1: anywhere), in the
// directions of `nodes`, its points half a millimetre apart: like the queries of a wire pushed along the wall. False if out of memory or there is no
// wall.
bool course_wire(const Vessel *exact, const VesselTree *nodes, Vec3 start, int from, int points, int steps, Course *out);
// Points from vertices of `mesh`, evenly by their order: all over the vessel. Beyond open ends there are none.
bool course_all_over(const Vessel *exact, const VesselTree *nodes, const TriangleMesh *mesh, int points, int steps, Course *out);
void course_free(Course *course);

// CPU time [ns] of a query: the smallest of `runs` passes over the steps, forwards and backwards, so that the points' memory is always valid, after one pass to
// warm up. Several courses act as several tools: one step of each in turn, so that caches are cold. NAN if out of memory.
double course_ns(const Vessel *vessel, int count, const Course *course, int runs);

typedef struct CourseError { // compared with the truth, over all results without flags
    double gap_rms_um, gap_max_um, normal_rms_deg, normal_max_deg;
    int flagged;             // results left out
} CourseError;
// False if out of memory or no result is left.
bool course_error(const Vessel *vessel, const Course *course, CourseError *out);

#endif
