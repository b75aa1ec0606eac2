// What the solver asks of a vessel: for tool points with their last node, the gap to the wall, the wall's normal and the
// Hessian of the gap. One small interface; LIM, exact tube, plane (and later mesh) answer it.
//
// gap: signed distance from the point to the wall [mm], > 0 inside the lumen (the tool's radius is the caller's business).
// normal: unit, gradient of the gap, pointing into the lumen. hessian: second derivative of the gap AT THE POINT [1/mm]: with S the
// surface's Hessian of distance at the foot, S (I + gap S)^-1; 0 along the normal.
// A vessel is immutable after creation; queries allocate nothing and may run in several threads, each with its own memory array.
#ifndef SELDINGER_GEOM_VESSEL_H
#define SELDINGER_GEOM_VESSEL_H

#include "base/base.h"
#include "geom/linear.h"
#include "geom/vessel_tree.h"

enum { VESSEL_BLOBS = 24 };
// What a tool point remembers between steps.
typedef struct VesselMemory {
    Vec3 foot;               // last projection, where Newton starts
    Vec3 place, normal;      // where the foot was found from, the answer there …
    Sym3 hessian;            // … and its curvature: they say where the foot has moved to
    // Of the field of shared blobs; field_lanes.h loads the numbers from `foot` to `bound_for` as one row of 32.
    double down;             // within `bound_for` mm of `bound_at` f bends down by no more than this, and up …
    Vec3 miss, step;         // by how much the last prediction missed the foot, and the motion that it was made for
    double trust;            // [mm] from `bound_at` within which no walls but the rival's need be looked for
    double up;               // … by no more than this [1/mm^2]
    Vec3 held_at;            // the blobs below are all that reach to within …
    double held_for2;        // … the root of this [mm^2] of here, as `node` sees the field
    Vec3 bound_at;
    double bound_for;
    Vec3 rival;              // another foot, nearly as close
    bool has_rival;
    bool contradicted;       // by another node, which puts the wall nearer than it can be: for now
    double credible;         // … the gap is this [mm]
    double clearance;        // [mm] at `clear_place` the wall of `node` was at least this far; 0: not known. Lets far points pass unevaluated
    Vec3 clear_place;
    int node;                // node of the tree, or segment of the tube; -1: not yet located
    int trusted;             // queries for which the foot need not be compared with other walls
    bool has_foot;
    int blobs;               // held; -1: more than there is room for
    int32_t blob[VESSEL_BLOBS];      // rows of the field, those beyond `blobs` that of the blob without weight
} VesselMemory;              // a fresh one: {.node = -1}

enum {
    VESSEL_FAR = 1,          // certainly further from the wall than `reach`: gap is a lower bound, normal and hessian are unset (0)
    VESSEL_OPEN_END = 2,     // beyond an open end and clear of it: there is no wall, gap = +HUGE_VAL, normal 0
    VESSEL_BEYOND = 8,       // beyond an open end's plane, where the wall is what carries on from the end (a cylinder upstream, a bell downstream)
    VESSEL_UNSURE = 4,       // the projection did not converge: gap is Taubin's distance, normal the gradient's direction
    VESSEL_DISAGREE = 16,    // two nodes put the point's wall at different places, see field_vessel_create: a fault of the model
};

typedef struct VesselHit {
    double gap;
    Vec3 normal;
    Sym3 hessian;
    int node;
    unsigned flags;
} VesselHit;

typedef struct Vessel Vessel;
struct Vessel {
    const char *kind;        // "field", "lim", "tube", "plane"
    // Answers for `count` points. memory[i] is updated. reach [mm]: gaps beyond it may be answered by VESSEL_FAR.
    void (*query)(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit);
    // First location of a point: the best node overall where `from` is -1, else the best reached by walking from node `from`
    // (Kerrien 2017, 6.2.1: the proximal point globally, each further one from its predecessor).
    int (*locate)(const Vessel *vessel, Vec3 point, int from);
    // Inlet: a point on the root's open end and the unit direction into the vessel. False where it has none (plane).
    bool (*inlet)(const Vessel *vessel, Vec3 *point, Vec3 *direction);
    void (*destroy)(Vessel *vessel);
    int64_t primitives;      // blobs, triangles, lattice points, segments
    size_t bytes;            // that queries read, of whatever owner; both for tables
};

