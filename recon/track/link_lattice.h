// The best path beside a straight link: over a lattice of places along it, where a step costs its length over the fourth power of how clear it is there. It
// keeps to the middle and crosses what is hardly clear only where it must.
#ifndef SELDINGER_RECON_TRACK_LINK_LATTICE_H
#define SELDINGER_RECON_TRACK_LINK_LATTICE_H

#include "geom/linear.h"

typedef struct LinkPath {    // {0}: none; free(point)
    Vec3 *point;             // (count) from the parent's axis to the child's first node
    int count;
    double share;            // how clear it is at its worst place, 0 … 1
} LinkPath;

typedef struct LinkGround {  // what decides
    double (*clear)(const void *context, Vec3 x);            // 0 … 1
    bool (*passes)(const void *context, Vec3 a, Vec3 b);     // whether a step may be taken; NULL: always
    const void *context;
} LinkGround;

// From `from` to `to` [mm], nowhere further than `beside` from the straight line; places are about `spacing` apart, never less than a sixth of `beside` across
// it. out->count is 0 where there is no path. False: out of memory.
bool link_lattice_path(Vec3 from, Vec3 to, double beside, double spacing, const LinkGround *ground, LinkPath *out);
// Fewer corners; both ends stay.
void link_path_smooth(LinkPath *path);
// What a step of `length` between places so clear costs.
float link_step_cost(float length, double a, double b);

#endif
