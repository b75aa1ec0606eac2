// Ghost lumens of a fitted tree: regions where the field is above 0 and from which no tool point reaches any node's centre. For shared blobs, also which blobs
// can be removed so that the ghosts vanish without a change to any other lumen.
#ifndef SELDINGER_GEOM_GHOST_LUMENS_H
#define SELDINGER_GEOM_GHOST_LUMENS_H

#include "geom/vessel_tree.h"

typedef struct GhostLumen {
    Vec3 place;              // a point in it
    int node;                // the node whose field is used there
    int points;              // points of a lattice of spacing `cell` in it; 0: it is smaller than a cell
    double volume;           // [mm3] of these points
    bool dissolves;          // without the blobs in `drop`, the field there is nowhere above 0
} GhostLumen;
typedef struct GhostLumens {
    double cell;             // [mm] of the lattice
    int count;
    GhostLumen *ghost;       // largest first
    int drop_count;
    int32_t *drop;           // blobs that add to ghosts and whose support meets no other lumen, ascending; empty for local models
} GhostLumens;

// Searches uphill in the field from each blob of positive amplitude; a ghost that no such search reaches is not found. Returns NULL if the tree has no model or
// if out of memory.
GhostLumens *ghost_lumens_find(const VesselTree *tree);
void ghost_lumens_free(GhostLumens *ghosts);

#endif
