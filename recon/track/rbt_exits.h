// Finds where a vessel continues after a place where no cylinder fits: an aneurysm or a wide bifurcation. Used when a branch ends or widens. Not in Kerrien
// et al. 2017.
#ifndef SELDINGER_RECON_TRACK_RBT_EXITS_H
#define SELDINGER_RECON_TRACK_RBT_EXITS_H

#include "recon/volume/volume.h"

enum { RBT_EXIT_PLACES = 6 };
typedef struct RbtExit {
    int count;               // number of places, from where the tube leaves the wide part onwards
    Vec3 center[RBT_EXIT_PLACES], direction[RBT_EXIT_PLACES];
    double radius;           // [mm] computed from the area of its cross-section
} RbtExit;

typedef struct RbtBlock {    // a ball on the path tracked so far; the search does not enter it (near the start: only the part behind the start)
    Vec3 center;
    double radius;
} RbtBlock;

// Finds the tubes that leave the lumen (brighter than `level`) around `start` within the path length `reach` [mm], widest first. Returns their number, at
// most `capacity`. `radius` and `direction` are the vessel's radius [mm] and axis at the start. The balls of `block` are not entered.
int rbt_find_exits(const Volume *volume, Vec3 start, Vec3 direction, double radius, double reach, double level, const RbtBlock *block, int block_count,
                   RbtExit *out, int capacity);

#endif
