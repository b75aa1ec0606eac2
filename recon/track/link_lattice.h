// The cheapest path near a straight link, over a lattice along it. A step costs its length divided by the fourth power of the clearness, so the path
// stays in the middle of the lumen and crosses dim places only where it must.
#ifndef SELDINGER_RECON_TRACK_LINK_LATTICE_H
#define SELDINGER_RECON_TRACK_LINK_LATTICE_H

#include "geom/geom.h"

typedef struct LinkPath {    // {0}: none; free(point)
    Vec3 *point;             // (count) from the parent's axis to the child's first node
    int count;
    double share;            // least clearness on the path, 0 … 1
} LinkPath;

typedef struct LinkGround {  // cost function
    double (*clear)(const void *context, Vec3 x);            // 0 … 1
    bool (*passes)(const void *context, Vec3 a, Vec3 b);     // whether a step may be taken; NULL: always
    const void *context;
} LinkGround;

// From `from` to `to` [mm], within `beside` of the straight line; lattice points are about `spacing` apart, at least a sixth of `beside` across the
// line. out->count is 0 if there is no path. False: out of memory.
bool link_lattice_path(Vec3 from, Vec3 to, double beside, double spacing, const LinkGround *ground, LinkPath *out);
// Smooths the path; both ends stay.
void link_path_smooth(LinkPath *path);
// Cost of a step of `length` between points of these clearnesses.
float link_step_cost(float length, double a, double b);

#endif
