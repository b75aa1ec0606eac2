// The interface through which the solver queries a vessel: for tool points with their last node, the gap to the wall, the wall's normal and the Hessian of the
// gap. Implemented by the fitted tree (LIM or shared blobs), the swept model, mesh, grid, exact
// tube and plane.
//
// gap: signed distance from the point to the wall [mm], > 0 inside the lumen (the caller subtracts the tool's radius).
// normal: unit, gradient of the gap, pointing into the lumen. hessian: second derivative of the gap AT THE POINT [1/mm]: with S the
// surface's Hessian of distance at the foot, S (I + gap S)^-1; 0 along the normal.
// A vessel is immutable after creation; queries allocate nothing and may run in several threads, each with its own memory array.
#ifndef SELDINGER_GEOM_VESSEL_H
#define SELDINGER_GEOM_VESSEL_H

#include "base/base.h"
#include "geom/linear.h"
#include "geom/vessel_tree.h"

enum { VESSEL_BLOBS = 24, VESSEL_SEEN = 6 };
// Where on a swept model a foot lies.
typedef struct VesselSweepMemory {
    int32_t segment;         // of the branch; -1: on a sac
    int32_t sac;             // on a sac: the node of the sacs' tree
    double t[VESSEL_SEEN];   // on the branches that the segment, or the sac's node, sees [mm]
    double own_t;            // on the own branch
    double rival_t;          // of the rival: segment, sac and t as above
    int32_t rival_segment, rival_sac;
    int32_t is_known;        // 0: t are not set
    int32_t open;            // 1: points of the rings are nearer than the foot, but are no wall
    double apart;            // [mm] way of the foot within which only its own branch matters; 0: unknown
} VesselSweepMemory;

// What is stored for a tool point between steps. The closest point on the wall is called the foot.
typedef struct VesselMemory {
    Vec3 foot;               // last foot, where Newton starts
    Vec3 place, normal;      // the point that the foot belongs to, the normal there …
    Sym3 hessian;            // … and the Hessian of the gap: from them the foot's motion is predicted
    // For the field of shared blobs; field_lanes.h loads the numbers from `foot` to `bound_for` as one row of 32.
    double down;             // bound of the field's downward second derivative within `bound_for` mm of `bound_at` [1/mm^2] …
    Vec3 miss, step;         // by how much the last prediction missed the foot, and the motion for which it was made
    double trust;            // [mm] from `bound_at`, within which no wall except the rival's can be closer
    double up;               // … and of its upward one
    Vec3 held_at;            // the blobs below are all that reach to within …
    double held_for2;        // … the square root of this [mm^2] of this point, in the field as `node` sees it
    Vec3 bound_at;
    double bound_for;
    Vec3 rival;              // another foot, nearly as close
    bool has_rival;
    bool contradicted;       // another node currently puts the wall nearer than it can be …
    double credible;         // … and the gap is this [mm]
    double clearance;        // [mm] lower bound of the distance from `clear_place` to the wall of `node`; 0: unknown. Far points are skipped by it
    Vec3 clear_place;
    int node;                // node of the tree or segment of the tube; -1: not yet located
    int trusted;             // number of queries for which the foot need not be compared with other walls
    bool has_foot;
    int blobs;               // number held; -1: more than VESSEL_BLOBS
    union {
        int32_t blob[VESSEL_BLOBS];  // rows of the field; beyond `blobs`, the row of the blob of amplitude 0
        VesselSweepMemory sweep;     // of a swept vessel
    };
} VesselMemory;              // initial value: {.node = -1}

enum {
    VESSEL_FAR = 1,          // certainly further from the wall than `reach`: gap is a lower bound, normal and hessian are unset (0)
    VESSEL_OPEN_END = 2,     // beyond an open end and clear of it: there is no wall, gap = +HUGE_VAL, normal 0
    VESSEL_BEYOND = 8,       // beyond an open end's plane, where the wall is an extension of the end (a cylinder upstream, a bell downstream)
    VESSEL_UNSURE = 4,       // the projection did not converge: gap is Taubin's distance, normal the gradient's direction
    VESSEL_DISAGREE = 16,    // two nodes put the point's wall at different places, see field_vessel_create: a defect of the model
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
    const char *kind;        // "field", "lim", "sweep", "mesh", "grid", "tube", "plane"
    // Fills hit[i] for `count` points and updates memory[i]. reach [mm]: a gap beyond it may be returned as VESSEL_FAR.
    void (*query)(const Vessel *vessel, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit);
    // First location of a point: the best node overall if `from` is -1, else the best node reached by walking from node `from` (Kerrien et al. 2017, 6.2.1: the
    // proximal point globally, each further one from its predecessor).
    int (*locate)(const Vessel *vessel, Vec3 point, int from);
    // Sets a point on the root's open end and the unit direction into the vessel. Returns false if there is none (plane).
    bool (*inlet)(const Vessel *vessel, Vec3 *point, Vec3 *direction);
    void (*destroy)(Vessel *vessel);
    int64_t primitives;      // blobs, triangles, lattice points, segments
    size_t bytes;            // memory that queries read, whoever owns it; both figures are for tables
};

