// Feet on the wall of a swept model: the blended field at a block of points, and the search for the closest point of F = 0. Internal to sweep_vessel.c.
#ifndef SELDINGER_GEOM_SWEEP_FEET_H
#define SELDINGER_GEOM_SWEEP_FEET_H

#include "geom/sweep_lanes.h"
#include "geom/vessel.h"

// Points of the sacs' walls, as if there were no branches: where rays from each node leave the blobs.
typedef struct SweepSacPoints {
    int count;               // a multiple of FOOT_BLOCK, the last ones repeated
    double *x, *y, *z;       // one allocation, owned by x
    int *node;               // of the sacs' tree
} SweepSacPoints;

typedef struct SweepFeet {
    const SweepField *field;
    const SweepKernels *kernels;
    int harmonics;           // highest harmonic that any row uses
    SweepSacPoints sacs;
    SweepView *alone;        // (branches) views of one branch only
} SweepFeet;

// Returns false if out of memory; sweep_sac_points_free must be called in either case.
bool sweep_sac_points_create(const SweepField *field, SweepSacPoints *points);
void sweep_sac_points_free(SweepSacPoints *points);

enum { SWEEP_PARTS = SWEEP_CANDIDATES };

// Eight points. A lane's place is a segment and the t of the branches that it sees; on a sac, a node of the sacs' tree.
typedef struct SweepBlock {
    FootBatch foot;          // its first FOOT_BLOCK lanes
    int segment[FOOT_BLOCK];             // -1: on a sac
    int sac[FOOT_BLOCK];                 // the sac's node that is seen, or on which the place is; -1: none
    const SweepView *view[FOOT_BLOCK];
    int own[FOOT_BLOCK];                 // index of the own branch in the view; -1: on a sac
    int owner[FOOT_BLOCK];               // after a sample: index of the part of largest share in the view; -1: the sac
    bool pure[FOOT_BLOCK];               // after a sample: the owner alone, nothing is blended
    bool keeps_t[FOOT_BLOCK];            // the parts' t are near the feet; else they start from the view
    bool alone[FOOT_BLOCK];              // the own branch is evaluated alone, whatever is seen
    SweepLane share[SWEEP_PARTS], sac_share;     // of the parts, after sweep_block_slope
    double apart[FOOT_BLOCK];            // after a sample of a pure lane: see VesselSweepMemory
    SweepLane own_t;                     // t on the own branch
    SweepLane is_flat;                   // 1: the ring holds (the own segment is no dome)
    SweepPartLanes part[SWEEP_PARTS];
    SweepRingLanes ring;
    int harmonics;                       // highest harmonic of the ring so far
    SweepLane ring_x, ring_y, ring_z;    // the foot that the ring belongs to
} SweepBlock;

// Prepares a new block: no lane is alone, and the ring is empty.
void sweep_block_begin(SweepBlock *b);
// Sets a lane's place; the parts' t are found from it.
// With b->alone[lane] set before, of the branch alone.
void sweep_block_place(const SweepFeet *feet, SweepBlock *b, int lane, int segment, int sac, double t);
enum { FOOT_ALL = (1 << FOOT_BLOCK) - 1 };
// F, gradient and Hessian at the feet of the lanes in `lanes` (bits). The first sample of a block is one of FOOT_ALL; lanes that are left out later keep their
// parts and owners.
void sweep_block_sample(const SweepFeet *feet, SweepBlock *b, unsigned lanes);
// The same without Hessians and rings, for those who need no feet; F and its gradient have the same bits. Sets the shares.
void sweep_block_slope(const SweepFeet *feet, SweepBlock *b, unsigned lanes);

typedef struct SweepFoot {
    Vec3 at, normal;
    Sym3 hessian;            // of the gap at X
    double gap;
    int segment, sac;        // the place; segment -1: on the sac
    double t;
    bool sure;
    bool pure;               // one branch alone: nothing is blended there
    bool doubtful;           // F as seen from the foot's place is not 0
} SweepFoot;

// The foot of a lane after `finish`.
SweepFoot sweep_block_foot(const SweepFeet *feet, const SweepBlock *b, int lane);
// Sets X of a lane that has a place, and its scale.
void sweep_block_set_point(const SweepFeet *feet, SweepBlock *b, int lane, Vec3 x);
// [mm] the scale of a place.
double sweep_place_radius(const SweepFeet *feet, int segment, int sac);

// A point from which Newton starts.
typedef struct SweepStart {
    Vec3 at;
    double far;              // [mm] from X
    double least;            // [mm] about the least distance of a foot near it
    int segment, sac;
    double t;
} SweepStart;

enum { SWEEP_FEET = 8 };
// Careful Newton steps of x from up to eight starts. Returns the number of feet found, closest first, doubtful ones last; feet closer together than 1e-4 mm are one.
int sweep_settle(const SweepFeet *feet, Vec3 x, const SweepStart *start, int count, SweepFoot *foot);
// What a search for starts leaves out, and what it reports.
typedef struct SweepSearch {
    bool alone;              // only the wall of the place's own branch, as if no other existed
    int most;                // starts, <= SWEEP_FEET
    double limit;            // [mm] starts further from x than this
    Vec3 from;               // the foot that is known; starts nearer to it than …
    double own;              // … this [mm]; 0: none is known
    double zone;             // [mm] the nearest point of a wall that lies farther from `from` than this …
    double *nearest_beyond;  // … reduces this distance
} SweepSearch;
// Starts for x on all walls that are seen from a place (`segment`: its segment), the nearest first.
int sweep_starts(const SweepFeet *feet, Vec3 x, SweepPlace place, int segment, const SweepSearch *search, SweepStart *start);
// Careful Newton steps of up to eight points, each from its own start; at most `rounds`. Returns the bits of those that reach a foot other than their
// `known` ones (NULL: none is known).
enum { SWEEP_ROUNDS = 24 };
unsigned sweep_follow(const SweepFeet *feet, const Vec3 *x, const SweepStart *start, const Vec3 *known, int count, int rounds, SweepFoot *foot);
// The place as seen from x: the branch or sac in which x lies deepest, from a place near it; F at x and its gradient.
SweepPlace sweep_descend(const SweepFeet *feet, Vec3 x, SweepPlace place, double *f, Vec3 *gradient);
// A foot on the line from the curve through x, by bisection. Always finds a wall point; `sure` is false.
SweepFoot sweep_bisect(const SweepFeet *feet, Vec3 x, SweepPlace place);

#endif
