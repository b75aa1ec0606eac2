// The field of shared blobs at points, in lanes: eight points are a block, and slot k of a block holds each point's k-th blob. A lane sums its own blobs
// in the order of its list, so that nothing is added across lanes and every instruction set gives the same bits; blobs that do not reach a point add
// exactly nothing, so that neither it matters which of those its list holds.
//
// The arithmetic between the samples is that of foot_lanes.h, on the first block of a FootBatch. Points' memories and answers are rows of doubles; they
// are turned into lanes and back in registers.
#ifndef SELDINGER_GEOM_FIELD_LANES_H
#define SELDINGER_GEOM_FIELD_LANES_H

#include "geom/foot_lanes.h"
#include "geom/vessel.h"

// A blob: adds a u^3 to f, u = max(0, 1 - inverse |X - C|^2).
typedef struct FieldRow {
    double cx, cy, cz;               // [mm]
    double inverse;                  // 1 / R^2 [1/mm^2]
    double amplitude;                // a
    double reach;                    // R [mm]
    double unused[2];
} __attribute__((aligned(64))) FieldRow;

// Places in a row of a VesselMemory.
enum {
    MEMORY_FOOT = 0,
    MEMORY_PLACE = 3,
    MEMORY_NORMAL = 6,
    MEMORY_HESSIAN = 9,
    MEMORY_DOWN = 15,
    MEMORY_MISS = 16,
    MEMORY_STEP = 19,
    MEMORY_TRUST = 22,
    MEMORY_UP = 23,
    MEMORY_WRITTEN = 24,
    MEMORY_HELD_AT = 24,
    MEMORY_HELD_FOR2 = 27,
    MEMORY_BOUND_AT = 28,
    MEMORY_BOUND_FOR = 31,
    MEMORY_ROW = 32
};
enum { HIT_ROW = 10 };               // gap, normal, Hessian

// Points in the unit ball: on two spheres about its middle, and on rings of the ball itself about the z axis.
#define CLEAR_OUTER 0.95
#define CLEAR_INNER 0.8
enum { CLEAR_ON_OUTER = 128, CLEAR_ON_INNER = 64, CLEAR_POINTS = CLEAR_ON_OUTER + CLEAR_ON_INNER, CLEAR_ON_RINGS = 96 };
typedef struct ClearPoints {
    int count;                       // a multiple of 96
    float x[CLEAR_POINTS], y[CLEAR_POINTS], z[CLEAR_POINTS], square[CLEAR_POINTS];     // square: of the distance from the middle
} ClearPoints;

typedef double FieldLane[FOOT_BLOCK];

typedef struct FieldBlock {
    FootBatch foot;                  // its first FOOT_BLOCK lanes
    const FieldRow *row;             // of all blobs, the last of which has no weight
    // each lane's …
    const double *point[FOOT_BLOCK];         // X
    const double *memory[FOOT_BLOCK];        // row of its memory, from which it is loaded …
    double *keep[FOOT_BLOCK];                // … and to which it is stored
    double *hit[FOOT_BLOCK];                 // row of its answer
    const int32_t *list[FOOT_BLOCK];         // blobs …
    int count[FOOT_BLOCK];                   // … and their number
    int slots;                               // lists are as long, filled up with the blob without weight; 0: only as their counts say
    FieldLane dx, dy, dz;            // the motion of X since the foot was found
    FieldLane straight_x, straight_y, straight_z;    // where the foot should be but for the last prediction's miss
    FieldLane held_x, held_y, held_z, held_for2, bound_x, bound_y, bound_z, bound_for, down, up, trusted;
    FieldLane trust;                 // what is left of it
} FieldBlock;

typedef struct FieldKernels {
    // Turns memories into lanes and predicts the feet. Returns a bit for each lane whose blobs are not all those that reach the start.
    unsigned (*load)(FieldBlock *b);
    // f, gradient and Hessian at the running feet.
    void (*sample)(FieldBlock *b);
    // One step from the samples; returns the bits of lanes that are FOOT_DONE.
    unsigned (*newton)(FieldBlock *b, bool careful);
    // Gap and Hessian at X; returns the bits of lanes whose foot is certainly the closest, see field_vessel.c.
    unsigned (*finish)(FieldBlock *b);
    // Turns lanes into memories and answers.
    void (*store)(FieldBlock *b);
    // Of the blobs of a list: a bit for each that reaches to within `skin` of q.
    void (*pick)(const FieldRow *row, const int32_t *list, int count, Vec3 q, double skin, uint8_t *bits);
    // No more than what the field of a list bends down and up by, anywhere within `ball` of q.
    void (*bends)(const FieldRow *row, const int32_t *list, int count, Vec3 q, double ball, double *down, double *up);
    // Is f of a list on one side (f * side > 0) at all points of a ball about `middle`? In single precision.
    bool (*is_clear)(const ClearPoints *point, const FieldRow *row, const int32_t *list, int count, Vec3 middle, double ball, double side);
    // f of a list at eight points.
    void (*look)(const FieldRow *row, const int32_t *list, int count, const double *x, const double *y, const double *z, double *f);
} FieldKernels;
// `count` directions all around: a spiral from pole to pole.
void field_directions(Vec3 *way, int count);
void field_clear_points(ClearPoints *points);
void field_clear_rings(ClearPoints *points);
// The same points turned so that the z axis becomes `axis` (unit).
void field_turn_points(const ClearPoints *points, Vec3 axis, ClearPoints *turned);
// isa as for lane_kernels.
const FieldKernels *field_kernels(int isa);

#endif
