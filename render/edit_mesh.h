// The surface that the editor shows: rings along each branch, moved outwards onto the blended wall, and the sacs. For display only: near a fork, rings lie inside
// the other vessel, hidden. Where nothing changed, an update keeps the vertices; the result is that of a new mesh. (geom/sweep_mesh.h makes a closed mesh. With
// 24 edges around, its update takes more than 50 ms for 16 of 63 edits of the angiogram's model, those at forks 0.1 s and at the sac 0.66 s; with 10 edges
// around still more than 50 ms for 9, 0.12 s at most. This one takes 6 ms, 15 at most. `test_edit_mesh MODEL.h5` prints both.)
#ifndef SELDINGER_RENDER_EDIT_MESH_H
#define SELDINGER_RENDER_EDIT_MESH_H

#include "recon/recon.h"

typedef struct EditRing {
    int branch, first;       // its vertices
    double t;                // [mm]; beyond an end: of the end
    double polar;            // of a dome's ring: angle over the end's plane [rad]
} EditRing;

typedef struct EditMesh {
    TriangleMesh *surface;
    int *branch;             // (V) -1: on a sac
    double *along;           // (V) [mm]
    int ring_count;
    EditRing *ring;
    int branch_count;
    struct EditMeshBranch {
        int first_ring, ring_count;
        Vec3 start, end;     // of its curve: by these it is known again
    } * of;              // (branch_count)
    int sac_triangles;       // the last ones
    int made;                // rings made by the last call
} EditMesh;

// NULL if out of memory. `old` may be NULL: else the mesh before a change within a box, of which it keeps what is outside, and the sacs.
EditMesh *edit_mesh_create(const SweepField *field, const EditMesh *old, Vec3 low, Vec3 high);
// Follows a change within a box. False, with the mesh unchanged, if the model has other branches or lengths.
bool edit_mesh_update(EditMesh *mesh, const SweepField *field, Vec3 low, Vec3 high);
void edit_mesh_free(EditMesh *mesh);

#endif
