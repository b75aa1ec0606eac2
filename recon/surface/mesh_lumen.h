// The inside of a closed surface as a sparse grid of cubic voxels, each with its exact distance to the wall. A voxel of a row along x is inside if the
// winding number there is positive: the number of entries minus exits through the wall before it, so that overlapping parts of a surface are one lumen. Two
// voxels are not neighbours if the line between their centres leaves the lumen: touching vessels stay separate, however thin the wall.
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
    Vec3 origin;             // [mm] centre of voxel (0, 0, 0)
    double h;                // [mm] edge of a voxel
    int size[3];
    int *row;                // (size[1] * size[2] + 1) row y + size[1] * z has runs row[…] … row[… + 1]-1
    LumenRun *run;
    int run_count, count;    // count: number of voxels
    int *run_of;             // (count) run of each voxel
    float *distance;         // (count) [mm] distance to the wall, > 0
    uint32_t *walled;        // (count) bit 13 + dx + 3 dy + 9 dz: there is a wall between this voxel and that neighbour
    int spoilt_rows;         // number of rows with unequal numbers of entries and exits: they are copied from the row before
} Lumen;

// Creates the surface with a fan of triangles over every opening (loop of open edges); `mesh` must be repaired. Returns false if out of memory.
bool mesh_close(const SurfaceMesh *mesh, SurfaceMesh *closed);
// Creates the grid. A voxel is a sixth as wide as the smallest radii, or so wide that there are about `voxels_max`. `tree` belongs to `mesh`. Returns NULL if
// out of memory.
Lumen *lumen_create(const SurfaceMesh *mesh, const MeshTree *tree, int voxels_max, int threads);
void lumen_free(Lumen *lumen);
void lumen_place(const Lumen *lumen, int voxel, int place[3]);
Vec3 lumen_middle(const Lumen *lumen, int voxel);
// Returns the voxel at grid coordinates, or -1 outside the lumen.
int lumen_voxel(const Lumen *lumen, int x, int y, int z);
// Lists the voxels that share a corner with this one and have no wall in between, and the distances of their centres [voxels]. Returns their number.
int lumen_neighbours(const Lumen *lumen, int voxel, int other[LUMEN_NEIGHBOURS], float step[LUMEN_NEIGHBOURS]);

#endif
