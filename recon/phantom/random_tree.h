// Grows a random vascular tree as a synthetic shape. A branch splits in two by Murray's law: r0^3 = r1^3 + r2^3, angles of least work
//   cos t1 = (r0^4 + r1^4 - r2^4) / (2 r0^2 r1^2)
// (Murray, J. Gen. Physiol. 9, 1926). Branches are smooth curves whose curvature wanders, 6 to 11 of their radii long; the wider daughter continues
// the same part, the other is a new part that starts on the parent's centreline with the parent's direction. A split that would come near another
// vessel is drawn again; if none fits, the branch ends. The widest tip splits first.
#ifndef SELDINGER_RECON_PHANTOM_RANDOM_TREE_H
#define SELDINGER_RECON_PHANTOM_RANDOM_TREE_H

#include "base/base.h"
#include "geom/geom.h"
#include "recon/phantom/phantom_parts.h"

typedef struct RandomTreeOptions {
    int branches;            // number of segments between bifurcations, or bifurcation and end; odd, an even number counts as one less
    double radius_mm;        // radius of the trunk
    uint64_t seed;
    int sacs;                // number of aneurysms on the sides of random branches
    int blocks;              // number of bone blocks beside random branches
    double gap_mm;           // distance of the blocks from the branches' walls
} RandomTreeOptions;

// Adds parts and blocks to an empty shape. Returns false with a fault if so many do not fit, or if out of memory.
bool random_tree_grow(Shape *shape, const RandomTreeOptions *options, const char *file, Faults *faults);
// Places a block beside a vessel, near x in direction d, at distance `gap_mm` from the nearest wall of the shape. Returns false if no position is found, or
// if out of memory.
bool shape_add_block(Shape *shape, Vec3 x, Vec3 d, Vec3 half, double gap_mm, Random *random);

#endif
