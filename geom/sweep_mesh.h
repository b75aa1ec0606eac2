// Triangle mesh of a swept model's wall, F = 0 (sweep_model.h): rings along the branches, and patches where branches or sacs blend. Kretschmer et al. 2013
// polygonise the whole field; here the lattice is used only where it is needed.
//
// A ring is the section at one t, with vertices at equal angles. Beyond a closed end rings follow the dome up to its pole. Where F is not the branch's own
// field, or the section cannot carry rings (mesh_carries_rings), the wall is a patch: marching cubes, the vertices moved onto F = 0, cut off at the planes of
// the nearest rings, t = constant. The cut edge replaces the ring there, so that the mesh is closed. Open starts are closed by a flat cap.
//
// The mesh is closed, and faces outwards. Lengths mm. Owns its memory; depends on the field only while it is created or updated.
#ifndef SELDINGER_GEOM_SWEEP_MESH_H
#define SELDINGER_GEOM_SWEEP_MESH_H

#include "geom/isosurface.h"
#include "geom/sweep_field.h"
#include "geom/sweep_mesh_options.h"

typedef struct SweepCap {    // a flat end
    int branch, end;         // end 0: the branch's start
    SweepTag flow;           // what crosses it (sweep_model_tag)
} SweepCap;

typedef struct SweepMesh {
    TriangleMesh *surface;   // `node` is the nearest knot's knot_node (or sac_node)
    int *branch;             // (V) branch of the vertex; -1: on a sac
    double *along;           // (V) [mm] t on the branch; on a sac 0
    int *sac;                // (V) on a sac: the node of model->sac; else -1
    int *boundary;           // (V) 0: wall; else the number of the cap on which it lies: 1, 2 … where blood enters, and from 2 on where it leaves, each in the order
                             // of the branches. A triangle belongs to a cap if its three vertices have the same number > 0
    int boundaries;          // highest number used
    SweepCap *cap;           // (boundaries + 1) by number; branch -1: no cap has the number
    int rings, patches;
    int failures;            // patches that could not be joined to their rings; expected 0. There the rings run through, so the mesh has several closed parts or crosses itself
    int remade_rings, remade_patches;        // by the last update
    struct SweepMeshParts *parts;            // rings and patches, see sweep_mesh_parts.h
} SweepMesh;

SweepMeshOptions sweep_mesh_default_options(void);
// `options` may be NULL. Returns NULL if the mesh would have more than 1e8 triangles.
SweepMesh *sweep_mesh_create(const SweepField *field, const SweepMeshOptions *options);
// Makes the mesh that of a changed model. What changed is found by comparing the fields' segments: patches from which no change can be seen are kept, and so are
// the rings of branches from which none can be seen. The result is the same to the bit as a fresh mesh. Returns false, with the mesh unchanged, if the model has
// another number of branches. `field` need not outlive the call.
bool sweep_mesh_update(SweepMesh *mesh, const SweepField *field);
// The number of the cap at an end of a branch; 0: there is none.
int sweep_mesh_cap(const SweepMesh *mesh, int branch, int end);
void sweep_mesh_free(SweepMesh *mesh);
// The surface alone. `options` may be NULL. Returns NULL as above, or if out of memory.
TriangleMesh *triangle_mesh_of_sweep(const SweepModel *model, const SweepMeshOptions *options);

#endif
