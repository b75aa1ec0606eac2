// The swept model at points, in lanes: a block is eight points, each with a segment of its own (sweep_field.h). A lane does the same operations in the same
// order whatever the other lanes hold, so neither the block nor the instruction set changes a bit. The arithmetic between two evaluations is that of
// foot_lanes.h, on the first block of a FootBatch.
//
// A part is one of the branches that a lane sees, at the same index of its view for all lanes; a lane that has no such branch is `absent` there.
#ifndef SELDINGER_GEOM_SWEEP_LANES_H
#define SELDINGER_GEOM_SWEEP_LANES_H

#include "geom/foot_lanes.h"
#include "geom/sweep_field.h"

typedef double SweepLane[FOOT_BLOCK];

enum { SWEEP_RING = 16 };                // points of a ring: a section's contour at equal angles

typedef struct SweepPartLanes {
    const SweepSegment *segment[FOOT_BLOCK];     // the one that holds t
    SweepLane t, longest;                // longest: bound of a step of t [mm]
    SweepLane settled;                   // 1: t is the foot on the curve
    SweepLane far2, last;                // the search for t: the square of the least distance so far, first HUGE_VAL [mm^2], and the step from there [mm]
    SweepLane away;                      // distance of the point from the curve [mm]
    SweepLane absent;                    // 1: f is -1e300 and the derivatives are 0
    SweepLane delta, reach_inverse;      // the blend with the parts before, see SweepFork; reach_inverse 0: delta everywhere
    // results
    SweepLane f, gx, gy, gz, hxx, hxy, hxz, hyy, hyz, hzz;
    SweepLane tx, ty, tz, vx, vy, vz;    // grad t = (tx, ty, tz); Hess t = grad t v' + v grad t'
    SweepLane width;                     // delta at the point
} SweepPartLanes;

// What the ring of a lane's own branch needs, kept by `evaluate`.
typedef struct SweepRingLanes {
    SweepLane term[SWEEP_TERMS];         // the section's coefficients at t
    SweepLane n, b;                      // coordinates of the point
    SweepLane nx, ny, nz, bx, by, bz, sx, sy, sz;    // N, B and S'/|S'|
    SweepLane near2, at_n, at_b;         // result: the square of X's distance to the nearest point of the ring, and that point's coordinates
} SweepRingLanes;

// Rings around a branch at several t, each a lane: points of its wall at equal angles, the first at N.
enum { SWEEP_RINGS = FOOT_BLOCK };
typedef double SweepRingRows[SWEEP_RING][SWEEP_RINGS];
typedef struct SweepRings {
    const SweepSegment *segment[SWEEP_RINGS];    // of each ring, with its t
    double t[SWEEP_RINGS];
    double radius[SWEEP_RINGS];          // results: c_0, …
    SweepRingRows x, y, z, far2;         // … points, and the squares of their distances from a point, …
    unsigned near[SWEEP_RING];           // … bits of the points that are nearer than a limit, …
    unsigned least[SWEEP_RING];          // … and of those among them that are not farther than any of their neighbours
} SweepRings;

// A branch near a place: curve, frame and section to second order in the length w along its tangent there.
typedef struct SweepNear {
    Vec3 s, tangent, bend;               // S; unit; S''/|S'|^2
    Vec3 n, b, n1, b1;                   // the frame, and its derivatives by w
    double from, to;                     // w of closed ends, where domes begin
    double term[SWEEP_TERMS], term1[SWEEP_TERMS];    // the section's coefficients, and their derivatives by w
} SweepNear;

typedef struct SweepKernels {
    // Up to three steps of t for the lanes that are not settled, on their segments: Newton's, halved where the last one led away from the point. Returns the
    // bits of lanes that are not settled; those whose t lies outside its segment (`outside`) need another one.
    unsigned (*seek)(SweepPartLanes *part, const double *x, const double *y, const double *z, unsigned *outside);
    // f, gradient and Hessian at the points. Terms beyond `harmonics` are 0 on all segments. `ring` may be NULL; only lanes with own[i] = 1 are
    // stored to it.
    void (*evaluate)(SweepPartLanes *part, const double *x, const double *y, const double *z, int harmonics, SweepRingLanes *ring, const double *own);
    // The same without the Hessian and without a ring.
    void (*evaluate_slope)(SweepPartLanes *part, const double *x, const double *y, const double *z, int harmonics);
    // Blends a part into the sum; `share`: the part's share, for each lane.
    void (*blend)(FootSample *sum, SweepPartLanes *part, double *share);
    // The same without the Hessian.
    void (*blend_slope)(FootSample *sum, SweepPartLanes *part, double *share);
    // Compact blobs and their gradient at the same eight points.
    void (*blobs_slope)(const Blobby *blobs, const double *x, const double *y, const double *z, double *f, double *gx, double *gy, double *gz);
    // Width of the blend at t.
    void (*width)(SweepPartLanes *part);
    // The nearest point of the ring at the foot's t to X.
    void (*ring)(SweepRingLanes *ring, const FootBatch *foot, const double *foot_x, const double *foot_y, const double *foot_z, int harmonics);
    // Points of the rings, on domes at the height of their t; those nearer to x than the root of limit2.
    void (*rings)(SweepRings *rings, int harmonics, Vec3 x, double limit2);
    // Finds the points that are not farther from x than any of their neighbours, nearer than the root of limit2, and farther from `from` than that of own2.
    // Returns the least far2 of the points that are farther from `from` than the root of zone2; at most limit2.
    double (*minima)(SweepRings *rings, Vec3 from, double own2, double zone2, double limit2);
    // f of a branch at `count` points (a multiple of FOOT_BLOCK), approximately.
    void (*near_field)(const SweepNear *near, int harmonics, int count, const double *x, const double *y, const double *z, double *f);
    void (*predict)(FootBatch *foot, double allowed);
    unsigned (*newton)(FootBatch *foot, bool careful);
    void (*finish)(FootBatch *foot);
} SweepKernels;
// Cosine and sine of the angles of a ring.
extern const double sweep_ring_cos[SWEEP_RING], sweep_ring_sin[SWEEP_RING];
// isa: as for lane_kernels.
const SweepKernels *sweep_kernels(int isa);

#endif
