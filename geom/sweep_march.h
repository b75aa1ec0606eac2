// The wall within a patch of the swept model's mesh, by marching cubes that follow it from the patch's cuts. Internal to the mesh of the swept model.
//
// F at a lattice point is seen from one place of the patch, whatever the cell that asks for it: so neighbouring cells agree, and the surface has no edge but
// where the march stops, a few cells beyond the patch.
#ifndef SELDINGER_GEOM_SWEEP_MARCH_H
#define SELDINGER_GEOM_SWEEP_MARCH_H

#include "geom/sweep_mesh_parts.h"

typedef struct SweepMarch {
    int vertices, triangles;
    Vec3 *at;                // (vertices) near the wall, on edges of the lattice
    SweepPlace *place;       // (vertices)
    bool *is_end;            // (vertices) the march stopped here
    int (*triangle)[3];
} SweepMarch;

// Follows the wall from the cuts' rings, or, if the patch has no cut, from all rings of its runs. The lattice lies at multiples of the cell [mm]. Returns false
// if the patch does not fit the lattice, or if out of memory; sweep_march_free must be called in either case.
bool sweep_march(const SweepMeshParts *parts, const MeshPatch *patch, double cell, SweepMarch *march);
void sweep_march_free(SweepMarch *march);
// [mm] how far t of a place is inside the patch, and the cut next to it (-1: none). On a branch or a sac that is not the patch's: -least.
double sweep_march_inside(const SweepField *field, const MeshPatch *patch, const SweepPlace *place, double least, int *cut);

#endif