// Does a hit keep what is promised above: a gap that is a number, a unit normal where there is a wall?
bool vessel_hit_is_sound(const VesselHit *hit);

static inline void vessel_query(const Vessel *v, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    SEL_ASSERT(count >= 0 && !isnan(reach), "a vessel is asked about a number of points, as far as a reach");
    v->query(v, count, point, reach, memory, hit);
    for (int i = 0; SELDINGER_ASSERTS && i < count; i++)
        SEL_ASSERT(vessel_hit_is_sound(&hit[i]), "a gap is a number and a wall's normal a unit vector");
}

// --- LIM: the fitted tree. Borrows the tree, which must outlive the vessel. NULL where the tree has no model. ---
// The root's end is open: its section goes on upstream of its plane (center, direction) as a cylinder, smoothly, from half a radius downstream on. Where
// the root's model does not hold the root's centre there is no wall upstream. A root from which the tree goes on upstream, or that its points close over,
// is no such end. Leaves are closed by their blobs.
Vessel *lim_vessel_create(const VesselTree *tree);

typedef enum {
    LIM_SWITCH,              // the paper's: the local model of the point's node alone; the wall jumps where the node changes
    LIM_BLEND,               // the default: gaps, normals and Hessians of the node's and its neighbours' models mixed towards the borders of the power
                             // cells, where they differ by less than min(r / 2, 0.8 mm); stays within 0.15 mm of the own model. The normal is the mean of
                             // normals: it leaves out the weights' slope, so that a wire sliding along does not catch on what the models differ by
} LimField;
typedef struct LimVesselOptions {
    LimField field;
    int hops;                // moves to a better neighbour a point may make in one query, >= 1 (the paper's: 1)
    int isa;                 // 0: what simd_level() says; 1 SSE2, 2 AVX2, 3 AVX-512 (the widest there is, where absent). All give the same bits
} LimVesselOptions;
LimVesselOptions lim_vessel_default_options(void);
Vessel *lim_vessel_create_with(const VesselTree *tree, const LimVesselOptions *options);

// --- The wall of shared blobs (vessel_tree_is_shared): one field, so that it is the same from both sides of every border between near cells. Borrows the
// tree. NULL where the tree has no such model, or there is no memory. ---
// A gap changes by no more than the point moves. Where it does by 0.1 mm more (no tool is thinner), because another node answers, the two contradict each
// other: VESSEL_DISAGREE. A wall that is suddenly nearer than it can be throws no tool: the gap goes over to it as the point moves on, by 0.2 mm a mm.
Vessel *field_vessel_create(const VesselTree *tree);
// isa: 0: what simd_level() says; 1 SSE2, 2 AVX2, 3 AVX-512 (the widest there is, where absent). All give the same bits.
Vessel *field_vessel_create_with(const VesselTree *tree, int isa);
// Whichever of the two answers for the tree's model; NULL where it has none.
Vessel *model_vessel_create(const VesselTree *tree);

// --- Exact tube: the union of spheres of one radius along lines and arcs, or along a polyline. ---
typedef struct TubePiece {   // a line (angle 0) or an arc
    double length;           // line [mm] > 0
    double arc_radius;       // arc [mm] > 0
    double angle;            // arc [rad] > 0; 0 marks a line
    double plane;            // arc: the turning plane is first rotated by this about the tangent [rad]
} TubePiece;
typedef struct TubeOptions {
    Vec3 start, direction, normal;   // arcs turn towards normal (made perpendicular to direction; the frame is carried along without twist)
    double radius;           // lumen [mm] > 0
    int piece_count;
    const TubePiece *piece;  // either pieces …
    int point_count;
    const Vec3 *point;       // … or a polyline of >= 2 points
    bool closed_ends;        // hemispheres instead of open ends (open at BOTH ends when false: the first cross-section goes on upstream as a cylinder,
                             // the last end flares like a bell of the lumen's radius, see tube_vessel.c)
} TubeOptions;
// NULL with a fault where a radius or a length is not positive, or an arc's radius is not larger than the lumen's.
Vessel *tube_vessel_create(const TubeOptions *options, const char *file, Faults *faults);

// --- Half space: gap = (x - point) . normal. ---
Vessel *plane_vessel_create(Vec3 point, Vec3 normal);

#endif
