// The inside of a closed surface as a sparse grid of cubic voxels, each with its exact distance to the wall. A row of voxels along x is inside where
// the winding number is: entries less exits of the wall before it, so that parts of a surface that overlap are one lumen. Voxels are not neighbours
// if the line between their middles leaves the lumen: touching vessels stay separate, however thin the wall.
#ifndef SELDINGER_RECON_SURFACE_MESH_LUMEN_H
#define SELDINGER_RECON_SURFACE_MESH_LUMEN_H

#include "recon/surface/mesh_tree.h"

#include <stdint.h>

enum { LUMEN_NEIGHBOURS = 26 };

typedef struct LumenRun {    // voxels x = first … end-1 of a row have indices base, base + 1, …
    int first, end, base, row;
    int winding;             // > 0
} LumenRun;

typedef struct Lumen {
    Vec3 origin;             // [mm] middle of voxel (0, 0, 0)
    double h;                // [mm] edge of voxels
    int size[3];
    int *row;                // (size[1] * size[2] + 1) row y + size[1] * z owns runs row[…] … row[… + 1]
    LumenRun *run;
    int run_count, count;    // count: of voxels
    int *run_of;             // (count)
    float *distance;         // (count) to the wall [mm], > 0
    uint32_t *walled;        // (count) bit 13 + dx + 3 dy + 9 dz: there is a wall between this voxel and that
    int spoilt_rows;         // with as many entries as exits nowhere: taken from the row before
} Lumen;

// The surface with a fan over every opening (loop of open edges); `mesh` is repaired. False if out of memory.
bool mesh_close(const SurfaceMesh *mesh, SurfaceMesh *closed);
// Voxels a sixth as wide as the smallest radii, or so wide that there are about `voxels_max`. `tree` is of `mesh`. NULL if out of memory.
Lumen *lumen_create(const SurfaceMesh *mesh, const MeshTree *tree, int voxels_max, int threads);
void lumen_free(Lumen *lumen);
void lumen_place(const Lumen *lumen, int voxel, int place[3]);
Vec3 lumen_middle(const Lumen *lumen, int voxel);
// The voxel at a point, -1 outside.
int lumen_voxel(const Lumen *lumen, int x, int y, int z);
// The voxels that share a corner with this one and no wall between, and how far their middles are [voxels]; returns how many.
int lumen_neighbours(const Lumen *lumen, int voxel, int other[LUMEN_NEIGHBOURS], float step[LUMEN_NEIGHBOURS]);

#endif