// Returns whether a hit fulfils the definitions above: the gap is a number, the normal is a unit vector where there is a wall.
bool vessel_hit_is_sound(const VesselHit *hit);

static inline void vessel_query(const Vessel *v, int count, const Vec3 *point, double reach, VesselMemory *memory, VesselHit *hit)
{
    SEL_ASSERT(count >= 0 && !isnan(reach), "the number of points is not negative and the reach is a number");
    v->query(v, count, point, reach, memory, hit);
    for (int i = 0; SELDINGER_ASSERTS && i < count; i++)
        SEL_ASSERT(vessel_hit_is_sound(&hit[i]), "a gap is a number and a wall's normal a unit vector");
}

// --- LIM: the fitted tree. Borrows the tree, which must outlive the vessel. Returns NULL if the tree has no model. ---
// The root's end is open: its section continues upstream of its plane (center, direction) as a cylinder, with a smooth transition from half a radius downstream
// on. There is no wall upstream if the root's model does not hold the root's centre. A root is no open end if the tree continues upstream of it or if its
// points close over it. Leaves are closed by their blobs.
Vessel *lim_vessel_create(const VesselTree *tree);

typedef enum {
    LIM_SWITCH,              // as in the paper: the local model of the point's node alone; the wall jumps where the node changes
    LIM_BLEND,               // the default: gaps, normals and Hessians of the node's and its neighbours' models are blended towards the borders of the power
                             // cells, where they differ by less than min(r / 2, 0.8 mm); stays within 0.15 mm of the own model. The normal is the mean of the
                             // normals: without the gradient of the weights, so that a sliding wire does not catch on the differences between the models
} LimField;
typedef struct LimVesselOptions {
    LimField field;
    int hops;                // moves to a better neighbour that a point may make in one query, >= 1 (in the paper: 1)
    int isa;                 // 0: the widest that simd_level() allows, 1 SSE2, 2 AVX2, 3 AVX-512; if absent, the widest available. All give the same bits
} LimVesselOptions;
LimVesselOptions lim_vessel_default_options(void);
Vessel *lim_vessel_create_with(const VesselTree *tree, const LimVesselOptions *options);

// --- The wall of shared blobs (vessel_tree_is_shared): one field, so that the wall is the same from both sides of every border between near cells. Borrows the
// tree. Returns NULL if the tree has no such model or if out of memory. ---
// A gap changes by no more than the point's motion. Where it changes by 0.1 mm more (no tool is thinner) because another node's field is used, the two nodes
// contradict each other: VESSEL_DISAGREE. So that a wall which is suddenly nearer than it can be does not throw the tool, the gap approaches the new value as
// the point moves, by 0.2 mm per mm.
Vessel *field_vessel_create(const VesselTree *tree);
// isa: as LimVesselOptions.isa.
Vessel *field_vessel_create_with(const VesselTree *tree, int isa);
// Creates whichever of the two fits the tree's model. Returns NULL if the tree has none.
Vessel *model_vessel_create(const VesselTree *tree);

// --- Exact tube: the union of spheres of one radius along lines and arcs, or along a polyline. ---
typedef struct TubePiece {   // a line (angle 0) or an arc
    double length;           // line [mm] > 0
    double arc_radius;       // arc [mm] > 0
    double angle;            // arc [rad] > 0; 0 marks a line
    double plane;            // arc: the turning plane is first rotated by this about the tangent [rad]
} TubePiece;
typedef struct TubeOptions {
    Vec3 start, direction, normal;   // arcs turn towards normal (made perpendicular to direction; the frame is transported without twist)
    double radius;           // lumen [mm] > 0
    int piece_count;
    const TubePiece *piece;  // either pieces …
    int point_count;
    const Vec3 *point;       // … or a polyline of >= 2 points
    bool closed_ends;        // hemispheres instead of open ends (if false, BOTH ends are open: the first cross-section continues upstream as a cylinder, the
                             // last end flares like a bell of the lumen's radius, see tube_vessel.c)
} TubeOptions;
// Returns NULL with a fault if a radius or a length is not positive, or if an arc's radius is not larger than the lumen's.
Vessel *tube_vessel_create(const TubeOptions *options, const char *file, Faults *faults);

// --- Half space: gap = (x - point) . normal. ---
Vessel *plane_vessel_create(Vec3 point, Vec3 normal);

#endif
