// Rings and patches, of which sweep_mesh.c assembles the mesh. Internal to the mesh of the swept model.
#ifndef SELDINGER_GEOM_SWEEP_MESH_PARTS_H
#define SELDINGER_GEOM_SWEEP_MESH_PARTS_H

#include "geom/sweep_feet.h"
#include "geom/sweep_mesh_options.h"

typedef enum {
    RING_SECTION,            // at t on the branch
    RING_DOME,               // beyond an end
    RING_POLE,               // one vertex: the top of a dome
    RING_MIDDLE,             // one vertex: the middle of a flat cap
} RingKind;

typedef struct MeshRing {
    RingKind kind;
    double t;                // [mm]; of domes and caps: of the end
    double polar;            // of a dome's ring: angle over the end's plane [rad]
    int count, first;        // vertices, in the arrays of MeshRings
    bool is_blended;         // not all vertices are on the branch's own wall
} MeshRing;

// The rings of a branch in the order of t. A gap is the strip between two neighbouring rings; gap j follows ring j.
typedef struct MeshRings {
    int count, capacity;
    MeshRing *ring;
    int vertices, vertex_capacity;
    Vec3 *at, *normal;
    int first_section, last_section;     // rings at t = 0 and t = length
    bool *in_patch;          // (gaps = count - 1)
    int marks, mark_capacity;
    struct MeshMark *mark;   // what the vertices of this branch blend with
} MeshRings;

// A place on another branch, or a sac, that blends with a vertex of `ring`.
typedef struct MeshMark {
    int ring;
    int branch;              // -1: a sac
    int sac;                 // first node of the sac's group
    double from, to;         // t on the branch
} MeshMark;

// Cells that a patch's wall is followed beyond the patch, see sweep_march.h.
enum { MESH_BEYOND = 6 };

// Gaps from … to of a branch that belong to a patch. Its cuts are the rings `from` and `to + 1`, unless these are poles or middles.
typedef struct MeshRun {
    int branch, from, to;
    double t_from, t_to;     // of the cuts; infinite where there is none
    int cut_from, cut_to;    // indices of the cuts in the patch; -1
} MeshRun;

// The cut edge of a patch at a ring.
typedef struct MeshCut {
    int branch, ring;
    int count;
    bool is_failed;          // has no loop of vertices, or a loop that belongs to others too
    int *vertex;             // (count) of the patch, by increasing angle
    double *angle;           // (count) [rad], increasing by 2 pi in one turn
} MeshCut;

typedef struct MeshPatch {
    int run_count, sac_count, cut_count;
    MeshRun *run;
    int *sac;                // first nodes of the groups
    MeshCut *cut;
    int vertices, triangles;
    Vec3 *at, *normal;
    int *branch, *sac_node;  // (vertices) sac_node: of vertices on sacs
    double *t;
    int (*triangle)[3];
    bool is_failed;          // could not be joined to its rings: empty
} MeshPatch;

typedef struct SweepMeshParts {
    SweepMeshOptions options;
    SweepFeet feet;
    int branch_count;
    MeshRings *rings;        // (branches)
    int patch_count, failures;
    MeshPatch *patch;
    int failed_count;        // tries that failed, also of patches that were then widened
    MeshPatch *failed;
    // what the mesh was made from
    int segment_count;
    int *first_segment;
    SweepSegment *segment;
    SweepView *view;
    SweepFork *fork;
    double *sacs;            // centres, widths and amplitudes of the blobs
    int sac_numbers;
} SweepMeshParts;

// [mm] edge length at t on a branch, and the number of vertices of the ring there.
double mesh_edge(const SweepMeshParts *parts, int branch, double t);
int mesh_around(const SweepMeshParts *parts, int branch, double t);

// The plane of a ring: points S + n p + b q have the coordinates n, b of sweep_model.h.
typedef struct MeshPlane {
    const SweepSegment *segment;
    int branch, segment_index;
    double t;
    Vec3 s, s1, s2, n, b, p, q;
    double term[SWEEP_TERMS];
} MeshPlane;
MeshPlane mesh_plane(const SweepFeet *feet, int branch, double t);
// The point of the section's contour at an angle given by its cosine and sine.
Vec3 mesh_plane_point(const MeshPlane *plane, double cosine, double sine);
// The point of F = 0 in the plane that is near to x.
Vec3 mesh_plane_blended(const SweepFeet *feet, const MeshPlane *plane, Vec3 x);
// Sets a lane's place, and reads the place on the part of largest share after a sample.
void mesh_set_place(const SweepFeet *feet, SweepBlock *b, int lane, const SweepPlace *place);
SweepPlace mesh_owner(const SweepBlock *b, int lane);
// Outward normals of F at points with places; `place` is moved to the part of largest share.
void mesh_normals(const SweepFeet *feet, int count, const Vec3 *at, SweepPlace *place, Vec3 *normal);

// Whether the sections of a segment may carry rings: each ray from the curve meets the contour once.
bool mesh_carries_rings(const SweepField *field, int segment);
// Fills the rings of a branch, `rings` being zeroed.
void mesh_rings_fill(const SweepMeshParts *parts, int branch, MeshRings *rings);
void mesh_rings_free(MeshRings *rings);

// Extracts the patch of the runs and sacs that it holds. Where a cut cannot be joined to its ring, it is marked as failed, and so is the patch, which stays empty;
// `last`: not before another lattice was tried.
void mesh_patch_fill(const SweepMeshParts *parts, MeshPatch *patch, bool last);
void mesh_patch_free(MeshPatch *patch);

#endif
