// The field of shared blobs at points, in lanes: a block is eight points, and slot k of a block holds the k-th blob of each point. A lane sums its own blobs in
// the order of its list; nothing is added across lanes, so every instruction set gives the same bits. Blobs that do not reach a point add exactly 0, so the
// result does not depend on which of them the list contains.
//
// The arithmetic between the samples is that of foot_lanes.h, on the first block of a FootBatch. The memories and the results of points are rows of doubles;
// they are transposed to lanes and back in registers.
#ifndef SELDINGER_GEOM_FIELD_LANES_H
#define SELDINGER_GEOM_FIELD_LANES_H

#include "geom/foot_lanes.h"
#include "geom/vessel.h"

// A blob adds a u^3 to f, u = max(0, 1 - inverse |X - C|^2).
typedef struct FieldRow {
    double cx, cy, cz;               // [mm]
    double inverse;                  // 1 / R^2 [1/mm^2]
    double amplitude;                // a
    double reach;                    // R [mm]
    double unused[2];
} __attribute__((aligned(64))) FieldRow;

// Offsets in a row of a VesselMemory.
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

// Points in the unit ball: on two spheres around its centre, and on rings of its surface around the z axis.
#define CLEAR_OUTER 0.95
#define CLEAR_INNER 0.8
enum { CLEAR_ON_OUTER = 128, CLEAR_ON_INNER = 64, CLEAR_POINTS = CLEAR_ON_OUTER + CLEAR_ON_INNER, CLEAR_ON_RINGS = 96 };
typedef struct ClearPoints {
    int count;                       // a multiple of 96
    float x[CLEAR_POINTS], y[CLEAR_POINTS], z[CLEAR_POINTS], square[CLEAR_POINTS];     // square: of the distance from the centre
} ClearPoints;

typedef double FieldLane[FOOT_BLOCK];

typedef struct FieldBlock {
    FootBatch foot;                  // its first FOOT_BLOCK lanes
    const FieldRow *row;             // all blobs; the last row is a blob of amplitude 0
    // for each lane:
    const double *point[FOOT_BLOCK];         // X
    const double *memory[FOOT_BLOCK];        // row of its memory from which it is loaded …
    double *keep[FOOT_BLOCK];                // … and to which it is stored
    double *hit[FOOT_BLOCK];                 // row of its result
    const int32_t *list[FOOT_BLOCK];         // its blobs …
    int count[FOOT_BLOCK];                   // … and their number
    int slots;                               // common length of all lists, padded with the blob of amplitude 0; 0: each list has its own count
    FieldLane dx, dy, dz;            // the motion of X since the foot was found
    FieldLane straight_x, straight_y, straight_z;    // where the foot would be without the correction by the last prediction's miss
    FieldLane held_x, held_y, held_z, held_for2, bound_x, bound_y, bound_z, bound_for, down, up, trusted;
    FieldLane trust;                 // remaining trust (see VesselMemory)
} FieldBlock;

typedef struct FieldKernels {
    // Transposes memories to lanes and predicts the feet. Returns a bit for each lane whose list may not hold all blobs that reach the start.
    unsigned (*load)(FieldBlock *b);
    // f, gradient and Hessian at the current feet.
    void (*sample)(FieldBlock *b);
    // One Newton step from the samples; returns the bits of lanes that are FOOT_DONE.
    unsigned (*newton)(FieldBlock *b, bool careful);
    // Gap and Hessian at X; returns the bits of lanes whose foot is certainly the closest, see field_vessel.c.
    unsigned (*finish)(FieldBlock *b);
    // Transposes lanes to memories and results.
    void (*store)(FieldBlock *b);
    // For each blob of a list, a bit that says whether it reaches to within `skin` of q.
    void (*pick)(const FieldRow *row, const int32_t *list, int count, Vec3 q, double skin, uint8_t *bits);
    // Upper bounds of the downward and upward second derivative of a list's field anywhere within `ball` of q.
    void (*bends)(const FieldRow *row, const int32_t *list, int count, Vec3 q, double ball, double *down, double *up);
    // Returns whether f of a list has one sign (f * side > 0) at all points of a ball around `middle`. In single precision.
    bool (*is_clear)(const ClearPoints *point, const FieldRow *row, const int32_t *list, int count, Vec3 middle, double ball, double side);
    // f of a list at eight points.
    void (*look)(const FieldRow *row, const int32_t *list, int count, const double *x, const double *y, const double *z, double *f);
} FieldKernels;
// `count` directions over the unit sphere: a spiral from pole to pole.
void field_directions(Vec3 *direction, int count);
void field_clear_points(ClearPoints *points);
void field_clear_rings(ClearPoints *points);
// The same points rotated so that the z axis becomes `axis` (unit).
void field_turn_points(const ClearPoints *points, Vec3 axis, ClearPoints *turned);
// isa: as for lane_kernels.
const FieldKernels *field_kernels(int isa);

#endif
