// The surfaces of `bench collision` and their representations: the exact wall, blobs (one field, local models), meshes, a sampled distance.
#ifndef SELDINGER_BENCH_COLLISION_SURFACE_H
#define SELDINGER_BENCH_COLLISION_SURFACE_H

#include "cli/cli.h"
#include "recon/phantom/phantom.h"

enum { SURFACE_MESHES = 3, WALLS_MOST = 6 + 5 * SURFACE_MESHES };

typedef struct PaperRow {    // Kerrien 2017, Table 6
    double ms;               // 0: the table has no such row
    int contacts;
} PaperRow;

typedef struct CollisionCase {
    const char *name, *scene;        // the scene gives wire, hand, friction and, where `capsule` is not set, the vessel
    bool convolution_capsule;        // the vessel is the paper's capsule
    int mesh_count, triangles[SURFACE_MESHES];   // about so many
    int pointwise_steps;     // of the runs with the slow pointwise contact solve
    const char *paper_name;          // of the paper's rows for comparison; NULL: none
    PaperRow paper_mesh[SURFACE_MESHES], paper_lim;
} CollisionCase;

typedef struct CollisionSurface {
    const CollisionCase *of;
    Scene *scene;
    const Vessel *truth;             // the true wall
    const Vessel *truth_gap;         // the same without curvature, which is faster
    const char *truth_is;            // in words
    bool truth_is_model;             // the model itself: there is no other truth
    VesselTree *nodes;               // centres, radii and samples: what was fitted, and where to search for the wall
    VesselTree *model;               // the default: one field of shared blobs, or what a file holds
    VesselTree *local;               // a model for each node of the same points; NULL if the model came from a file
    VesselTree *fine;                // the default, fitted to a tenth of the usual distance; NULL if the model came from a file
    double fit_s, local_s, fine_s;   // CPU time of the fits; NAN if the model came from a file
    double length_mm;                // of the centreline
    // owned
    Vessel *exact, *lim, *gap_only;
    VesselTree *exact_tree;
    Shape *shape;
} CollisionSurface;

// Loads the scene, makes the truth, fits the model. False with faults; close it in any case.
bool collision_surface_open(const CollisionCase *of, int threads, CollisionSurface *out, Faults *faults);
void collision_surface_close(CollisionSurface *surface);

// One representation of the wall.
typedef struct CollisionWall {
    const char *name;        // "exact", "lim", "lim-blend", "lim-switch", "lim fine", "mesh full", "mesh warm", "mesh cached", "mesh curved", "mesh smooth", "grid"
    const Vessel *vessel;
    int triangles;           // of a mesh; 0
    int mesh;                // which of the case's meshes; -1
    double cell_mm;          // of the mesh or the grid; 0
    double surface_s, build_s;       // CPU time of what the vessel is made of (fit, marching cubes), and of the vessel itself
} CollisionWall;

typedef struct CollisionWalls {
    int count;
    CollisionWall wall[WALLS_MOST];
    const char *without_mesh;        // why there are no meshes; NULL if there are
    Vessel *owned[WALLS_MOST];
    int owned_count;
} CollisionWalls;

// False with faults. Close it before the surface, in any case.
bool collision_walls_open(const CollisionSurface *surface, CollisionWalls *out, Faults *faults);
void collision_walls_close(CollisionWalls *walls);
const CollisionWall *collision_wall_find(const CollisionWalls *walls, const char *name, int mesh);   // NULL: not there

// A mesh of the true wall with about `triangles` triangles: a coarse one tells the cell. A shape's is that of its model, every vertex moved onto the
// shape (evaluating the shape itself on a lattice takes ten times as long). NULL with a fault.
typedef struct CollisionMesh {
    double cell_mm, made_s;  // CPU time, of the mesh alone
} CollisionMesh;
TriangleMesh *collision_mesh(const CollisionSurface *surface, double triangles, CollisionMesh *out, Faults *faults);
Vessel *collision_lim(const VesselTree *model, LimField field);   // NULL if out of memory
double collision_build_clock_s(void);    // CPU time of all threads

#endif
