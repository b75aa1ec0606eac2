// Lumen that hangs on nothing: places where the field of a fitted tree is above 0 and from where no tool point gets to any node's centre. And, of shared
// blobs, which of them can be left out so that it goes, without a change to any other lumen.
#ifndef SELDINGER_GEOM_GHOST_LUMENS_H
#define SELDINGER_GEOM_GHOST_LUMENS_H

#include "geom/vessel_tree.h"

typedef struct GhostLumen {
    Vec3 place;              // in it
    int node;                // that answers there
    int points;              // of a lattice of `cell`, that it holds; 0: it is smaller than that
    double volume;           // [mm3] of these
    bool dissolves;          // without the blobs in `drop` the field there is nowhere above 0
} GhostLumen;
typedef struct GhostLumens {
    double cell;             // [mm] of the lattice
    int count;
    GhostLumen *ghost;       // largest first
    int drop_count;
    int32_t *drop;           // blobs that add to ghosts and whose support meets no other lumen, ascending; none of local models
} GhostLumens;

// Looks from each blob that adds; what no blob's centre leads to (uphill in the field) is not found. NULL where the tree has no model or memory ends.
GhostLumens *ghost_lumens_find(const VesselTree *tree);
void ghost_lumens_free(GhostLumens *ghosts);

#endif
