// Finds the cheapest path near a straight link, over a lattice along it. A step costs its length divided by the fourth power of the clearness, so the path
// stays in the middle of the lumen and crosses dim places only where it must.
#ifndef SELDINGER_RECON_TRACK_LINK_LATTICE_H
#define SELDINGER_RECON_TRACK_LINK_LATTICE_H

#include "geom/geom.h"

typedef struct LinkPath {    // {0}: no path; the caller frees `point`
    Vec3 *point;             // (count) from the parent's axis to the child's first node
    int count;
    double share;            // least clearness on the path, 0 … 1
} LinkPath;

typedef struct LinkGround {  // cost function
    double (*clear)(const void *context, Vec3 x);            // clearness at x: 0 … 1
    bool (*passes)(const void *context, Vec3 a, Vec3 b);     // whether the step from a to b is allowed; NULL: always
    const void *context;
} LinkGround;

// Finds the path from `from` to `to` [mm], within `beside` [mm] of the straight line. Lattice points are about `spacing` [mm] apart, across the line at least
// a sixth of `beside`. out->count is 0 if there is no path. Returns false if out of memory.
bool link_lattice_path(Vec3 from, Vec3 to, double beside, double spacing, const LinkGround *ground, LinkPath *out);
// Smooths the path; its ends are fixed.
void link_path_smooth(LinkPath *path);
// Cost of a step of `length` between points of clearness a and b.
float link_step_cost(float length, double a, double b);

#endif
